//! Cause of the differences between records and runs of the augmented model, in the format of `result.json`.
//!
//! Autocorrelated errors of correlation time T are noise only if the records contain enough independent values of them: each of duration D contains
//! max(1, D / 2T). With fewer than the number of blocks, a missing effect that varies as slowly would look the same, and the score's blocks would share
//! errors.

use crate::result::{Discovery, Verdict};
use crate::score::BLOCKS;
use crate::sentence::{SMALL_SHARE, with_three_digits};
use serde::{Deserialize, Serialize};

/// Source of the residuals: measurement noise or process noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// White measurement noise.
    Sensor,
    /// Autocorrelated measurement noise.
    #[serde(rename = "lasting-sensor")]
    AutocorrelatedSensor,
    /// Process noise, beside measurement noise.
    #[serde(rename = "motion")]
    ProcessNoise,
}

/// Standard deviation of one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRow {
    /// Output, or state on whose rate process noise acts.
    pub name: String,
    /// Standard deviation, in `unit`.
    pub sd: f64,
    /// Unit (of the rate, for process noise); empty for a pure number.
    pub unit: String,
}

/// Noise model that explains the differences between records and runs of the augmented model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseCause {
    /// The best-supported source.
    #[serde(rename = "by")]
    pub source: NoiseSource,
    /// Standard deviations of the process noise by state, or of the autocorrelated errors by output.
    #[serde(rename = "lasting")]
    pub disturbances: Vec<NoiseRow>,
    /// Correlation time, s; 0 for noise that is independent from sample to sample.
    #[serde(rename = "memory_s")]
    pub correlation_time_s: f64,
    /// White measurement noise, by output.
    #[serde(rename = "readings")]
    pub white_noise: Vec<NoiseRow>,
}

impl NoiseCause {
    /// Sentence on the source; `None` for white measurement noise.
    pub fn sentence(&self) -> Option<String> {
        let describe = |r: &NoiseRow| {
            let unit = if r.unit.is_empty() { String::new() } else { format!(" {}", r.unit) };
            format!("{} {:.3e}{unit}", r.name, r.sd)
        };
        let rows = self.disturbances.iter().map(describe).collect::<Vec<_>>().join(", ");
        let correlation = match self.correlation_time_s > 0.0 {
            true => format!("with a correlation time of {:.3} s", self.correlation_time_s),
            false => "independent from sample to sample".to_owned(),
        };
        match self.source {
            NoiseSource::Sensor => None,
            NoiseSource::AutocorrelatedSensor => Some(format!(
                "the measurement noise is autocorrelated: standard deviation {rows}, {correlation}"
            )),
            NoiseSource::ProcessNoise => Some(format!(
                "the residuals look like process noise, or like an effect that the model lacks: noise on the rates of standard deviation \
                 {rows}, {correlation}"
            )),
        }
    }
}

impl NoiseCause {
    /// Number of independent values of the autocorrelated errors in records of these durations (s); infinite for white noise.
    fn independent_values(&self, durations_s: &[f64]) -> f64 {
        match self.correlation_time_s > 0.0 {
            true => {
                durations_s.iter().map(|duration| (duration / (2.0 * self.correlation_time_s)).max(1.0)).sum()
            }
            false => f64::INFINITY,
        }
    }

    /// Name of the noise that is left by a model that needs nothing more.
    fn remainder(&self) -> &'static str {
        match self.source {
            NoiseSource::Sensor => "only noise",
            NoiseSource::AutocorrelatedSensor => "only autocorrelated measurement noise",
            NoiseSource::ProcessNoise => "only process noise and measurement noise",
        }
    }

    /// Describes what is left by a model with this verdict if it is not noise.
    ///
    /// Process noise cannot be distinguished from the trace of a missing effect, so a model explains the data beside it only if `is_better`: the effects
    /// decrease the prediction error significantly.
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

    /// Describes errors that vary too slowly to be noise in records of these durations (s).
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

/// The verdict if the residuals vary too slowly to be noise.
fn with_slow_errors(verdict: Verdict) -> Verdict {
    match verdict {
        Verdict::NothingToAdd => Verdict::Unknown,
        Verdict::Explained => Verdict::PartlyExplained,
        other => other,
    }
}

impl Discovery {
    /// Adds the cause of the residuals, and takes it into account in verdict and sentence.
    ///
    /// `durations_s` are those of the records, s. If errors vary too slowly to be noise, the data have structure that no effect explains.
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
    //! Contract: the sentence gives size, unit and correlation time; there is none for white measurement
    //! noise.
    use super::*;

    fn row(name: &str, sd: f64, unit: &str) -> NoiseRow {
        NoiseRow { name: name.into(), sd, unit: unit.into() }
    }

    #[test]
    fn sentences_give_size_and_correlation_time() {
        let cause = |by, lasting, memory_s| NoiseCause {
            source: by,
            disturbances: lasting,
            correlation_time_s: memory_s,
            white_noise: vec![row("y_m", 1e-3, "m")],
        };
        assert_eq!(cause(NoiseSource::Sensor, Vec::new(), 0.0).sentence(), None);
        let pushed = cause(NoiseSource::ProcessNoise, vec![row("v_m_s", 0.036, "m/s^2")], 0.02).sentence();
        let pushed = pushed.expect("a sentence");
        assert!(pushed.contains("v_m_s 3.600e-2 m/s^2") && pushed.contains("time of 0.020 s"), "{pushed}");
        let autocorrelated =
            cause(NoiseSource::AutocorrelatedSensor, vec![row("y_m", 5e-3, "m")], 0.0).sentence();
        assert!(autocorrelated.is_some_and(|s| s.contains("y_m 5.000e-3 m") && s.contains("independent")));
    }

    #[test]
    fn slow_errors_are_not_noise() {
        let slow = |correlation_time_s: f64, durations_s: &[f64]| {
            let rows = vec![row("v_m_s", 1.0, "m/s^2")];
            let cause = NoiseCause {
                source: NoiseSource::ProcessNoise,
                disturbances: rows,
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
