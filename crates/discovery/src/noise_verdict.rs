//! Adapts the verdict of a result to the kind of noise that causes the residuals.
//!
//! Autocorrelated errors of correlation time T are noise only if the records contain enough independent values of them: each of duration D contains
//! max(1, D / 2T). With fewer than the number of blocks, a missing effect that varies as slowly would look the same, and the score's blocks would share
//! errors.

use crate::estimate::with_three_digits;
use crate::noise_cause::{NoiseCause, NoiseSource};
use crate::result::{Discovery, Verdict};
use crate::score::BLOCKS;
use crate::sentence::SMALL_SHARE;

impl NoiseCause {
    /// Number of independent values of the autocorrelated errors in records of these durations, s. Infinite
    /// for noise that is independent from sample to sample.
    fn independent_values(&self, durations_s: &[f64]) -> f64 {
        match self.correlation_time_s > 0.0 {
            true => {
                durations_s.iter().map(|duration| (duration / (2.0 * self.correlation_time_s)).max(1.0)).sum()
            }
            false => f64::INFINITY,
        }
    }

    /// Text that names the noise left by a model that needs no further effect.
    fn remainder(&self) -> &'static str {
        match self.source {
            NoiseSource::Sensor => "only noise",
            NoiseSource::AutocorrelatedSensor => "only autocorrelated measurement noise",
            NoiseSource::ProcessNoise => "only process noise and measurement noise",
        }
    }

    /// Describes structure in the residuals of a model with this verdict; `None` if they are only noise.
    ///
    /// Process noise cannot be distinguished from the trace of a missing effect. A model with process noise
    /// therefore explains the data only if `is_better`: the effects decrease the prediction error
    /// significantly.
    fn structure(&self, durations_s: &[f64], verdict: Verdict, is_better: bool) -> Option<String> {
        let is_doubtful =
            verdict == Verdict::Explained && self.source == NoiseSource::ProcessNoise && !is_better;
        self.slow_errors(durations_s).or_else(|| {
            is_doubtful.then(|| {
                "the residuals look like process noise or the trace of something else that the model lacks, and the prediction error does not \
                 decrease significantly"
                    .to_owned()
            })
        })
    }

    /// Describes residuals that vary too slowly to be noise in records of these durations, s; `None`
    /// otherwise.
    fn slow_errors(&self, durations_s: &[f64]) -> Option<String> {
        let values = self.independent_values(durations_s);
        (values < BLOCKS as f64).then(|| {
            format!(
                "the residuals vary with a correlation time of {} s, so slowly that the data contain only {values:.0} independent values of \
                 them: that is not noise, but something that the model lacks or that differs between the recordings",
                with_three_digits(self.correlation_time_s)
            )
        })
    }
}

/// Weakens a verdict because the residuals vary too slowly to be noise.
fn with_slow_errors(verdict: Verdict) -> Verdict {
    match verdict {
        Verdict::NothingToAdd => Verdict::Unknown,
        Verdict::Explained => Verdict::PartlyExplained,
        other => other,
    }
}

impl Discovery {
    /// Stores the kind of noise that causes the residuals, and adapts verdict and sentence to it.
    ///
    /// `durations_s` are the durations of the records, s. If errors vary too slowly to be noise, the data
    /// have structure that no effect explains.
    pub fn set_noise_cause(&mut self, cause: NoiseCause, durations_s: &[f64]) {
        let is_better = self.error.reduction.ci95[0] > 0.0;
        let structure = cause.structure(durations_s, self.verdict, is_better);
        let verdict = self.verdict;
        // As small as an effect that the sentence calls small: the small error of a form of friction, for example, that adds up in an angle.
        let is_small = verdict == Verdict::Explained
            && self.error.augmented.rmse <= SMALL_SHARE * self.error.calibrated.rmse;
        if let Some(structure) = structure.as_ref().filter(|_| !is_small) {
            self.verdict = with_slow_errors(verdict);
            self.tests.pass = false;
            match verdict {
                Verdict::NothingToAdd => {
                    self.sentence = format!("The library does not explain the data: {structure}.");
                }
                Verdict::Explained => {
                    self.sentence += &format!(" This explains only part of the data: {structure}.")
                }
                _ => {}
            }
        } else if verdict == Verdict::NothingToAdd {
            self.sentence = self.sentence.replace("only noise", cause.remainder());
        }
        self.notes.extend(cause.sentence());
        self.noise_cause = Some(cause);
    }
}

#[cfg(test)]
mod tests {
    //! Contract: errors with fewer independent values than blocks are no noise, and process noise explains only beside effects that improve predictions.
    use super::*;

    #[test]
    fn slow_errors_are_not_noise() {
        let slow = |correlation_time_s: f64, durations_s: &[f64]| {
            let cause = NoiseCause {
                source: NoiseSource::ProcessNoise,
                disturbances: Vec::new(),
                correlation_time_s,
                white_noise: Vec::new(),
            };
            cause.slow_errors(durations_s)
        };
        // Eight records of 10 s: 8 * 10 / (2 * 2.4) = 16.7 independent values, and 15.4 with 2.6 s.
        assert_eq!(slow(2.4, &[10.0; 8]), None);
        assert!(slow(2.6, &[10.0; 8]).is_some_and(|text| text.contains("only 15 independent values")));
        // An offset that lasts whole records has one value in each.
        assert!(slow(1e6, &[10.0; 15]).is_some());
        assert_eq!(slow(1e6, &[10.0; 16]), None);
        assert_eq!(slow(0.0, &[1.0]), None);
        let cause = |by| NoiseCause {
            source: by,
            disturbances: Vec::new(),
            correlation_time_s: 0.0,
            white_noise: Vec::new(),
        };
        let left = |by, is_better| cause(by).structure(&[1.0], Verdict::Explained, is_better).is_some();
        assert!(left(NoiseSource::ProcessNoise, false));
        assert!(!left(NoiseSource::ProcessNoise, true) && !left(NoiseSource::Sensor, false));
        let verdicts = [Verdict::NothingToAdd, Verdict::Explained, Verdict::Unknown].map(with_slow_errors);
        assert_eq!(verdicts, [Verdict::Unknown, Verdict::PartlyExplained, Verdict::Unknown]);
    }
}
