//! From trajectories to what the nets read: targets and conditions per time step.

use crate::engine::WrittenMotion;
use crate::engine::{Engine, ModelPush};
use crate::league::reads::Reads;
use crate::prepared::Prepared;
use crate::push::features;
use crate::rates::features as rates;
use crate::recipe::Recipe;
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::{Correction, Settings};
use crate::{TrainerError, steps};

/// The translation between trajectories and the numbers that a net reads and gives, by the [`Correction`] of the settings.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Featuriser<'a> {
    /// Single steps are corrected, or states given outright.
    Step(Recipe, &'a Engine),
    /// The whole roll-out is corrected.
    Rollout(Recipe, &'a ModelPush),
    /// Rates of equations are corrected.
    Rates(&'a WrittenMotion),
    /// A class of the league has readings of its own.
    Class(Reads, &'a Settings),
}

impl<'a> Featuriser<'a> {
    /// Gives the features that the net of a run reads.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if the engine has no roll-outs to correct.
    pub fn of(settings: &'a Settings) -> Result<Self, TrainerError> {
        if let Some(class) = settings.recipe.class() {
            return Ok(Featuriser::Class(class.reads, settings));
        }
        Ok(match (settings.rollouts()?, settings.engine.rates()) {
            (Some(push), _) => Featuriser::Rollout(settings.recipe, push),
            (None, Some(motion)) => Featuriser::Rates(motion),
            (None, None) => Featuriser::Step(settings.recipe, &settings.engine),
        })
    }

    /// Fits the scales on a training set.
    pub fn fit(self, train: &Sequences) -> Scales {
        match self {
            Featuriser::Step(_, engine) => steps::fit(engine, train),
            Featuriser::Rollout(recipe, push) => features::fit(recipe, push, train),
            Featuriser::Rates(motion) => rates::fit(motion, train),
            Featuriser::Class(reads, settings) => reads.fit(settings, train),
        }
    }

    /// Targets and conditions of a whole trajectory.
    pub fn prepare(self, scales: &Scales, q: &Sequence) -> Prepared {
        match self {
            Featuriser::Step(recipe, engine) => steps::prepare(recipe, engine, scales, q),
            Featuriser::Rollout(recipe, push) => features::prepare(recipe, push, scales, q),
            Featuriser::Rates(motion) => rates::prepare(motion, scales, q),
            Featuriser::Class(reads, settings) => reads.prepare(settings, scales, q),
        }
    }
}

/// Width of a condition row for states of `state` columns.
pub(crate) fn width(settings: &Settings, state: usize) -> usize {
    match (settings.recipe.class(), settings.correction) {
        (Some(class), _) => class.reads.width(settings),
        (None, Correction::Step) => steps::width(settings.recipe, &settings.engine, state),
        (None, Correction::Rates) => settings.engine.rates().map_or(0, rates::width),
        (None, Correction::Rollout) => features::width(settings.recipe),
    }
}

/// Whether scales have the sizes that a run with these settings fits.
pub(crate) fn fits(scales: &Scales, settings: &Settings, state: usize) -> bool {
    let expected = match (settings.recipe.class(), settings.correction) {
        (Some(class), _) => class.reads.scale_sizes(settings, state),
        (None, Correction::Step) => [state; 4],
        (None, Correction::Rates) => settings.engine.rates().map_or([0; 4], rates::scale_sizes),
        (None, Correction::Rollout) => {
            let read = features::width(settings.recipe);
            [read, read, 0, state]
        }
    };
    [scales.mean.len(), scales.sd.len(), scales.step.len(), scales.correction.len()] == expected
}
