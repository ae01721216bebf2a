//! Conversion of trajectories into the targets and conditions per time step that the nets read.

use crate::engine::EquationMotion;
use crate::engine::{Engine, ModelPush};
use crate::league::inputs::ClassInputs;
use crate::prepared::Prepared;
use crate::push::features;
use crate::rates::features as rates;
use crate::recipe::Recipe;
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::{Correction, Settings};
use crate::{TrainerError, steps};

/// Converts trajectories into net inputs and targets, as the [`Correction`] of the settings asks.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Featuriser<'a> {
    /// Conversion for nets that correct single physics steps or predict states directly (recipe, engine).
    Step(Recipe, &'a Engine),
    /// Conversion for nets that correct the whole physics roll-out of a push.
    Rollout(Recipe, &'a ModelPush),
    /// Conversion for nets that correct the rates (time derivatives) of a system of equations.
    Rates(&'a EquationMotion),
    /// Conversion for a model class of the benchmark league, which defines its own inputs and targets.
    Class(ClassInputs, &'a Settings),
}

impl<'a> Featuriser<'a> {
    /// Chooses the conversion for the settings of a run.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if roll-outs are to be corrected and the engine is not one of pushing.
    pub fn for_settings(settings: &'a Settings) -> Result<Self, TrainerError> {
        if let Some(class) = settings.recipe.class() {
            return Ok(Featuriser::Class(class.inputs, settings));
        }
        Ok(match (settings.rollouts()?, settings.engine.rate_model()) {
            (Some(push), _) => Featuriser::Rollout(settings.recipe, push),
            (None, Some(motion)) => Featuriser::Rates(motion),
            (None, None) => Featuriser::Step(settings.recipe, &settings.engine),
        })
    }

    /// Fits the normalisation scales of inputs and targets on a training set.
    pub fn fit(self, train: &Sequences) -> Scales {
        match self {
            Featuriser::Step(_, engine) => steps::fit(engine, train),
            Featuriser::Rollout(recipe, push) => features::fit(recipe, push, train),
            Featuriser::Rates(motion) => rates::fit(motion, train),
            Featuriser::Class(inputs, settings) => inputs.fit(settings, train),
        }
    }

    /// Computes the targets and the conditions (net inputs) of a whole trajectory.
    pub fn prepare(self, scales: &Scales, q: &Sequence) -> Prepared {
        match self {
            Featuriser::Step(recipe, engine) => steps::prepare(recipe, engine, scales, q),
            Featuriser::Rollout(recipe, push) => features::prepare(recipe, push, scales, q),
            Featuriser::Rates(motion) => rates::prepare(motion, scales, q),
            Featuriser::Class(inputs, settings) => inputs.prepare(settings, scales, q),
        }
    }
}

/// Returns the number of net inputs per time step (condition row) for states of `state` columns.
pub(crate) fn width(settings: &Settings, state: usize) -> usize {
    match (settings.recipe.class(), settings.correction) {
        (Some(class), _) => class.inputs.width(settings),
        (None, Correction::Step) => steps::width(settings.recipe, &settings.engine, state),
        (None, Correction::Rates) => settings.engine.rate_model().map_or(0, rates::width),
        (None, Correction::Rollout) => features::width(settings.recipe),
    }
}

/// Checks whether saved scales have the sizes that a run with these settings would fit.
pub(crate) fn fits(scales: &Scales, settings: &Settings, state: usize) -> bool {
    let expected = match (settings.recipe.class(), settings.correction) {
        (Some(class), _) => class.inputs.scale_sizes(settings, state),
        (None, Correction::Step) => [state; 4],
        (None, Correction::Rates) => settings.engine.rate_model().map_or([0; 4], rates::scale_sizes),
        (None, Correction::Rollout) => {
            let inputs = features::width(settings.recipe);
            [inputs, inputs, 0, state]
        }
    };
    [scales.mean.len(), scales.sd.len(), scales.step.len(), scales.correction.len()] == expected
}
