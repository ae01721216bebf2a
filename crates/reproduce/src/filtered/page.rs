//! Report pages of forecasts from a prefix: a forecast figure and tables.

use crate::reproduction::{how_to_reproduce, provenance};
use augsim_report::figure::{Axis, Event, Fan, Figure, Tone};
use augsim_report::page::{Block, Cell, Column, Columns, Grid, LegendEntry, Page, Row, Section, Table};
use augsim_trainer::Samples;

/// Makes a report page: first the given blocks, then the tables.
pub fn page(
    (title, summary): (&str, String),
    blocks: Vec<Block>,
    tables: Vec<Table>,
    (command, seed): (&str, u64),
) -> Page {
    let mut sections = Vec::new();
    if !blocks.is_empty() {
        sections.push(Section::new("Forecasts with increasing prefixes", blocks));
    }
    sections.push(Section::new(
        "All models with the same prefixes",
        tables.into_iter().map(Block::Table).collect(),
    ));
    sections.push(how_to_reproduce(command));
    Page {
        overline: "filtered forecasts".to_owned(),
        title: title.to_owned(),
        summary,
        sections,
        provenance: provenance(seed, None),
        ..Default::default()
    }
}

/// Converts a fraction to per cent.
pub fn percent(share: Option<f64>) -> Option<f64> {
    share.map(|v| 100.0 * v)
}

/// Formats a fraction in per cent with one decimal; a dash if `None`.
pub fn percent_text(share: Option<f64>) -> String {
    percent(share).map_or("-".to_owned(), |v| format!("{v:.1}"))
}

/// Makes a table of models by prefix; `numbers` are title, unit and decimals of its number columns.
pub fn table(
    caption: String,
    numbers: &[(&str, &str, usize)],
    rows: impl Iterator<Item = (String, Vec<Option<f64>>)>,
) -> Table {
    let number =
        |(title, unit, decimals): &(&str, &str, usize)| Column::number(title, unit).decimals(*decimals);
    let row = |(name, values): (String, Vec<Option<f64>>)| {
        let cells = [Cell::text(name)].into_iter().chain(values.into_iter().map(Cell::number));
        Row::from(cells.collect::<Vec<_>>())
    };
    Table {
        caption,
        columns: [Column::text("model")].into_iter().chain(numbers.iter().map(number)).collect(),
        rows: rows.map(row).collect(),
        footnotes: Vec::new(),
    }
}

/// Draws forecasts of one column of a trajectory with increasing prefixes on the same scale.
///
/// `values` are those of the column at `times`. Each forecast has the number of measured rows and its samples
/// `[forecast rows, columns, sample]`.
pub fn fans(
    (label, unit): (&str, &str),
    (times, values): (&[f64], &[f64]),
    forecasts: &[(usize, Samples)],
    column: (usize, usize),
    caption: String,
) -> Block {
    let end = |ends: [f64; 2], v: f64| [ends[0].min(v), ends[1].max(v)];
    let mut range =
        values.iter().copied().filter(|v| v.is_finite()).fold([f64::INFINITY, f64::NEG_INFINITY], end);
    let each: Vec<Fan> =
        forecasts.iter().map(|(n, samples)| fan((times, values), *n, samples, column)).collect();
    for fan in &each {
        range = fan.lower90.iter().chain(&fan.upper90).copied().filter(|v| v.is_finite()).fold(range, end);
    }
    let one = |fan: Fan| {
        let y = Axis { domain: Some(range), ..Axis::linear(label, unit) };
        Figure::from(Fan { x: Axis::linear("time", "s"), y, ..fan })
    };
    Block::Grid(Grid {
        columns: Columns::Two,
        legend: vec![LegendEntry::Fan(Tone::Series(0))],
        figures: each.into_iter().map(one).collect(),
        caption,
    })
}

/// Returns median and bands of a forecast after `n` measured rows, which are gaps.
fn fan(
    (times, values): (&[f64], &[f64]),
    n: usize,
    samples: &Samples,
    (column, columns): (usize, usize),
) -> Fan {
    let mut levels = [0.5, 0.25, 0.75, 0.05, 0.95].map(|level| (level, vec![f64::NAN; n]));
    for row in 0..times.len() - n {
        let at = (row * columns + column) * samples.count;
        let mut sorted = samples.values[at..at + samples.count].to_vec();
        sorted.sort_unstable_by(f32::total_cmp);
        for (level, curve) in &mut levels {
            curve.push(f64::from(sorted[(*level * (sorted.len() - 1) as f64).round() as usize]));
        }
    }
    let [median, lower50, upper50, lower90, upper90] = levels.map(|(_, curve)| curve);
    let at = times[n - 1];
    Fan {
        title: format!("{n} measured samples ({at:.2} s)"),
        t: times.to_vec(),
        truth: values.to_vec(),
        events: vec![Event { at, label: "seen".to_owned() }],
        hide_legend: true,
        tone: Tone::Series(0),
        median,
        lower50,
        upper50,
        lower90,
        upper90,
        ..Fan::default()
    }
}
