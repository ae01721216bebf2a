//! Which recipes are classes of the league, and what follows from it.

use super::reads::Reads;
use super::{
    CALIBRATED, CONDITIONAL_VRNN, CONVEX_QUARTIC, CONVEX_QUARTIC_DRAWN, Class, ENSEMBLE, ENSEMBLE_RESIDUAL,
    FEED_FORWARD, FEED_FORWARD_RESIDUAL, GP_RESIDUAL, GP_RESIDUAL_MEAN, Kind, MIXTURE_RESIDUAL,
    PREDICTED_PARAMETERS, PREDICTED_PARAMETERS_ERROR, RECURRENT_RESIDUAL, RIGID_FLOW, VRNN,
};
use crate::recipe::Recipe;

impl Recipe {
    /// How a class of the league is built; none for the paper's nets and ours, which are in [`crate::nets`].
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

    /// Whether it learns the whole motion, and no physics takes part.
    pub fn is_blind(self) -> bool {
        match self.class() {
            Some(class) => !class.reads.physics(),
            None => matches!(self, Recipe::Neural | Recipe::NeuralPlus),
        }
    }

    /// Whether it can correct the rates of a system of equations.
    pub fn corrects_rates(self) -> bool {
        let strides = |class: &Class| matches!(class.reads, Reads::Strides { physics: true, .. });
        self == Recipe::HybridPlus || self.class().is_some_and(strides)
    }

    /// Whether it is made for an object and a rod.
    pub fn is_of_pushing(self) -> bool {
        self == Recipe::NeuralPlus || self.class().is_some_and(|class| class.pushing_only)
    }

    /// Whether it is fitted directly, in one iteration, and has no settings to try.
    pub fn is_fitted(self) -> bool {
        self.class().is_some_and(|class| matches!(class.kind, Kind::Fitted(_)))
    }
}
