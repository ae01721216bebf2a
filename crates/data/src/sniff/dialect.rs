//! Separator, decimal mark, comments and header of a file, told by what makes most of its cells numbers.

use super::unrecognised::Unrecognised;
use crate::error::DataError;
use crate::limits::Limit;
use crate::source::Source;
use std::path::{Path, PathBuf};

/// Lines that a dialect is told by.
const TELLING: usize = 300;
/// Lines at the beginning among which the header may be.
const PREAMBLE: usize = 60;
/// Separators that files use, in the order in which they are preferred where several fit.
const SEPARATORS: [char; 5] = [',', ';', '\t', '|', ' '];
/// Words for a value that was not measured.
const GAPS: [&str; 10] = ["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "missing"];
/// Beginnings of lines that are no data.
const COMMENTS: [&str; 3] = ["#", "%", "//"];

/// How the cells of a file are told apart and read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    /// A blank stands for any run of blanks.
    pub separator: char,
    pub decimal: char,
}

/// A file cut into cells.
#[derive(Debug)]
pub(super) struct Sheet {
    pub path: PathBuf,
    pub dialect: Dialect,
    /// Names of the columns; `None` for a file without a header.
    pub names: Option<Vec<String>>,
    /// Units that stand in a row of their own below the names.
    pub units: Vec<String>,
    /// Comments before the data, without their mark.
    pub comments: Vec<String>,
    /// Lines before the header that were passed over.
    pub passed_over: usize,
    pub columns: usize,
    /// Line of each row, from 1.
    pub lines: Vec<u64>,
    /// Cells row by row, trimmed and without quotes.
    cells: Vec<String>,
}

impl Sheet {
    /// Cells of a row.
    pub fn row(&self, row: usize) -> &[String] {
        &self.cells[row * self.columns..(row + 1) * self.columns]
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }
}

/// A finite number in a cell, `None` for a gap.
///
/// # Errors
/// The cell is neither.
pub(super) fn number(cell: &str, decimal: char) -> Result<Option<f64>, ()> {
    if GAPS.iter().any(|gap| cell.eq_ignore_ascii_case(gap)) {
        return Ok(None);
    }
    let digits = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let parsed = match decimal {
        '.' => cell.chars().all(digits).then(|| cell.parse::<f64>()),
        _ if cell.contains('.') => None,
        mark => {
            let pointed = cell.replacen(mark, ".", 1);
            pointed.chars().all(digits).then(|| pointed.parse::<f64>())
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

/// Cells of a line.
fn cut(line: &str, separator: char) -> Vec<String> {
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

fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    COMMENTS.iter().find_map(|mark| line.strip_prefix(mark)).map(|rest| rest.trim_start_matches('#').trim())
}

/// Most frequent number of cells, and how many lines have it.
fn usual_width(rows: &[Vec<String>]) -> (usize, usize) {
    let mut widths: Vec<usize> = rows.iter().map(Vec::len).collect();
    widths.sort_unstable();
    let runs = widths.chunk_by(|a, b| a == b).map(|run| (run[0], run.len()));
    runs.max_by_key(|&(width, count)| (count, width)).unwrap_or((0, 0))
}

/// How well a dialect fits: share of the lines with the usual number of cells, times the share of cells that are numbers.
fn fit(lines: &[&str], dialect: Dialect) -> (f64, usize) {
    let rows: Vec<Vec<String>> = lines.iter().map(|line| cut(line, dialect.separator)).collect();
    let (width, count) = usual_width(&rows);
    if width < 2 {
        return (0.0, width);
    }
    let cells = || rows.iter().filter(|row| row.len() == width).flatten();
    let known = cells().filter(|c| !c.is_empty()).count().max(1);
    let numbers = cells().filter(|c| is_number(c, dialect.decimal)).count();
    (count as f64 / rows.len() as f64 * numbers as f64 / known as f64, width)
}

/// The dialect in which most of the lines are rows of numbers; `None` where none is.
fn dialect_of_lines(lines: &[&str], separator: Option<char>, decimal: Option<char>) -> Option<Dialect> {
    let quoted = lines.iter().any(|line| line.contains('"'));
    let separators = SEPARATORS.into_iter().filter(|s| separator.is_none_or(|wanted| wanted == *s));
    let separators = separators.chain(separator.filter(|s| !SEPARATORS.contains(s)));
    let both = separators.flat_map(|s| ['.', ','].map(|d| Dialect { separator: s, decimal: d }));
    let allowed = both
        .filter(|d| decimal.is_none_or(|wanted| wanted == d.decimal) && (d.separator != d.decimal || quoted));
    let mut best: Option<(f64, usize, Dialect)> = None;
    for dialect in allowed {
        let (score, width) = fit(lines, dialect);
        if score > best.map_or(0.0, |b| b.0 + 1e-9) {
            best = Some((score, width, dialect));
        }
    }
    best.filter(|(score, ..)| *score > LEAST).map(|(.., dialect)| dialect)
}

/// Least fit of a table of measurements: columns of text make it small, prose has hardly any numbers.
const LEAST: f64 = 0.2;

/// Cuts a text into a sheet.
///
/// # Errors
/// It is no table of numbers, or a row has too few or too many cells.
pub(super) fn sheet(
    path: &Path,
    text: &str,
    separator: Option<char>,
    decimal: Option<char>,
) -> Result<Sheet, DataError> {
    let numbered = || (1u64..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    let plain: Vec<&str> =
        numbered().map(|(_, l)| l).filter(|l| comment(l).is_none()).take(TELLING).collect();
    if plain.is_empty() {
        return Err(DataError::Empty { path: path.to_owned() });
    }
    let most = Limit::Columns.value();
    if plain.iter().any(|line| line.len() as u64 > 64 * most) {
        return Err(DataError::Limit {
            origin: Source::File(path.to_owned()),
            cause: Limit::Columns.exceeded(),
        });
    }
    // The preamble must not decide: the dialect is that of the lines after it.
    let tail = &plain[plain.len().min(PREAMBLE) / 2..];
    let dialect =
        dialect_of_lines(tail, separator, decimal).or_else(|| dialect_of_lines(&plain, separator, decimal));
    let no_numbers = || DataError::NotRecognised { path: path.to_owned(), open: Unrecognised::NoNumbers };
    let dialect = dialect.ok_or_else(no_numbers)?;
    let cells_of = |line: &str| cut(line, dialect.separator);
    let tail: Vec<Vec<String>> = tail.iter().map(|line| cells_of(line)).collect();
    let (columns, _) = usual_width(&tail);
    let share = |row: &[String]| {
        let numbers = row.iter().filter(|c| is_number(c, dialect.decimal)).count();
        let known = row.iter().filter(|c| !c.is_empty()).count();
        numbers as f64 / known.max(1) as f64
    };
    let usual = tail.iter().filter(|row| row.len() == columns).map(|row| share(row)).fold(0.0, f64::max);
    let numeric = |row: &[String]| share(row) > 0.5 * usual;
    let mut out = Sheet {
        path: path.to_owned(),
        dialect,
        names: None,
        units: Vec::new(),
        comments: Vec::new(),
        passed_over: 0,
        columns,
        lines: Vec::new(),
        cells: Vec::new(),
    };
    let mut above: Vec<Vec<String>> = Vec::new();
    for (line_number, line) in numbered() {
        if let Some(text) = comment(line) {
            if out.lines.is_empty() {
                out.comments.push(text.to_owned());
                let row = cells_of(text);
                if row.len() == columns && !numeric(&row) {
                    above.push(row);
                }
            }
            continue;
        }
        let mut row = cells_of(line);
        if out.lines.is_empty() && (row.len() != columns || !numeric(&row)) && above.len() < PREAMBLE {
            above.push(row);
            continue;
        }
        while row.len() > columns && row.last().is_some_and(String::is_empty) {
            row.pop();
        }
        if row.len() != columns {
            return Err(DataError::RaggedRow {
                path: path.to_owned(),
                line: line_number,
                found: row.len(),
                expected: columns,
                first_column: above.last().and_then(|names| names.first().cloned()).unwrap_or_default(),
                remedy: match row.len() < columns {
                    true => crate::RowRemedy::Complete,
                    false => crate::RowRemedy::Shorten,
                },
            });
        }
        out.lines.push(line_number);
        out.cells.append(&mut row);
        if out.cells.len() as u64 > Limit::Cells.value() {
            return Err(DataError::Limit {
                origin: Source::File(path.to_owned()),
                cause: Limit::Cells.exceeded(),
            });
        }
    }
    if out.lines.is_empty() {
        return Err(DataError::HeaderOnly { path: path.to_owned() });
    }
    name_columns(&mut out, above);
    Ok(out)
}

/// Takes names, and a row of units below them, from the rows above the data.
fn name_columns(out: &mut Sheet, mut above: Vec<Vec<String>>) {
    let all = above.len();
    // A header may have lost the cells of empty names at its end.
    let header = |row: &Vec<String>| {
        row.len() <= out.columns && 2 * row.iter().filter(|c| !c.is_empty()).count() > out.columns.min(3)
    };
    let Some(last) = above.pop().filter(header) else {
        out.passed_over = all;
        return;
    };
    let is_units = last.iter().all(|c| c.is_empty() || super::heading::Scale::of(c).is_some());
    let (names, units) = match above.pop().filter(|row| is_units && header(row)) {
        Some(names) => (names, last),
        None => (last, Vec::new()),
    };
    out.passed_over = all - 1 - usize::from(!units.is_empty());
    let filled = |mut row: Vec<String>| {
        row.resize(out.columns, String::new());
        row
    };
    out.units = if units.is_empty() { units } else { filled(units) };
    out.names = Some(filled(names));
}

#[cfg(test)]
mod tests {
    //! Contract: the dialect of a file is the one in which its cells are numbers.
    use super::*;

    fn read(text: &str) -> Sheet {
        sheet(Path::new("f"), text, None, None).unwrap_or_else(|e| panic!("{text}: {e}"))
    }

    #[test]
    fn separators_and_decimal_marks_are_told_apart() {
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
    fn header_units_comments_and_preamble_are_told_from_data() {
        let sheet = read("made by a tracker\n# 60 Hz\nt\tx\ns\tmm\n0\t1\n\n1\t\n");
        assert_eq!(sheet.names.as_deref(), Some(&["t".to_owned(), "x".to_owned()][..]));
        assert_eq!((sheet.units.join(" "), sheet.comments.join(" ")), ("s mm".into(), "60 Hz".into()));
        assert_eq!((sheet.lines.clone(), sheet.passed_over), (vec![5, 7], 1));
        assert_eq!(sheet.row(1), ["1", ""]);
        assert_eq!(read("# t x\n0 1\n1 2\n").names.map(|n| n.join(" ")), Some("t x".into()));
        assert_eq!(read("0 1\n1 2\n").names, None);
    }
}
