//! Who takes part.

use crate::args::LeagueScenario;
use augsim_trainer::Recipe;

/// A model class in the league.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entrant {
    /// The measured trajectories themselves: what sensors alone violate.
    Data,
    /// The paper's scale of errors: zero, or that nothing moves.
    Nothing,
    /// The declared physics.
    Physics,
    /// The law that made the drops.
    Law,
    /// Gaussian processes of pushing, rolled out (GP-SUM without observations).
    GaussianProcess,
    /// A recipe of `train`.
    Trained(Recipe),
}

/// The entrants of a scenario, in the order of the table.
pub fn entrants(scenario: LeagueScenario) -> Vec<Entrant> {
    let push = scenario == LeagueScenario::Push;
    let mut out = vec![Entrant::Data, Entrant::Nothing, Entrant::Physics];
    out.push(if push { Entrant::GaussianProcess } else { Entrant::Law });
    let fits = |r: &Recipe| match r {
        Recipe::HybridStandardised => !push,
        Recipe::NeuralPlus => push,
        r => push || !r.is_of_pushing(),
    };
    // Hybrid+ stands last, below what it is compared with.
    let others = Recipe::all().filter(|r| *r != Recipe::HybridPlus).filter(fits);
    out.extend(others.chain([Recipe::HybridPlus]).map(Entrant::Trained));
    out
}
