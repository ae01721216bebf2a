//! The recipes: every model class that `train` knows, by name.

use serde::{Deserialize, Serialize};

/// Which net is trained, and on what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recipe {
    /// The paper's DCVRNN without physics: the condition is s_0.
    Neural,
    /// The paper's DCVRNN: the condition is s_0 and the physics roll-out from it.
    Hybrid,
    /// The paper's Hybrid on standardised states and conditions, with a faster learning rate.
    HybridStandardised,
    /// Ours: physics step by step, one latent per trajectory, learned deviations.
    HybridPlus,
    /// The net of Hybrid+ without physics (pushing only): what physics is worth.
    NeuralPlus,
    /// Physics fitted by least squares, with a scatter that grows with the way moved.
    PhysicsCalibrated,
    /// A perceptron that gives the next state.
    FeedForward,
    /// A perceptron that corrects a physics step.
    FeedForwardResidual,
    /// A recurrent net that corrects a physics step, with a learned deviation.
    RecurrentResidual,
    /// The residual net with a mixture of five Gaussians.
    MixtureResidual,
    /// Five probabilistic perceptrons (PETS).
    Ensemble,
    /// Five probabilistic perceptrons that correct a physics step.
    EnsembleResidual,
    /// The variational recurrent net of Chung et al., without condition.
    Vrnn,
    /// The variational recurrent net of Chung et al., conditioned on the physics' roll-out.
    ConditionalVrnn,
    /// A net that predicts the inputs of the contact model (Kloss et al. 2017), for pushes.
    PredictedParameters,
    /// The net that predicts the inputs of the contact model, with an additive learned error.
    PredictedParametersError,
    /// Gaussian processes for the residual of the contact model (Fazeli et al. 2017), drawn; for pushes.
    GpResidual,
    /// Gaussian processes for the residual of the contact model with the mean propagated; for pushes.
    GpResidualMean,
    /// The contact model with a convex polynomial for the support's friction (Zhou et al. 2016), for pushes.
    ConvexQuartic,
    /// The same, drawn anew in each roll-out (Zhou et al. 2017).
    ConvexQuarticDrawn,
    /// Points that move with soft rigid bodies, without physics (SE3-Nets, Byravan and Fox 2017), for pushes.
    RigidFlow,
}

/// A recipe as it is chosen and shown.
struct Entry {
    recipe: Recipe,
    /// Word on the command line.
    name: &'static str,
    /// Name in tables.
    label: &'static str,
    about: &'static str,
}

const fn entry(recipe: Recipe, [name, label, about]: [&'static str; 3]) -> Entry {
    Entry { recipe, name, label, about }
}

/// Every recipe, in the order of the variants.
static RECIPES: [Entry; 21] = [
    entry(Recipe::Neural, ["neural", "Neural", "DCVRNN without physics"]),
    entry(Recipe::Hybrid, ["hybrid", "Hybrid", "DCVRNN on the physics roll-out, as published"]),
    entry(
        Recipe::HybridStandardised,
        ["hybrid-standardised", "Hybrid-std", "The same on standardised states: reconstructs best"],
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
            "Physics fitted by least squares, with a scatter that grows with the way moved",
        ],
    ),
    entry(Recipe::FeedForward, ["feed-forward", "FF", "Perceptron that gives the next state"]),
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
        ["mixture-residual", "MDN residual", "The same with a mixture of five Gaussians"],
    ),
    entry(
        Recipe::Ensemble,
        ["ensemble", "PETS", "Five probabilistic perceptrons, trajectory sampling (PETS)"],
    ),
    entry(
        Recipe::EnsembleResidual,
        ["ensemble-residual", "PETS residual", "The same as corrections of a physics step"],
    ),
    entry(Recipe::Vrnn, ["vrnn", "VRNN", "Variational recurrent net (Chung et al. 2015) without condition"]),
    entry(
        Recipe::ConditionalVrnn,
        ["conditional-vrnn", "CVRNN", "The same, conditioned on the physics roll-out"],
    ),
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
        ["predicted-parameters-error", "Kloss+error", "The same with an additive learned error"],
    ),
    entry(
        Recipe::GpResidual,
        [
            "gp-residual",
            "GP residual",
            "Gaussian processes for what the contact model leaves (Fazeli et al. 2017), for pushes",
        ],
    ),
    entry(Recipe::GpResidualMean, ["gp-residual-mean", "GP res. mean", "The same with the mean propagated"]),
    entry(
        Recipe::ConvexQuartic,
        [
            "convex-quartic",
            "Zhou",
            "Contact model with a convex quartic for the support's friction (Zhou et al. 2016), for pushes",
        ],
    ),
    entry(
        Recipe::ConvexQuarticDrawn,
        ["convex-quartic-drawn", "Zhou drawn", "The same, drawn anew in each roll-out (Zhou et al. 2017)"],
    ),
    entry(
        Recipe::RigidFlow,
        [
            "rigid-flow",
            "SE3-Nets",
            "Points that move with soft rigid bodies, without physics (Byravan, Fox 2017), for pushes",
        ],
    ),
];

impl Recipe {
    fn entry(self) -> &'static Entry {
        &RECIPES[self as usize]
    }

    /// All recipes.
    pub fn all() -> impl Iterator<Item = Recipe> {
        RECIPES.iter().map(|e| e.recipe)
    }

    /// The recipe of a word on the command line.
    pub fn named(name: &str) -> Option<Recipe> {
        RECIPES.iter().find(|e| e.name == name).map(|e| e.recipe)
    }

    /// Word on the command line and in files.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// Name in tables.
    pub fn label(self) -> &'static str {
        self.entry().label
    }

    /// The class in a line.
    pub fn about(self) -> &'static str {
        self.entry().about
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the table is in the order of the variants, and words are those that files hold.
    use super::*;

    #[test]
    fn every_recipe_finds_its_own_entry_and_is_written_by_its_name() {
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
