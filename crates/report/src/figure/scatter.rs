//! Scatter plot: clouds of points that differ in colour and marker shape.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};

use super::{Axis, Reference, Target, Tone};
use crate::plot::frame::{Frame, Key, Spec, Swatch, no_data};
use crate::plot::marker::marker;
use crate::plot::scale::{Scale, drawable};

/// A named cloud of points in a scatter plot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cloud {
    /// Name of the cloud in the legend.
    pub name: String,
    /// Colour and marker shape of the cloud.
    pub tone: Tone,
    /// Horizontal values of the points.
    #[serde(with = "crate::nullable")]
    pub x: Vec<f64>,
    /// Vertical values of the points.
    #[serde(with = "crate::nullable")]
    pub y: Vec<f64>,
}

/// A scatter plot of one or several clouds of points.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scatter {
    /// Title of the plot.
    pub title: String,
    /// Horizontal axis of the plot.
    pub x: Axis,
    /// Vertical axis of the plot.
    pub y: Axis,
    /// Clouds of points, drawn in order.
    pub clouds: Vec<Cloud>,
    /// Horizontal reference lines of the plot.
    #[serde(default)]
    pub references: Vec<Reference>,
    /// Whether the legend is omitted, for figures in a grid with a common legend.
    #[serde(default)]
    pub hide_legend: bool,
}

impl Scatter {
    pub(crate) fn draw(&self, target: &Target) -> Markup {
        let points = |cloud: &Cloud| -> Vec<(f64, f64)> {
            let both = cloud.x.iter().copied().zip(cloud.y.iter().copied());
            both.filter(|(x, y)| drawable(*x) && drawable(*y)).collect()
        };
        let clouds: Vec<(&Cloud, Vec<(f64, f64)>)> =
            self.clouds.iter().map(|cloud| (cloud, points(cloud))).filter(|(_, p)| !p.is_empty()).collect();
        let all_points = || clouds.iter().flat_map(|(_, p)| p.iter().copied());
        let (Some(x), Some(y)) = (
            Scale::fit(&self.x, all_points().map(|p| p.0), 0.04, (0.0, 1.0)),
            Scale::fit(&self.y, all_points().map(|p| p.1), 0.06, (1.0, 0.0)),
        ) else {
            return no_data(target, &self.title, &format!("{} against {}", self.y.label, self.x.label));
        };
        let key = |cloud: &Cloud| Key { name: cloud.name.clone(), tone: cloud.tone, swatch: Swatch::Point };
        let keys = if self.hide_legend || clouds.len() < 2 {
            Vec::new()
        } else {
            clouds.iter().map(|(cloud, _)| key(cloud)).collect()
        };
        let spec = Spec { title: &self.title, x: &self.x, y: &self.y, keys, right: 8.0, aspect: Some(0.72) };
        let frame = Frame::new(target, &spec, x, y);
        let (guides, labels) = frame.guides(&self.references, &[]);
        let max_points = clouds.iter().map(|(_, p)| p.len()).max().unwrap_or(0);
        let r = if max_points > 300 {
            1.8
        } else if max_points > 80 {
            2.4
        } else {
            3.2
        };
        let marks = html! {
            (guides)
            @for (cloud, points) in &clouds {
                @for (x, y) in points.iter().filter_map(|(x, y)| frame.pixel(*x, *y)) { (marker(cloud.tone, x, y, r)) }
            }
        };
        let mut description = format!("{} against {}.", self.y.text(0), self.x.text(0));
        for (cloud, points) in &clouds {
            description.push_str(&format!(" {}: {} points.", cloud.name, points.len()));
        }
        frame.finish(target, &self.title, &description, &marks, &labels)
    }
}
