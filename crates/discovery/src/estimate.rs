//! Estimates of parameters, and their text with the digits that their intervals support.

use crate::group_distribution::GroupDistribution;
use augsim_data::{digits, estimate_digits};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Fitted value of a parameter, with interval and unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Fitted value; for a parameter with one value per group, the mean over the groups.
    pub value: f64,
    /// Lower and upper end of the 95 % interval of the value.
    pub ci95: [f64; 2],
    /// Unit of the value; empty for a pure number.
    pub unit: String,
    /// Estimate for each group, by name; empty for a parameter with one value.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub groups: BTreeMap<String, Estimate>,
    /// Distribution of the values over groups; `None` with one value or with fewer than five groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distribution: Option<GroupDistribution>,
    /// Reason why the data do not determine the value, as text to follow it; `None` if they do. With a
    /// reason, `ci95` is the range of the model file and is not displayed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_identified: Option<String>,
}

impl Estimate {
    /// Marks the value as not determined by the data, or not distinguishable from the parameters `others`.
    pub fn set_not_identified(&mut self, others: &[String]) {
        let names: Vec<String> = others.iter().map(|name| format!("`{name}`")).collect();
        self.not_identified = Some(match &names[..] {
            [] => "not determined by these data".to_owned(),
            names => format!("these data do not distinguish it from {}", names.join(", ")),
        });
    }

    /// Text of the 95 % interval, or of the reason why there is none.
    pub fn interval_text(&self) -> String {
        let [_, low, high] = estimate_digits(self.value, self.ci95);
        match &self.not_identified {
            Some(why) => format!("no interval: {why}"),
            None => format!("95 % interval {low} to {high}"),
        }
    }

    /// Text of the value, with the digits that its interval supports.
    pub fn value_text(&self) -> String {
        match self.not_identified {
            Some(_) => digits(self.value),
            None => estimate_digits(self.value, self.ci95)[0].clone(),
        }
    }

    /// Text of the estimate for a sentence, with `name` as the parameter's name.
    pub fn phrase(&self, name: &str) -> String {
        if self.groups.is_empty() {
            return format!("{name} = {self}");
        }
        let (low, high) = self
            .groups
            .values()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.value), high.max(v.value)));
        let range = format!("{name} between {} and {}", with_three_digits(low), with_three_digits(high));
        let Some(over_groups) = &self.distribution else { return format!("{range}, one value per group") };
        let (count, mean, sd) =
            (self.groups.len(), with_three_digits(over_groups.mean), with_three_digits(over_groups.sd));
        let [least, most] = over_groups.sd_ci95.map(with_three_digits);
        let outlying: Vec<String> = over_groups.outlying.iter().map(|name| format!("`{name}`")).collect();
        let outlying = match &outlying[..] {
            [] => String::new(),
            [one] => format!("; {one} differs from all others"),
            several => format!("; {} differ from the others", several.join(", ")),
        };
        format!("{range} in {count} groups, mean {mean}, standard deviation {sd} [{least}, {most}]{outlying}")
    }
}

/// Prints a number with three digits, in scientific notation if it is small or large.
pub(crate) fn with_three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor();
    if (-3.0..6.0).contains(&exponent) {
        format!("{value:.*}", (2.0 - exponent).max(0.0) as usize)
    } else {
        format!("{value:.2e}")
    }
}

/// Displays value and interval: `0.00040 [0.00038, 0.00042]`.
impl std::fmt::Display for Estimate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(why) = &self.not_identified {
            return write!(f, "{} ({why})", digits(self.value));
        }
        let [value, low, high] = estimate_digits(self.value, self.ci95);
        write!(f, "{value} [{low}, {high}]")
    }
}

#[cfg(test)]
mod tests {
    //! Contract: an estimate is displayed with the digits that its interval supports.
    use super::*;

    #[test]
    fn small_values_are_displayed_with_all_supported_digits() {
        let e = |value: f64, half: f64| Estimate {
            value,
            ci95: [value - half, value + half],
            ..Estimate::default()
        };
        assert_eq!(e(4.042e-4, 2.1e-5).to_string(), "0.000404 [0.000383, 0.000425]");
        assert_eq!(e(1.3, 0.02).to_string(), "1.300 [1.280, 1.320]");
        assert_eq!(e(1.3, 0.0).to_string(), "1.3 [1.3, 1.3]");
        assert_eq!(e(4.042e-12, 2.1e-14).to_string(), "4.042e-12 [4.021e-12, 4.063e-12]");
    }
}
