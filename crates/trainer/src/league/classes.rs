//! Maps recipes to classes of the benchmark league, and answers questions that depend on the class.

use super::inputs::ClassInputs;
use super::{
    CALIBRATED, CONDITIONAL_VRNN, CONVEX_QUARTIC, CONVEX_QUARTIC_DRAWN, Class, ENSEMBLE, ENSEMBLE_RESIDUAL,
    FEED_FORWARD, FEED_FORWARD_RESIDUAL, GP_RESIDUAL, GP_RESIDUAL_MEAN, Kind, MIXTURE_RESIDUAL,
    PREDICTED_PARAMETERS, PREDICTED_PARAMETERS_ERROR, RECURRENT_RESIDUAL, RIGID_FLOW, VRNN,
};
use crate::recipe::Recipe;

impl Recipe {
    /// Class of the recipe in the benchmark league; `None` for the nets in [`crate::nets`].
    pub(crate) fn class(self) -> Option<&'static Class> {
        Some(match self {
            Recipe::PhysicsCalibrated => &CALIBRATED,
            Recipe::FeedForward => &FEED_FORWARD,
            Recipe::FeedForwardResidual => &FEED_FORWARD_RESIDUAL,
            Recipe::RecurrentResidual => &RECURRENT_RESIDUAL,
            Recipe::MixtureResidual => &MIXTURE_RESIDUAL,
            Recipe::Ensemble => &ENSEMBLE,
            Recipe::EnsembleResidual => &ENSEMBLE_RESIDUAL,
            Recipe::Vrnn => &VRNN,
            Recipe::ConditionalVrnn => &CONDITIONAL_VRNN,
            Recipe::PredictedParameters => &PREDICTED_PARAMETERS,
            Recipe::PredictedParametersError => &PREDICTED_PARAMETERS_ERROR,
            Recipe::GpResidual => &GP_RESIDUAL,
            Recipe::GpResidualMean => &GP_RESIDUAL_MEAN,
            Recipe::ConvexQuartic => &CONVEX_QUARTIC,
            Recipe::ConvexQuarticDrawn => &CONVEX_QUARTIC_DRAWN,
            Recipe::RigidFlow => &RIGID_FLOW,
            Recipe::Neural
            | Recipe::Hybrid
            | Recipe::HybridStandardised
            | Recipe::HybridPlus
            | Recipe::NeuralPlus => return None,
        })
    }

    /// Whether the recipe's model uses no physics.
    pub fn is_without_physics(self) -> bool {
        match self.class() {
            Some(class) => !class.inputs.uses_physics(),
            None => matches!(self, Recipe::Neural | Recipe::NeuralPlus),
        }
    }

    /// Whether the recipe can correct the rates of a system of equations.
    pub fn corrects_rates(self) -> bool {
        let corrects_steps = |class: &Class| matches!(class.inputs, ClassInputs::Steps { physics: true, .. });
        self == Recipe::HybridPlus || self.class().is_some_and(corrects_steps)
    }

    /// Whether the recipe supports pushing only.
    pub fn supports_pushing_only(self) -> bool {
        self == Recipe::NeuralPlus || self.class().is_some_and(|class| class.is_pushing_only)
    }

    /// Whether the recipe is fitted directly in one iteration, so that it has no hyperparameters to tune.
    pub fn is_fitted(self) -> bool {
        self.class().is_some_and(|class| matches!(class.kind, Kind::Fitted(_)))
    }
}
