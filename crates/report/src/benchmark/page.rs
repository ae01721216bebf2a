//! Builds the page of a benchmark from its results.

use super::curves::{errors, learning, parts, sizes};
use super::sections::{clouds, parameters};
use super::tones::{Tones, distinct};
use super::{BenchmarkReport, Forecast, Protocol, ResultRow, Results};
use crate::figure::{Axis, Fan, Figure, Tone};
use crate::page::{Block, Cell, Column, Columns, Grid, LegendEntry, Page, Row, Section, Table};
use crate::plot::scale::extent;
use crate::plot::text::capitalised;

pub(super) fn page(report: &BenchmarkReport) -> Page {
    let tones = Tones::from_report(report);
    let [one, many] = &report.words;
    Page {
        overline: format!("augsim · {}", report.kind),
        title: report.title.clone(),
        verdict: String::new(),
        summary: report.summary.clone(),
        key_figures: report.key_figures.clone(),
        sections: vec![
            Section::new("Results", results(report)),
            Section::new(&format!("Training {many}"), sizes(report, &tones)),
            Section::new(&format!("One {one} repeated many times"), clouds(report)),
            Section::new("Forecasts and true trajectories", forecasts(report, &tones)),
            Section::new("Error over time", errors(report, &tones)),
            Section::new(&format!("Error over the {one}"), parts(report, &tones)),
            Section::new("Fitted parameters", parameters(report)),
            Section::new("Learning curves", learning(report, &tones)),
            Section::new("Remarks", report.notes.iter().cloned().map(Block::Prose).collect()),
            Section::new("Methods and references", methods(report)),
            Section::new("How to reproduce", reproduce(report)),
        ],
        provenance: report.provenance.clone(),
    }
}

fn results(report: &BenchmarkReport) -> Vec<Block> {
    if report.results.iter().all(|r| r.rows.is_empty()) {
        return vec![Block::Prose("No model was evaluated.".to_owned())];
    }
    let mut blocks: Vec<Block> = report.results.iter().flat_map(Results::tables).map(Block::Table).collect();
    if report.results.iter().any(names_protocols) {
        blocks.push(Block::Heading("What the protocols mean".to_owned()));
        blocks.push(Block::Definitions(protocols()));
    }
    blocks
}

fn names_protocols(results: &Results) -> bool {
    results.rows.iter().any(|r| !r.estimator.is_empty())
}

impl Results {
    /// Tables of the scores, one per protocol, since errors of different protocols are not comparable.
    #[must_use]
    pub fn tables(&self) -> Vec<Table> {
        let mut protocols: Vec<Protocol> = self.rows.iter().map(|r| r.protocol).collect();
        protocols.sort();
        protocols.dedup();
        let caption = |protocol: &Protocol| match protocols.len() {
            0 | 1 => self.caption.clone(),
            _ => format!("{}: {}", self.caption, protocol.name()),
        };
        protocols.iter().map(|protocol| self.table(*protocol, caption(protocol))).collect()
    }

    /// Table of the scores under one protocol.
    fn table(&self, protocol: Protocol, caption: String) -> Table {
        let named = names_protocols(self);
        let mut columns = vec![Column::text("model")];
        if named {
            columns.extend(["protocol", "prediction"].map(Column::text));
        }
        columns.extend(self.columns.iter().cloned());
        let row = |r: &ResultRow| {
            let mut cells = vec![Cell::text(&r.model)];
            if named {
                let estimator = if r.estimator.is_empty() { Cell::Missing } else { Cell::text(&r.estimator) };
                cells.extend([Cell::text(r.protocol.name()), estimator]);
            }
            cells.extend(r.values.iter().map(|v| Cell::number(*v)));
            Row { cells, compare: Some(r.protocol.name().to_owned()), strong: false }
        };
        Table {
            caption,
            columns,
            rows: self.rows.iter().filter(|r| r.protocol == protocol).map(row).collect(),
            footnotes: self.footnotes.clone(),
        }
    }
}

fn protocols() -> Vec<(String, String)> {
    [
        ("forecast", "The model is given only the initial state, draws samples from its prior, and is scored on the whole trajectory. This is a prediction."),
        ("reconstruction", "The encoder is given the trajectory that is then decoded. This shows how much information the latent variables carry. It is not a prediction, and its error is not attainable by a forecast."),
        ("floor", "An estimate of the smallest error that a prediction from the initial state can have, by Monte Carlo simulation of the known equations. Quantities that are drawn per trajectory and not measurable at its start, such as the restitution, are unknown to every model. It is the mean over the test trajectories, so a forecast that is as good as possible can lie slightly above or below it by chance."),
    ]
    .map(|(term, meaning)| (term.to_owned(), meaning.to_owned()))
    .to_vec()
}

fn forecasts(report: &BenchmarkReport, tones: &Tones) -> Vec<Block> {
    let mut blocks = Vec::new();
    let models = distinct(&report.forecasts, |f| &f.model);
    for channel in distinct(&report.forecasts, |f| &f.channel) {
        let mut fans = Vec::new();
        for trajectory in distinct(&report.forecasts, |f| &f.trajectory) {
            let find = |model: &str| {
                report
                    .forecasts
                    .iter()
                    .find(|f| f.channel == channel && f.trajectory == trajectory && f.model == model)
            };
            fans.extend(models.iter().filter_map(|model| find(model)).map(|f| fan(f, tones.get(&f.model))));
        }
        // All panels of a channel share one range, so that they can be compared.
        if let Some((low, high)) = extent(fans.iter().flat_map(Fan::values)).filter(|(low, high)| low < high)
        {
            let margin = (high - low) * 0.04;
            for fan in &mut fans {
                fan.y = fan.y.clone().with_domain(low - margin, high + margin);
            }
        }
        if fans.is_empty() {
            continue;
        }
        let legend_tone = match models.as_slice() {
            [only] => tones.get(only),
            _ => Tone::Muted,
        };
        blocks.push(Block::Heading(capitalised(channel)));
        blocks.push(Block::Grid(Grid {
            columns: if models.len() == 2 || models.len() == 4 { Columns::Two } else { Columns::Three },
            legend: vec![LegendEntry::Fan(legend_tone)],
            figures: fans.into_iter().map(Figure::from).collect(),
            caption: format!("Forecasts of the {channel} from the initial state alone: median, 50 and 90 % bands of the samples, over the true trajectory."),
        }));
    }
    blocks
}

fn fan(f: &Forecast, tone: Tone) -> Fan {
    Fan {
        title: format!("{}, {}", f.model, f.trajectory),
        x: Axis::linear("time", "s"),
        y: Axis::linear(&f.channel, &f.unit),
        tone,
        t: f.t_s.clone(),
        median: f.median.clone(),
        lower50: f.lower50.clone(),
        upper50: f.upper50.clone(),
        lower90: f.lower90.clone(),
        upper90: f.upper90.clone(),
        truth: f.truth.clone(),
        events: Vec::new(),
        hide_legend: true,
    }
}

fn methods(report: &BenchmarkReport) -> Vec<Block> {
    if report.methods.is_empty() { Vec::new() } else { vec![Block::Methods(report.methods.clone())] }
}

fn reproduce(report: &BenchmarkReport) -> Vec<Block> {
    if report.reproduce.is_empty() {
        return Vec::new();
    }
    vec![Block::Code { caption: String::new(), text: report.reproduce.join("\n") }]
}
