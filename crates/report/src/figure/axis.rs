//! Axes, tones, reference lines and event markers, which all figures share.

use serde::{Deserialize, Serialize};

use crate::plot::{palette, text};

/// Linear or logarithmic scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Equal steps are equal differences.
    #[default]
    Linear,
    /// Equal steps are equal ratios; values that are not positive are left out.
    Log,
}

/// A numeric axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Quantity, e.g. `height`.
    pub label: String,
    /// Unit, e.g. `m`; empty for a pure number.
    pub unit: String,
    /// Linear or logarithmic.
    #[serde(default)]
    pub scale: Scale,
    /// Range to show; `None` uses the range of the data. Marks outside are clipped.
    #[serde(default)]
    pub domain: Option<[f64; 2]>,
    /// Whether a linear axis must show zero.
    #[serde(default)]
    pub include_zero: bool,
    /// Whether ticks are at whole numbers only, e.g. for iterations.
    #[serde(default)]
    pub integer: bool,
}

impl Axis {
    /// A linear axis for `label` in `unit` (empty for a pure number).
    #[must_use]
    pub fn linear(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), ..Self::default() }
    }

    /// A logarithmic axis for `label` in `unit`.
    #[must_use]
    pub fn log(label: &str, unit: &str) -> Self {
        Self { scale: Scale::Log, ..Self::linear(label, unit) }
    }

    /// This axis with zero in its range.
    #[must_use]
    pub fn with_zero(self) -> Self {
        Self { include_zero: true, ..self }
    }

    /// This axis with ticks at whole numbers only.
    #[must_use]
    pub fn with_integers(self) -> Self {
        Self { integer: true, ..self }
    }

    /// This axis with the range `low` to `high` instead of the data's.
    #[must_use]
    pub fn with_domain(self, low: f64, high: f64) -> Self {
        Self { domain: Some([low, high]), ..self }
    }

    /// Label with unit, e.g. "height (m)".
    ///
    /// If the tick labels are scaled by a power of ten, it is part of the unit: "height (10⁻³ m)".
    pub(crate) fn text(&self, power: i32) -> String {
        let factor = if power == 0 { String::new() } else { format!("10{}", text::superscript(power)) };
        match (factor.is_empty(), self.unit.is_empty()) {
            (true, true) => self.label.clone(),
            (true, false) => format!("{} ({})", self.label, self.unit),
            (false, true) => format!("{} ({factor})", self.label),
            (false, false) => format!("{} ({factor} {})", self.label, self.unit),
        }
    }

    /// A value with three significant digits and the unit.
    pub(crate) fn value(&self, value: f64) -> String {
        let number = text::significant(value, 3);
        if self.unit.is_empty() { number } else { format!("{number} {}", self.unit) }
    }
}

/// Colour, dash and marker shape of a series; a model has the same tone in a whole report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// The text colour, solid: measured or true values.
    #[default]
    Ink,
    /// Muted, dashed: floors and baselines.
    Muted,
    /// One of five colours, each with its own dash and marker shape; higher numbers start over.
    Series(u8),
}

impl Tone {
    /// CSS class of this tone.
    pub(crate) fn class(self) -> String {
        match self {
            Self::Ink => "ki".to_owned(),
            Self::Muted => "km".to_owned(),
            Self::Series(i) => format!("k{}", i % palette::SERIES),
        }
    }
}

/// A line at a value of the dependent axis, with a label.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// The value, in the axis' unit.
    pub value: f64,
    /// Name of the quantity, e.g. `noise floor`.
    pub label: String,
}

/// A vertical marker at a position on the horizontal axis, e.g. an impact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Position on the horizontal axis, in its unit.
    pub at: f64,
    /// Name of the event; empty for no label. Labels that do not fit are left out.
    #[serde(default)]
    pub label: String,
}
