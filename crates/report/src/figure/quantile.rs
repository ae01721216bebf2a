//! Quantile plot: standardised sample quantiles against those of the normal distribution.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::{Axis, Target, Tone};
use crate::plot::frame::{Frame, Key, Spec, Swatch, no_data};
use crate::plot::marker::marker;
use crate::plot::path;
use crate::plot::scale::{Scale, drawable};

/// Quantiles of one sample and of the standard normal distribution.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QuantileSeries {
    /// Name of the sample in the legend.
    pub name: String,
    /// Colour and marker shape of the sample.
    pub tone: Tone,
    /// Quantiles of the standard normal distribution at the same probabilities as `sample`.
    #[serde(with = "crate::nullable")]
    pub normal: Vec<f64>,
    /// Quantiles of the sample in units of the measurement noise's standard deviation, in the same order.
    #[serde(with = "crate::nullable")]
    pub sample: Vec<f64>,
}

/// A quantile plot, with the diagonal that normal noise follows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quantile {
    /// Title of the plot.
    pub title: String,
    /// Samples whose quantiles are drawn.
    pub series: Vec<QuantileSeries>,
}

impl Quantile {
    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let (x_axis, y_axis) =
            (Axis::linear("normal quantile", "sd"), Axis::linear("residual quantile", "sd"));
        let points = |s: &QuantileSeries| -> Vec<(f64, f64)> {
            let both = s.normal.iter().copied().zip(s.sample.iter().copied());
            both.filter(|(x, y)| drawable(*x) && drawable(*y)).collect()
        };
        let series: Vec<(&QuantileSeries, Vec<(f64, f64)>)> =
            self.series.iter().map(|s| (s, points(s))).filter(|(_, p)| !p.is_empty()).collect();
        let all_points = || series.iter().flat_map(|(_, p)| p.iter().copied());
        let (Some(x), Some(y)) = (
            Scale::fit(&x_axis, all_points().map(|p| p.0), 0.04, (0.0, 1.0)),
            Scale::fit(&y_axis, all_points().flat_map(|p| [p.0, p.1]), 0.05, (1.0, 0.0)),
        ) else {
            return no_data(target, &self.title, "quantiles of the residual");
        };
        let point_key =
            |s: &QuantileSeries| Key { name: s.name.clone(), tone: s.tone, swatch: Swatch::Point };
        let mut keys: Vec<Key> = series.iter().map(|(s, _)| point_key(s)).collect();
        keys.push(Key { name: "pure noise".to_owned(), tone: Tone::Ink, swatch: Swatch::Reference });
        let spec = Spec { title: &self.title, x: &x_axis, y: &y_axis, keys, right: 8.0, aspect: Some(0.66) };
        let frame = Frame::new(target, &spec, x, y);
        let diagonal = path::line(&path::runs([frame.pixel(x.low, x.low), frame.pixel(x.high, x.high)]));
        let marks = html! {
            path class="rf" d=(diagonal) {}
            @for (s, points) in &series {
                @for (x, y) in points.iter().filter_map(|(x, y)| frame.pixel(*x, *y)) { (marker(s.tone, x, y, 2.4)) }
            }
        };
        let mut description =
            "Quantiles of the residual against normal quantiles; pure noise lies on the diagonal.".to_owned();
        for (s, points) in &series {
            let farthest = points.iter().map(|(x, y)| (y - x).abs()).fold(0.0, f64::max);
            description.push_str(&format!(" {}: at most {farthest:.1} sd off the diagonal.", s.name));
        }
        frame.finish(target, &self.title, &description, &marks, &html! {})
    }
}
