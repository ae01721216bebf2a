//! Cause of the differences between records and runs of the augmented model, in the format of `result.json`.

use serde::{Deserialize, Serialize};

/// Kind of noise that causes the residuals of the augmented model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// White measurement noise only.
    Sensor,
    /// Autocorrelated measurement noise, beside white measurement noise.
    #[serde(rename = "lasting-sensor")]
    AutocorrelatedSensor,
    /// Process noise in the rates of states, beside white measurement noise.
    #[serde(rename = "motion")]
    ProcessNoise,
}

/// Standard deviation of the noise of one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRow {
    /// Name of the noisy output, or of the state whose rate process noise disturbs.
    pub name: String,
    /// Standard deviation of the noise, in `unit`.
    pub sd: f64,
    /// Unit of the standard deviation (of the rate, for process noise); empty for a pure number.
    pub unit: String,
}

/// Noise model that explains the differences between records and runs of the augmented model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseCause {
    /// Kind of noise that the data support best.
    #[serde(rename = "by")]
    pub source: NoiseSource,
    /// Standard deviations of the process noise by state, or of the autocorrelated measurement errors by
    /// output.
    #[serde(rename = "lasting")]
    pub disturbances: Vec<NoiseRow>,
    /// Correlation time of the process noise or autocorrelated errors, s; 0 for noise independent from sample
    /// to sample.
    #[serde(rename = "memory_s")]
    pub correlation_time_s: f64,
    /// Standard deviations of the white measurement noise, by output.
    #[serde(rename = "readings")]
    pub white_noise: Vec<NoiseRow>,
}

impl NoiseCause {
    /// Sentence on the kind of noise, for the notes of a result; `None` for white measurement noise.
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
}
