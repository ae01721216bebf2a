//! Examples: measured trajectories with the predictions of the models, and the residuals below them; pushes from above.

use super::residuals::quantity_of;
use super::{AFTER, BEFORE, display_unit};
use augsim_discovery::{Discovery, ExampleChannel};
use augsim_physics::system::TopView as Scene;
use augsim_report::capitalised;
use augsim_report::figure::{Axis, Event, Figure, Line, Mark, Series, Tone};
use augsim_report::page::{Block, Columns, Grid, LegendEntry};

const MEASURED: &str = "measured";
const DECLARED: &str = "declared model";
const AUGMENTED: &str = "augmented model";

/// A trajectory with predictions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Example {
    /// Trajectory, e.g. `worst: trajectory 31`.
    pub trajectory: String,
    /// Channel, e.g. `height`.
    pub channel: String,
    /// Its unit.
    pub unit: String,
    /// Times, s.
    pub t_s: Vec<f64>,
    /// Measured values; NaN where none was measured.
    pub measured: Vec<f64>,
    /// Predictions of the first model.
    pub before: Vec<f64>,
    /// Predictions of the augmented model; may be empty.
    pub after: Vec<f64>,
    /// Time until which the initial state was fitted, s; the values after it are predicted.
    pub known_until_s: Option<f64>,
    /// For a pushed object: the view from above.
    pub top_view: Option<TopView>,
}

/// A push seen from above, m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopView {
    /// Outline of the object where it began.
    pub start: Vec<[f64; 2]>,
    /// Outline at the end: measured, by the declared model, by the augmented model.
    pub ends: [Vec<[f64; 2]>; 3],
    /// Path of the rod's centre.
    pub rod: Vec<[f64; 2]>,
    /// The rod where it began and ended.
    pub rod_outlines: [Vec<[f64; 2]>; 2],
}

/// The figures of all examples: for each its prediction and, beside it, its residuals; for a push the view from above. Pictures of whole
/// recordings, where there are any, take the place of the examples of the result.
pub(super) fn blocks(d: &Discovery, pictures: &[Example]) -> Vec<Block> {
    let own = if pictures.is_empty() { of_result(d) } else { Vec::new() };
    let examples = if pictures.is_empty() { &own } else { pictures };
    let figures: Vec<Figure> = examples.iter().flat_map(figures_of).collect();
    if figures.is_empty() {
        return Vec::new();
    }
    let key = |name: &str, tone| LegendEntry::Line(name.to_owned(), tone);
    let first = if pictures.is_empty() { DECLARED } else { "calibrated model" };
    let mut legend = vec![LegendEntry::Points(MEASURED.to_owned(), Tone::Ink), key(first, BEFORE)];
    if examples.iter().any(|e| !e.after.is_empty()) {
        legend.push(key(AUGMENTED, AFTER));
    }
    let is_push = examples.iter().any(|e| e.top_view.is_some());
    let is_fitted = d.heldout.is_empty();
    let caption = match (pictures.is_empty(), is_push) {
        (false, _) => "Data that the models were fitted to in windows, over a stretch in which every turn can be seen: each model runs on from \
                       the first 20 samples, calibrated (before) and with the effects added (after)."
            .to_owned(),
        (true, true) => format!(
            "{}. Each runs from the first measured pose: the object and the rod from above, where the push began and where it ended, \
             and the errors of the position.",
            whose("Pushes", is_fitted)
        ),
        (true, false) => format!(
            "{}. Up to the mark the initial state was fitted; what follows is predicted. Below zero the measured value is less than \
             predicted.",
            whose("Trajectories", is_fitted)
        ),
    };
    vec![Block::Grid(Grid { columns: Columns::Two, legend, figures, caption })]
}

/// Examples of a result: each in the channel with the largest residual of the declared model, the same for all; pushes from above.
fn of_result(d: &Discovery) -> Vec<Example> {
    let gap = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(0.0, |(a, b)| (a - b).powi(2));
    let misfit = |c: usize| -> f64 {
        let each = d.examples.iter().filter_map(|e| e.channels.get(c));
        each.flat_map(|c| c.measured.iter().zip(&c.declared)).map(|(m, f)| gap(*m, *f)).sum()
    };
    let count = d.examples.first().map_or(0, |e| e.channels.len());
    let most = (0..count).max_by(|&a, &b| misfit(a).total_cmp(&misfit(b))).unwrap_or(0);
    d.examples.iter().filter_map(|e| Some(example(e, e.channels.get(most)?, !d.effects.is_empty()))).collect()
}

fn example(e: &augsim_discovery::Example, c: &ExampleChannel, added: bool) -> Example {
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
        after: if added { plain(&c.augmented) } else { Vec::new() },
        known_until_s: e.times_s.get(e.known).copied().filter(|_| e.known > 1),
        top_view: None,
    };
    match &e.scene {
        None => base,
        Some(scene) => pushed(base, e, scene, added),
    }
}

/// A push: its view from above, and the distance of each forecast from the measured position instead of a channel.
fn pushed(base: Example, e: &augsim_discovery::Example, scene: &Scene, added: bool) -> Example {
    let value = |c: usize, k: usize, values: fn(&ExampleChannel) -> &Vec<Option<f64>>| {
        values(&e.channels[c])[k].unwrap_or(f64::NAN)
    };
    let outline = |k: usize, of: fn(&ExampleChannel) -> &Vec<Option<f64>>| -> Vec<[f64; 2]> {
        let [x, y, angle] = [0, 1, 2].map(|c| value(c, k, of));
        let (sin, cos) = angle.sin_cos();
        scene.outline_m.iter().map(|[a, b]| [x + cos * a - sin * b, y + sin * a + cos * b]).collect()
    };
    let distance = |of: fn(&ExampleChannel) -> &Vec<Option<f64>>| -> Vec<f64> {
        let off = |c: usize, k: usize| value(c, k, |c| &c.measured) - value(c, k, of);
        // Measured less predicted: a distance is shown as an error of none.
        (0..e.times_s.len()).map(|k| -off(0, k).hypot(off(1, k))).collect()
    };
    let last = e.times_s.len().saturating_sub(1);
    let rod = |at: Option<&[f64; 2]>| -> Vec<[f64; 2]> {
        let corner = |i: usize, [x, y]: [f64; 2]| {
            let turn = std::f64::consts::TAU * i as f64 / 24.0;
            [x + scene.rod_radius_m * turn.cos(), y + scene.rod_radius_m * turn.sin()]
        };
        at.map_or_else(Vec::new, |at| (0..24).map(|i| corner(i, *at)).collect())
    };
    Example {
        unit: "m".to_owned(),
        measured: vec![0.0; e.times_s.len()],
        before: distance(|c| &c.declared),
        after: if added { distance(|c| &c.augmented) } else { Vec::new() },
        top_view: Some(TopView {
            start: outline(0, |c| &c.measured),
            ends: [
                outline(last, |c| &c.measured),
                outline(last, |c| &c.declared),
                if added { outline(last, |c| &c.augmented) } else { Vec::new() },
            ],
            rod: scene.rod_m.clone(),
            rod_outlines: [rod(scene.rod_m.first()), rod(scene.rod_m.last())],
        }),
        ..base
    }
}

/// Whose data the examples are.
fn whose(records: &str, are_fitted: bool) -> String {
    if are_fitted {
        format!("{records} that the models were fitted to")
    } else {
        format!("{records} that no fit has seen")
    }
}

fn figures_of(e: &Example) -> [Figure; 2] {
    let first = match &e.top_view {
        Some(view) => from_above(&capitalised(&e.trajectory), view),
        None => overlay(e),
    };
    [first.into(), residuals(e).into()]
}

fn begun(e: &Example) -> Vec<Event> {
    e.known_until_s.map(|at| Event { at, label: "foretold from here".to_owned() }).into_iter().collect()
}

fn overlay(e: &Example) -> Line {
    let title = capitalised(&format!("{}: {}", e.trajectory, e.channel));
    let mut line = Line::new(&title, Axis::linear("time", "s"), Axis::linear(&e.channel, &e.unit));
    line.hide_legend = true;
    line.events = begun(e);
    line = line
        .with(Series::line(MEASURED, Tone::Ink, e.t_s.clone(), e.measured.clone()).with_mark(Mark::Points))
        .with(Series::line(DECLARED, BEFORE, e.t_s.clone(), e.before.clone()));
    if !e.after.is_empty() {
        line = line.with(Series::line(AUGMENTED, AFTER, e.t_s.clone(), e.after.clone()));
    }
    line
}

/// Measured less foretold, in mm where the channel is in m; of a push the distance.
fn residuals(e: &Example) -> Line {
    let (unit, scale) = if e.unit == "m" { ("mm", 1e3) } else { (e.unit.as_str(), 1.0) };
    let what = if e.top_view.is_some() { "error of the position" } else { "measured less foretold" };
    // The error stands above the figure beside it; a narrow page has no room for it twice.
    let name = e.trajectory.split(", error").next().unwrap_or_default();
    let title = format!("{name}, {what}");
    let less = |by: &[f64]| e.measured.iter().zip(by).map(|(m, f)| scale * (m - f)).collect::<Vec<_>>();
    let mut line =
        Line::new(&capitalised(&title), Axis::linear("time", "s"), Axis::linear(what, unit).with_zero());
    line.hide_legend = true;
    line.events = begun(e);
    line = line.with(Series::line(DECLARED, BEFORE, e.t_s.clone(), less(&e.before)));
    if !e.after.is_empty() {
        line = line.with(Series::line(AUGMENTED, AFTER, e.t_s.clone(), less(&e.after)));
    }
    line
}

fn from_above(title: &str, view: &TopView) -> Line {
    let mut line = Line::new(title, Axis::linear("x", "m"), Axis::linear("y", "m"));
    (line.hide_legend, line.to_scale) = (true, true);
    let path = |name: &str, tone, points: &[[f64; 2]], closed: bool| {
        let again = points.first().filter(|_| closed);
        let (x, y) = points.iter().chain(again).map(|p| (p[0], p[1])).unzip();
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
