//! Requests that would produce more values than a limit allows.

use std::fmt;

/// The settings that make a request too large.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Oversized {
    /// Number of samples of each forecast.
    Forecasts { samples: usize },
    /// Number of simulated trajectories, and of samples (draws) of each.
    Simulation { trajectories: usize, samples: usize },
    /// Number of trajectories of a generated data set.
    Trajectories { count: usize },
    /// Number of samples of each trajectory of a generated data set.
    Samples { count: usize },
}

impl fmt::Display for Oversized {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Oversized::Forecasts { samples } => write!(f, "--samples {samples}: each forecast"),
            Oversized::Simulation { trajectories, samples } => {
                write!(f, "{trajectories} trajectories of {samples} samples: it")
            }
            Oversized::Trajectories { count } => write!(f, "trajectories = {count}: the set"),
            Oversized::Samples { count } => write!(f, "samples = {count}: the set"),
        }
    }
}
