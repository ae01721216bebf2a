//! Horizontal bars with intervals, in labelled groups.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::{Axis, Reference, Target, Tone};
use crate::plot::frame::{Key, LABEL, Swatch, TICK, header, label, no_data, svg};
use crate::plot::marker::marker;
use crate::plot::scale::{Scale, drawable};
use crate::plot::text::{coordinate as c, shorten, significant, width};

/// One horizontal bar of a bar chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bar {
    /// Name of the bar; bars of the same name share a legend entry.
    pub name: String,
    /// Colour of the bar.
    pub tone: Tone,
    /// Length of the bar, in the unit of the value axis; `None` shows "no data".
    pub value: Option<f64>,
    /// Interval drawn over the end of the bar; `None` draws none.
    #[serde(default)]
    pub interval: Option<[f64; 2]>,
}

/// Bars of a chart under one label.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BarGroup {
    /// Label of the group; empty if the names of the bars suffice.
    pub label: String,
    /// Bars of the group, top to bottom.
    pub bars: Vec<Bar>,
}

/// Whether values are drawn as bars or as dots.
///
/// The length of a bar is meaningful only on an axis that contains zero; use dots on others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BarShape {
    /// Values are drawn as bars from zero.
    #[default]
    Bar,
    /// Values are drawn as dots on a thin line.
    Dot,
}

/// A chart of horizontal bars or dots.
///
/// With one group each bar is labelled by its name; with several, groups are labelled and a legend names the
/// bars.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bars {
    /// Title of the chart.
    pub title: String,
    /// Axis of the values, which is horizontal.
    pub value: Axis,
    /// Groups of bars, top to bottom.
    pub groups: Vec<BarGroup>,
    /// Vertical reference lines of the chart.
    #[serde(default)]
    pub references: Vec<Reference>,
    /// Whether the values are drawn as bars or as dots.
    #[serde(default)]
    pub shape: BarShape,
}

/// Thickness of a bar, px.
const BAR_THICKNESS: f64 = 13.0;
/// Distance between the centres of neighbouring bars, px.
const ROW_HEIGHT: f64 = 20.0;
/// Radius of the dot that shows a value, px.
const RADIUS: f64 = 4.0;

impl Bars {
    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let all_bars = || self.groups.iter().flat_map(|g| &g.bars);
        let ends = all_bars().flat_map(|b| b.value.into_iter().chain(b.interval.into_iter().flatten()));
        let has_value = all_bars().any(|b| b.value.is_some_and(drawable));
        let from_zero = self.shape == BarShape::Bar && self.value.scale == super::Scale::Linear;
        let axis = Axis { include_zero: from_zero, ..self.value.clone() };
        let references = self.references.iter().map(|r| r.value);
        let Some(scale) = Scale::fit(&axis, ends.chain(references).filter(|_| has_value), 0.04, (0.0, 1.0))
        else {
            return no_data(target, &self.title, &self.value.label);
        };
        let grouped = self.groups.len() > 1;
        let mut keys: Vec<Key> = Vec::new();
        for bar in all_bars().filter(|_| grouped) {
            if keys.iter().all(|k| k.name != bar.name) {
                keys.push(Key { name: bar.name.clone(), tone: bar.tone, swatch: Swatch::Bar });
            }
        }
        let (head, head_height) = header(target.width, &self.title, if keys.len() > 1 { &keys } else { &[] });
        let names = || {
            self.groups
                .iter()
                .flat_map(|g| if grouped { vec![&g.label] } else { g.bars.iter().map(|b| &b.name).collect() })
        };
        let widest = names().map(|n| width(n, LABEL)).fold(0.0, f64::max).min(target.width * 0.42);
        let value_width =
            all_bars().filter_map(|b| b.value).map(|v| width(&significant(v, 3), TICK)).fold(0.0, f64::max);
        let (left, right) = (widest + 10.0, target.width - value_width - 12.0);
        let scale = scale.with_pixels(left, right);
        let top = head_height + if self.references.is_empty() { 10.0 } else { 26.0 };

        let mut y = top;
        let mut rows = Vec::new();
        for group in &self.groups {
            if grouped {
                let middle = y + group.bars.len() as f64 * ROW_HEIGHT / 2.0;
                rows.push(label("", 0.0, middle + 3.8, LABEL, &shorten(&group.label, LABEL, widest)));
            }
            for bar in &group.bars {
                let name = if grouped { "" } else { bar.name.as_str() };
                rows.push(self.row(&scale, bar, name, y + ROW_HEIGHT / 2.0, [widest, target.width]));
                y += ROW_HEIGHT;
            }
            y += 8.0;
        }
        let bottom = y;
        let (mut ticks, power) = scale.ticks(((right - left) / 70.0).round().clamp(3.0, 9.0) as usize);
        // Next to long names the ticks of a logarithmic axis may be closer than their labels are wide: drop
        // those that overlap.
        let mut free = f64::NEG_INFINITY;
        ticks.retain(|(value, text)| {
            let half = width(text, TICK) / 2.0;
            let Some(x) = scale.pixel(*value).filter(|x| x - half > free) else { return false };
            free = x + half;
            true
        });
        let body = html! {
                    (head)
                    @for (value, text) in &ticks {
                        @if let Some(x) = scale.pixel(*value) {
                            path class="gr" d={ "M" (c(x)) " " (c(top)) "V" (c(bottom)) } {}
                            (label("mu mi", x, bottom + 15.0, TICK, text))
                        }
                    }
                    @for part in &rows { (part) }
                    @if let Some(x) = scale.pixel(if scale.contains(0.0) { 0.0 } else { scale.low }) {
                        path class="ax" d={ "M" (c(x)) " " (c(top)) "V" (c(bottom)) } {}
                    }
                    @for reference in self.references.iter().filter(|r| scale.contains(r.value)) {
                        @if let Some(x) = scale.pixel(reference.value) {
                            path class="rf" d={ "M" (c(x)) " " (c(top - 4.0)) "V" (c(bottom)) } {}
        @let text = shorten(&reference.label, TICK, target.width * 0.45);
                            @let fits_right = x + width(&text, TICK) < target.width;
                            (label(if fits_right { "" } else { "en" }, x, top - 9.0, TICK, &text))
                        }
                    }
                    (label("mu en", right, bottom + 32.0, LABEL, &shorten(&self.value.text(power), LABEL, right)))
                };
        svg(target, bottom + 39.0, &self.title, &self.describe(), &body)
    }

    fn describe(&self) -> String {
        let mut words = format!("{}.", self.value.text(0));
        for group in &self.groups {
            for bar in &group.bars {
                let value = bar.value.map_or_else(|| "no data".to_owned(), |v| self.value.value(v));
                let place = if group.label.is_empty() { String::new() } else { format!("{}, ", group.label) };
                words.push_str(&format!(" {place}{}: {value}.", bar.name));
            }
        }
        words
    }

    /// Draws one bar or dot with its name, its interval, and its number at the right.
    fn row(
        &self,
        scale: &Scale,
        bar: &Bar,
        name: &str,
        middle: f64,
        [name_width, right]: [f64; 2],
    ) -> Markup {
        let base = scale.pixel(if scale.contains(0.0) { 0.0 } else { scale.low });
        let tone = bar.tone.class();
        let value = bar.value.filter(|v| drawable(*v));
        let drawn = |zero: f64, end: f64| match self.shape {
            BarShape::Bar => html! {
                rect class={ "br " (tone) } x=(c(zero.min(end))) y=(c(middle - BAR_THICKNESS / 2.0)) width=(c((end - zero).abs().max(0.5))) height=(c(BAR_THICKNESS)) rx="1" {}
            },
            BarShape::Dot => html! {
                path class="gr" d={ "M" (c(zero)) " " (c(middle)) "H" (c(end)) } {}
                (marker(bar.tone, end, middle, RADIUS))
            },
        };
        html! {
        @if !name.is_empty() { (label("", 0.0, middle + 3.8, LABEL, &shorten(name, LABEL, name_width))) }
        @match value.and_then(|v| Some((base?, scale.pixel(v)?, v))) {
            Some((zero, end, v)) => {
                (drawn(zero, end))
                @if let Some((a, b)) = bar.interval.and_then(|[a, b]| Some((scale.pixel(a)?, scale.pixel(b)?))) {
                    path class="iv ki" d={ "M" (c(a)) " " (c(middle)) "H" (c(b)) "M" (c(a)) " " (c(middle - 3.0)) "v6M" (c(b)) " " (c(middle - 3.0)) "v6" } {}
                }
                (label("en", right, middle + 3.8, TICK, &significant(v, 3)))
            }
            None => (label("mu en", right, middle + 3.8, TICK, "–")),
        }
        }
    }
}
