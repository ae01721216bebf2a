//! Opening a CSV file, plain or gzip, and turning what the parser says into our errors.

use crate::error::DataError;
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Rows of a CSV file with their line numbers; cells are trimmed of blanks.
pub(crate) struct CsvSource {
    path: PathBuf,
    gzip: bool,
    header: Vec<String>,
    reader: csv::Reader<Box<dyn Read>>,
    record: csv::ByteRecord,
    line: u64,
}

impl CsvSource {
    /// Opens `path`; gzip is told by its magic bytes, not by the name.
    pub(crate) fn open(path: &Path) -> Result<Self, DataError> {
        let unreadable = |cause| DataError::Unreadable {
            path: path.to_owned(),
            cause,
        };
        let mut bytes = BufReader::new(File::open(path).map_err(unreadable)?);
        let gzip = bytes
            .fill_buf()
            .map_err(unreadable)?
            .starts_with(&[0x1f, 0x8b]);
        let content: Box<dyn Read> = if gzip {
            Box::new(MultiGzDecoder::new(bytes))
        } else {
            Box::new(bytes)
        };
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(content);
        let mut source = CsvSource {
            path: path.to_owned(),
            gzip,
            header: Vec::new(),
            reader,
            record: csv::ByteRecord::new(),
            line: 0,
        };
        source.read_header()?;
        Ok(source)
    }

    fn read_header(&mut self) -> Result<(), DataError> {
        if !self.advance()? {
            return Err(DataError::Empty {
                path: self.path.clone(),
            });
        }
        for (i, name) in self.record.iter().enumerate() {
            let name = std::str::from_utf8(name).map_err(|_| DataError::NotUtf8 {
                path: self.path.clone(),
                line: self.line,
                column: format!("number {}", i + 1),
            })?;
            self.header.push(name.to_owned());
        }
        let repeated = (1..self.header.len()).find(|&i| self.header[..i].contains(&self.header[i]));
        match repeated {
            Some(i) => Err(DataError::DuplicateColumn {
                origin: crate::Source::File(self.path.clone()),
                column: self.header[i].clone(),
            }),
            None => Ok(()),
        }
    }

    pub(crate) fn header(&self) -> &[String] {
        &self.header
    }

    /// Line of the current row, from 1.
    pub(crate) fn line(&self) -> u64 {
        self.line
    }

    /// Position of a header name that the layout needs.
    pub(crate) fn require(&self, name: &str, layout: &'static str) -> Result<usize, DataError> {
        self.header
            .iter()
            .position(|h| h == name)
            .ok_or_else(|| DataError::MissingColumn {
                path: self.path.clone(),
                column: name.to_owned(),
                available: self.header.clone(),
                layout,
            })
    }

    /// Moves to the next row; `false` at the end of the file.
    pub(crate) fn next_row(&mut self) -> Result<bool, DataError> {
        if !self.advance()? {
            return Ok(false);
        }
        if self.record.len() != self.header.len() {
            return Err(DataError::RaggedRow {
                path: self.path.clone(),
                line: self.line,
                found: self.record.len(),
                expected: self.header.len(),
                first_column: self.header.first().cloned().unwrap_or_default(),
            });
        }
        Ok(true)
    }

    fn advance(&mut self) -> Result<bool, DataError> {
        let more = self.reader.read_byte_record(&mut self.record);
        let next_line = self.reader.position().line();
        match more {
            Ok(more) => {
                self.line = self
                    .record
                    .position()
                    .map_or(next_line, csv::Position::line);
                Ok(more)
            }
            Err(error) => Err(self.read_failure(error, next_line)),
        }
    }

    /// The parser is set to accept rows of any length and any bytes, so what is left is input and
    /// output.
    fn read_failure(&self, error: csv::Error, line: u64) -> DataError {
        let path = self.path.clone();
        let cause = match error.into_kind() {
            csv::ErrorKind::Io(cause) => cause,
            other => io::Error::other(format!("{other:?}")),
        };
        match (self.gzip, cause.kind()) {
            (true, io::ErrorKind::UnexpectedEof) => DataError::TruncatedGzip { path, line },
            (true, io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData) => {
                DataError::DamagedGzip { path, line, cause }
            }
            _ => DataError::Unreadable { path, cause },
        }
    }

    /// Text of a cell; empty text is given as it is.
    pub(crate) fn text(&self, cell: usize) -> Result<&str, DataError> {
        std::str::from_utf8(&self.record[cell]).map_err(|_| DataError::NotUtf8 {
            path: self.path.clone(),
            line: self.line,
            column: self.header[cell].clone(),
        })
    }

    /// Finite number in a cell; `None` where the cell is empty.
    pub(crate) fn number(&self, cell: usize) -> Result<Option<f64>, DataError> {
        let text = self.text(cell)?;
        if text.is_empty() {
            return Ok(None);
        }
        // Rust also parses "nan" and "inf" and lets 1e999 overflow: none of them is a measurement.
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(DataError::BadNumber {
                path: self.path.clone(),
                line: self.line,
                column: self.header[cell].clone(),
                cell: text.to_owned(),
            }),
        }
    }

    /// The error for an empty cell in this row.
    pub(crate) fn empty_cell(&self, cell: usize, remedy: &'static str) -> DataError {
        DataError::EmptyCell {
            path: self.path.clone(),
            line: self.line,
            column: self.header[cell].clone(),
            remedy,
        }
    }
}
