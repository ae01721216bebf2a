//! The declared model, fitted: where every search begins.

use crate::fit::{ChosenRecords, Fit, fit};
use crate::hypothesis::Hypothesis;
use crate::statistics::median;

/// The declared model fitted.
pub(crate) fn calibrate(train: &ChosenRecords<'_>) -> Fit {
    let h = Hypothesis::new(train.data, &[]);
    fit(train, &h, &calibration_start(train, &h), &[])
}

/// Nominal values, with the parameter of the events (of each group, where it has its own) at the median of its rough values.
pub(crate) fn calibration_start(train: &ChosenRecords<'_>, h: &Hypothesis) -> Vec<f64> {
    let mut theta = h.theta_start(0.0);
    let mut at = 0;
    for f in &h.free {
        let width = h.width(f);
        if let Some(value) = h.system.fit_from(f.index).filter(|_| f.addition.is_none()) {
            theta[at..at + width].fill(value.clamp(f.min, f.max));
        }
        at += width;
    }
    let Some(event) = h.system.schema().event.as_ref().map(|e| e.parameter) else { return theta };
    let rough = |group: Option<usize>| {
        let chosen = train.records().map(|r| &r.seen).filter(|r| group.is_none_or(|g| r.group == g));
        median(&mut chosen.flat_map(|r| r.events.iter().map(|e| e.value)).collect::<Vec<_>>())
    };
    let all = rough(None);
    let mut at = 0;
    for f in &h.free {
        let width = h.width(f);
        if f.index == event && all > 0.0 {
            for (group, value) in theta[at..at + width].iter_mut().enumerate() {
                let own = if width > 1 { rough(Some(group)) } else { all };
                *value = if own > 0.0 { own } else { all }.clamp(f.min, f.max);
            }
        }
        at += width;
    }
    theta
}
