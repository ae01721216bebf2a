//! The recipes: all model classes that `augsim train` offers, by name.

use serde::{Deserialize, Serialize};

/// Model class to be trained, with its inputs and targets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recipe {
    /// DCVRNN (decoupled conditional variational recurrent net) without physics, conditioned on the initial
    /// state s_0.
    Neural,
    /// DCVRNN, conditioned on the initial state s_0 and the physics roll-out from it.
    Hybrid,
    /// Hybrid (DCVRNN with physics roll-out) on standardised states and conditions, with a faster learning rate.
    HybridStandardised,
    /// Hybrid+: a net corrects physics step by step, with one latent per trajectory and learned deviations.
    HybridPlus,
    /// The net of Hybrid+ without physics, for pushes: an ablation that shows the benefit of the physics.
    NeuralPlus,
    /// Physics calibrated by least squares, with a noise variance that grows with the distance travelled.
    PhysicsCalibrated,
    /// A perceptron that predicts the next state.
    FeedForward,
    /// A perceptron that corrects a physics step.
    FeedForwardResidual,
    /// A recurrent net that corrects a physics step, with a learned standard deviation.
    RecurrentResidual,
    /// A recurrent net that corrects a physics step, by a mixture of five Gaussians.
    MixtureResidual,
    /// Ensemble of five probabilistic perceptrons that predict the next state (PETS).
    Ensemble,
    /// Ensemble of five probabilistic perceptrons that correct a physics step.
    EnsembleResidual,
    /// The variational recurrent net (VRNN) of Chung et al. 2015, without condition.
    Vrnn,
    /// The variational recurrent net (VRNN) of Chung et al. 2015, conditioned on the physics roll-out.
    ConditionalVrnn,
    /// A net that predicts the parameters of the contact model (Kloss et al. 2017), for pushes.
    PredictedParameters,
    /// A net that predicts the parameters of the contact model, and an additive error; for pushes.
    PredictedParametersError,
    /// Gaussian processes for the residual of the contact model (Fazeli et al. 2017), as samples; for pushes.
    GpResidual,
    /// Gaussian processes for the residual of the contact model, as mean only; for pushes.
    GpResidualMean,
    /// The contact model with a convex quartic limit surface (Zhou et al. 2016), for pushes.
    ConvexQuartic,
    /// The contact model with a random convex quartic limit surface per roll-out (Zhou et al. 2017), for pushes.
    ConvexQuarticDrawn,
    /// SE3-Nets: points are assigned softly to moving rigid bodies (Byravan and Fox 2017), for pushes.
    RigidFlow,
}

/// Names and one-line description of a recipe, a row of the table of recipes.
struct Entry {
    recipe: Recipe,
    /// Name of the recipe on the command line and in files.
    name: &'static str,
    /// Name of the recipe in tables.
    label: &'static str,
    /// One-line description of the recipe for help texts.
    about: &'static str,
}

const fn entry(recipe: Recipe, [name, label, about]: [&'static str; 3]) -> Entry {
    Entry { recipe, name, label, about }
}

/// All recipes, in the order of the variants, so that a variant is its own index.
static RECIPES: [Entry; 21] = [
    entry(Recipe::Neural, ["neural", "Neural", "DCVRNN without physics"]),
    entry(Recipe::Hybrid, ["hybrid", "Hybrid", "DCVRNN on the physics roll-out, as published"]),
    entry(
        Recipe::HybridStandardised,
        ["hybrid-standardised", "Hybrid-std", "Hybrid on standardised states: lowest reconstruction error"],
    ),
    entry(
        Recipe::HybridPlus,
        ["hybrid-plus", "Hybrid+", "Physics step by step, one latent per trajectory, learned deviations"],
    ),
    entry(Recipe::NeuralPlus, ["neural-plus", "Neural+", "The net of Hybrid+ without physics, for pushes"]),
    entry(
        Recipe::PhysicsCalibrated,
        [
            "physics-calibrated",
            "Calibrated",
            "Physics fitted by least squares, with noise that grows with the distance travelled",
        ],
    ),
    entry(Recipe::FeedForward, ["feed-forward", "FF", "Perceptron that predicts the next state"]),
    entry(
        Recipe::FeedForwardResidual,
        ["feed-forward-residual", "FF residual", "Perceptron that corrects a physics step"],
    ),
    entry(
        Recipe::RecurrentResidual,
        ["recurrent-residual", "GRU residual", "Recurrent net without latent that corrects a physics step"],
    ),
    entry(
        Recipe::MixtureResidual,
        ["mixture-residual", "MDN residual", "Recurrent-residual with a mixture of five Gaussians"],
    ),
    entry(
        Recipe::Ensemble,
        ["ensemble", "PETS", "Five probabilistic perceptrons, trajectory sampling (PETS)"],
    ),
    entry(
        Recipe::EnsembleResidual,
        ["ensemble-residual", "PETS residual", "PETS ensemble that corrects a physics step"],
    ),
    entry(Recipe::Vrnn, ["vrnn", "VRNN", "Variational recurrent net (Chung et al. 2015) without condition"]),
    entry(Recipe::ConditionalVrnn, ["conditional-vrnn", "CVRNN", "VRNN conditioned on the physics roll-out"]),
    entry(
        Recipe::PredictedParameters,
        [
            "predicted-parameters",
            "Kloss",
            "Net that predicts the inputs of the contact model (Kloss et al. 2017), for pushes",
        ],
    ),
    entry(
        Recipe::PredictedParametersError,
        [
            "predicted-parameters-error",
            "Kloss+error",
            "Predicted-parameters with an additive learned error, for pushes",
        ],
    ),
    entry(
        Recipe::GpResidual,
        [
            "gp-residual",
            "GP residual",
            "Gaussian processes for the residual of the contact model (Fazeli et al. 2017), for pushes",
        ],
    ),
    entry(
        Recipe::GpResidualMean,
        ["gp-residual-mean", "GP res. mean", "Gp-residual with the mean prediction only, for pushes"],
    ),
    entry(
        Recipe::ConvexQuartic,
        [
            "convex-quartic",
            "Zhou",
            "Contact model with a convex quartic limit surface of the support friction (Zhou et al. 2016), for pushes",
        ],
    ),
    entry(
        Recipe::ConvexQuarticDrawn,
        [
            "convex-quartic-drawn",
            "Zhou drawn",
            "Convex-quartic with a random limit surface per roll-out (Zhou et al. 2017), for pushes",
        ],
    ),
    entry(
        Recipe::RigidFlow,
        [
            "rigid-flow",
            "SE3-Nets",
            "Points assigned softly to moving rigid bodies, without physics (Byravan, Fox 2017), for pushes",
        ],
    ),
];

impl Recipe {
    fn entry(self) -> &'static Entry {
        &RECIPES[self as usize]
    }

    /// Iterates over all recipes.
    pub fn all() -> impl Iterator<Item = Recipe> {
        RECIPES.iter().map(|e| e.recipe)
    }

    /// Finds the recipe with a name as given on the command line.
    pub fn named(name: &str) -> Option<Recipe> {
        RECIPES.iter().find(|e| e.name == name).map(|e| e.recipe)
    }

    /// Name of the recipe on the command line and in files.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// Name of the recipe in tables.
    pub fn label(self) -> &'static str {
        self.entry().label
    }

    /// One-line description of the recipe for help texts.
    pub fn about(self) -> &'static str {
        self.entry().about
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the table is in the order of the variants, and its names are the serialised ones.
    use super::*;

    #[test]
    fn each_recipe_is_at_its_index_and_serialises_to_its_name() {
        for (i, entry) in RECIPES.iter().enumerate() {
            assert_eq!(entry.recipe as usize, i, "{}", entry.name);
            assert_eq!(Recipe::named(entry.name), Some(entry.recipe));
            #[derive(Serialize)]
            struct File {
                recipe: Recipe,
            }
            let text = toml::to_string(&File { recipe: entry.recipe }).expect("it can be written");
            assert_eq!(text.trim(), format!("recipe = \"{}\"", entry.name));
        }
    }
}
