//! Calibration: the fit of the declared model, from which every search starts.

use crate::fit::{ChosenRecords, Fit, fit};
use crate::hypothesis::Hypothesis;
use crate::statistics::median;

/// Fits the declared model, without any added effect, to the records.
pub(crate) fn calibrate(train: &ChosenRecords<'_>) -> Fit {
    let h = Hypothesis::new(train.data, &[]);
    fit(train, &h, &calibration_start(train, &h), &[])
}

/// Initial theta (shared parameters) of a calibration: nominal values, except for the events' parameter. That
/// one starts at the median of its rough values over all events (of each group, if it has one value per
/// group).
pub(crate) fn calibration_start(train: &ChosenRecords<'_>, h: &Hypothesis) -> Vec<f64> {
    let mut theta = h.initial_theta(0.0);
    for (f, range) in h.entries() {
        if let Some(value) = h.system.start_value(f.index).filter(|_| f.addition.is_none()) {
            theta[range].fill(value.clamp(f.min, f.max));
        }
    }
    let Some(event) = h.system.schema().event.as_ref().map(|e| e.parameter) else { return theta };
    let rough = |group: Option<usize>| {
        let chosen = train.records().map(|r| &r.data).filter(|r| group.is_none_or(|g| r.group == g));
        median(&mut chosen.flat_map(|r| r.events.iter().map(|e| e.value)).collect::<Vec<_>>())
    };
    let overall = rough(None);
    for (f, range) in h.entries() {
        if f.index == event && overall > 0.0 {
            let is_grouped = range.len() > 1;
            for (group, value) in theta[range].iter_mut().enumerate() {
                let of_group = if is_grouped { rough(Some(group)) } else { overall };
                *value = if of_group > 0.0 { of_group } else { overall }.clamp(f.min, f.max);
            }
        }
    }
    theta
}
