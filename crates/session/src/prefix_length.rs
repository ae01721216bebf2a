//! Length of the observed beginning (prefix) of a trajectory.

use std::fmt;

/// Length of the prefix of a trajectory that a filter observes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PrefixLength {
    /// Number of observed samples.
    Rows(usize),
    /// Observed duration, s from the first sample.
    Seconds(f64),
}

/// Rounding tolerance when times are compared with the length of a prefix, s.
const TIME_TOLERANCE_S: f64 = 1e-9;

impl PrefixLength {
    /// Number of samples that the prefix covers in a trajectory with these sample times, s.
    pub fn rows(self, times: &[f64]) -> usize {
        match self {
            PrefixLength::Rows(n) => n,
            PrefixLength::Seconds(s) => {
                let until = times.first().map_or(0.0, |t| t + s + TIME_TOLERANCE_S);
                times.iter().take_while(|t| **t <= until).count()
            }
        }
    }
}

impl fmt::Display for PrefixLength {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PrefixLength::Rows(n) => write!(f, "{n}"),
            PrefixLength::Seconds(s) => write!(f, "{s}s"),
        }
    }
}
