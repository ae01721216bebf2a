//! The frame of a figure with two numeric axes: title, legend, axes, grid, plot area.

use maud::{Markup, PreEscaped, html};

use super::scale::Scale;
use super::text::{coordinate as c, shorten, width, wrap};
use super::{marker::marker, palette};
use crate::figure::{Axis, Event, Reference, Target, Tone};

/// Font size of a figure's title, px.
pub(crate) const TITLE: f64 = 13.0;
/// Font size of axis labels and legends, px.
pub(crate) const LABEL: f64 = 11.5;
/// Font size of tick labels, px.
pub(crate) const TICK: f64 = 11.0;
/// Width of bold text relative to regular text: DejaVu Sans Bold is 10 to 14 % wider.
const BOLD: f64 = 1.15;

/// Symbol by which a legend entry is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Swatch {
    /// The symbol is a line with the dash of the series.
    Line,
    /// The symbol is a solid line.
    Solid,
    /// The symbol is a marker with the shape of the series.
    Point,
    /// The symbol is the darker box of a 50 % band.
    Band50,
    /// The symbol is the lighter box of a 90 % band.
    Band90,
    /// The symbol is a filled bar.
    Bar,
    /// The symbol is the dotted line of a reference value.
    Reference,
}

/// One entry of a legend: name, tone and symbol.
#[derive(Clone, Debug)]
pub(crate) struct Key {
    pub(crate) name: String,
    pub(crate) tone: Tone,
    pub(crate) swatch: Swatch,
}

/// A rectangle of a figure, in pixels from the top left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rect {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

/// An SVG text element; font size and position are attributes, so that tests can check for overlaps.
pub(crate) fn label(class: &str, x: f64, y: f64, size: f64, content: &str) -> Markup {
    html! { text class=(class) x=(c(x)) y=(c(y)) font-size=(c(size)) { (content) } }
}

/// The `<svg>` element of a figure, with title and description for screen readers.
pub(crate) fn svg(target: &Target, height: f64, title: &str, description: &str, body: &Markup) -> Markup {
    let (w, h) = (c(target.width), c(height));
    let (title_id, desc_id) = (format!("{}-t", target.id), format!("{}-d", target.id));
    html! {
        svg xmlns="http://www.w3.org/2000/svg" class="fig" viewBox={ "0 0 " (w) " " (h) } width=(w) height=(h)
            role="img" aria-labelledby={ (title_id) " " (desc_id) } {
            title id=(title_id) { (title) }
            desc id=(desc_id) { (description) }
            @if target.standalone {
                style { (PreEscaped(palette::variables_css(".fig"))) (PreEscaped(palette::figure_css())) }
                rect class="bg" width=(w) height=(h) {}
            }
            (body)
        }
    }
}

/// Draws title and legend at the top of a figure; returns the drawing and its height, px.
pub(crate) fn header(width_px: f64, title: &str, keys: &[Key]) -> (Markup, f64) {
    let mut y = 2.0;
    let mut parts = Vec::new();
    for line in wrap(title, BOLD * TITLE, width_px - 4.0, 2) {
        y += 16.0;
        parts.push(label("ti", 0.0, y - 2.0, TITLE, &line));
    }
    if !keys.is_empty() {
        let (legend, height) = legend(keys, 0.0, y + 6.0, width_px);
        parts.push(legend);
        y += 6.0 + height;
    }
    (html! { @for part in &parts { (part) } }, y)
}

/// Draws legend entries in rows of at most `width_px`; returns the drawing and its height, px.
pub(crate) fn legend(keys: &[Key], left: f64, top: f64, width_px: f64) -> (Markup, f64) {
    let (mut x, mut y) = (left, top + 12.0);
    let mut parts = Vec::new();
    for key in keys {
        let name = shorten(&key.name, LABEL, width_px - 26.0);
        let advance = 26.0 + width(&name, LABEL) + 14.0;
        if x > left && x + advance - 14.0 > left + width_px {
            x = left;
            y += 17.0;
        }
        parts.push(html! {
            (swatch(key, x, y - 4.0))
            (label("", x + 26.0, y, LABEL, &name))
        });
        x += advance;
    }
    (html! { @for part in &parts { (part) } }, y - top + 5.0)
}

/// Draws the symbol of a legend entry, 20 px wide, centred on `y`.
pub(crate) fn swatch(key: &Key, x: f64, y: f64) -> Markup {
    let tone = key.tone.class();
    let rect = |class: &str| html! { rect class={ (class) " " (tone) } x=(c(x + 2.0)) y=(c(y - 5.0)) width="16" height="10" rx="1.5" {} };
    match key.swatch {
        Swatch::Line => html! { path class={ "ln " (tone) } d={ "M" (c(x)) " " (c(y)) "h20" } {} },
        Swatch::Solid => {
            html! { path class={ "ln so " (tone) } d={ "M" (c(x)) " " (c(y)) "h20" } {} }
        }
        Swatch::Point => marker(key.tone, x + 10.0, y, 3.6),
        Swatch::Band50 => html! { (rect("b9")) (rect("b5")) },
        Swatch::Band90 => rect("b9"),
        Swatch::Bar => rect("br"),
        Swatch::Reference => html! { path class="rf" d={ "M" (c(x)) " " (c(y)) "h20" } {} },
    }
}

/// An SVG with the text "no data" and the reason, in place of a figure.
pub(crate) fn no_data(target: &Target, title: &str, reason: &str) -> Markup {
    let (head, top) = header(target.width, title, &[]);
    let height = top + 96.0;
    let text = shorten(&format!("no data: {reason}"), LABEL, target.width - 24.0);
    let body = html! {
        (head)
        rect class="pn" x="0" y=(c(top + 10.0)) width=(c(target.width)) height="78" rx="4" {}
        (label("mu mi", target.width / 2.0, top + 53.0, LABEL, &text))
    };
    svg(target, height, title, &format!("No data: {reason}."), &body)
}

/// Input of the layout of a frame: title, axes, legend entries and proportions.
pub(crate) struct Spec<'a> {
    pub(crate) title: &'a str,
    pub(crate) x: &'a Axis,
    pub(crate) y: &'a Axis,
    pub(crate) keys: Vec<Key>,
    /// Width reserved to the right of the plot area for direct labels, px.
    pub(crate) right: f64,
    /// Ratio of height to width of the plot area; `None` for the default proportions.
    pub(crate) aspect: Option<f64>,
}

/// A laid-out frame of a figure: the plot area, and the scales from data to pixels.
pub(crate) struct Frame {
    pub(crate) plot: Rect,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    height: f64,
    head: Markup,
    axes: Markup,
}

impl Frame {
    /// Lays out a frame for scales fitted to the data, and sets the pixels of these scales.
    pub(crate) fn new(target: &Target, spec: &Spec, x: Scale, y: Scale) -> Self {
        let (head, head_height) = header(target.width, spec.title, &spec.keys);
        let plot_guess = target.width - 46.0 - spec.right;
        let plot_height = match spec.aspect {
            Some(aspect) => (plot_guess * aspect).min(360.0),
            None => (plot_guess * 0.56).clamp(150.0, 320.0),
        };
        let (y_ticks, y_power) = y.ticks(if plot_height > 230.0 { 6 } else { 5 });
        let widest = y_ticks.iter().map(|t| width(&t.1, TICK)).fold(0.0, f64::max);
        let left = (widest + 9.0).max(24.0);
        let top = head_height + 25.0;
        let plot = Rect { left, top, right: target.width - spec.right.max(8.0), bottom: top + plot_height };
        let (x, y) = (x.with_pixels(plot.left, plot.right), y.with_pixels(plot.bottom, plot.top));
        let (x_ticks, x_power) = x.ticks(((plot.right - plot.left) / 62.0).round().clamp(3.0, 10.0) as usize);
        let x_label = shorten_to(&spec.x.text(x_power), plot.right - plot.left);
        let y_label = shorten_to(&spec.y.text(y_power), target.width);
        let axes = html! {
            @for (value, text) in &y_ticks {
                @if let Some(py) = y.pixel(*value) {
                    path class="gr" d={ "M" (c(plot.left)) " " (c(py)) "H" (c(plot.right)) } {}
                    (label("mu en", plot.left - 6.0, py + 3.8, TICK, text))
                }
            }
            @if let Some(py) = y.pixel(0.0).filter(|_| y.contains(0.0) && y.low < 0.0) {
                path class="ze" d={ "M" (c(plot.left)) " " (c(py)) "H" (c(plot.right)) } {}
            }
            path class="ax" d={ "M" (c(plot.left)) " " (c(plot.bottom)) "H" (c(plot.right)) } {}
            @for (value, text) in &thin_ticks(&x, &x_ticks, target.width) {
                @if let Some(px) = x.pixel(*value) {
                    path class="ax" d={ "M" (c(px)) " " (c(plot.bottom)) "v4" } {}
                    (label(tick_anchor(px, text, target.width), px, plot.bottom + 16.0, TICK, text))
                }
            }
            (label("mu", 0.0, top - 9.0, LABEL, &y_label))
            (label("mu en", plot.right, plot.bottom + 33.0, LABEL, &x_label))
        };
        Self { plot, x, y, height: plot.bottom + 40.0, head, axes }
    }

    /// Pixel of a data point; `None` if it cannot be drawn.
    pub(crate) fn pixel(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        Some((self.x.pixel(x)?, self.y.pixel(y)?))
    }

    /// Draws reference lines, event lines, and the labels that fit beside them; returns lines and labels.
    pub(crate) fn guides(&self, references: &[Reference], events: &[Event]) -> (Markup, Markup) {
        let plot = self.plot;
        let shown: Vec<(f64, &Reference)> = (references.iter())
            .filter(|r| self.y.contains(r.value))
            .filter_map(|r| self.y.pixel(r.value).map(|y| (y, r)))
            .collect();
        let events: Vec<(f64, &Event)> = (events.iter())
            .filter(|e| self.x.contains(e.at))
            .filter_map(|e| self.x.pixel(e.at).map(|x| (x, e)))
            .collect();
        let marks = html! {
            @for (y, _) in &shown { path class="rf" d={ "M" (c(plot.left)) " " (c(*y)) "H" (c(plot.right)) } {} }
            @for (x, _) in &events { path class="ev" d={ "M" (c(*x)) " " (c(plot.top)) "V" (c(plot.bottom)) } {} }
        };
        let mut free_from = plot.left;
        let mut event_labels = Vec::new();
        for (x, event) in &events {
            let end = x + 4.0 + width(&event.label, TICK);
            if !event.label.is_empty() && *x >= free_from && end <= plot.right {
                event_labels.push(label("mu ha", x + 4.0, plot.top + 10.0, TICK, &event.label));
                free_from = end + 6.0;
            }
        }
        let mut occupied: Vec<f64> = Vec::new();
        let mut reference_labels = Vec::new();
        for (y, reference) in &shown {
            let above = y - 5.0;
            let base = if above - 10.0 < plot.top + 14.0 { y + 13.0 } else { above };
            let fits = width(&reference.label, TICK) < plot.right - plot.left;
            if !reference.label.is_empty() && fits && occupied.iter().all(|t| (t - base).abs() > 13.0) {
                reference_labels.push(label("en ha", plot.right - 3.0, base, TICK, &reference.label));
                occupied.push(base);
            }
        }
        (marks, html! { @for l in event_labels.iter().chain(&reference_labels) { (l) } })
    }

    /// The SVG of the finished figure; `marks` are clipped to the plot area, `labels` are not.
    pub(crate) fn finish(
        &self,
        target: &Target,
        title: &str,
        description: &str,
        marks: &Markup,
        labels: &Markup,
    ) -> Markup {
        let p = self.plot;
        // A nested viewport clips its content; a clip path would need an id that is unique in the page.
        let (w, h) = (p.right - p.left, p.bottom - p.top);
        let view = format!("{} {} {} {}", c(p.left), c(p.top), c(w), c(h));
        let body = html! {
            (self.head)
            (self.axes)
            svg class="plot" x=(c(p.left)) y=(c(p.top)) width=(c(w)) height=(c(h)) viewBox=(view) overflow="hidden" { (marks) }
            (labels)
        };
        svg(target, self.height, title, description, &body)
    }
}

fn shorten_to(text: &str, width_px: f64) -> String {
    shorten(text, LABEL, width_px)
}

/// CSS class of a tick label: right-aligned if it would leave the figure at the right edge.
fn tick_anchor(px: f64, text: &str, right: f64) -> &'static str {
    if px + width(text, TICK) / 2.0 > right { "mu en" } else { "mu mi" }
}

/// Drops tick labels that would touch the previous one.
fn thin_ticks(x: &Scale, ticks: &[(f64, String)], right: f64) -> Vec<(f64, String)> {
    let mut end = f64::NEG_INFINITY;
    let mut kept = Vec::new();
    for (value, text) in ticks {
        let Some(px) = x.pixel(*value) else { continue };
        let w = width(text, TICK);
        let start = if px + w / 2.0 > right { px - w } else { px - w / 2.0 };
        if start > end + 5.0 {
            end = start + w;
            kept.push((*value, text.clone()));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    //! Contract: a title stays within its figure.
    use super::*;

    #[test]
    fn long_bold_titles_are_wrapped() {
        // About 547 px wide in DejaVu Sans Bold.
        let title = "Median: 1023_SinglePerturbationsBlackDark from 0.000 s, error 0.467 mm";
        let (head, height) = header(500.0, title, &[]);
        assert_eq!(head.into_string().matches("<text").count(), 2);
        assert!((height - 34.0).abs() < 1e-12, "{height}");
    }
}
