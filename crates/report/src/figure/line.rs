//! Line chart: named series with optional bands, reference lines and event markers.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::{Axis, Event, Reference, Target, Tone};
use crate::plot::frame::{Frame, Key, LABEL, Spec, Swatch, label, no_data};
use crate::plot::marker::marker;
use crate::plot::path;
use crate::plot::scale::{Scale, drawable, extent};
use crate::plot::text::{coordinate as c, shorten, width};

/// Whether a series is drawn as a line, as points or both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// The series is a line; missing values are gaps.
    #[default]
    Line,
    /// The series is a marker at each value.
    Points,
    /// The series is a line with a marker at each value.
    LinePoints,
}

/// An interval around a series, drawn as a band.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Coverage probability of the band, e.g. `0.9`.
    pub level: f64,
    /// Lower ends of the band, one for each x of the series.
    #[serde(with = "crate::nullable")]
    pub lower: Vec<f64>,
    /// Upper ends of the band, one for each x of the series.
    #[serde(with = "crate::nullable")]
    pub upper: Vec<f64>,
}

/// A named series of points in a line chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Name of the series in the legend or at its line.
    pub name: String,
    /// Colour, dash and marker shape of the series.
    pub tone: Tone,
    /// Horizontal values of the series.
    #[serde(with = "crate::nullable")]
    pub x: Vec<f64>,
    /// Vertical values of the series; NaN is a gap.
    #[serde(with = "crate::nullable")]
    pub y: Vec<f64>,
    /// Bands around the series, widest first.
    #[serde(default)]
    pub bands: Vec<Band>,
    /// Whether the series is drawn as a line, as points or both.
    #[serde(default)]
    pub mark: Mark,
}

impl Series {
    /// A series that is drawn as a line without bands.
    #[must_use]
    pub fn line(name: &str, tone: Tone, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self { name: name.to_owned(), tone, x, y, ..Self::default() }
    }

    /// Adds a band with coverage probability `level` to this series.
    #[must_use]
    pub fn with_band(mut self, level: f64, lower: Vec<f64>, upper: Vec<f64>) -> Self {
        self.bands.push(Band { level, lower, upper });
        self
    }

    /// Sets whether this series is drawn as a line, as points or both.
    #[must_use]
    pub fn with_mark(self, mark: Mark) -> Self {
        Self { mark, ..self }
    }

    fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        self.x.iter().copied().zip(self.y.iter().copied())
    }
}

/// A line chart of one or several series.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Title of the chart, one or two short lines.
    pub title: String,
    /// Horizontal axis of the chart.
    pub x: Axis,
    /// Vertical axis of the chart.
    pub y: Axis,
    /// Series of the chart, drawn in order.
    pub series: Vec<Series>,
    /// Horizontal reference lines of the chart.
    #[serde(default)]
    pub references: Vec<Reference>,
    /// Vertical event markers of the chart.
    #[serde(default)]
    pub events: Vec<Event>,
    /// Whether the legend is omitted, for figures in a grid with a common legend.
    #[serde(default)]
    pub hide_legend: bool,
    /// Whether both axes have the same number of pixels per unit, as on a map.
    #[serde(default)]
    pub to_scale: bool,
}

impl Line {
    /// A line chart without series.
    #[must_use]
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self { title: title.to_owned(), x, y, ..Self::default() }
    }

    /// Adds a series to this chart.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let drawn: Vec<&Series> =
            (self.series.iter()).filter(|s| s.points().any(|(x, y)| drawable(x) && drawable(y))).collect();
        let xs = drawn.iter().flat_map(|s| s.x.iter().copied());
        let ys = drawn.iter().flat_map(|s| {
            let bands = s.bands.iter().flat_map(|b| b.lower.iter().chain(&b.upper));
            s.y.iter().chain(bands).copied()
        });
        let references = self.references.iter().map(|r| r.value);
        let (x_axis, y_axis) = match self.to_scale {
            true => equal_scale_axes(&self.x, &self.y, extent(xs.clone()), extent(ys.clone()), target.width),
            false => (self.x.clone(), self.y.clone()),
        };
        let (Some(x), Some(y)) = (
            Scale::fit(&x_axis, xs, 0.0, (0.0, 1.0)),
            Scale::fit(&y_axis, ys.chain(references.filter(|_| !drawn.is_empty())), 0.05, (1.0, 0.0)),
        ) else {
            return no_data(target, &self.title, &format!("{} against {}", self.y.label, self.x.label));
        };
        let direct = !self.hide_legend
            && target.width >= 440.0
            && (2..=5).contains(&drawn.len())
            && drawn.iter().all(|s| s.mark != Mark::Points)
            && has_room_for_labels(&y, &drawn);
        let room = target.width * 0.3;
        let widest = drawn.iter().map(|s| width(&s.name, LABEL)).fold(0.0, f64::max).min(room);
        let spec = Spec {
            title: &self.title,
            x: &self.x,
            y: &self.y,
            keys: if self.hide_legend || direct || drawn.iter().all(|s| s.name.is_empty()) {
                Vec::new()
            } else {
                keys(&drawn)
            },
            right: if direct { widest + 26.0 } else { 8.0 },
            aspect: self.to_scale.then(|| (y.high - y.low) / (x.high - x.low)),
        };
        let frame = Frame::new(target, &spec, x, y);
        let (guides, guide_labels) = frame.guides(&self.references, &self.events);
        let marks = html! {
            @for s in &drawn { @for band in &s.bands { (draw_band(&frame, s, band)) } }
            (guides)
            @for s in &drawn { (draw_series(&frame, s)) }
        };
        let labels = html! {
            (guide_labels)
            @if direct { (direct_labels(&frame, &drawn, room)) }
        };
        frame.finish(target, &self.title, &self.describe(&drawn), &marks, &labels)
    }

    fn describe(&self, drawn: &[&Series]) -> String {
        let mut words = format!("{} against {}.", self.y.text(0), self.x.text(0));
        for s in drawn {
            let ys: Vec<f64> = s.y.iter().copied().filter(|v| drawable(*v)).collect();
            if let (Some(first), Some(last)) = (ys.first(), ys.last()) {
                words.push_str(&format!(
                    " {}: from {} to {}.",
                    s.name,
                    self.y.value(*first),
                    self.y.value(*last)
                ));
            }
        }
        words
    }
}

/// Maximum height of the plot area of a chart with equal scales, px.
const MAX_HEIGHT: f64 = 360.0;
/// Width of the figure on both sides of the plot area, px.
const MARGIN_WIDTH: f64 = 54.0;

/// Axes of a chart with equal scales: widens the ranges so that both have the same pixels per unit.
fn equal_scale_axes(
    x: &Axis,
    y: &Axis,
    xs: Option<(f64, f64)>,
    ys: Option<(f64, f64)>,
    width: f64,
) -> (Axis, Axis) {
    let (Some((left, right)), Some((low, high))) = (xs, ys) else { return (x.clone(), y.clone()) };
    let margin = 0.04 * (right - left).max(high - low).max(1e-9);
    let [x_span, y_span] = [right - left + 2.0 * margin, high - low + 2.0 * margin];
    let x_span = x_span.max(y_span * (width - MARGIN_WIDTH).max(1.0) / MAX_HEIGHT);
    let middle = 0.5 * (left + right);
    (
        x.clone().with_domain(middle - 0.5 * x_span, middle + 0.5 * x_span),
        y.clone().with_domain(low - margin, high + margin),
    )
}

/// Whether the lines end far enough apart for names at their ends; otherwise a legend is drawn.
fn has_room_for_labels(y: &Scale, drawn: &[&Series]) -> bool {
    // The plot area is about 230 px high. `direct_labels` moves names to 15 px distance, so ends may be
    // somewhat closer.
    let scale = y.with_pixels(0.0, 230.0);
    let mut ends: Vec<f64> =
        (drawn.iter()).filter_map(|s| s.y.iter().filter_map(|v| scale.pixel(*v)).next_back()).collect();
    ends.sort_by(f64::total_cmp);
    ends.windows(2).all(|pair| pair[1] - pair[0] >= 9.0)
}

fn keys(drawn: &[&Series]) -> Vec<Key> {
    let swatch = |s: &Series| {
        if s.mark == Mark::Points { Swatch::Point } else { Swatch::Line }
    };
    drawn.iter().map(|s| Key { name: s.name.clone(), tone: s.tone, swatch: swatch(s) }).collect()
}

/// Draws the area of a band; bands of up to 70 % are darker than wider ones.
fn draw_band(frame: &Frame, series: &Series, band: &Band) -> Markup {
    let area = path::area(series.x.iter().zip(band.lower.iter().zip(&band.upper)).map(|(x, (l, u))| {
        let (px, low) = frame.pixel(*x, *l)?;
        Some((px, low, frame.y.pixel(*u)?))
    }));
    let class = if band.level <= 0.7 { "b5" } else { "b9" };
    html! { path class={ (class) " " (series.tone.class()) } d=(area) {} }
}

fn draw_series(frame: &Frame, series: &Series) -> Markup {
    let points: Vec<_> = series.points().map(|(x, y)| frame.pixel(x, y)).collect();
    let r = if points.len() > 120 { 1.8 } else { 3.0 };
    html! {
        @if series.mark != Mark::Points {
            path class={ "ln " (series.tone.class()) } d=(path::line(&path::runs(points.iter().copied()))) {}
        }
        @if series.mark != Mark::Line {
            @for (x, y) in points.iter().flatten() { (marker(series.tone, *x, *y, r)) }
        }
    }
}

/// Draws names at the ends of the lines, at least 15 px apart, each connected to its line.
fn direct_labels(frame: &Frame, drawn: &[&Series], room: f64) -> Markup {
    let plot = frame.plot;
    let mut ends: Vec<((f64, f64), &Series)> = (drawn.iter())
        .filter_map(|s| {
            let last = s.points().filter_map(|(x, y)| frame.pixel(x, y)).last()?;
            Some(((last.0, last.1.clamp(plot.top, plot.bottom)), *s))
        })
        .collect();
    ends.sort_by(|a, b| a.0.1.total_cmp(&b.0.1));
    let gap = 15.0;
    let mut places: Vec<f64> = Vec::new();
    for (end, _) in &ends {
        let free = places.last().map_or(plot.top, |last| last + gap);
        places.push(end.1.max(free));
    }
    let mut limit = plot.bottom;
    for place in places.iter_mut().rev() {
        *place = place.min(limit);
        limit = *place - gap;
    }
    html! {
        @for ((end, series), y) in ends.iter().zip(&places) {
            path class={ "ld " (series.tone.class()) } d={ "M" (c(end.0 + 2.0)) " " (c(end.1)) "L" (c(plot.right + 14.0)) " " (c(*y)) "h4" } {}
            (label("", plot.right + 21.0, y + 3.8, LABEL, &shorten(&series.name, LABEL, room)))
        }
    }
}
