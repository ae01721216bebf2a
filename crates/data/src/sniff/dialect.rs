//! Infers separator, decimal mark, comments and header such that most cells of a table are numbers.

use super::heading::ColumnUnit;
use super::unrecognised::Unrecognised;
use crate::error::DataError;
use crate::limits::Limit;
use crate::source::Source;
use std::path::{Path, PathBuf};

/// Number of lines from which separator and decimal mark are inferred.
const DIALECT_LINES: usize = 300;
/// Maximum number of lines before the data.
const MAX_PREAMBLE_LINES: usize = 60;
/// Candidate separators, in the order of preference where several fit equally well.
const SEPARATORS: [char; 5] = [',', ';', '\t', '|', ' '];
/// Cell contents, in lower case, that stand for a value that was not measured.
const GAP_WORDS: [&str; 10] = ["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "missing"];
/// Characters with which a comment line begins.
const COMMENT_MARKS: [&str; 3] = ["#", "%", "//"];

/// Separator and decimal mark of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    /// Character between cells; a space stands for any sequence of white space.
    pub separator: char,
    pub decimal: char,
}

/// Table of text cells read from a file, with its header.
#[derive(Debug)]
pub(super) struct Sheet {
    pub path: PathBuf,
    pub dialect: Dialect,
    /// Names of the columns from the header; `None` for a file without a header.
    pub names: Option<Vec<String>>,
    /// Units of the columns from a separate row below the names; empty without such a row.
    pub units: Vec<String>,
    /// Comment lines before the data, without the comment mark.
    pub comments: Vec<String>,
    /// Number of lines before the header that were skipped.
    pub skipped_lines: usize,
    pub columns: usize,
    /// Line number in the file of each row, from 1.
    pub lines: Vec<u64>,
    /// Cells of the table row by row, trimmed and without quotes.
    cells: Vec<String>,
}

impl Sheet {
    /// Cells of the row with the index `row`.
    pub fn row(&self, row: usize) -> &[String] {
        &self.cells[row * self.columns..(row + 1) * self.columns]
    }

    /// Number of rows of the table.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Creates a table with other columns and without rows, for the same file.
    pub fn emptied(&self, names: Vec<String>, units: Vec<String>) -> Sheet {
        Sheet {
            path: self.path.clone(),
            dialect: self.dialect,
            columns: names.len(),
            names: Some(names),
            units,
            comments: self.comments.clone(),
            skipped_lines: self.skipped_lines,
            lines: Vec::new(),
            cells: Vec::new(),
        }
    }

    /// Adds a row, read from the line `line`, with as many cells as there are columns.
    pub fn append(&mut self, line: u64, cells: impl Iterator<Item = String>) {
        self.lines.push(line);
        self.cells.extend(cells);
    }

    /// Adds a row of data, without surplus empty cells at its end; `head`, the rows before the data, is for errors.
    fn push_row(&mut self, line: u64, mut row: Vec<String>, head: &[Vec<String>]) -> Result<(), DataError> {
        while row.len() > self.columns && row.last().is_some_and(String::is_empty) {
            row.pop();
        }
        if row.len() != self.columns {
            return Err(DataError::RaggedRow {
                path: self.path.clone(),
                line,
                found: row.len(),
                expected: self.columns,
                first_column: head.last().and_then(|names| names.first().cloned()).unwrap_or_default(),
                remedy: match row.len() < self.columns {
                    true => crate::RowRemedy::Complete,
                    false => crate::RowRemedy::Shorten,
                },
            });
        }
        self.lines.push(line);
        self.cells.append(&mut row);
        Ok(())
    }

    /// Sets the column names and units from the rows before the data.
    ///
    /// The last of these rows is the header, or the row of units below it.
    fn set_header(&mut self, mut head: Vec<Vec<String>>) {
        let head_rows = head.len();
        // A header may lack empty cells at its end.
        let is_header = |row: &Vec<String>| {
            row.len() <= self.columns
                && 2 * row.iter().filter(|c| !c.is_empty()).count() > self.columns.min(3)
        };
        let Some(last) = head.pop().filter(is_header) else {
            self.skipped_lines = head_rows;
            return;
        };
        let is_units = last.iter().all(|c| c.is_empty() || ColumnUnit::parse(c).is_some());
        let (names, units) = match head.pop().filter(|row| is_units && is_header(row)) {
            Some(names) => (names, last),
            None => (last, Vec::new()),
        };
        self.skipped_lines = head_rows - 1 - usize::from(!units.is_empty());
        let padded = |mut row: Vec<String>| {
            row.resize(self.columns, String::new());
            row
        };
        self.units = if units.is_empty() { units } else { padded(units) };
        self.names = Some(padded(names));
    }
}

/// Parses a cell as a finite number; `None` for a gap.
///
/// # Errors
/// The cell is neither a finite number nor a gap.
pub(super) fn number(cell: &str, decimal: char) -> Result<Option<f64>, ()> {
    if GAP_WORDS.iter().any(|gap| cell.eq_ignore_ascii_case(gap)) {
        return Ok(None);
    }
    let is_number_char = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let parsed = match decimal {
        '.' => cell.chars().all(is_number_char).then(|| cell.parse::<f64>()),
        _ if cell.contains('.') => None,
        mark => {
            let with_point = cell.replacen(mark, ".", 1);
            with_point.chars().all(is_number_char).then(|| with_point.parse::<f64>())
        }
    };
    match parsed {
        Some(Ok(value)) if value.is_finite() => Ok(Some(value)),
        _ => Err(()),
    }
}

fn is_number(cell: &str, decimal: char) -> bool {
    matches!(number(cell, decimal), Ok(Some(_)))
}

/// Splits a line into cells, without white space and quotes around them.
fn split_cells(line: &str, separator: char) -> Vec<String> {
    if separator == ' ' {
        return line.split_whitespace().map(|c| c.trim_matches('"').to_owned()).collect();
    }
    if !line.contains('"') {
        return line.split(separator).map(|c| c.trim().to_owned()).collect();
    }
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(separator as u8)
        .trim(csv::Trim::All)
        .from_reader(line.as_bytes());
    let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
    record.iter().map(str::to_owned).collect()
}

/// Text of a comment line; `None` for other lines.
fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let text = COMMENT_MARKS.iter().find_map(|mark| line.strip_prefix(mark));
    text.map(|text| text.trim_start_matches('#').trim())
}

/// Most frequent number of cells per row, and the number of rows with it.
fn usual_width(rows: &[Vec<String>]) -> (usize, usize) {
    let mut widths: Vec<usize> = rows.iter().map(Vec::len).collect();
    widths.sort_unstable();
    let runs = widths.chunk_by(|a, b| a == b).map(|run| (run[0], run.len()));
    runs.max_by_key(|&(width, count)| (count, width)).unwrap_or((0, 0))
}

/// Score, between 0 and 1, of how well a separator and a decimal mark fit the lines.
///
/// It is the product of the share of the lines with the usual number of cells and the share of numbers among the
/// non-empty cells of these lines.
fn dialect_score(lines: &[&str], dialect: Dialect) -> f64 {
    let rows: Vec<Vec<String>> = lines.iter().map(|line| split_cells(line, dialect.separator)).collect();
    let (width, count) = usual_width(&rows);
    if width < 2 {
        return 0.0;
    }
    let cells = || rows.iter().filter(|row| row.len() == width).flatten();
    let filled = cells().filter(|c| !c.is_empty()).count().max(1);
    let numbers = cells().filter(|c| is_number(c, dialect.decimal)).count();
    count as f64 / rows.len() as f64 * numbers as f64 / filled as f64
}

/// Minimum score ([`dialect_score`]) of a table of measurements.
///
/// Columns of text lower the score; prose has hardly any numbers.
const MIN_SCORE: f64 = 0.2;

/// Separator and decimal mark with the best score; `None` where all scores are too low.
///
/// `separator` and `decimal` restrict the choice where they are given.
fn infer_dialect(lines: &[&str], separator: Option<char>, decimal: Option<char>) -> Option<Dialect> {
    let has_quotes = lines.iter().any(|line| line.contains('"'));
    let separators = SEPARATORS.into_iter().filter(|s| separator.is_none_or(|wanted| wanted == *s));
    let separators = separators.chain(separator.filter(|s| !SEPARATORS.contains(s)));
    let all = separators.flat_map(|s| ['.', ','].map(|d| Dialect { separator: s, decimal: d }));
    // A comma is both separator and decimal mark only where cells are quoted.
    let allowed = all.filter(|d| {
        decimal.is_none_or(|wanted| wanted == d.decimal) && (d.separator != d.decimal || has_quotes)
    });
    let mut best: Option<(f64, Dialect)> = None;
    for dialect in allowed {
        let score = dialect_score(lines, dialect);
        if score > best.map_or(0.0, |b| b.0 + 1e-9) {
            best = Some((score, dialect));
        }
    }
    best.filter(|(score, _)| *score > MIN_SCORE).map(|(_, dialect)| dialect)
}

/// Stands for the separator of a table with one column; no line contains it.
const NO_SEPARATOR: char = '\n';

/// Decimal mark of a table with one column; `None` where most lines are not numbers.
fn single_column(lines: &[&str], decimal: Option<char>) -> Option<Dialect> {
    let marks = ['.', ','].into_iter().filter(|mark| decimal.is_none_or(|wanted| wanted == *mark));
    let count = |mark: char| lines.iter().filter(|line| is_number(line.trim(), mark)).count();
    let best = marks.max_by_key(|mark| (count(*mark), *mark == '.'))?;
    (2 * count(best) > lines.len()).then_some(Dialect { separator: NO_SEPARATOR, decimal: best })
}

/// Splits the text of a file into a table.
///
/// `separator` and `decimal` are inferred where they are not given.
///
/// # Errors
/// The text is not a table of numbers, or a row has too few or too many cells.
pub(super) fn read_table(
    path: &Path,
    text: &str,
    separator: Option<char>,
    decimal: Option<char>,
) -> Result<Sheet, DataError> {
    let exceeded =
        |limit: Limit| DataError::Limit { origin: Source::File(path.to_owned()), cause: limit.exceeded() };
    let numbered = || (1u64..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    let first_lines: Vec<&str> =
        numbered().map(|(_, l)| l).filter(|l| comment(l).is_none()).take(DIALECT_LINES).collect();
    if first_lines.is_empty() {
        return Err(DataError::Empty { path: path.to_owned() });
    }
    let max_columns = Limit::Columns.value();
    if first_lines.iter().any(|line| line.len() as u64 > 64 * max_columns) {
        return Err(exceeded(Limit::Columns));
    }
    // The dialect is that of the lines after the preamble.
    let tail = &first_lines[first_lines.len().min(MAX_PREAMBLE_LINES) / 2..];
    let dialect =
        infer_dialect(tail, separator, decimal).or_else(|| infer_dialect(&first_lines, separator, decimal));
    let dialect = dialect.or_else(|| single_column(&first_lines, decimal));
    let no_numbers = || DataError::NotRecognised { path: path.to_owned(), reason: Unrecognised::NotNumbers };
    let dialect = dialect.ok_or_else(no_numbers)?;
    let tail: Vec<Vec<String>> = tail.iter().map(|line| split_cells(line, dialect.separator)).collect();
    let (columns, _) = usual_width(&tail);
    let number_share = |row: &[String]| {
        let numbers = row.iter().filter(|c| is_number(c, dialect.decimal)).count();
        let filled = row.iter().filter(|c| !c.is_empty()).count();
        numbers as f64 / filled.max(1) as f64
    };
    let full_rows = tail.iter().filter(|row| row.len() == columns);
    let max_share = full_rows.map(|row| number_share(row)).fold(0.0, f64::max);
    let is_numeric = |row: &[String]| number_share(row) > 0.5 * max_share;
    let mut out = Sheet {
        path: path.to_owned(),
        dialect,
        names: None,
        units: Vec::new(),
        comments: Vec::new(),
        skipped_lines: 0,
        columns,
        lines: Vec::new(),
        cells: Vec::new(),
    };
    // Rows before the data: the preamble, the header and a row of units.
    let mut head: Vec<Vec<String>> = Vec::new();
    for (line_number, line) in numbered() {
        if let Some(text) = comment(line) {
            if out.lines.is_empty() {
                out.comments.push(text.to_owned());
                let row = split_cells(text, dialect.separator);
                if row.len() == columns && !is_numeric(&row) {
                    head.push(row);
                }
            }
            continue;
        }
        let row = split_cells(line, dialect.separator);
        let is_data = row.len() == columns && is_numeric(&row);
        if out.lines.is_empty() && !is_data && head.len() < MAX_PREAMBLE_LINES {
            head.push(row);
            continue;
        }
        out.push_row(line_number, row, &head)?;
        if out.cells.len() as u64 > Limit::Cells.value() {
            return Err(exceeded(Limit::Cells));
        }
    }
    if out.lines.is_empty() {
        return Err(DataError::HeaderOnly { path: path.to_owned() });
    }
    out.set_header(head);
    Ok(out)
}

#[cfg(test)]
mod tests {
    //! Contract: the inferred dialect is the one in which the cells are numbers.
    use super::*;

    fn read(text: &str) -> Sheet {
        read_table(Path::new("f"), text, None, None).unwrap_or_else(|e| panic!("{text}: {e}"))
    }

    #[test]
    fn separators_and_decimal_marks_are_inferred() {
        for (text, separator, decimal) in [
            ("t,x\n0,1.5\n1,2.5\n", ',', '.'),
            ("t;x\n0;1,5\n1;2,5\n", ';', ','),
            ("t;x\n0;1.5\n1;2.5\n", ';', '.'),
            ("t\tx\n0\t1,5\n1\t2,5\n", '\t', ','),
            ("t  x\n0  1.5\n1  2.5\n", ' ', '.'),
            ("t,x\n\"0\",\"1,5\"\n\"1\",\"2,5\"\n", ',', ','),
            ("0|1.5\n1|2.5\n", '|', '.'),
        ] {
            assert_eq!(read(text).dialect, Dialect { separator, decimal }, "{text}");
        }
    }

    #[test]
    fn header_units_comments_and_preamble_are_separated_from_data() {
        let sheet = read("made by a tracker\n# 60 Hz\nt\tx\ns\tmm\n0\t1\n\n1\t\n");
        assert_eq!(sheet.names.as_deref(), Some(&["t".to_owned(), "x".to_owned()][..]));
        assert_eq!((sheet.units.join(" "), sheet.comments.join(" ")), ("s mm".into(), "60 Hz".into()));
        assert_eq!((sheet.lines.clone(), sheet.skipped_lines), (vec![5, 7], 1));
        assert_eq!(sheet.row(1), ["1", ""]);
        assert_eq!(read("# t x\n0 1\n1 2\n").names.map(|n| n.join(" ")), Some("t x".into()));
        assert_eq!(read("0 1\n1 2\n").names, None);
    }
}
