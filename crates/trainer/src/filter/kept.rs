//! Forecasts that were made once, to be looked at in several ways.

use super::behind::{FilterSettings, Prefix, PrefixForecaster};
use super::evaluate::each_forecast;
use super::{Sensor, StartLaw};
use crate::{Samples, Sequences, TrainerError};

/// The forecasts of a model behind prefixes of a set. It forecasts these and no others.
#[derive(Debug, Clone)]
pub struct Kept {
    /// Rows seen and forecast, `[trajectory][prefix]`.
    behind: Vec<Vec<(usize, Samples)>>,
}

impl Kept {
    /// Forecasts `set` behind prefixes of `lengths [trajectory][prefix]` rows (ascending), as [`super::evaluate_filtered`] does.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run.
    pub fn of(
        model: &dyn PrefixForecaster,
        set: &Sequences,
        known: (&Sensor, &StartLaw),
        lengths: &[Vec<usize>],
        settings: FilterSettings,
    ) -> Result<Self, TrainerError> {
        let keep = |_: usize, n: usize, samples: Samples| (n, samples);
        Ok(Kept { behind: each_forecast(model, set, known, (lengths, settings), &keep)? })
    }
}

impl PrefixForecaster for Kept {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        _: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let own = self.behind.get(prefix.index as usize);
        let one = |n: &usize| {
            let kept = own.and_then(|own| own.iter().find(|(seen, _)| seen == n));
            let rule = "no forecast behind so many rows was kept";
            kept.map(|(_, samples)| samples.clone()).ok_or(TrainerError::Setting {
                key: "seen",
                value: n.to_string(),
                rule,
            })
        };
        lengths.iter().map(one).collect()
    }
}
