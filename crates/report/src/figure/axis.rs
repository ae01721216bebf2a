//! Axes, tones, reference lines and event markers, which all figures share.

use serde::{Deserialize, Serialize};

use crate::plot::{palette, text};

/// Scale of an axis: linear or logarithmic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Linear scale: equal steps are equal differences.
    #[default]
    Linear,
    /// Logarithmic scale: equal steps are equal ratios; values that are not positive are left out.
    Log,
}

/// A numeric axis of a figure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Name of the quantity on the axis, e.g. `height`.
    pub label: String,
    /// Unit of the axis, e.g. `m`; empty for a pure number.
    pub unit: String,
    /// Whether the axis is linear or logarithmic.
    #[serde(default)]
    pub scale: Scale,
    /// Range that the axis shows; `None` uses the range of the data. Marks outside are clipped.
    #[serde(default)]
    pub domain: Option<[f64; 2]>,
    /// Whether a linear axis must contain zero.
    #[serde(default)]
    pub include_zero: bool,
    /// Whether the axis has ticks at whole numbers only, e.g. for iterations.
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

    /// Extends the range of this axis to contain zero.
    #[must_use]
    pub fn with_zero(self) -> Self {
        Self { include_zero: true, ..self }
    }

    /// Restricts the ticks of this axis to whole numbers.
    #[must_use]
    pub fn with_integers(self) -> Self {
        Self { integer: true, ..self }
    }

    /// Sets the range of this axis to `low` to `high` instead of that of the data.
    #[must_use]
    pub fn with_domain(self, low: f64, high: f64) -> Self {
        Self { domain: Some([low, high]), ..self }
    }

    /// Label of the axis with its unit, e.g. "height (m)".
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

    /// Text of a value on this axis, with three significant digits and the unit.
    pub(crate) fn value(&self, value: f64) -> String {
        let number = text::significant(value, 3);
        if self.unit.is_empty() { number } else { format!("{number} {}", self.unit) }
    }
}

/// Colour, dash and marker shape of a series; a model has the same tone in a whole report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// Text colour, solid: for measured or true values.
    #[default]
    Ink,
    /// Muted colour, dashed: for smallest possible errors and baselines.
    Muted,
    /// One of five series colours, each with its own dash and marker shape; higher numbers start over.
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

/// Reference line at a value of the dependent axis, with a label.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Value at which the line is drawn, in the unit of the axis.
    pub value: f64,
    /// Label of the line, e.g. `noise floor`.
    pub label: String,
}

/// Vertical marker of an event at a position on the horizontal axis, e.g. an impact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Position of the event marker on the horizontal axis, in the unit of that axis.
    pub at: f64,
    /// Label of the event; empty for none. Labels that do not fit are left out.
    #[serde(default)]
    pub label: String,
}
