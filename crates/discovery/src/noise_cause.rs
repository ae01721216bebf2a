//! Noise by which records differ from runs of a model, as a result has it.

use serde::{Deserialize, Serialize};

/// Cause by which readings differ from runs of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShakenBy {
    /// The sensor alone, each reading for itself.
    Sensor,
    /// The sensor, whose errors last from reading to reading.
    LastingSensor,
    /// Pushes on the motion beside the sensor's noise.
    Motion,
}

/// Standard deviation of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRow {
    /// Output, or state whose rate is pushed.
    pub name: String,
    /// Standard deviation, in the unit.
    pub sd: f64,
    /// Unit; of a rate, where a state is pushed; empty for a pure number.
    pub unit: String,
}

/// Noise by which records differ from runs of the augmented model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseCause {
    /// The likeliest cause.
    pub by: ShakenBy,
    /// Numbers that wander: pushes on rates, or lasting errors of outputs.
    pub lasting: Vec<NoiseRow>,
    /// Seconds over which they wander; 0 where they are anew with every sample.
    pub memory_s: f64,
    /// Noise of each reading for itself, by output.
    pub readings: Vec<NoiseRow>,
}

impl NoiseCause {
    /// The cause in a sentence, where it is more than a sensor whose readings err each for itself.
    pub fn sentence(&self) -> Option<String> {
        let row = |r: &NoiseRow| {
            let unit = if r.unit.is_empty() { String::new() } else { format!(" {}", r.unit) };
            format!("{} by {:.3e}{unit}", r.name, r.sd)
        };
        let rows = self.lasting.iter().map(row).collect::<Vec<_>>().join(", ");
        let lasts = match self.memory_s > 0.0 {
            true => format!("for some {:.3} s at a time", self.memory_s),
            false => "anew with every sample".to_owned(),
        };
        match self.by {
            ShakenBy::Sensor => None,
            ShakenBy::LastingSensor => {
                Some(format!("errors of the sensor last: {rows} (standard deviation), {lasts}"))
            }
            ShakenBy::Motion => Some(format!(
                "the motion has noise of its own, or follows a law that is not in the model: rates are pushed, {rows} (standard \
                 deviation), {lasts}"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a sentence gives size, unit and time of what wanders, and there is none for a sensor that simply errs.
    use super::*;

    #[test]
    fn sentences_say_how_much_and_for_how_long() {
        let row = |name: &str, sd, unit: &str| NoiseRow { name: name.into(), sd, unit: unit.into() };
        let cause = |by, lasting, memory_s| NoiseCause {
            by,
            lasting,
            memory_s,
            readings: vec![row("y_m", 1e-3, "m")],
        };
        assert_eq!(cause(ShakenBy::Sensor, Vec::new(), 0.0).sentence(), None);
        let pushed = cause(ShakenBy::Motion, vec![row("v_m_s", 0.036, "m/s^2")], 0.02).sentence();
        let pushed = pushed.expect("a sentence");
        assert!(
            pushed.contains("v_m_s by 3.600e-2 m/s^2") && pushed.contains("0.020 s at a time"),
            "{pushed}"
        );
        let lasting = cause(ShakenBy::LastingSensor, vec![row("y_m", 5e-3, "m")], 0.0).sentence();
        assert!(lasting.is_some_and(|s| s.contains("y_m by 5.000e-3 m") && s.contains("anew")));
    }
}
