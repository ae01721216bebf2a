//! From trajectories to what the nets read: targets and conditions per time step.

use crate::engine::{Engine, ModelPush};
use crate::prepared::Prepared;
use crate::push::features;
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::{Correction, Recipe, Settings};
use crate::{TrainerError, steps};

/// The translation between trajectories and the numbers that a net reads and gives, by the [`Correction`] of the settings.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Featuriser<'a> {
    /// Single steps are corrected, or states given outright.
    Step(Recipe, &'a Engine),
    /// The whole roll-out is corrected.
    Rollout(Recipe, &'a ModelPush),
}

impl<'a> Featuriser<'a> {
    /// That of a run.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if the engine has no roll-outs to correct.
    pub fn of(settings: &'a Settings) -> Result<Self, TrainerError> {
        Ok(match settings.rollouts()? {
            Some(push) => Featuriser::Rollout(settings.recipe, push),
            None => Featuriser::Step(settings.recipe, &settings.engine),
        })
    }

    /// Fits the scales on a training set.
    pub fn fit(self, train: &Sequences) -> Scales {
        match self {
            Featuriser::Step(_, engine) => steps::fit(engine, train),
            Featuriser::Rollout(recipe, push) => features::fit(recipe, push, train),
        }
    }

    /// Targets and conditions of a whole trajectory.
    pub fn prepare(self, scales: &Scales, q: &Sequence) -> Prepared {
        match self {
            Featuriser::Step(recipe, engine) => steps::prepare(recipe, engine, scales, q),
            Featuriser::Rollout(recipe, push) => features::prepare(recipe, push, scales, q),
        }
    }
}

/// Width of a condition row for states of `state` columns.
pub(crate) fn width(recipe: Recipe, correction: Correction, state: usize) -> usize {
    match correction {
        Correction::Step => steps::width(recipe, state),
        Correction::Rollout => features::width(recipe),
    }
}

/// Whether scales have the sizes that a run with these settings fits.
pub(crate) fn fits(scales: &Scales, recipe: Recipe, correction: Correction, state: usize) -> bool {
    let (read, step) = match correction {
        Correction::Step => (state, state),
        Correction::Rollout => (features::width(recipe), 0),
    };
    [scales.mean.len(), scales.sd.len(), scales.step.len(), scales.correction.len()]
        == [read, read, step, state]
}
