//! Reads the rows of a CSV file, plain or gzip, with errors that state line and column.

use crate::error::{DataError, EVERY_ROW_NEEDS_A_VALUE, NO_EMPTY_CELLS, RowRemedy};
use crate::limits::Limit;
use crate::source::Source;
use crate::whole_file::{gunzip, is_gzip, read_whole};
use std::collections::BTreeSet;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reader of the rows of a CSV file, with their line numbers; spaces around cells are removed.
///
/// The whole content is in memory, as the data set will be. Line numbers are counted from the content,
/// because the parser skips blank lines without counting them in the position of a record.
pub(crate) struct CsvSource {
    path: PathBuf,
    content: Arc<[u8]>,
    header: Vec<String>,
    reader: csv::Reader<Cursor<Arc<[u8]>>>,
    record: csv::ByteRecord,
    /// Byte offset of the current row in the content.
    start: usize,
    /// Line number of the current row, from 1.
    line: u64,
    max_columns: u64,
}

impl CsvSource {
    /// Opens `path`; gzip is recognised from its magic number, not from the file name.
    pub(crate) fn open(path: &Path) -> Result<Self, DataError> {
        Self::from_bytes(path, read_whole(path)?)
    }

    /// Opens a file whose bytes were read; `path` is its name in messages.
    pub(crate) fn from_bytes(path: &Path, mut content: Vec<u8>) -> Result<Self, DataError> {
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
            max_columns: Limit::Columns.value(),
        };
        source.read_header()?;
        Ok(source)
    }

    /// Reads the first row as the header and checks that no name occurs twice.
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

    /// Line number of the current row, from 1.
    pub(crate) fn line(&self) -> u64 {
        self.line
    }

    /// Index of the column `name`, or an error if it is missing; `layout` describes the layout in the message.
    pub(crate) fn require(&self, name: &str, layout: &'static str) -> Result<usize, DataError> {
        self.header.iter().position(|h| h == name).ok_or_else(|| {
            let path = self.path.clone();
            // A header that is not split by commas may have one of these separators.
            match [';', '\t'].into_iter().find(|&c| self.header.iter().any(|cell| cell.contains(c))) {
                Some(separator) => DataError::UnexpectedSeparator { path, separator },
                None => {
                    let available = self.header.clone();
                    DataError::MissingColumn { path, column: name.to_owned(), available, layout }
                }
            }
        })
    }

    /// Moves to the next row and checks its number of cells; returns `false` at the end of the file.
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

    /// Remedy for a row that has fewer or more cells than the header.
    fn row_remedy(&self) -> RowRemedy {
        let surplus = self.record.len().saturating_sub(self.header.len());
        let is_digits = |cell: &[u8]| !cell.is_empty() && cell.iter().all(u8::is_ascii_digit);
        let is_integer = |cell: &[u8]| is_digits(cell.strip_prefix(b"-").unwrap_or(cell));
        // A decimal comma leaves the digits before and after it in two adjacent cells.
        let (mut pairs, mut cell) = (0, 0);
        while cell + 1 < self.record.len() {
            let is_pair = is_integer(&self.record[cell]) && is_digits(&self.record[cell + 1]);
            pairs += usize::from(is_pair);
            cell += 1 + usize::from(is_pair);
        }
        match surplus {
            0 => RowRemedy::Complete,
            _ if pairs >= surplus => RowRemedy::Points,
            _ => RowRemedy::Shorten,
        }
    }

    /// Checks the number of commas in the line at offset `start`, before the parser allocates its cells.
    fn check_columns(&self, start: usize) -> Result<(), DataError> {
        let line = self.content.iter().skip(start).take_while(|&&byte| byte != b'\n');
        if line.filter(|&&byte| byte == b',').count() as u64 >= self.max_columns {
            let origin = Source::File(self.path.clone());
            return Err(DataError::Limit { origin, cause: Limit::Columns.exceeded() });
        }
        Ok(())
    }

    /// Reads the next row and updates its line number; returns `false` at the end of the file.
    fn advance(&mut self) -> Result<bool, DataError> {
        self.check_columns(self.reader.position().byte() as usize)?;
        let has_record = self.reader.read_byte_record(&mut self.record).map_err(|error| {
            // Reading from memory, with rows of any length and any bytes allowed, cannot fail.
            DataError::Unreadable { path: self.path.clone(), cause: io::Error::other(error) }
        })?;
        let offset = self.record.position().map_or(self.start, |p| p.byte() as usize);
        let is_line_end = |byte: &u8| matches!(byte, b'\r' | b'\n');
        let skipped = self.content.iter().skip(offset).take_while(|&byte| is_line_end(byte)).count();
        let start = (offset + skipped).min(self.content.len()).max(self.start);
        self.line += newlines(&self.content[self.start..start]);
        self.start = start;
        Ok(has_record)
    }

    /// Text of the cell of an identifier or a group; an empty cell is an error.
    pub(crate) fn label(&self, cell: usize) -> Result<&str, DataError> {
        let text = self.text(cell)?;
        if text.is_empty() { Err(self.empty_cell(cell, EVERY_ROW_NEEDS_A_VALUE)) } else { Ok(text) }
    }

    /// Finite number in a cell of the current row; an empty cell is an error.
    pub(crate) fn required_number(&self, cell: usize) -> Result<f64, DataError> {
        self.number(cell)?.ok_or_else(|| self.empty_cell(cell, NO_EMPTY_CELLS))
    }

    /// Uses the column `name` as the column `role`; a column that has this name already loses it.
    ///
    /// # Errors
    /// There is no column `name`; `layout` says what the file should contain.
    pub(crate) fn use_column_as(
        &mut self,
        name: &str,
        role: &str,
        layout: &'static str,
    ) -> Result<(), DataError> {
        let cell = self.require(name, layout)?;
        self.header.iter_mut().filter(|h| *h == role).for_each(|h| *h = format!("{role} (unused)"));
        role.clone_into(&mut self.header[cell]);
        Ok(())
    }

    /// Text of a cell of the current row; it may be empty.
    pub(crate) fn text(&self, cell: usize) -> Result<&str, DataError> {
        std::str::from_utf8(&self.record[cell]).map_err(|_| DataError::NotUtf8 {
            path: self.path.clone(),
            line: self.line,
            column: self.header[cell].clone(),
        })
    }

    /// Finite number in a cell of the current row; `None` where the cell is empty.
    pub(crate) fn number(&self, cell: usize) -> Result<Option<f64>, DataError> {
        let text = self.text(cell)?;
        if text.is_empty() {
            return Ok(None);
        }
        // Rust also parses "nan", "inf" and 1e999 (as infinity), none of which is a measurement.
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

    /// Creates the error for an empty cell in the current row.
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
