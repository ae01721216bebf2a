//! Histogram: densities of one or several samples in common bins, drawn as outlines.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::{Axis, Target, Tone};
use crate::plot::frame::{Frame, Key, Spec, Swatch, no_data};
use crate::plot::path;
use crate::plot::scale::{Scale, drawable, extent};

/// A named sample whose distribution a histogram shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HistogramSample {
    /// Name of the sample in the legend.
    pub name: String,
    /// Colour and dash of the sample.
    pub tone: Tone,
    /// Values of the sample; NaN is left out.
    #[serde(with = "crate::nullable")]
    pub values: Vec<f64>,
}

/// Histogram of one or several samples, each with area one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Histogram {
    /// Title of the histogram.
    pub title: String,
    /// Axis of the sample values.
    pub x: Axis,
    /// Samples that are drawn in common bins.
    pub samples: Vec<HistogramSample>,
}

impl Histogram {
    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let samples: Vec<(&HistogramSample, Vec<f64>)> = (self.samples.iter())
            .map(|s| (s, s.values.iter().copied().filter(|v| drawable(*v)).collect::<Vec<f64>>()))
            .filter(|(_, values)| !values.is_empty())
            .collect();
        let edges = bins(&samples.iter().flat_map(|(_, v)| v.iter().copied()).collect::<Vec<f64>>());
        let unit = if self.x.unit.is_empty() { String::new() } else { format!("1/{}", self.x.unit) };
        let y_axis = Axis::linear("density", &unit).with_zero();
        let outlines: Vec<Vec<f64>> = samples.iter().map(|(_, values)| density(values, &edges)).collect();
        let (Some(x), Some(y)) = (
            Scale::fit(&self.x, edges.iter().copied(), 0.02, (0.0, 1.0)),
            Scale::fit(&y_axis, outlines.iter().flatten().copied(), 0.05, (1.0, 0.0)),
        ) else {
            return no_data(target, &self.title, &self.x.label);
        };
        let key = |s: &HistogramSample| Key { name: s.name.clone(), tone: s.tone, swatch: Swatch::Line };
        let keys = if samples.len() < 2 { Vec::new() } else { samples.iter().map(|(s, _)| key(s)).collect() };
        let spec = Spec { title: &self.title, x: &self.x, y: &y_axis, keys, right: 8.0, aspect: None };
        let frame = Frame::new(target, &spec, x, y);
        let steps = |heights: &[f64]| {
            let mut corners = vec![(edges.first().copied(), 0.0)];
            for (pair, height) in edges.windows(2).zip(heights) {
                corners.extend(pair.iter().map(|edge| (Some(*edge), *height)));
            }
            corners.push((edges.last().copied(), 0.0));
            let points = corners.into_iter().map(|(x, y)| frame.pixel(x?, y));
            path::line(&path::runs(points))
        };
        let marks = html! {
            @for ((sample, _), heights) in samples.iter().zip(&outlines) {
                @let tone = sample.tone.class();
                path class={ "b9 " (tone) } d=(steps(heights)) {}
                path class={ "ln " (tone) } d=(steps(heights)) {}
            }
        };
        let mut description = format!("Density of {}.", self.x.text(0));
        for (sample, values) in &samples {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            description.push_str(&format!(
                " {}: {} values, mean {}.",
                sample.name,
                values.len(),
                self.x.value(mean)
            ));
        }
        frame.finish(target, &self.title, &description, &marks, &html! {})
    }
}

/// Edges of the common bins by the rule of Freedman and Diaconis (1981), 5 to 60 bins.
fn bins(values: &[f64]) -> Vec<f64> {
    let Some((low, high)) = extent(values.iter().copied()) else {
        return Vec::new();
    };
    let (low, high) = if low == high { (low - 0.5, high + 0.5) } else { (low, high) };
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let quantile =
        |q: f64| sorted.get((q * (sorted.len() - 1) as f64).round() as usize).copied().unwrap_or(low);
    let width = 2.0 * (quantile(0.75) - quantile(0.25)) / (sorted.len() as f64).cbrt();
    let count = if width > 0.0 { ((high - low) / width).ceil().clamp(5.0, 60.0) } else { 5.0 };
    (0..=count as u32).map(|i| low + (high - low) * f64::from(i) / count).collect()
}

/// Density of `values` in each bin: their share in the bin divided by its width.
fn density(values: &[f64], edges: &[f64]) -> Vec<f64> {
    let mut counts = vec![0.0_f64; edges.len().saturating_sub(1)];
    for value in values {
        let bin = edges.partition_point(|e| e <= value).saturating_sub(1).min(counts.len().saturating_sub(1));
        if let Some(count) = counts.get_mut(bin) {
            *count += 1.0;
        }
    }
    let total = values.len() as f64;
    counts.iter().zip(edges.windows(2)).map(|(n, e)| n / total / (e[1] - e[0])).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: the drawn density integrates to one, also for constant samples.
    use super::*;

    #[test]
    fn density_integrates_to_one() {
        for values in [vec![0.0, 1.0, 1.5, 2.0, 7.0, 7.0], vec![3.0; 9], vec![1.0]] {
            let edges = bins(&values);
            let area: f64 =
                density(&values, &edges).iter().zip(edges.windows(2)).map(|(d, e)| d * (e[1] - e[0])).sum();
            assert!((area - 1.0).abs() < 1e-12, "{area}");
        }
    }
}
