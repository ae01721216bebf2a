//! Fan chart: median, 50 % and 90 % bands of a forecast, with the true trajectory.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::{Axis, Event, Target, Tone};
use crate::plot::frame::{Frame, Key, Spec, Swatch, no_data};
use crate::plot::path;
use crate::plot::scale::{Scale, drawable};

/// Fan chart of a forecast. All vectors have one value per time; NaN is a gap.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fan {
    /// Title of the chart, e.g. model and trajectory.
    pub title: String,
    /// Horizontal axis: time.
    pub x: Axis,
    /// Axis of the forecast quantity.
    pub y: Axis,
    /// Colour of the forecast and its bands.
    pub tone: Tone,
    /// Times of the forecast, in the unit of the time axis.
    #[serde(with = "crate::nullable")]
    pub t: Vec<f64>,
    /// Median of the forecast samples; empty to draw the bands without a median.
    #[serde(with = "crate::nullable")]
    pub median: Vec<f64>,
    /// Lower end of the 50 % band; empty for a deterministic forecast.
    #[serde(default, with = "crate::nullable")]
    pub lower50: Vec<f64>,
    /// Upper end of the 50 % band; empty for a deterministic forecast.
    #[serde(default, with = "crate::nullable")]
    pub upper50: Vec<f64>,
    /// Lower end of the 90 % band; empty for a deterministic forecast.
    #[serde(default, with = "crate::nullable")]
    pub lower90: Vec<f64>,
    /// Upper end of the 90 % band; empty for a deterministic forecast.
    #[serde(default, with = "crate::nullable")]
    pub upper90: Vec<f64>,
    /// Measured values of the forecast quantity.
    #[serde(with = "crate::nullable")]
    pub truth: Vec<f64>,
    /// Vertical event markers, e.g. impacts.
    #[serde(default)]
    pub events: Vec<Event>,
    /// Whether the legend is omitted, for figures in a grid with a common legend.
    #[serde(default)]
    pub hide_legend: bool,
}

impl Fan {
    pub(crate) fn keys(tone: Tone) -> Vec<Key> {
        [
            ("true trajectory", Tone::Ink, Swatch::Line),
            ("median", tone, Swatch::Solid),
            ("50 % band", tone, Swatch::Band50),
            ("90 % band", tone, Swatch::Band90),
        ]
        .map(|(name, tone, swatch)| Key { name: name.to_owned(), tone, swatch })
        .to_vec()
    }

    /// All values on the vertical axis, to find a range that several fan charts share.
    pub(crate) fn values(&self) -> impl Iterator<Item = f64> {
        [&self.median, &self.lower50, &self.upper50, &self.lower90, &self.upper90, &self.truth]
            .into_iter()
            .flatten()
            .copied()
    }

    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let has_data = self.values().any(drawable);
        let (Some(x), Some(y)) = (
            Scale::fit(&self.x, self.t.iter().copied().filter(|_| has_data), 0.0, (0.0, 1.0)),
            Scale::fit(&self.y, self.values(), 0.05, (1.0, 0.0)),
        ) else {
            return no_data(target, &self.title, &format!("{} against {}", self.y.label, self.x.label));
        };
        let keys = if self.hide_legend { Vec::new() } else { Self::keys(self.tone) };
        let spec = Spec { title: &self.title, x: &self.x, y: &self.y, keys, right: 8.0, aspect: None };
        let frame = Frame::new(target, &spec, x, y);
        let (guides, labels) = frame.guides(&[], &self.events);
        let area = |lower: &[f64], upper: &[f64]| {
            path::area(self.t.iter().zip(lower.iter().zip(upper)).map(|(t, (l, u))| {
                let (px, low) = frame.pixel(*t, *l)?;
                Some((px, low, frame.y.pixel(*u)?))
            }))
        };
        let line = |values: &[f64]| {
            path::line(&path::runs(self.t.iter().zip(values).map(|(t, v)| frame.pixel(*t, *v))))
        };
        let tone = self.tone.class();
        let marks = html! {
            path class={ "b9 " (tone) } d=(area(&self.lower90, &self.upper90)) {}
            path class={ "b5 " (tone) } d=(area(&self.lower50, &self.upper50)) {}
            (guides)
            path class={ "ln so " (tone) } d=(line(&self.median)) {}
            path class="ln th ki" d=(line(&self.truth)) {}
        };
        frame.finish(target, &self.title, &self.describe(), &marks, &labels)
    }

    fn describe(&self) -> String {
        let inside = (self.truth.iter().zip(self.lower90.iter().zip(&self.upper90)))
            .filter(|(t, (l, u))| drawable(**t) && drawable(**l) && drawable(**u))
            .map(|(t, (l, u))| (l..=u).contains(&t));
        let (mut covered, mut total) = (0_u32, 0_u32);
        for is_inside in inside {
            total += 1;
            covered += u32::from(is_inside);
        }
        let mut words = format!(
            "Forecast of {} against {}: median and bands over the true trajectory.",
            self.y.text(0),
            self.x.text(0)
        );
        if total > 0 {
            let share = f64::from(covered) / f64::from(total) * 100.0;
            words.push_str(&format!(" The 90 % band holds the truth at {share:.0} % of the times."));
        }
        words
    }
}
