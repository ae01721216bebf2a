//! Errors before and after as a table with intervals.

use crate::fit::{Fit, Sample, fit_nuisance};
use crate::forecast::{self, Errors};
use crate::hypothesis::Hypothesis;
use crate::result::{ErrorTable, FreeRun, Rmse};
use augsim_physics::system::{Schema, System};

/// Forecast errors of the same trajectories: as declared, calibrated, augmented, and what noise and scatter leave.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lists {
    declared: Errors,
    calibrated: Errors,
    augmented: Errors,
    floor: Errors,
}

impl Lists {
    /// On `test`, which the fits (calibrated, augmented) have not seen.
    pub fn of(test: &Sample<'_>, [base, best]: [&Fit; 2], seed: u64) -> Self {
        let nominal = Hypothesis::new(test.data, &[]).theta_start(0.0);
        let held = fit_nuisance(test, &best.hypothesis, &best.theta, &[]);
        Self {
            declared: forecast::errors(test, base, &nominal),
            calibrated: forecast::errors(test, base, &base.theta),
            augmented: forecast::errors(test, best, &best.theta),
            floor: forecast::floor(test, best, &held, seed),
        }
    }

    /// Root mean square errors of each trajectory, in the order of the sample: declared, augmented.
    pub fn by_trajectory(&self) -> Vec<[f64; 2]> {
        let of = |errors: &Errors, i: usize| forecast::rmse(&errors[i..=i]);
        (0..self.augmented.len()).map(|i| [of(&self.declared, i), of(&self.augmented, i)]).collect()
    }

    /// Adds the trajectories of another fold.
    pub fn extend(&mut self, other: Self) {
        self.declared.extend(other.declared);
        self.calibrated.extend(other.calibrated);
        self.augmented.extend(other.augmented);
        self.floor.extend(other.floor);
    }

    /// The table, in `unit`.
    pub fn table(&self, unit: &str, seed: u64, heldout_gain: f64) -> ErrorTable {
        let row =
            |e: &Errors| Rmse { rmse: forecast::rmse(e), ci95: forecast::bootstrap(&[e], seed, |r| r[0]) };
        let [calibrated, augmented, noise_floor] = [&self.calibrated, &self.augmented, &self.floor].map(row);
        ErrorTable {
            unit: unit.into(),
            heldout_trajectories: self.declared.len(),
            folds: None,
            declared: row(&self.declared),
            calibrated,
            augmented,
            noise_floor,
            reduction: Rmse {
                rmse: calibrated.rmse - augmented.rmse,
                ci95: forecast::bootstrap(&[&self.calibrated, &self.augmented], seed, |r| r[0] - r[1]),
            },
            explained_share: ErrorTable::explained(calibrated.rmse, augmented.rmse, noise_floor.rmse),
            heldout_gain,
            free_run: None,
        }
    }
}

impl FreeRun {
    /// The errors of free runs of the calibrated and of the augmented model; `None` where there are none.
    pub(crate) fn of(system: &dyn System, calibrated: Option<f64>, augmented: Option<f64>) -> Option<Self> {
        let unit = match &system.schema().channels[..] {
            [one] => one.unit.clone(),
            _ => String::new(),
        };
        let finite = |error: Option<f64>| error.filter(|e| e.is_finite());
        augmented.map(|_| Self { unit, calibrated: finite(calibrated), augmented: finite(augmented) })
    }
}

/// Unit and channels of the measure that decides: the first of the schema.
pub(crate) fn measured_in(schema: &Schema) -> (String, Vec<usize>) {
    let channels = schema.measures.first().map_or(Vec::new(), |m| m.channels.clone());
    let first = channels.first().and_then(|&c| schema.channels.get(c));
    (first.map_or(String::new(), |c| c.unit.clone()), channels)
}
