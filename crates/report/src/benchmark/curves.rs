//! Figures of a benchmark: errors over time, duration and training-set size, and training losses.

use super::tones::{Tones, distinct};
use super::{BenchmarkReport, Curve, ErrorCurve, LearningCurve, Protocol, TrainingRun};
use crate::figure::{Axis, Figure, Line, Mark, Series, Tone};
use crate::page::{Block, Cell, Column, Columns, FigureBlock, Grid, Row, Table};
use crate::plot::scale::{drawable, extent};
use crate::plot::text::capitalised;

/// Number of bins that summarise a long learning curve in a figure.
///
/// Curves up to twice this length are drawn point by point.
const CURVE_BINS: usize = 160;

pub(super) fn errors(report: &BenchmarkReport, tones: &Tones) -> Vec<Block> {
    let mut is_cut = false;
    let mut figures = Vec::new();
    // The floor is drawn with the forecasts, which it bounds; reconstructions have their own figure.
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
            if let Some(top) = axis_end_without_outlier(&line.series) {
                line.y = line.y.with_domain(0.0, top);
                is_cut = true;
            }
            figures.push(Figure::from(line));
        }
    }
    let mut caption = "Mean absolute error over the test trajectories at each time after the start. The floor is an estimate of the smallest error of a prediction from the initial state.".to_owned();
    if is_cut {
        caption.push_str(" The curve of one model, with a much larger error, is cut off at the top.");
    }
    grid(figures, &caption)
}

/// Upper end of an axis that cuts off one curve far above all others; `None` without such a curve.
fn axis_end_without_outlier(series: &[Series]) -> Option<f64> {
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

pub(super) fn learning(report: &BenchmarkReport, tones: &Tones) -> Vec<Block> {
    let mut parts: Vec<&str> = Vec::new();
    for part in report.learning.iter().flat_map(|l| &l.parts) {
        if !parts.contains(&part.name.as_str()) {
            parts.push(&part.name);
        }
    }
    let mut figures = Vec::new();
    for name in parts {
        let find = |l: &LearningCurve| l.parts.iter().position(|p| p.name == name);
        let named_parts = || report.learning.iter().flat_map(|l| l.parts.iter().filter(|p| p.name == name));
        let unit = named_parts().next().map_or("", |p| p.unit.as_str());
        let is_log = extent(named_parts().flat_map(|p| p.values.iter().copied()))
            .is_some_and(|(low, high)| low > 0.0 && high / low > 50.0);
        let y = if is_log { Axis::log("loss", unit) } else { Axis::linear("loss", unit) };
        let mut x = Axis::linear("iteration", "").with_integers();
        let iterations = report.learning.iter().flat_map(|l| l.iteration.iter());
        if let Some((first, last)) = extent(iterations.copied()).filter(|(a, b)| a < b) {
            // Counted from 0, the last of n iterations is n - 1: the axis ends at n, which is usually a round
            // number.
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
        "Loss parts over the iterations. Long runs are drawn as means of neighbouring iterations, with a band that contains 90 % of them.",
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

/// Series of a curve point by point or, if it is long, the mean and 5 % and 95 % quantiles of each bin.
fn summarised(name: &str, tone: Tone, iteration: &[f64], values: &[f64]) -> Series {
    let n = iteration.len().min(values.len());
    if n <= 2 * CURVE_BINS {
        return Series::line(name, tone, iteration.to_vec(), values.to_vec());
    }
    let (mut x, mut mean, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let size = n.div_ceil(CURVE_BINS);
    for (iterations, chunk) in iteration.chunks(size).zip(values.chunks(size)) {
        let mut sorted: Vec<f64> = chunk.iter().copied().filter(|v| drawable(*v)).collect();
        sorted.sort_by(f64::total_cmp);
        let quantile = |q: f64| {
            sorted
                .get((q * (sorted.len().saturating_sub(1)) as f64).round() as usize)
                .copied()
                .unwrap_or(f64::NAN)
        };
        x.push(iterations.iter().sum::<f64>() / iterations.len() as f64);
        mean.push(sorted.iter().sum::<f64>() / sorted.len() as f64);
        lower.push(quantile(0.05));
        upper.push(quantile(0.95));
    }
    Series::line(name, tone, x, mean).with_band(0.9, lower, upper)
}

/// One figure of the curves for each error measure; `{}` in `title` and `y` stands for the measure.
fn measure_figures(
    curves: &[Curve],
    title: &str,
    x: &Axis,
    y: &str,
    mark: Mark,
    tones: &Tones,
) -> Vec<Figure> {
    let figure = |measure: &str| {
        let measured = || curves.iter().filter(|c| c.measure == measure);
        let unit = measured().next().map_or("", |c| c.unit.as_str());
        let title = title.replace("{}", measure);
        let mut line = Line::new(
            &title,
            x.clone(),
            Axis::linear(&y.replace("{}", &measure.to_lowercase()), unit).with_zero(),
        );
        for c in measured() {
            let series = Series::line(&c.model, tones.get(&c.model), c.x.clone(), c.y.clone());
            line = line.with(series.with_mark(mark));
        }
        Figure::from(line)
    };
    distinct(curves, |c| &c.measure).into_iter().map(figure).collect()
}

pub(super) fn sizes(report: &BenchmarkReport, tones: &Tones) -> Vec<Block> {
    if report.sizes.iter().all(|c| c.x.len() < 2) {
        return Vec::new();
    }
    let many = &report.words[1];
    let x = Axis::log(&format!("training {many}"), "");
    let figures = measure_figures(&report.sizes, "{}", &x, "error", Mark::LinePoints, tones);
    grid(figures, &format!("Error on the test {many} over the number of training {many}."))
}

pub(super) fn parts(report: &BenchmarkReport, tones: &Tones) -> Vec<Block> {
    let x = Axis::linear("part of the duration", "");
    let [one, many] = &report.words;
    let title = format!("{{}} error over the {one}");
    let figures = measure_figures(&report.parts, &title, &x, "{} error", Mark::Line, tones);
    let caption = format!("Mean over the test {many}; {}", report.parts_caption);
    let block = |figure| Block::Figure(Box::new(FigureBlock { figure, caption: caption.clone() }));
    figures.into_iter().map(block).collect()
}
