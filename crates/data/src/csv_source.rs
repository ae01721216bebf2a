//! Opening a CSV file, plain or gzip, and turning what the parser says into our errors.

use crate::error::{DataError, RowRemedy};
use crate::limits::Limit;
use crate::source::Source;
use crate::whole_file::{gunzip, is_gzip, read_whole};
use std::collections::BTreeSet;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows of a CSV file with their line numbers; cells are trimmed of blanks.
///
/// The whole content is held in memory, as the data set read from it will be. That makes line numbers
/// exact: the parser skips blank lines without counting them in a record's position.
pub(crate) struct CsvSource {
    path: PathBuf,
    content: Arc<[u8]>,
    header: Vec<String>,
    reader: csv::Reader<Cursor<Arc<[u8]>>>,
    record: csv::ByteRecord,
    /// Offset of the current record and the line it stands on.
    start: usize,
    line: u64,
    most_columns: u64,
}

impl CsvSource {
    /// Opens `path`; gzip is told by its magic bytes, not by the name.
    pub(crate) fn open(path: &Path) -> Result<Self, DataError> {
        Self::of_bytes(path, read_whole(path)?)
    }

    /// Opens a file whose bytes were read; `path` is for messages.
    pub(crate) fn of_bytes(path: &Path, mut content: Vec<u8>) -> Result<Self, DataError> {
        if is_gzip(&content) {
            content = gunzip(path, &content)?;
        }
        let content: Arc<[u8]> = content.into();
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(Cursor::new(Arc::clone(&content)));
        let mut source = CsvSource {
            path: path.to_owned(),
            content,
            header: Vec::new(),
            reader,
            record: csv::ByteRecord::new(),
            start: 0,
            line: 1,
            most_columns: Limit::Columns.value(),
        };
        source.read_header()?;
        Ok(source)
    }

    fn read_header(&mut self) -> Result<(), DataError> {
        if !self.advance()? {
            return Err(DataError::Empty { path: self.path.clone() });
        }
        for (i, name) in self.record.iter().enumerate() {
            let name = std::str::from_utf8(name).map_err(|_| DataError::NotUtf8 {
                path: self.path.clone(),
                line: self.line,
                column: format!("number {}", i + 1),
            })?;
            self.header.push(name.to_owned());
        }
        let mut names = BTreeSet::new();
        match self.header.iter().find(|name| !names.insert(name.as_str())) {
            Some(repeated) => Err(DataError::DuplicateColumn {
                origin: Source::File(self.path.clone()),
                column: repeated.clone(),
            }),
            None => Ok(()),
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
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
        self.header.iter().position(|h| h == name).ok_or_else(|| {
            let path = self.path.clone();
            // A header that does not fall apart at its commas, but would at these.
            match [';', '\t'].into_iter().find(|&c| self.header.iter().any(|cell| cell.contains(c))) {
                Some(separator) => DataError::OtherSeparator { path, separator },
                None => {
                    let available = self.header.clone();
                    DataError::MissingColumn { path, column: name.to_owned(), available, layout }
                }
            }
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
                remedy: self.row_remedy(),
            });
        }
        Ok(true)
    }

    /// Remedy for a row whose cells are not as many as the header's.
    fn row_remedy(&self) -> RowRemedy {
        let surplus = self.record.len().saturating_sub(self.header.len());
        let whole = |cell: &[u8]| !cell.is_empty() && cell.iter().all(u8::is_ascii_digit);
        let begins = |cell: &[u8]| whole(cell.strip_prefix(b"-").unwrap_or(cell));
        // A decimal comma leaves the digits before and after it in two cells.
        let (mut pairs, mut cell) = (0, 0);
        while cell + 1 < self.record.len() {
            let is_pair = begins(&self.record[cell]) && whole(&self.record[cell + 1]);
            pairs += usize::from(is_pair);
            cell += 1 + usize::from(is_pair);
        }
        match surplus {
            0 => RowRemedy::Complete,
            _ if pairs >= surplus => RowRemedy::Points,
            _ => RowRemedy::Shorten,
        }
    }

    /// Checks that the line at `from` has no more commas than a row may: a parsed row takes many times its bytes.
    fn check_columns(&self, from: usize) -> Result<(), DataError> {
        let line = self.content.iter().skip(from).take_while(|&&byte| byte != b'\n');
        if line.filter(|&&byte| byte == b',').count() as u64 >= self.most_columns {
            let origin = Source::File(self.path.clone());
            return Err(DataError::Limit { origin, cause: Limit::Columns.exceeded() });
        }
        Ok(())
    }

    fn advance(&mut self) -> Result<bool, DataError> {
        self.check_columns(self.reader.position().byte() as usize)?;
        let more = self.reader.read_byte_record(&mut self.record).map_err(|error| {
            // Reading from memory, with rows of any length and any bytes allowed, cannot fail.
            DataError::Unreadable { path: self.path.clone(), cause: io::Error::other(error) }
        })?;
        let from = self.record.position().map_or(self.start, |p| p.byte() as usize);
        let blank = |byte: &u8| matches!(byte, b'\r' | b'\n');
        let skipped = self.content.iter().skip(from).take_while(|&byte| blank(byte)).count();
        let start = (from + skipped).min(self.content.len()).max(self.start);
        self.line += newlines(&self.content[self.start..start]);
        self.start = start;
        Ok(more)
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

fn newlines(bytes: &[u8]) -> u64 {
    bytes.iter().filter(|&&byte| byte == b'\n').count() as u64
}
