//! Requests that would make more values than a limit allows.

use std::fmt;

/// A request that is too large, by the settings that make it so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Oversized {
    /// Forecasts with so many samples of each.
    Forecasts { samples: usize },
    /// Simulated trajectories with so many samples of each.
    Simulation { trajectories: usize, samples: usize },
    /// A generated set of so many trajectories.
    Trajectories { count: usize },
    /// A generated set of so many samples of each trajectory.
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
