//! Kinds of inputs and targets of the classes in the benchmark league, with their widths, scales and rows.

use super::{strides, trajectories};
use crate::prepared::Prepared;
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::Settings;
use augsim_data::random_stream;
use rand_distr::{Distribution, Poisson};

/// Kind of inputs and targets of a class in the benchmark league.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ClassInputs {
    /// Single steps (for a push, short motions of the rod); with `physics` the targets are its corrections.
    ///
    /// Each row ends with one bootstrap weight of the trajectory per ensemble member.
    Steps { physics: bool, members: usize },
    /// Short motions of the rod in a push, without physics; each row ends with the rod's motion.
    PushStrides,
    /// Whole trajectories in standard units; the conditions contain the physics roll-out if `physics`.
    Trajectories { physics: bool },
    /// No prepared rows: the class is fitted to the trajectories directly.
    Unprepared,
}

impl ClassInputs {
    /// Whether the class uses physics.
    pub fn uses_physics(self) -> bool {
        match self {
            Self::Steps { physics, .. } | Self::Trajectories { physics } => physics,
            Self::PushStrides | Self::Unprepared => true,
        }
    }

    /// Returns the number of conditions (net inputs) per row.
    pub fn width(self, settings: &Settings) -> usize {
        match self {
            Self::Steps { physics, members } => strides::width(settings, physics) + members,
            Self::PushStrides => strides::width(settings, false) + strides::ROD_MOTION_WIDTH,
            Self::Trajectories { physics } => trajectories::width(settings, physics),
            Self::Unprepared => 0,
        }
    }

    /// Fits the normalisation scales on a training set.
    pub fn fit(self, settings: &Settings, train: &Sequences) -> Scales {
        match self {
            Self::Steps { physics, .. } => strides::fit(settings, physics, train),
            Self::PushStrides => strides::fit(settings, false, train),
            Self::Trajectories { physics } => trajectories::fit(settings, physics, train),
            Self::Unprepared => Scales { mean: vec![], sd: vec![], step: vec![], correction: vec![] },
        }
    }

    /// Number of values of each normalisation scale: mean, sd, step, correction.
    pub fn scale_sizes(self, settings: &Settings, state: usize) -> [usize; 4] {
        match self {
            Self::Steps { physics, .. } => strides::scale_sizes(settings, physics, state),
            Self::PushStrides => strides::scale_sizes(settings, false, state),
            Self::Trajectories { physics } => trajectories::scale_sizes(settings, physics, state),
            Self::Unprepared => [0; 4],
        }
    }

    /// Computes targets and conditions (net inputs) of a whole trajectory.
    pub fn prepare(self, settings: &Settings, scales: &Scales, q: &Sequence) -> Prepared {
        match self {
            Self::Steps { physics, members } => {
                let rows = strides::prepare(settings, physics, scales, q);
                if members == 0 { rows } else { append_weights(rows, settings.seed, &q.id, members) }
            }
            Self::PushStrides => strides::prepare_push_strides(settings, scales, q),
            Self::Trajectories { physics } => trajectories::prepare(settings, physics, scales, q),
            Self::Unprepared => Prepared { time: 1, x_width: 0, u_width: 0, x: vec![], u: vec![] },
        }
    }
}

/// Appends the bootstrap weights of a trajectory, one per ensemble member, to its conditions.
///
/// The weight is how often the member's bootstrap sample contains the trajectory: for many trajectories a
/// Poisson number of mean 1.
fn append_weights(p: Prepared, seed: u64, id: &str, members: usize) -> Prepared {
    let mut rng = random_stream(seed, "bootstrap", u64::from(crc32fast::hash(id.as_bytes())));
    let weights: Vec<f32> = match Poisson::new(1.0_f64) {
        Ok(poisson) => (0..members).map(|_| poisson.sample(&mut rng) as f32).collect(),
        // Unreachable, because the mean 1 is valid.
        Err(_) => vec![1.0; members],
    };
    let u_width = p.u_width + members;
    let mut u = Vec::with_capacity(p.time * u_width);
    for row in p.u.chunks_exact(p.u_width) {
        u.extend_from_slice(row);
        u.extend_from_slice(&weights);
    }
    Prepared { u_width, u, ..p }
}
