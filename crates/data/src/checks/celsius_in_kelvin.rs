//! Check for degrees Celsius in a column of kelvins.
//!
//! 1. A temperature below 0 K does not exist. Without a temperature in the model, values around 0 K are a
//!    difference of temperatures with noise, so all values have to be below.
//! 2. The values are degrees Celsius where adding 273.15 brings their median nearer to a temperature that the
//!    model declares. Without a tolerance, this is the more likely of the two readings.
//!
//! Differences of temperatures are alike in both scales; columns that say so in their name are left out.

use super::measured::Series;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;
use crate::unit::Unit;

/// Temperature of 0 degrees Celsius, K.
const ZERO_CELSIUS_K: f64 = 273.15;
/// Words in a column name that mark a difference of temperatures, which is equal in kelvins and degrees Celsius.
const DIFFERENCE_WORDS: [&str; 10] =
    ["rise", "delta", "diff", "difference", "excess", "error", "dt", "drop", "offset", "deviation"];

/// Finds the columns in kelvins whose values are probably degrees Celsius.
pub(super) fn run(data: &Dataset, expected: &ExpectedData) -> Vec<Finding> {
    let kelvin = Unit::parse("K");
    let columns = data.columns().iter().enumerate().filter(|(_, c)| Some(c.unit()) == kelvin);
    columns.filter_map(|(index, _)| find(data, index, &expected.temperatures_kelvin)).collect()
}

fn find(data: &Dataset, index: usize, temperatures: &[f64]) -> Option<Finding> {
    let series = Series::of_column(data, index);
    let is_difference = |word: &str| DIFFERENCE_WORDS.contains(&word.to_lowercase().as_str());
    if series.name().split('_').any(is_difference) {
        return None;
    }
    let mut values: Vec<f64> = data.trajectories().iter().flat_map(|t| series.samples(t).1).collect();
    let typical = median(&mut values)?;
    let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let distance = |value: f64| temperatures.iter().map(|t| (value - t).abs()).fold(f64::INFINITY, f64::min);
    let declared = temperatures
        .iter()
        .copied()
        .min_by(|a, b| (typical + ZERO_CELSIUS_K - a).abs().total_cmp(&(typical + ZERO_CELSIUS_K - b).abs()))
        .filter(|_| distance(typical + ZERO_CELSIUS_K) < distance(typical));
    (largest < 0.0 && temperatures.is_empty() || declared.is_some()).then(|| Finding::CelsiusInKelvin {
        column: series.name().to_owned(),
        typical_kelvin: typical,
        smallest_kelvin: smallest,
        declared_kelvin: declared,
    })
}
