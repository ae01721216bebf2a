//! Model classes of the comparison.

use crate::args::LeagueScenario;
use augsim_trainer::Recipe;

/// A model class in the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entrant {
    /// The measured trajectories themselves, as a reference for violations by sensor noise.
    Data,
    /// Baseline that predicts zero or no motion: the error scale of the paper.
    Zero,
    /// The declared physics.
    Physics,
    /// The exact model that generated the drops.
    ExactDistribution,
    /// Gaussian processes of pushing in roll-out (GP-SUM without observations).
    GaussianProcess,
    /// A recipe of `train`.
    Trained(Recipe),
}

/// Returns the model classes of a scenario in the order of the table.
pub fn entrants(scenario: LeagueScenario) -> Vec<Entrant> {
    let push = scenario == LeagueScenario::Push;
    let mut out = vec![Entrant::Data, Entrant::Zero, Entrant::Physics];
    out.push(if push { Entrant::GaussianProcess } else { Entrant::ExactDistribution });
    let applies = |r: &Recipe| match r {
        Recipe::HybridStandardised => !push,
        Recipe::NeuralPlus => push,
        r => push || !r.supports_pushing_only(),
    };
    // Hybrid+ is last, below the models that it is compared with.
    let others = Recipe::all().filter(|r| *r != Recipe::HybridPlus).filter(applies);
    out.extend(others.chain([Recipe::HybridPlus]).map(Entrant::Trained));
    out
}
