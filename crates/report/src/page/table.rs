//! Tables, with units in the head and the best value of each column marked.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::rich;
use crate::plot::text::{fixed, significant, typographic};
use augsim_data::estimate_digits;

/// A table of a page: caption, columns, rows and footnotes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Subject of the table, shown above it.
    pub caption: String,
    /// Columns of the table; the first one heads the rows.
    pub columns: Vec<Column>,
    /// Rows of the table.
    pub rows: Vec<Row>,
    /// Notes under the table.
    #[serde(default)]
    pub footnotes: Vec<String>,
}

/// Which value of a column counts as best.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Best {
    /// The smallest value is best.
    Lowest,
    /// The largest value is best.
    Highest,
    /// The value nearest to this target is best, e.g. to a nominal coverage.
    Nearest(f64),
}

/// A column of a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Name of the quantity in the column.
    pub title: String,
    /// Unit of the column; empty for none.
    #[serde(default)]
    pub unit: String,
    /// Whether the column has right-aligned numbers.
    #[serde(default)]
    pub numeric: bool,
    /// Decimals of plain numbers; `None`: three significant digits, cell by cell.
    #[serde(default)]
    pub decimals: Option<usize>,
    /// Which value of the column is marked as best; `None` marks none.
    #[serde(default)]
    pub best: Option<Best>,
}

impl Column {
    /// A column that contains text.
    #[must_use]
    pub fn text(title: &str) -> Self {
        Self { title: title.to_owned(), ..Self::default() }
    }

    /// A column that contains numbers in `unit`.
    #[must_use]
    pub fn number(title: &str, unit: &str) -> Self {
        Self { title: title.to_owned(), unit: unit.to_owned(), numeric: true, ..Self::default() }
    }

    /// Sets the number of decimals of this column.
    #[must_use]
    pub fn decimals(self, decimals: usize) -> Self {
        Self { decimals: Some(decimals), ..self }
    }

    /// Sets which value of this column is marked as best.
    #[must_use]
    pub fn best(self, best: Best) -> Self {
        Self { best: Some(best), ..self }
    }
}

/// A row of a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Cells of the row, one per column.
    pub cells: Vec<Cell>,
    /// Group of rows among which the best value is marked; `None`: the row is not compared.
    #[serde(default)]
    pub compare: Option<String>,
    /// Whether the row is highlighted.
    #[serde(default)]
    pub strong: bool,
}

impl From<Vec<Cell>> for Row {
    fn from(cells: Vec<Cell>) -> Self {
        Self { cells, ..Self::default() }
    }
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cell {
    /// The cell has no value and shows "–".
    #[default]
    Missing,
    /// The cell contains text.
    Text(String),
    /// The cell contains a number in the column's unit.
    Number(f64),
    /// The cell contains a number with its interval.
    Interval {
        /// Estimated value.
        value: f64,
        /// Lower end of the interval.
        low: f64,
        /// Upper end of the interval.
        high: f64,
    },
}

impl Cell {
    /// A cell with text.
    #[must_use]
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A cell with a number; `None` gives a cell without a value.
    #[must_use]
    pub fn number(value: Option<f64>) -> Self {
        value.map_or(Self::Missing, Self::Number)
    }

    /// A cell with an estimate, and with its interval if there is one.
    #[must_use]
    pub fn estimate(value: f64, interval: Option<[f64; 2]>) -> Self {
        interval.map_or(Self::Number(value), |[low, high]| Self::Interval { value, low, high })
    }

    fn value(&self) -> Option<f64> {
        match self {
            Self::Number(v) | Self::Interval { value: v, .. } => v.is_finite().then_some(*v),
            Self::Missing | Self::Text(_) => None,
        }
    }

    fn draw(&self, column: &Column) -> Markup {
        match self {
            Self::Missing => html! { "–" },
            Self::Text(text) => rich(text),
            Self::Number(v) => {
                html! { (column.decimals.map_or_else(|| significant(*v, 3), |d| fixed(*v, d))) }
            }
            Self::Interval { value, low, high } => {
                let (value, interval) = estimate_text(*value, [*low, *high]);
                html! { (value) span class="ci" { "[" (interval) "]" } }
            }
        }
    }
}

/// Estimate and interval as texts with the digits of [`estimate_digits`], in the typography of a page.
pub fn estimate_text(value: f64, [low, high]: [f64; 2]) -> (String, String) {
    let half = 0.5 * (high - low).abs();
    if !(half > 0.0 && half.is_finite() && value.is_finite()) {
        return (significant(value, 3), format!("{}, {}", significant(low, 3), significant(high, 3)));
    }
    let [value, low, high] = estimate_digits(value, [low, high]).map(|text| typographic(&text));
    (value, format!("{low}, {high}"))
}

impl Table {
    /// Whether a cell has the best value of its column within its group.
    fn is_best(&self, row: &Row, index: usize) -> bool {
        let Some((column, group)) = self.columns.get(index).zip(row.compare.as_ref()) else {
            return false;
        };
        let Some(best) = column.best else {
            return false;
        };
        let badness = |row: &Row| {
            let value = row.cells.get(index)?.value()?;
            Some(match best {
                Best::Lowest => value,
                Best::Highest => -value,
                Best::Nearest(target) => (value - target).abs(),
            })
        };
        let group_values: Vec<f64> =
            self.rows.iter().filter(|r| r.compare.as_ref() == Some(group)).filter_map(badness).collect();
        group_values.len() > 1 && badness(row).is_some_and(|own| group_values.iter().all(|v| own <= *v))
    }

    /// Whether row `i` begins a new group, so that a line is drawn above it.
    fn starts_group(&self, i: usize) -> bool {
        i > 0 && self.rows.get(i).map(|r| &r.compare) != self.rows.get(i - 1).map(|r| &r.compare)
    }

    pub(super) fn draw(&self) -> Markup {
        let class = |column: &Column, cell: &Cell| match cell {
            _ if column.numeric => Some("num"),
            // Short texts stay on one line; sentences wrap.
            Cell::Text(text) if text.chars().count() <= 18 => Some("nw"),
            Cell::Text(_) => Some("tx"),
            _ => None,
        };
        html! {
            @if !self.caption.is_empty() { p class="cap" { (rich(&self.caption)) } }
            div class="scroll stick" role="region" aria-label=(self.caption) tabindex="0" {
                table {
                    thead {
                        tr {
                            @for column in &self.columns {
                                th scope="col" class=[column.numeric.then_some("num")] {
                                    (rich(&column.title))
                                    @if !column.unit.is_empty() { " " span class="unit" { (column.unit) } }
                                }
                            }
                        }
                    }
                    tbody {
                        @for (i, row) in self.rows.iter().enumerate() {
                            tr class=[self.row_class(i, row)] {
                                @for (at, (cell, column)) in row.cells.iter().zip(&self.columns).enumerate() {
                                    @let best = self.is_best(row, at);
                                    @if at == 0 {
                                        th scope="row" { (cell.draw(column)) }
                                    } @else {
                                        td class=[class(column, cell)] {
                                            @if best { span class="best" { (cell.draw(column)) } } @else { (cell.draw(column)) }
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
            @if !self.footnotes.is_empty() {
                div class="foot" { @for note in &self.footnotes { p { (rich(note)) } } }
            }
        }
    }

    fn row_class(&self, i: usize, row: &Row) -> Option<&'static str> {
        match (row.strong, self.starts_group(i)) {
            (true, true) => Some("strong sep"),
            (true, false) => Some("strong"),
            (false, true) => Some("sep"),
            (false, false) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the best value is marked within each group of comparable rows only.
    use super::*;

    #[test]
    fn best_value_is_marked_within_its_group() {
        let row = |group: Option<&str>, value: f64| Row {
            cells: vec![Cell::text("model"), Cell::Number(value)],
            compare: group.map(str::to_owned),
            strong: false,
        };
        let table = Table {
            columns: vec![Column::text("model"), Column::number("error", "m").best(Best::Lowest)],
            rows: vec![
                row(Some("forecast"), 0.3),
                row(Some("forecast"), 0.2),
                row(Some("reconstruction"), 0.1),
                row(None, 0.0),
            ],
            ..Table::default()
        };
        let best: Vec<bool> = table.rows.iter().map(|r| table.is_best(r, 1)).collect();
        assert_eq!(best, [false, true, false, false]);
    }

    #[test]
    fn digits_of_an_estimate_follow_its_interval() {
        assert_eq!(estimate_text(0.013_21, [0.012_7, 0.013_8]), ("0.0132".into(), "0.0127, 0.0138".into()));
        assert_eq!(estimate_text(-4.0, [-5.5, -2.5]), ("−4.00".into(), "−5.50, −2.50".into()));
        assert_eq!(estimate_text(3.0, [3.0, 3.0]), ("3.00".into(), "3.00, 3.00".into()));
    }
}
