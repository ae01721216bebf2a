//! One self-contained HTML page: prose, tables, figures, commands, methods, provenance.
//!
//! Text may contain `code` between backticks; everything is escaped. The page has no script and loads
//! nothing. Its style covers phones, dark mode and print.

mod figures;
mod style;
mod table;

pub use figures::{Columns, FigureBlock, Grid, LegendEntry};
pub use table::{Best, Cell, Column, Row, Table, estimate_text};

use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde::{Deserialize, Serialize};

use crate::figure::Figure;
use crate::plot::palette;
pub use crate::plot::text::significant;
use figures::Ids;

/// Content of a self-contained HTML page of a report: title, summary, key figures and sections.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Page {
    /// Small line above the title, e.g. the kind of report.
    pub overline: String,
    /// Title of the page.
    pub title: String,
    /// Short verdict of the report, e.g. `explained`; empty for none.
    #[serde(default)]
    pub verdict: String,
    /// Outcome of the report in one or two sentences.
    pub summary: String,
    /// Key figures of the page, shown in large type.
    #[serde(default)]
    pub key_figures: Vec<KeyFigure>,
    /// Sections of the page, in order.
    pub sections: Vec<Section>,
    /// Version, seed and data of the run, shown at the end.
    #[serde(default)]
    pub provenance: Provenance,
}

/// A key figure: a number in large type with unit and label.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KeyFigure {
    /// The number as formatted text.
    pub value: String,
    /// Unit of the number.
    pub unit: String,
    /// Name of the quantity that the number measures.
    pub label: String,
    /// Note under the number, e.g. what to compare it with.
    #[serde(default)]
    pub note: String,
}

/// A section of a page, with a heading.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Heading of the section.
    pub title: String,
    /// Content of the section, in order.
    pub blocks: Vec<Block>,
}

/// One element of a section: text, table, figure or other content.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "block", content = "content", rename_all = "kebab-case")]
pub enum Block {
    /// A paragraph of text.
    Prose(String),
    /// A heading within a section.
    Heading(String),
    /// A list of terms with their meanings.
    Definitions(Vec<(String, String)>),
    /// An unordered list of texts.
    List(Vec<String>),
    /// A highlighted paragraph, e.g. the next experiment.
    Callout(String),
    /// A table with caption, columns and rows.
    Table(Table),
    /// A figure over the whole width of the page.
    Figure(Box<FigureBlock>),
    /// A grid of small figures.
    Grid(Grid),
    /// Text to copy: commands, a model file.
    Code {
        /// Name of the text, shown above it.
        caption: String,
        /// Text to copy, kept line by line.
        text: String,
    },
    /// A list of methods with references.
    Methods(Vec<Method>),
    /// Blocks that are hidden until the reader opens them by a click.
    Folded {
        /// Line that is always shown, which opens the blocks.
        title: String,
        /// Blocks that are hidden at first.
        blocks: Vec<Block>,
    },
}

/// A method that was used, with its reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Method {
    /// Name of the method.
    pub name: String,
    /// Purpose of the method in this analysis.
    pub purpose: String,
    /// Reference of the method: author, title, place, year.
    pub reference: String,
}

/// Origin of a report: version, seed, data and machine. The caller passes all of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of augsim that wrote the report.
    pub version: String,
    /// Seed of every random stream of the run; `None` if not stated.
    #[serde(default)]
    pub seed: Option<u64>,
    /// Data files that were read.
    #[serde(default)]
    pub data: Vec<DataSource>,
    /// Machine of the run, e.g. processor and thread count; `None` if not stated.
    #[serde(default)]
    pub machine: Option<String>,
    /// Date of the run, e.g. `2026-01-31`; `None` if not stated.
    #[serde(default)]
    pub date: Option<String>,
    /// Further facts about the run, as name and value.
    #[serde(default)]
    pub more: Vec<(String, String)>,
}

/// A data file and the hash of its bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DataSource {
    /// Path or name of the data file.
    pub path: String,
    /// Hash of the file with its algorithm, e.g. `sha256:…`; empty for generated data.
    #[serde(default)]
    pub hash: String,
}

impl Section {
    /// A section with this title and these blocks.
    #[must_use]
    pub fn new(title: &str, blocks: Vec<Block>) -> Self {
        Self { title: title.to_owned(), blocks }
    }
}

/// Escapes a text and marks `code` between backticks.
pub(crate) fn rich(text: &str) -> Markup {
    let pieces: Vec<&str> = text.split('`').collect();
    // With an odd number of backticks the text is shown unchanged.
    if pieces.len().is_multiple_of(2) {
        return html! { (text) };
    }
    html! {
        @for (i, piece) in pieces.iter().enumerate() {
            @if i % 2 == 1 { code { (piece) } } @else { (piece) }
        }
    }
}

/// Maximum number of sections in a short version of a page.
const EXCERPT_SECTIONS: usize = 3;

impl Page {
    /// Short version of the page: title, outcome and the first non-empty sections.
    #[must_use]
    pub fn excerpt(mut self) -> Self {
        self.sections.retain(|section| !section.blocks.is_empty());
        self.sections.truncate(EXCERPT_SECTIONS);
        self
    }

    /// All figures of the page, in the order of its sections.
    #[must_use]
    pub fn into_figures(self) -> Vec<Figure> {
        let blocks = self.sections.into_iter().flat_map(|section| section.blocks);
        let figures = |block| match block {
            Block::Figure(figure) => vec![figure.figure],
            Block::Grid(grid) => grid.figures,
            _ => Vec::new(),
        };
        blocks.flat_map(figures).collect()
    }
}

/// File names for figures, e.g. `error-over-time-2`.
///
/// A name is the title up to a colon or comma, in lower case with hyphens, and a number if several figures
/// have the same name.
#[must_use]
pub fn figure_names(figures: &[Figure]) -> Vec<String> {
    let mut plain: Vec<String> = Vec::new();
    let mut names = Vec::new();
    for figure in figures {
        let title = figure.title().split([':', ',']).next().unwrap_or_default().to_lowercase();
        let words: Vec<&str> =
            title.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
        let name = words.join("-");
        let same_count = plain.iter().filter(|n| **n == name).count();
        names.push(if same_count == 0 { name.clone() } else { format!("{name}-{}", same_count + 1) });
        plain.push(name);
    }
    names
}

impl Page {
    /// Renders the page as HTML; sections without blocks are left out.
    #[must_use]
    pub fn render(&self) -> String {
        let mut ids = Ids::default();
        let sections: Vec<(usize, &Section)> =
            self.sections.iter().filter(|s| !s.blocks.is_empty()).enumerate().collect();
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="generator" content={ "augsim " (self.provenance.version) };
                    title { (self.title) }
                    style { (PreEscaped(palette::variables_css(":root"))) (PreEscaped(palette::figure_css())) (PreEscaped(style::PAGE)) }
                }
                body {
                    main {
                        header {
                            p class="over" { (self.overline.trim_end_matches([' ', '·'])) }
                            @if !self.title.is_empty() { h1 { (self.title) } }
                            p class="lead" {
                                @if !self.verdict.is_empty() { span class="chip" { (self.verdict) } " " }
                                (rich(&self.summary))
                            }
                            @if !self.key_figures.is_empty() { (key_figures(&self.key_figures)) }
                        }
                        @if sections.len() > 3 {
                            nav aria-label="Sections" {
                                @for (i, section) in &sections { a href={ "#s" (i + 1) } { (section.title) } }
                            }
                        }
                        @for (i, section) in &sections {
                            section id={ "s" (i + 1) } {
                                h2 { (section.title) }
                                @for block in &section.blocks { (draw_block(block, &mut ids)) }
                            }
                        }
                        (provenance(&self.provenance))
                    }
                }
            }
        };
        let mut text = page.into_string();
        text.push('\n');
        text
    }
}

fn key_figures(figures: &[KeyFigure]) -> Markup {
    html! {
        dl class="keys" {
            @for k in figures {
                div {
                    dt { (k.label) }
                    dd {
                        span class="big" { (k.value) @if !k.unit.is_empty() { span class="unit" { "\u{202f}" (k.unit) } } }
                        @if !k.note.is_empty() { span class="note" { (k.note) } }
                    }
                }
            }
        }
    }
}

fn draw_block(block: &Block, ids: &mut Ids) -> Markup {
    match block {
        Block::Prose(text) => html! { p { (rich(text)) } },
        Block::Heading(text) => html! { h3 { (rich(text)) } },
        Block::Callout(text) => html! { p class="callout" { (rich(text)) } },
        Block::List(items) => html! { ul { @for item in items { li { (rich(item)) } } } },
        Block::Definitions(terms) => html! {
            dl class="terms" { @for (term, meaning) in terms { div { dt { (rich(term)) } dd { (rich(meaning)) } } } }
        },
        Block::Table(table) => table.draw(),
        Block::Figure(figure) => figure.draw(ids),
        Block::Grid(grid) => grid.draw(ids),
        Block::Code { caption, text } => html! {
            figure class="code" {
                @if !caption.is_empty() { figcaption { (rich(caption)) } }
                pre tabindex="0" { code { (text) } }
            }
        },
        Block::Folded { title, blocks } => html! {
            details { summary { (rich(title)) } @for block in blocks { (draw_block(block, ids)) } }
        },
        Block::Methods(methods) => html! {
            ol class="methods" {
                @for m in methods {
                    li { strong { (m.name) } ": " (rich(&m.purpose)) " " span class="ref" { (rich(&m.reference)) } }
                }
            }
        },
    }
}

fn provenance(p: &Provenance) -> Markup {
    let mut terms: Vec<(&str, String, String)> =
        vec![("version", format!("augsim {}", p.version).trim_end().to_owned(), String::new())];
    terms.extend(p.seed.map(|seed| ("seed", seed.to_string(), String::new())));
    terms.extend(p.data.iter().map(|d| ("data", d.path.clone(), d.hash.clone())));
    terms.extend(p.machine.clone().map(|m| ("machine", m, String::new())));
    terms.extend(p.date.clone().map(|d| ("date", d, String::new())));
    terms.extend(p.more.iter().map(|(name, value)| (name.as_str(), value.clone(), String::new())));
    html! {
        footer aria-label="Provenance" {
            dl {
                @for (term, value, hash) in &terms {
                    div { dt { (term) } dd { (value) @if !hash.is_empty() { " " code { (hash) } } } }
                }
            }
        }
    }
}
