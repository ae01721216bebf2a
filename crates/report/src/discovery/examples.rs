//! Examples: measured trajectories with the predictions of the models, and the residuals below them; pushes from above.

use super::tones::{AFTER, BEFORE};
use super::{DiscoveryReport, Example, TopView};
use crate::figure::{Axis, Event, Figure, Line, Mark, Series, Tone};
use crate::page::{Block, Columns, Grid, LegendEntry};
use crate::plot::text::capitalised;

const MEASURED: &str = "measured";
const DECLARED: &str = "declared model";
const AUGMENTED: &str = "augmented model";

/// The figures of all examples: for each the overlay and, beside it, the strip of residuals; for a push the view from above.
/// With a note of its own the first model is the calibrated one.
pub(super) fn examples(report: &DiscoveryReport) -> Vec<Block> {
    let (examples, note) = (&report.examples, &report.examples_note);
    let figures: Vec<Figure> = examples.iter().flat_map(of_one).collect();
    if figures.is_empty() {
        return Vec::new();
    }
    let key = |name: &str, tone| LegendEntry::Line(name.to_owned(), tone);
    let first = if note.is_empty() { DECLARED } else { "calibrated model" };
    let mut legend = vec![LegendEntry::Points(MEASURED.to_owned(), Tone::Ink), key(first, BEFORE)];
    if examples.iter().any(|e| !e.after.is_empty()) {
        legend.push(key(AUGMENTED, AFTER));
    }
    let above = examples.iter().any(|e| e.top_view.is_some());
    let caption = match (note.is_empty(), above) {
        (false, _) => note.clone(),
        (true, true) => format!(
            "{}. Each runs from the first measured pose: the object and the rod from above, where the push began and where it ended, \
             and the errors of the position.",
            whose("Pushes", report.examples_fitted)
        ),
        (true, false) => format!(
            "{}. Up to the mark the initial state was fitted; what follows is predicted. Below zero the measured value is less than \
             predicted.",
            whose("Trajectories", report.examples_fitted)
        ),
    };
    vec![Block::Grid(Grid { columns: Columns::Two, legend, figures, caption })]
}

/// Whose data the examples are.
fn whose(records: &str, are_fitted: bool) -> String {
    if are_fitted {
        format!("{records} that the models were fitted to")
    } else {
        format!("{records} that no fit has seen")
    }
}

fn of_one(e: &Example) -> [Figure; 2] {
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
