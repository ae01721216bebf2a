//! Forecasts whose prediction bands are widened by a factor about their median.
//!
//! A model's errors along a trajectory are correlated from row to row, so its posterior is too narrow.
//! Assuming a larger measurement noise would widen it too, but would also discard information in the
//! prefix. A factor of the spread that was learned on training trajectories keeps it.

use super::prefix::{FilterSettings, Prefix, PrefixForecaster};
use crate::score::median_of;
use crate::{Samples, TrainerError};

/// A forecaster whose samples' distances from their median are multiplied by a factor.
#[derive(Clone, Copy)]
pub struct RescaledSpread<'a> {
    model: &'a dyn PrefixForecaster,
    /// Factor of the spread for each prefix length, in the order of the lengths.
    factors: &'a [f64],
}

impl<'a> RescaledSpread<'a> {
    /// Creates a forecaster that multiplies the samples' distances from their median by `factors`.
    /// `factors[i]` applies after the i-th prefix; the factor is 1 for prefixes beyond the end of the list.
    pub fn new(model: &'a dyn PrefixForecaster, factors: &'a [f64]) -> Self {
        RescaledSpread { model, factors }
    }
}

impl PrefixForecaster for RescaledSpread<'_> {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let mut forecasts = self.model.forecasts(prefix, lengths, settings)?;
        for (samples, factor) in forecasts.iter_mut().zip(self.factors) {
            let mut sorted = vec![0.0; samples.count];
            for values in samples.values.chunks_exact_mut(samples.count) {
                let median = median_of(values, &mut sorted) as f32;
                values.iter_mut().for_each(|v| *v = median + *factor as f32 * (*v - median));
            }
        }
        Ok(forecasts)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the median stays and distances from it grow by the factor, which is 1 if there is none.
    use super::*;
    use crate::filter::{InitialStatePrior, Sensor};

    /// Test forecaster with samples 0, 1, 3, 4 of one row after every prefix.
    struct FourSamples;

    impl PrefixForecaster for FourSamples {
        fn forecasts(
            &self,
            _: Prefix<'_>,
            lengths: &[usize],
            _: FilterSettings,
        ) -> Result<Vec<Samples>, TrainerError> {
            Ok(vec![Samples { count: 4, values: vec![0.0, 1.0, 3.0, 4.0] }; lengths.len()])
        }
    }

    #[test]
    fn samples_move_away_from_their_median() {
        let (sensor, start) =
            (Sensor::with_sd([1.0; 1]), InitialStatePrior { mean: vec![0.0], sd: vec![1.0] });
        let prefix = Prefix {
            id: "1",
            rows: &[0.0; 3],
            sensor: &sensor,
            start: &start,
            actions: &[],
            time: 4,
            index: 0,
        };
        let settings = FilterSettings::new(1, 1);
        let forecasts =
            RescaledSpread::new(&FourSamples, &[1.5, 0.5]).forecasts(prefix, &[1, 2, 3], settings).unwrap();
        let values: Vec<&[f32]> = forecasts.iter().map(|s| &s.values[..]).collect();
        assert_eq!(values, [[-1.0, 0.5, 3.5, 5.0], [1.0, 1.5, 2.5, 3.0], [0.0, 1.0, 3.0, 4.0]]);
    }
}
