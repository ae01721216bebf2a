//! How much of the beginning of a trajectory is seen.

use std::fmt;

/// The length of a prefix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// A number of samples.
    Rows(usize),
    /// Seconds from the first sample.
    Seconds(f64),
}

/// Times that are equal but for rounding, s.
const SAME_S: f64 = 1e-9;

impl Seen {
    /// Samples of a trajectory with these times that are seen.
    pub fn rows(self, times: &[f64]) -> usize {
        match self {
            Seen::Rows(n) => n,
            Seen::Seconds(s) => {
                let until = times.first().map_or(0.0, |t| t + s + SAME_S);
                times.iter().take_while(|t| **t <= until).count()
            }
        }
    }
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Seen::Rows(n) => write!(f, "{n}"),
            Seen::Seconds(s) => write!(f, "{s}s"),
        }
    }
}
