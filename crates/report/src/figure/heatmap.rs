//! Heat map of a correlation matrix: a number in each cell, with sign and size also shown by colour.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::Target;
use crate::plot::frame::{LABEL, TICK, header, label, no_data, svg};
use crate::plot::scale::drawable;
use crate::plot::text::{coordinate as c, fixed, shorten, width};

/// Heat map of a correlation matrix, of which the lower triangle is drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Heatmap {
    /// Title of the heat map.
    pub title: String,
    /// Names of the correlated parameters.
    pub names: Vec<String>,
    /// Correlations in `[-1, 1]`, one row per parameter; `None` is shown as "–".
    pub values: Vec<Vec<Option<f64>>>,
}

impl Heatmap {
    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let n = self.names.len().min(self.values.len());
        if n < 2 {
            return no_data(target, &self.title, "correlations need two parameters");
        }
        let (head, top) = header(target.width, &self.title, &[]);
        let names: Vec<String> =
            (self.names.iter()).map(|name| shorten(name, LABEL, target.width * 0.45)).collect();
        // Rows 1.. and columns ..n-1: the diagonal, which is always 1, is not drawn.
        let left = names.iter().skip(1).map(|s| width(s, LABEL)).fold(0.0, f64::max) + 10.0;
        let cell = ((target.width - left) / (n as f64 - 1.0)).min(72.0);
        let height = cell.min(34.0);
        let top = top + 12.0;
        let bottom = top + (n as f64 - 1.0) * height;
        let number_fits = cell >= width("−0.00", TICK) + 4.0;
        let column_width = names.iter().take(n - 1).map(|s| width(s, LABEL)).fold(0.0, f64::max);
        let slanted = column_width > cell - 6.0;
        let foot = if slanted { column_width * 0.58 + 22.0 } else { 24.0 };
        let column = |j: usize| left + (j as f64 + 0.5) * cell;
        let body = html! {
            (head)
            @for (i, name) in names.iter().enumerate().take(n).skip(1) {
                @let y = top + (i as f64 - 1.0) * height;
                (label("", 0.0, y + height / 2.0 + 3.8, LABEL, name))
                @for (j, value) in self.values.get(i).into_iter().flatten().enumerate().take(i) {
                    @let value = value.filter(|v| drawable(*v)).map(|v| v.clamp(-1.0, 1.0));
                    @let x = left + j as f64 * cell;
                    rect class="pn" x=(c(x + 1.0)) y=(c(y + 1.0)) width=(c(cell - 2.0)) height=(c(height - 2.0)) rx="2" {}
                    @if let Some(v) = value {
                        rect x=(c(x + 1.0)) y=(c(y + 1.0)) width=(c(cell - 2.0)) height=(c(height - 2.0)) rx="2"
                            style={ "fill:var(--" (if v < 0.0 { "s1" } else { "s0" }) ");fill-opacity:" (format!("{:.2}", v.abs() * 0.5)) } {}
                    }
                    @if number_fits {
                        (label("mi", column(j), y + height / 2.0 + 3.8, TICK, &value.map_or_else(|| "–".to_owned(), |v| fixed(v, 2))))
                    }
                }
            }
            @for (j, name) in names.iter().enumerate().take(n - 1) {
                @if slanted {
                    text class="en" x="0" y="0" font-size=(c(LABEL)) transform={ "translate(" (c(column(j) + 4.0)) " " (c(bottom + 14.0)) ") rotate(-35)" } { (name) }
                } @else {
                    (label("mi", column(j), bottom + 16.0, LABEL, name))
                }
            }
        };
        svg(target, bottom + foot, &self.title, &self.describe(n), &body)
    }

    fn describe(&self, n: usize) -> String {
        let mut strongest: Option<(f64, usize, usize)> = None;
        for (i, row) in self.values.iter().enumerate().take(n) {
            for (j, value) in row.iter().enumerate().take(i) {
                if let Some(v) = value.filter(|v| drawable(*v))
                    && strongest.is_none_or(|(s, _, _)| v.abs() > s.abs())
                {
                    strongest = Some((v, i, j));
                }
            }
        }
        let name = |i: usize| self.names.get(i).map_or("", String::as_str);
        let strongest_text = strongest.map_or_else(String::new, |(v, i, j)| {
            format!(" Strongest: {} with {}, {}.", name(i), name(j), fixed(v, 2))
        });
        format!("Correlations of {n} parameters.{strongest_text}")
    }
}
