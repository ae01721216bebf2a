//! Inputs and targets of the classes of the league: steps of the motion, or nothing but the trajectories themselves.

use super::{states, strides};
use crate::prepared::Prepared;
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::Settings;
use augsim_data::random_stream;
use rand_distr::{Distribution, Poisson};

/// Inputs and targets of a class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reads {
    /// Single steps of the motion, with `physics` as corrections of the physics' own. Each of `members` nets has a weight for each
    /// trajectory behind the features, drawn as a bootstrap draws it.
    Strides { physics: bool, members: usize },
    /// Strides of a push outright, with the rod's way in metres behind the features, for a model of the contact.
    Contacts,
    /// Whole trajectories in standard units, with `physics` beside its roll-out.
    States { physics: bool },
    /// The trajectories, which it is fitted to directly.
    Sequences,
}

impl Reads {
    /// Whether the physics takes part.
    pub fn physics(self) -> bool {
        match self {
            Reads::Strides { physics, .. } | Reads::States { physics } => physics,
            Reads::Contacts | Reads::Sequences => true,
        }
    }

    /// Width of a condition row.
    pub fn width(self, settings: &Settings) -> usize {
        match self {
            Reads::Strides { physics, members } => strides::width(settings, physics) + members,
            Reads::Contacts => strides::width(settings, false) + strides::RAW,
            Reads::States { physics } => states::width(settings, physics),
            Reads::Sequences => 0,
        }
    }

    /// Scales fitted on a training set.
    pub fn fit(self, settings: &Settings, train: &Sequences) -> Scales {
        match self {
            Reads::Strides { physics, .. } => strides::fit(settings, physics, train),
            Reads::Contacts => strides::fit(settings, false, train),
            Reads::States { physics } => states::fit(settings, physics, train),
            Reads::Sequences => Scales { mean: vec![], sd: vec![], step: vec![], correction: vec![] },
        }
    }

    /// Sizes of the scales: means, deviations, steps, corrections.
    pub fn scale_sizes(self, settings: &Settings, state: usize) -> [usize; 4] {
        match self {
            Reads::Strides { physics, .. } => strides::scale_sizes(settings, physics, state),
            Reads::Contacts => strides::scale_sizes(settings, false, state),
            Reads::States { physics } => states::scale_sizes(settings, physics, state),
            Reads::Sequences => [0; 4],
        }
    }

    /// Targets and conditions of a whole trajectory.
    pub fn prepare(self, settings: &Settings, scales: &Scales, q: &Sequence) -> Prepared {
        match self {
            Reads::Strides { physics, members } => {
                let plain = strides::prepare(settings, physics, scales, q);
                if members == 0 { plain } else { with_weights(plain, settings.seed, &q.id, members) }
            }
            Reads::Contacts => strides::prepare_contacts(settings, scales, q),
            Reads::States { physics } => states::prepare(settings, physics, scales, q),
            Reads::Sequences => Prepared { time: 1, x_width: 0, u_width: 0, x: vec![], u: vec![] },
        }
    }
}

/// Appends the weights of a trajectory to its conditions: how often each member's bootstrap draws it, which for many
/// trajectories is a Poisson number of mean 1.
fn with_weights(p: Prepared, seed: u64, id: &str, members: usize) -> Prepared {
    let mut rng = random_stream(seed, "bootstrap", u64::from(crc32fast::hash(id.as_bytes())));
    let weights: Vec<f32> = match Poisson::new(1.0_f64) {
        Ok(law) => (0..members).map(|_| law.sample(&mut rng) as f32).collect(),
        // The mean 1 is a valid one.
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
