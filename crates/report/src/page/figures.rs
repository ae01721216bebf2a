//! Figures in a page: one over the whole width, or a grid of small multiples.
//!
//! A wide figure is drawn twice, for wide and for narrow screens, and the style shows one of them: the text
//! of an SVG that is scaled down to a phone would be unreadable.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::rich;
use crate::figure::{Fan, Figure, Target, Tone};
use crate::plot::frame::{Key, Swatch, swatch};

/// Width of every figure on a narrow screen, px.
const NARROW: f64 = 360.0;

/// A figure over the whole width of the page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FigureBlock {
    /// The figure that is drawn.
    pub figure: Figure,
    /// Caption: how to read the figure; may be empty.
    pub caption: String,
}

/// Number of columns of a grid of figures on a wide screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Columns {
    /// The grid has two columns.
    #[default]
    Two,
    /// The grid has three columns.
    Three,
}

/// A grid of figures with one legend and one caption.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Number of columns on a wide screen.
    pub columns: Columns,
    /// Common legend of all figures of the grid, which then hide theirs; may be empty.
    #[serde(default)]
    pub legend: Vec<LegendEntry>,
    /// Figures of the grid, row by row.
    pub figures: Vec<Figure>,
    /// Caption: how to read the figures; may be empty.
    pub caption: String,
}

/// An entry of a grid's legend.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LegendEntry {
    /// A line with its name and colour.
    Line(String, Tone),
    /// A marker with its name and colour.
    Points(String, Tone),
    /// Median and both bands of a fan chart in this colour, and the truth.
    Fan(Tone),
}

impl LegendEntry {
    fn keys(&self) -> Vec<Key> {
        match self {
            Self::Line(name, tone) => vec![Key { name: name.clone(), tone: *tone, swatch: Swatch::Line }],
            Self::Points(name, tone) => {
                vec![Key { name: name.clone(), tone: *tone, swatch: Swatch::Point }]
            }
            Self::Fan(tone) => Fan::keys(*tone),
        }
    }
}

/// Counter of figures, which makes every element id unique in the page.
#[derive(Debug, Default)]
pub(super) struct Ids {
    figures: usize,
}

impl Ids {
    fn next(&mut self) -> String {
        self.figures += 1;
        format!("f{}", self.figures)
    }
}

fn draw(figure: &Figure, width: f64, ids: &mut Ids) -> Markup {
    figure.draw(&Target { width, id: &ids.next(), standalone: false })
}

fn draw_for_both_widths(figure: &Figure, width: f64, ids: &mut Ids) -> Markup {
    html! {
        div class="wide" { (draw(figure, width, ids)) }
        div class="narrow" { (draw(figure, NARROW, ids)) }
    }
}

impl FigureBlock {
    pub(super) fn draw(&self, ids: &mut Ids) -> Markup {
        html! {
            figure {
                (draw_for_both_widths(&self.figure, 960.0, ids))
                @if !self.caption.is_empty() { figcaption { (rich(&self.caption)) } }
            }
        }
    }
}

impl Grid {
    pub(super) fn draw(&self, ids: &mut Ids) -> Markup {
        html! {
            figure {
                @if !self.legend.is_empty() {
                    ul class="legend" {
                        @for key in self.legend.iter().flat_map(LegendEntry::keys) {
                            li {
                                svg class="fig" viewBox="0 0 24 14" width="24" height="14" aria-hidden="true" { (swatch(&key, 2.0, 7.0)) }
                                (key.name)
                            }
                        }
                    }
                }
                @match self.columns {
                    Columns::Two => div class="grid c2" { @for f in &self.figures { div { (draw_for_both_widths(f, 500.0, ids)) } } },
                    Columns::Three => div class="grid c3" { @for f in &self.figures { div { (draw(f, 336.0, ids)) } } },
                }
                @if !self.caption.is_empty() { figcaption { (rich(&self.caption)) } }
            }
        }
    }
}
