//! Model classes of the league, the comparison of all model classes.

use crate::args::LeagueScenario;
use augsim_trainer::Recipe;

/// A model class or baseline in the league.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entrant {
    /// The measured trajectories themselves: shows which physics violations come from sensor noise.
    Data,
    /// Baseline that predicts zero (balls) or no motion (pushes); the paper relates errors to it.
    Zero,
    /// The declared physics without training.
    Physics,
    /// The exact distribution from which the drops were generated.
    ExactDistribution,
    /// Gaussian processes of pushing in roll-out (GP-SUM without observations).
    GaussianProcess,
    /// A model class that `train` can train.
    Trained(Recipe),
}

/// Returns the model classes and baselines of a scenario in the order of the table.
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
