//! Figures as plain data, and their drawing as SVG, deterministic and without scripts or external resources.
//!
//! ```
//! use augsim_report::figure::{Axis, Figure, Line, Series, Tone};
//!
//! let line = Line::new("Free fall", Axis::linear("time", "s"), Axis::linear("height", "m"))
//!     .with(Series::line("ball", Tone::Series(0), vec![0.0, 0.1, 0.2], vec![1.0, 0.951, 0.804]));
//! let svg = Figure::Line(line).svg_document(520.0);
//! assert!(svg.starts_with("<svg") && svg.contains("height (m)"));
//! ```

mod autocorrelation;
mod axis;
mod bars;
mod fan;
mod heatmap;
mod histogram;
mod line;
mod quantile;
mod scatter;

pub use autocorrelation::{Autocorrelation, Correlogram};
pub use axis::{Axis, Event, Reference, Scale, Tone};
pub use bars::{Bar, BarGroup, BarShape, Bars};
pub use fan::Fan;
pub use heatmap::Heatmap;
pub use histogram::{Histogram, HistogramSample};
pub use line::{Band, Line, Mark, Series};
pub use quantile::{Quantile, QuantileSeries};
pub use scatter::{Cloud, Scatter};

use maud::Markup;
use serde::{Deserialize, Serialize};

/// A figure of any kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "figure", rename_all = "kebab-case")]
pub enum Figure {
    /// Line chart: named series over a numeric axis.
    Line(Line),
    /// Fan chart: forecast bands with the true trajectory.
    Fan(Fan),
    /// Scatter plot: clouds of points.
    Scatter(Scatter),
    /// Bar chart: horizontal bars or dots with intervals.
    Bars(Bars),
    /// Histogram: densities of samples.
    Histogram(Histogram),
    /// Quantile plot: sample quantiles against those of a normal distribution.
    Quantile(Quantile),
    /// Autocorrelation of residuals against lag.
    Autocorrelation(Autocorrelation),
    /// Heat map of a correlation matrix.
    Heatmap(Heatmap),
}

/// Where a figure is drawn: its width, the prefix of its ids, and its style.
pub(crate) struct Target<'a> {
    /// Width of the figure, px; its height follows.
    pub(crate) width: f64,
    /// Prefix of the figure's element ids, unique in the page.
    pub(crate) id: &'a str,
    /// Whether the SVG has its own style (a file) or uses that of the page.
    pub(crate) standalone: bool,
}

impl Figure {
    /// Title of the figure.
    #[must_use]
    pub fn title(&self) -> &str {
        match self {
            Self::Line(f) => &f.title,
            Self::Fan(f) => &f.title,
            Self::Scatter(f) => &f.title,
            Self::Bars(f) => &f.title,
            Self::Histogram(f) => &f.title,
            Self::Quantile(f) => &f.title,
            Self::Autocorrelation(f) => &f.title,
            Self::Heatmap(f) => &f.title,
        }
    }

    /// SVG file of the figure, `width` pixels wide (at least 240), with its own style.
    #[must_use]
    pub fn svg_document(&self, width: f64) -> String {
        self.draw(&Target { width: width.max(240.0), id: "figure", standalone: true }).into_string()
    }

    pub(crate) fn draw(&self, target: &Target) -> Markup {
        match self {
            Self::Line(f) => f.draw(target),
            Self::Fan(f) => f.draw(target),
            Self::Scatter(f) => f.draw(target),
            Self::Bars(f) => f.draw(target),
            Self::Histogram(f) => f.draw(target),
            Self::Quantile(f) => f.draw(target),
            Self::Autocorrelation(f) => f.draw(target),
            Self::Heatmap(f) => f.draw(target),
        }
    }
}

macro_rules! into_figure {
    ($($kind:ident),*) => {
        $(impl From<$kind> for Figure {
            fn from(figure: $kind) -> Self {
                Self::$kind(figure)
            }
        })*
    };
}
into_figure!(Line, Fan, Scatter, Bars, Histogram, Quantile, Autocorrelation, Heatmap);
