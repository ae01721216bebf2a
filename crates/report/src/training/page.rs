//! From a training run to a page.

use super::{ErrorCurve, Forecast, LearningCurve, MetricRow, Protocol, TrainingReport, TrainingRun};
use crate::figure::{Axis, Fan, Figure, Line, Series, Tone};
use crate::page::{
    Best, Block, Cell, Column, Columns, Grid, KeyFigure, LegendEntry, Page, Row, Section, Table,
};
use crate::plot::scale::{drawable, extent};
use crate::plot::text::{capitalised, significant};

/// Longest learning curve that is drawn as it is; longer ones are summarised in this many bins.
const CURVE_BINS: usize = 160;

pub(super) fn page(report: &TrainingReport) -> Page {
    let tones = Tones::of(report);
    Page {
        overline: format!("augsim · training report · {}", report.scenario),
        title: report.title.clone(),
        verdict: String::new(),
        summary: report.summary.clone(),
        key_figures: key_figures(report),
        sections: vec![
            Section::new("Results", results(report)),
            Section::new("Forecasts over what happened", forecasts(report, &tones)),
            Section::new("Error over time", errors(report, &tones)),
            Section::new("Learning curves", learning(report, &tones)),
            Section::new("Remarks", report.notes.iter().cloned().map(Block::Prose).collect()),
            Section::new("Methods and references", methods(report)),
            Section::new("How to reproduce", reproduce(report)),
        ],
        provenance: report.provenance.clone(),
    }
}

/// The colour of each model through the report: the subject first, floors muted.
pub(crate) struct Tones<'a>(Vec<&'a str>);

impl<'a> Tones<'a> {
    pub(crate) fn of(report: &'a TrainingReport) -> Self {
        let rows = report.rows.iter().filter(|r| r.protocol != Protocol::Floor).map(|r| &r.model);
        let curves = report.errors.iter().filter(|e| e.protocol != Protocol::Floor).map(|e| &e.model);
        let forecasts = report.forecasts.iter().map(|f| &f.model);
        let learning = report.learning.iter().map(|l| &l.model);
        let mut names = vec![report.subject.as_str()];
        // Trained models come before baselines, so that they get the clearest colours.
        for name in learning.chain(forecasts).chain(rows).chain(curves) {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        Self(names)
    }

    pub(crate) fn get(&self, model: &str) -> Tone {
        let at = self.0.iter().position(|name| *name == model);
        at.and_then(|i| u8::try_from(i).ok()).map_or(Tone::Muted, Tone::Series)
    }
}

fn key_figures(report: &TrainingReport) -> Vec<KeyFigure> {
    if !report.key_figures.is_empty() {
        return report.key_figures.clone();
    }
    let of = |protocol: Protocol| {
        report.rows.iter().find(move |r| {
            r.protocol == protocol && (protocol == Protocol::Floor || r.model == report.subject)
        })
    };
    let Some(row) = of(Protocol::Forecast) else {
        return Vec::new();
    };
    let floor = of(Protocol::Floor);
    let figure = |label: &str, unit: &str, get: fn(&MetricRow) -> Option<f64>, scale: f64| {
        let value = get(row)?;
        let note = floor.and_then(get).map(|f| format!("floor {}\u{202f}{unit}", significant(f * scale, 3)));
        Some(KeyFigure {
            value: significant(value * scale, 3),
            unit: unit.to_owned(),
            label: label.to_owned(),
            note: note.unwrap_or_default(),
        })
    };
    let covered = |label: &str, get: fn(&MetricRow) -> Option<f64>| {
        let value = significant(get(row)? * 100.0, 3);
        Some(KeyFigure {
            value,
            unit: "%".to_owned(),
            label: label.to_owned(),
            note: "of true values inside".to_owned(),
        })
    };
    [
        figure(&format!("{}, forecast: position error", report.subject), "m", |r| r.pos_m, 1.0),
        figure("velocity error", "m/s", |r| r.vel_m_s, 1.0),
        figure("translation error", "%", |r| r.trans_percent, 1.0),
        covered("90 % band holds", |r| r.coverage90),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn results(report: &TrainingReport) -> Vec<Block> {
    let estimators = report.rows.iter().any(|r| !r.estimator.is_empty());
    let mut columns = vec![Column::text("model"), Column::text("protocol")];
    if estimators {
        columns.push(Column::text("prediction"));
    }
    let lowest =
        |title: &str, unit: &str, decimals| Column::number(title, unit).decimals(decimals).best(Best::Lowest);
    columns.extend([
        lowest("translation", "%", 2),
        lowest("position", "m", 3),
        lowest("velocity", "m/s", 3),
        lowest("CRPS position", "m", 3),
        lowest("CRPS velocity", "m/s", 3),
        Column::number("50 % band holds", "%").decimals(1).best(Best::Nearest(50.0)),
        Column::number("90 % band holds", "%").decimals(1).best(Best::Nearest(90.0)),
    ]);
    let row = |r: &MetricRow| {
        let mut cells = vec![Cell::text(&r.model), Cell::text(r.protocol.name())];
        if estimators {
            cells.push(if r.estimator.is_empty() { Cell::Missing } else { Cell::text(&r.estimator) });
        }
        let percent = |v: Option<f64>| Cell::number(v.map(|v| v * 100.0));
        cells.extend([r.trans_percent, r.pos_m, r.vel_m_s, r.crps_pos_m, r.crps_vel_m_s].map(Cell::number));
        cells.extend([percent(r.coverage50), percent(r.coverage90)]);
        Row { cells, compare: Some(r.protocol.name().to_owned()), strong: false }
    };
    let mut sorted: Vec<&MetricRow> = report.rows.iter().collect();
    sorted.sort_by_key(|r| r.protocol);
    let table = Table {
        caption: format!("Error on {}", report.test_set),
        columns,
        rows: sorted.into_iter().map(row).collect(),
        footnotes: vec![
            "Mean absolute error over all steps and trajectories; translation is the mean over trajectories of the summed absolute error over the summed true height. CRPS: continuous ranked probability score; for a deterministic model it is the absolute error.".to_owned(),
            "Bold and underlined: best of its protocol (for bands: nearest to the stated share). Protocols are not compared with each other.".to_owned(),
        ],
    };
    let mut blocks = Vec::new();
    if report.rows.is_empty() {
        blocks.push(Block::Prose("No model was evaluated.".to_owned()));
    } else {
        blocks.push(Block::Table(table));
        blocks.push(Block::Heading("What the protocols mean".to_owned()));
        blocks.push(Block::Definitions(protocols()));
    }
    blocks
}

fn protocols() -> Vec<(String, String)> {
    [
        ("forecast", "The model sees the initial state and nothing else, draws samples from its prior, and is judged on the whole trajectory. This is a prediction."),
        ("reconstruction", "The encoder has seen the very trajectory that is then decoded. This shows what the latent variables can carry. It is not a prediction, and no forecast can be expected to reach it."),
        ("floor", "The best that any predictor can do from the initial state, computed by Monte Carlo from the known law. What is drawn per trajectory and cannot be seen at the start, such as the restitution, no model can know: a forecast below the floor would be luck or a mistake."),
    ]
    .map(|(term, meaning)| (term.to_owned(), meaning.to_owned()))
    .to_vec()
}

/// Distinct values of a key, in order of appearance.
pub(crate) fn distinct<'a, T>(items: &'a [T], key: impl Fn(&'a T) -> &'a str) -> Vec<&'a str> {
    let mut seen = Vec::new();
    for item in items.iter().map(key) {
        if !seen.contains(&item) {
            seen.push(item);
        }
    }
    seen
}

pub(crate) fn forecasts(report: &TrainingReport, tones: &Tones) -> Vec<Block> {
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
        // One range for all panels of a channel, so that they can be compared.
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

fn errors(report: &TrainingReport, tones: &Tones) -> Vec<Block> {
    let mut cut = false;
    let mut figures = Vec::new();
    // The floor belongs beside the forecasts; a reconstruction has a figure of its own.
    for (shown, name) in [
        (&[Protocol::Forecast, Protocol::Floor][..], "forecast"),
        (&[Protocol::Reconstruction][..], "reconstruction"),
    ] {
        for channel in distinct(&report.errors, |e| &e.channel) {
            let curves: Vec<&ErrorCurve> = (report.errors.iter())
                .filter(|e| e.channel == channel && shown.contains(&e.protocol))
                .collect();
            let Some(first) = curves.first() else {
                continue;
            };
            let y = Axis::linear("mean absolute error", &first.unit).with_zero();
            let mut line =
                Line::new(&format!("{}, {name}", capitalised(channel)), Axis::linear("time", "s"), y);
            for curve in curves {
                let floor = curve.protocol == Protocol::Floor;
                let tone = if floor { Tone::Muted } else { tones.get(&curve.model) };
                let name = match curve.protocol {
                    Protocol::Floor => format!("{}, floor", curve.model),
                    _ => curve.model.clone(),
                };
                line = line.with(Series::line(&name, tone, curve.t_s.clone(), curve.error.clone()));
            }
            if let Some(top) = crowded_below(&line.series) {
                line.y = line.y.with_domain(0.0, top);
                cut = true;
            }
            figures.push(Figure::from(line));
        }
    }
    let mut caption = "Mean absolute error over the test trajectories at each time after the start. The floor is the least error that any predictor from the initial state can have.".to_owned();
    if cut {
        caption.push_str(" One model is so far off that its curve is cut at the top.");
    }
    grid(figures, &caption)
}

/// The end of an axis that shows all curves but one which would press the others to the bottom.
fn crowded_below(series: &[Series]) -> Option<f64> {
    let mut peaks: Vec<f64> =
        (series.iter()).filter_map(|s| extent(s.y.iter().copied()).map(|range| range.1)).collect();
    peaks.sort_by(f64::total_cmp);
    let [.., second, first] = peaks.as_slice() else {
        return None;
    };
    (peaks.len() > 2 && *second > 0.0 && *first > 2.5 * second).then_some(second * 1.2)
}

fn grid(figures: Vec<Figure>, caption: &str) -> Vec<Block> {
    if figures.is_empty() {
        return Vec::new();
    }
    let caption = caption.to_owned();
    vec![Block::Grid(Grid { columns: Columns::Two, legend: Vec::new(), figures, caption })]
}

pub(crate) fn learning(report: &TrainingReport, tones: &Tones) -> Vec<Block> {
    let parts: Vec<&str> = {
        let mut seen: Vec<&str> = Vec::new();
        for part in report.learning.iter().flat_map(|l| &l.parts) {
            if !seen.contains(&part.name.as_str()) {
                seen.push(&part.name);
            }
        }
        seen
    };
    let mut figures = Vec::new();
    for name in parts {
        let find = |l: &LearningCurve| l.parts.iter().position(|p| p.name == name);
        let all = || report.learning.iter().flat_map(|l| l.parts.iter().filter(|p| p.name == name));
        let unit = all().next().map_or("", |p| p.unit.as_str());
        let log = extent(all().flat_map(|p| p.values.iter().copied()))
            .is_some_and(|(low, high)| low > 0.0 && high / low > 50.0);
        let y = if log { Axis::log("loss", unit) } else { Axis::linear("loss", unit) };
        let mut x = Axis::linear("iteration", "").with_integers();
        let iterations = report.learning.iter().flat_map(|l| l.iteration.iter());
        if let Some((first, last)) = extent(iterations.copied()).filter(|(a, b)| a < b) {
            // To the end of the last iteration, which is a round number more often than its start.
            x = x.with_domain(first, last + if first == 0.0 { 1.0 } else { 0.0 });
        }
        let mut line = Line::new(&capitalised(name), x, y);
        for curve in &report.learning {
            if let Some(part) = find(curve).and_then(|i| curve.parts.get(i)) {
                line = line.with(summarised(
                    &curve.model,
                    tones.get(&curve.model),
                    &curve.iteration,
                    &part.values,
                ));
            }
        }
        figures.push(Figure::from(line));
    }
    let mut blocks = grid(
        figures,
        "Loss parts over the iterations. Long runs are drawn as the mean of neighbouring iterations, with a band that holds 90 % of them.",
    );
    if !blocks.is_empty() && !report.training.is_empty() {
        blocks.push(Block::Table(runs(&report.training)));
    }
    blocks
}

fn runs(runs: &[TrainingRun]) -> Table {
    let count = |v: Option<u64>| Cell::number(v.map(|v| v as f64));
    Table {
        caption: "Training".to_owned(),
        columns: vec![
            Column::text("model"),
            Column::text("recipe"),
            Column::number("parameters", "").decimals(0),
            Column::number("iterations", "").decimals(0),
        ],
        rows: (runs.iter())
            .map(|r| {
                Row::from(vec![
                    Cell::text(&r.model),
                    Cell::text(&r.recipe),
                    count(r.parameters),
                    count(r.iterations),
                ])
            })
            .collect(),
        footnotes: Vec::new(),
    }
}

/// A curve as it is, or, where it is long, the mean and the 5 and 95 % quantiles of equal runs.
fn summarised(name: &str, tone: Tone, iteration: &[f64], values: &[f64]) -> Series {
    let n = iteration.len().min(values.len());
    if n <= 2 * CURVE_BINS {
        return Series::line(name, tone, iteration.to_vec(), values.to_vec());
    }
    let (mut x, mut mean, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let size = n.div_ceil(CURVE_BINS);
    for (at, chunk) in iteration.chunks(size).zip(values.chunks(size)) {
        let mut sorted: Vec<f64> = chunk.iter().copied().filter(|v| drawable(*v)).collect();
        sorted.sort_by(f64::total_cmp);
        let quantile = |q: f64| {
            sorted
                .get((q * (sorted.len().saturating_sub(1)) as f64).round() as usize)
                .copied()
                .unwrap_or(f64::NAN)
        };
        x.push(at.iter().sum::<f64>() / at.len() as f64);
        mean.push(sorted.iter().sum::<f64>() / sorted.len() as f64);
        lower.push(quantile(0.05));
        upper.push(quantile(0.95));
    }
    Series::line(name, tone, x, mean).with_band(0.9, lower, upper)
}

fn methods(report: &TrainingReport) -> Vec<Block> {
    if report.methods.is_empty() { Vec::new() } else { vec![Block::Methods(report.methods.clone())] }
}

fn reproduce(report: &TrainingReport) -> Vec<Block> {
    if report.reproduce.is_empty() {
        return Vec::new();
    }
    vec![Block::Code { caption: String::new(), text: report.reproduce.join("\n") }]
}
