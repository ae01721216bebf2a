//! A cache of forecasts that were computed once, for several evaluations.

use super::evaluate::map_forecasts;
use super::prefix::{FilterSettings, Prefix, PrefixForecaster};
use super::{InitialStatePrior, Sensor};
use crate::{Samples, Sequences, TrainerError};

/// Stored forecasts of a model after the prefixes (first rows) of one set; other forecasts are refused.
#[derive(Debug, Clone)]
pub struct CachedForecasts {
    /// For each prefix of each trajectory, the number of observed rows and the forecast, `[trajectory][prefix]`.
    forecasts_by_prefix: Vec<Vec<(usize, Samples)>>,
}

impl CachedForecasts {
    /// Computes the forecasts for `set` as [`super::evaluate_filtered`] does.
    /// `lengths [trajectory][prefix]` are the ascending numbers of observed rows.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run.
    pub fn compute(
        model: &dyn PrefixForecaster,
        set: &Sequences,
        known: (&Sensor, &InitialStatePrior),
        lengths: &[Vec<usize>],
        settings: FilterSettings,
    ) -> Result<Self, TrainerError> {
        let keep = |_: usize, n: usize, samples: Samples| (n, samples);
        Ok(CachedForecasts {
            forecasts_by_prefix: map_forecasts(model, set, known, (lengths, settings), &keep)?,
        })
    }
}

impl PrefixForecaster for CachedForecasts {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        _: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let cached = self.forecasts_by_prefix.get(prefix.index as usize);
        let lookup = |n: &usize| {
            let forecast = cached.and_then(|cached| cached.iter().find(|(rows, _)| rows == n));
            let rule = "no forecast after this number of rows is in the cache";
            forecast.map(|(_, samples)| samples.clone()).ok_or(TrainerError::Setting {
                key: "seen",
                value: n.to_string(),
                rule,
            })
        };
        lengths.iter().map(lookup).collect()
    }
}

#[cfg(test)]
mod tests {
    //! Contract: cached forecasts equal those of the model, each is computed once, and others are refused.
    use super::*;
    use crate::Sequence;
    use crate::filter::{RescaledSpread, evaluate_filtered};
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A forecaster that counts its calls. It draws two samples: the last observed row, and 1 above it.
    struct CallCounter(AtomicUsize);

    impl PrefixForecaster for CallCounter {
        fn forecasts(
            &self,
            prefix: Prefix<'_>,
            lengths: &[usize],
            _: FilterSettings,
        ) -> Result<Vec<Samples>, TrainerError> {
            self.0.fetch_add(1, Ordering::Relaxed);
            let forecast_after = |&n: &usize| {
                let last = prefix.rows[n - 1] as f32;
                Samples { count: 2, values: [last, last + 1.0].repeat(prefix.time - n) }
            };
            Ok(lengths.iter().map(forecast_after).collect())
        }
    }

    #[test]
    fn cached_forecasts_equal_the_model_and_others_are_refused() {
        let item = |id: usize| Sequence {
            id: id.to_string(),
            time: 5,
            states: (0..5).map(|t| (10 * id + t) as f64).collect(),
            actions: Vec::new(),
        };
        let items = (0..3).map(item).collect();
        let set = Sequences { columns: vec!["x_m".to_owned()], action_columns: Vec::new(), items };
        let known = (&Sensor::exact(1), &InitialStatePrior { mean: vec![0.0], sd: vec![1.0] });
        let settings = FilterSettings { is_measured: true, ..FilterSettings::new(1, 1) };
        let (model, lengths) = (CallCounter(AtomicUsize::new(0)), vec![vec![2, 3]; 3]);
        let cached = CachedForecasts::compute(&model, &set, known, &lengths, settings).unwrap();
        let calls = model.0.load(Ordering::Relaxed);
        for factors in [[1.0, 1.0], [2.0, 3.0]] {
            let score = |model: &dyn PrefixForecaster| {
                evaluate_filtered(&RescaledSpread::new(model, &factors), &set, known, &lengths, settings)
                    .unwrap()
            };
            let cached_scores = score(&cached);
            assert_eq!(model.0.swap(calls, Ordering::Relaxed), calls, "the model was asked again");
            assert_eq!(cached_scores, score(&model));
            model.0.store(calls, Ordering::Relaxed);
        }
        let others = evaluate_filtered(&cached, &set, known, &vec![vec![4]; 3], settings);
        assert!(matches!(others, Err(TrainerError::Setting { key: "seen", .. })));
    }
}
