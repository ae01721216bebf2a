//! Example figures of the report: measured trajectories with predictions and residuals; for pushes the top view.

use super::residuals::quantity_of;
use super::{AFTER, BEFORE, display_unit};
use augsim_discovery::{Discovery, ExampleChannel};
use augsim_report::capitalised;
use augsim_report::figure::{Axis, Event, Figure, Line, Mark, Series, Tone};
use augsim_report::page::{Block, Columns, Grid, LegendEntry};
use augsim_system::TopView as Scene;

const MEASURED: &str = "measured";
const DECLARED: &str = "declared model";
const AUGMENTED: &str = "augmented model";

/// A measured trajectory with the predictions of the models before and after effects were added.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Example {
    /// Name of the trajectory, e.g. `worst: trajectory 31`.
    pub trajectory: String,
    /// Name of the plotted channel, e.g. `height`.
    pub channel: String,
    /// Unit of the plotted channel.
    pub unit: String,
    /// Times of the trajectory's samples, s.
    pub t_s: Vec<f64>,
    /// Measured values of the channel; NaN at gaps.
    pub measured: Vec<f64>,
    /// Values that the declared or calibrated model predicts.
    pub before: Vec<f64>,
    /// Values that the augmented model predicts; empty if no effect was added.
    pub after: Vec<f64>,
    /// End of the samples that the initial state was fitted to, s (`None` if to none); later values are predicted.
    pub known_until_s: Option<f64>,
    /// Top view of the motion, for a pushed object; `None` for other systems.
    pub top_view: Option<TopView>,
}

/// Outlines of a pushed object and of the rod, seen from above; coordinates in m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopView {
    /// Outline of the object at the start of the push.
    pub start: Vec<[f64; 2]>,
    /// Outlines of the object at the end: measured, predicted by the declared model, by the augmented model.
    pub ends: [Vec<[f64; 2]>; 3],
    /// Path of the rod's centre during the push.
    pub rod: Vec<[f64; 2]>,
    /// Outlines of the rod at the start and at the end of the push.
    pub rod_outlines: [Vec<[f64; 2]>; 2],
}

/// Figures of the report's examples: predictions, with the residuals beside them; for pushes the top view.
///
/// The examples of the result come first, unless they were fitted to and there are whole recordings
/// (`pictures`); then follow the whole recordings.
pub(super) fn blocks(d: &Discovery, pictures: &[Example]) -> Vec<Block> {
    let mut blocks = Vec::new();
    if pictures.is_empty() || !d.heldout.is_empty() {
        blocks.extend(grid(d, &examples_of(d), false));
    }
    blocks.extend(grid(d, pictures, true));
    blocks
}

/// Arranges the figures of examples in a grid with legend and caption; `None` if there are none.
///
/// `are_free_runs` is true for whole recordings, false for the examples of the result.
fn grid(d: &Discovery, examples: &[Example], are_free_runs: bool) -> Option<Block> {
    let figures: Vec<Figure> = examples.iter().flat_map(figures_of).collect();
    if figures.is_empty() {
        return None;
    }
    let key = |name: &str, tone| LegendEntry::Line(name.to_owned(), tone);
    let first = if are_free_runs { "calibrated model" } else { DECLARED };
    let mut legend = vec![LegendEntry::Points(MEASURED.to_owned(), Tone::Ink), key(first, BEFORE)];
    if examples.iter().any(|e| !e.after.is_empty()) {
        legend.push(key(AUGMENTED, AFTER));
    }
    let is_push = examples.iter().any(|e| e.top_view.is_some());
    let is_fitted = d.heldout.is_empty();
    let caption = match (are_free_runs, is_push) {
        (true, _) => "Data that the models were fitted to in windows, over a time span short enough to resolve the motion: free runs from an \
                       initial state fitted to the first 20 samples, calibrated model (before) and with the effects added (after)."
            .to_owned(),
        (false, true) => format!(
            "{}. Each prediction starts at the first measured pose. Top view of the object and the rod at the start and the end of \
             the push, and the position error over time.",
            examples_caption("Pushes", is_fitted)
        ),
        (false, false) => format!(
            "{}. The initial state was fitted to the samples before the mark; later values are predicted. Residuals are measured \
             minus predicted: negative means that the model predicts too much.",
            examples_caption("Trajectories", is_fitted)
        ),
    };
    Some(Block::Grid(Grid { columns: Columns::Two, legend, figures, caption }))
}

/// Converts the examples of a result, each in the channel where the declared model has the largest residual.
fn examples_of(d: &Discovery) -> Vec<Example> {
    let square = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(0.0, |(a, b)| (a - b).powi(2));
    let residual_squares = |c: usize| -> f64 {
        let channels = d.examples.iter().filter_map(|e| e.channels.get(c));
        channels.flat_map(|c| c.measured.iter().zip(&c.declared)).map(|(m, f)| square(*m, *f)).sum()
    };
    let count = d.examples.first().map_or(0, |e| e.channels.len());
    let worst = (0..count).max_by(|&a, &b| residual_squares(a).total_cmp(&residual_squares(b))).unwrap_or(0);
    let has_effects = !d.effects.is_empty();
    d.examples.iter().filter_map(|e| Some(example(e, e.channels.get(worst)?, has_effects))).collect()
}

fn example(e: &augsim_discovery::Example, c: &ExampleChannel, has_effects: bool) -> Example {
    let (unit, scale) = display_unit(if e.scene.is_some() { "m" } else { &c.unit });
    let plain = |list: &[Option<f64>]| -> Vec<f64> { list.iter().map(|v| v.unwrap_or(f64::NAN)).collect() };
    let error = scale * e.rmse[1];
    let trajectory = format!("{}: {}, error {error:.3} {unit}", e.rank, e.id);
    let (channel, _) = quantity_of(&c.column);
    let base = Example {
        trajectory,
        channel: channel.trim_end_matches("_m").to_owned(),
        unit: c.unit.clone(),
        t_s: e.times_s.clone(),
        measured: plain(&c.measured),
        before: plain(&c.declared),
        after: if has_effects { plain(&c.augmented) } else { Vec::new() },
        known_until_s: e.times_s.get(e.known).copied().filter(|_| e.known > 1),
        top_view: None,
    };
    match &e.scene {
        None => base,
        Some(scene) => push_example(base, e, scene, has_effects),
    }
}

/// Adds the top view to the example of a push, and replaces its channel by the position error.
fn push_example(base: Example, e: &augsim_discovery::Example, scene: &Scene, has_effects: bool) -> Example {
    let value = |c: usize, k: usize, values: fn(&ExampleChannel) -> &Vec<Option<f64>>| {
        values(&e.channels[c])[k].unwrap_or(f64::NAN)
    };
    let outline = |k: usize, values: fn(&ExampleChannel) -> &Vec<Option<f64>>| -> Vec<[f64; 2]> {
        let [x, y, angle] = [0, 1, 2].map(|c| value(c, k, values));
        let (sin, cos) = angle.sin_cos();
        scene.outline_m.iter().map(|[a, b]| [x + cos * a - sin * b, y + sin * a + cos * b]).collect()
    };
    let distance = |predicted: fn(&ExampleChannel) -> &Vec<Option<f64>>| -> Vec<f64> {
        let residual = |c: usize, k: usize| value(c, k, |c| &c.measured) - value(c, k, predicted);
        // The figure plots measured minus predicted. With 0 as the measured value, the negative distance is
        // plotted as a positive error.
        (0..e.times_s.len()).map(|k| -residual(0, k).hypot(residual(1, k))).collect()
    };
    let last = e.times_s.len().saturating_sub(1);
    let rod = |centre: Option<&[f64; 2]>| -> Vec<[f64; 2]> {
        let corner = |i: usize, [x, y]: [f64; 2]| {
            let turn = std::f64::consts::TAU * i as f64 / 24.0;
            [x + scene.rod_radius_m * turn.cos(), y + scene.rod_radius_m * turn.sin()]
        };
        centre.map_or_else(Vec::new, |centre| (0..24).map(|i| corner(i, *centre)).collect())
    };
    Example {
        unit: "m".to_owned(),
        measured: vec![0.0; e.times_s.len()],
        before: distance(|c| &c.declared),
        after: if has_effects { distance(|c| &c.augmented) } else { Vec::new() },
        top_view: Some(TopView {
            start: outline(0, |c| &c.measured),
            ends: [
                outline(last, |c| &c.measured),
                outline(last, |c| &c.declared),
                if has_effects { outline(last, |c| &c.augmented) } else { Vec::new() },
            ],
            rod: scene.rod_m.clone(),
            rod_outlines: [rod(scene.rod_m.first()), rod(scene.rod_m.last())],
        }),
        ..base
    }
}

/// Beginning of the caption of the examples: whether they were held out or fitted to.
fn examples_caption(records: &str, are_fitted: bool) -> String {
    if are_fitted {
        format!("{records} that the models were fitted to")
    } else {
        format!("Held-out {}", records.to_lowercase())
    }
}

fn figures_of(e: &Example) -> [Figure; 2] {
    let first = match &e.top_view {
        Some(view) => top_view(&capitalised(&e.trajectory), view),
        None => overlay(e),
    };
    [first.into(), residuals(e).into()]
}

/// Mark in a figure at the time where the fitted samples end and the prediction begins.
fn prediction_begin(e: &Example) -> Vec<Event> {
    e.known_until_s.map(|at| Event { at, label: "predicted from here".to_owned() }).into_iter().collect()
}

fn overlay(e: &Example) -> Line {
    let title = capitalised(&format!("{}: {}", e.trajectory, e.channel));
    let mut line = Line::new(&title, Axis::linear("time", "s"), Axis::linear(&e.channel, &e.unit));
    line.hide_legend = true;
    line.events = prediction_begin(e);
    line = line
        .with(Series::line(MEASURED, Tone::Ink, e.t_s.clone(), e.measured.clone()).with_mark(Mark::Points))
        .with(Series::line(DECLARED, BEFORE, e.t_s.clone(), e.before.clone()));
    if !e.after.is_empty() {
        line = line.with(Series::line(AUGMENTED, AFTER, e.t_s.clone(), e.after.clone()));
    }
    line
}

/// Figure of the residuals (measured - predicted) of an example; for a push of the position error.
///
/// Residuals in m are shown in mm.
fn residuals(e: &Example) -> Line {
    let (unit, scale) = if e.unit == "m" { ("mm", 1e3) } else { (e.unit.as_str(), 1.0) };
    let label = if e.top_view.is_some() { "position error" } else { "measured minus predicted" };
    // The title of the figure beside this one states the error; a narrow page has no room for it twice.
    let name = e.trajectory.split(", error").next().unwrap_or_default();
    let title = format!("{name}, {label}");
    let residuals = |predicted: &[f64]| {
        e.measured.iter().zip(predicted).map(|(m, f)| scale * (m - f)).collect::<Vec<_>>()
    };
    let mut line =
        Line::new(&capitalised(&title), Axis::linear("time", "s"), Axis::linear(label, unit).with_zero());
    line.hide_legend = true;
    line.events = prediction_begin(e);
    line = line.with(Series::line(DECLARED, BEFORE, e.t_s.clone(), residuals(&e.before)));
    if !e.after.is_empty() {
        line = line.with(Series::line(AUGMENTED, AFTER, e.t_s.clone(), residuals(&e.after)));
    }
    line
}

fn top_view(title: &str, view: &TopView) -> Line {
    let mut line = Line::new(title, Axis::linear("x", "m"), Axis::linear("y", "m"));
    (line.hide_legend, line.to_scale) = (true, true);
    let path = |name: &str, tone, points: &[[f64; 2]], closed: bool| {
        let closing_point = points.first().filter(|_| closed);
        let (x, y) = points.iter().chain(closing_point).map(|p| (p[0], p[1])).unzip();
        Series::line(name, tone, x, y)
    };
    line = line.with(path("start", Tone::Muted, &view.start, true));
    line = line.with(path("rod", Tone::Muted, &view.rod, false));
    for rod in &view.rod_outlines {
        line = line.with(path("rod", Tone::Muted, rod, true));
    }
    let ends = [(MEASURED, Tone::Ink), (DECLARED, BEFORE), (AUGMENTED, AFTER)];
    for ((name, tone), end) in ends.into_iter().zip(&view.ends).filter(|(_, end)| !end.is_empty()) {
        line = line.with(path(name, tone, end, true));
    }
    line
}
