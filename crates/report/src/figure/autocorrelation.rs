//! Autocorrelation of a residual over lag, with the 95 % band of white noise.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::{Axis, Target, Tone};
use crate::plot::frame::{Frame, Key, Spec, Swatch, no_data};
use crate::plot::marker::marker;
use crate::plot::scale::{Scale, drawable};
use crate::plot::text::coordinate as c;

/// Autocorrelation of one residual at several lags.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Correlogram {
    /// Name of the residual in the legend.
    pub name: String,
    /// Colour and marker shape of the residual.
    pub tone: Tone,
    /// Lags of the autocorrelation, in the figure's lag unit, without lag 0.
    #[serde(with = "crate::nullable")]
    pub lag: Vec<f64>,
    /// Autocorrelation of the residual at each lag.
    #[serde(with = "crate::nullable")]
    pub value: Vec<f64>,
}

/// Figure of the autocorrelation of one or several residuals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Autocorrelation {
    /// Title of the figure.
    pub title: String,
    /// Unit of the lags, e.g. `samples` or `s`.
    pub lag_unit: String,
    /// Half width of the 95 % band of white noise, `1.96 / sqrt(n)`; `None` draws no band.
    #[serde(default)]
    pub white95: Option<f64>,
    /// Autocorrelations of the residuals.
    pub series: Vec<Correlogram>,
}

impl Autocorrelation {
    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let x_axis = Axis {
            integer: self.series.iter().flat_map(|s| &s.lag).all(|lag| lag.fract() == 0.0),
            ..Axis::linear("lag", &self.lag_unit)
        };
        let y_axis = Axis::linear("autocorrelation", "").with_zero();
        let white = self.white95.filter(|w| drawable(*w));
        let points = |s: &Correlogram| -> Vec<(f64, f64)> {
            let both = s.lag.iter().copied().zip(s.value.iter().copied());
            both.filter(|(x, y)| drawable(*x) && drawable(*y)).collect()
        };
        let series: Vec<(&Correlogram, Vec<(f64, f64)>)> =
            self.series.iter().map(|s| (s, points(s))).filter(|(_, p)| !p.is_empty()).collect();
        let all_points = || series.iter().flat_map(|(_, p)| p.iter().copied());
        let band = white.into_iter().flat_map(|w| [-w, w]).filter(|_| !series.is_empty());
        let (Some(x), Some(y)) = (
            Scale::fit(&x_axis, all_points().map(|p| p.0), 0.04, (0.0, 1.0)),
            Scale::fit(&y_axis, all_points().map(|p| p.1).chain(band), 0.08, (1.0, 0.0)),
        ) else {
            return no_data(target, &self.title, "autocorrelation over lag");
        };
        let mut keys: Vec<Key> = (series.iter())
            .map(|(s, _)| Key { name: s.name.clone(), tone: s.tone, swatch: Swatch::Point })
            .collect();
        if white.is_some() {
            keys.push(Key {
                name: "white noise, 95 %".to_owned(),
                tone: Tone::Muted,
                swatch: Swatch::Band90,
            });
        }
        let spec = Spec { title: &self.title, x: &x_axis, y: &y_axis, keys, right: 8.0, aspect: Some(0.66) };
        let frame = Frame::new(target, &spec, x, y);
        let zero = frame.y.pixel(0.0).unwrap_or(frame.plot.bottom);
        // Stems of several series are drawn next to each other around their lag.
        let shift = |i: usize| (i as f64 - (series.len() as f64 - 1.0) / 2.0) * 3.0;
        let marks = html! {
            @if let Some((high, low)) = white.and_then(|w| Some((frame.y.pixel(w)?, frame.y.pixel(-w)?))) {
                rect class="b9 km" x=(c(frame.plot.left)) y=(c(high)) width=(c(frame.plot.right - frame.plot.left)) height=(c(low - high)) {}
            }
            @for (i, (s, points)) in series.iter().enumerate() {
                @for (x, y) in points.iter().filter_map(|(x, y)| frame.pixel(*x, *y)) {
                    path class={ "ld " (s.tone.class()) } d={ "M" (c(x + shift(i))) " " (c(zero)) "V" (c(y)) } {}
                    (marker(s.tone, x + shift(i), y, 2.6))
                }
            }
        };
        frame.finish(target, &self.title, &self.describe(&series), &marks, &html! {})
    }

    fn describe(&self, series: &[(&Correlogram, Vec<(f64, f64)>)]) -> String {
        let mut words = "Autocorrelation of the residual against lag.".to_owned();
        for (s, points) in series {
            let largest = points.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
            words.push_str(&format!(" {}: at most {largest:.2} in size", s.name));
            if let Some(white) = self.white95 {
                let outside = points.iter().filter(|p| p.1.abs() > white).count();
                words.push_str(&format!(", {outside} of {} lags outside the 95 % band", points.len()));
            }
            words.push('.');
        }
        words
    }
}
