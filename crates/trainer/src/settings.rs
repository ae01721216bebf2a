//! Settings of a training run, with the paper's values as defaults.

use crate::TrainerError;
use crate::engine::{Engine, ModelPush};
use crate::recipe::Recipe;
use augsim_data::Limit;
use augsim_nn::{Adam, StepDecay};
use serde::{Deserialize, Serialize};

/// Which part of the physics the net corrects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Correction {
    /// The net corrects single steps, each from the last predicted state; the paper's nets predict states directly.
    Step,
    /// The net corrects the whole roll-out from the initial state, for states too noisy to start a step from.
    Rollout,
    /// The net corrects rates (time derivatives) of a system of equations, one correction per sample interval.
    Rates,
}

impl Correction {
    /// Name of the correction in configurations.
    fn name(self) -> &'static str {
        match self {
            Correction::Step => "step",
            Correction::Rollout => "rollout",
            Correction::Rates => "rates",
        }
    }

    /// Chooses which part of the physics is corrected, for an engine other than one of pushing.
    pub(crate) fn for_engine(engine: &Engine) -> Self {
        if engine.rate_model().is_some() { Correction::Rates } else { Correction::Step }
    }
}

/// Sizes of a net: layers, units and latent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NetSettings {
    /// Number of units of every GRU layer.
    pub hidden: usize,
    /// Number of GRU layers.
    pub layers: usize,
    /// Size of the latent variable, which is per time step for the DCVRNN and per trajectory for Hybrid+.
    pub latent: usize,
    /// Lower bound that is added to every learned standard deviation, in the net's units.
    pub sd_floor: f64,
}

/// All settings that determine a training run, given its data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Model class that is trained.
    pub recipe: Recipe,
    /// Seed of all random draws of the run.
    pub seed: u64,
    /// Number of training iterations.
    pub iterations: u64,
    /// Number of trajectories in the batch of one iteration.
    pub batch: usize,
    /// Norm to which longer gradients are rescaled; `None` for no clipping.
    pub clip_norm: Option<f64>,
    /// Learning rate schedule.
    pub learning_rate: StepDecay,
    /// Parameters of the Adam optimiser.
    pub adam: Adam,
    /// Sizes of the net that is trained.
    pub net: NetSettings,
    /// Part of the physics that the net corrects.
    pub correction: Correction,
    /// Physics engine that the net corrects.
    pub engine: Engine,
}

impl Settings {
    /// Default settings of a recipe for an engine; the learning rate schedule scales with `iterations`.
    ///
    /// Roll-outs are corrected for pushing, rates for systems of equations, single steps otherwise.
    ///
    /// The bouncing ball (paper, section IV-A): Adam at 1e-3, halved every quarter of the 10,000 iterations,
    /// batch 100, two GRU layers of 16 units, latent 4. Planar pushing (section IV-B): halved every tenth of
    /// the 50,000 iterations, feature extractors of 32 and 16, latent 16, learned deviations. Hybrid+ (not in
    /// the paper): rate 3e-3, 32 units, one latent of 2 per trajectory, or of 4 per push together with a GRU
    /// over the features of the roll-out.
    pub fn new(recipe: Recipe, iterations: u64, seed: u64, engine: Engine) -> Self {
        let pushing = engine.push_model().is_some();
        if let Some(class) = recipe.class() {
            return class.settings(recipe, iterations, seed, engine);
        }
        let correction = match pushing {
            true => Correction::Rollout,
            false => Correction::for_engine(&engine),
        };
        let net = |hidden, layers, latent, sd_floor| NetSettings { hidden, layers, latent, sd_floor };
        let is_plus = matches!(recipe, Recipe::HybridPlus | Recipe::NeuralPlus);
        let (initial, halvings, net) = match (correction, recipe) {
            (Correction::Step, Recipe::Neural | Recipe::Hybrid) => (1e-3, 4, net(16, 2, 4, 1e-6)),
            (Correction::Step, Recipe::HybridStandardised) => (3e-3, 8, net(16, 2, 4, 1e-6)),
            (Correction::Step, _) => (3e-3, 8, net(32, 1, 2, 1e-3)),
            (Correction::Rates, _) => (3e-3, 8, net(32, 1, 2, 1e-2)),
            (Correction::Rollout, _) if is_plus => (3e-3, 8, net(32, 1, 4, 1e-3)),
            // `HybridStandardised`, which also ends here, is rejected by `check`.
            (Correction::Rollout, _) => (1e-3, 10, net(16, 2, 16, 1e-3)),
        };
        Settings {
            recipe,
            seed,
            iterations,
            // Records of equations are cut into short segments, of which a smaller batch is enough.
            batch: if correction == Correction::Rates { 32 } else { 100 },
            clip_norm: (is_plus || correction == Correction::Rollout).then_some(100.0),
            learning_rate: StepDecay { initial, factor: 0.5, every: iterations.div_ceil(halvings).max(1) },
            adam: Adam::default(),
            net,
            correction,
            engine,
        }
    }

    /// Upper bound of the net's number of parameters, in floating point because integers could overflow.
    ///
    /// Let w = units + latent + 64, the 64 for all other inputs of a layer (states, conditions, extractors of
    /// at most 32). Three recurrent nets of three gates have fewer than 9 w^2 parameters per layer; the
    /// remaining 7 w^2 cover heads, extractors and biases.
    fn max_parameters(&self) -> f64 {
        let NetSettings { hidden, layers, latent, .. } = self.net;
        let width = hidden as f64 + latent as f64 + 64.0;
        16.0 * layers as f64 * width * width
    }

    /// Returns the pushing engine if roll-outs are corrected, else `None`.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if roll-outs are to be corrected and the engine is not one of pushing.
    pub(crate) fn rollouts(&self) -> Result<Option<&ModelPush>, TrainerError> {
        let rule = "needs an engine of an object pushed by a rod; use `step` for other engines";
        let missing = TrainerError::Setting { key: "correction", value: "rollout".to_owned(), rule };
        match self.correction {
            Correction::Step | Correction::Rates => Ok(None),
            Correction::Rollout => self.engine.push_model().ok_or(missing).map(Some),
        }
    }

    /// Checks all ranges, and that recipe, correction and engine fit together.
    ///
    /// # Errors
    /// [`TrainerError::Setting`], which names the key.
    pub fn check(&self) -> Result<(), TrainerError> {
        let recipe_rule = match (self.recipe, self.correction) {
            (Recipe::NeuralPlus, Correction::Step) => Some("is for pushing only"),
            (recipe, _) if self.engine.rate_model().is_some() && !recipe.corrects_rates() => Some(
                "does not correct rates of equations; use hybrid-plus, feed-forward-residual, recurrent-residual, \
                 mixture-residual or ensemble-residual",
            ),
            (Recipe::HybridStandardised, Correction::Rollout) => {
                Some("is for the ball only; nets for pushes always standardise")
            }
            _ => self.recipe.class().and_then(|class| class.rejection_reason(&self.engine)),
        };
        if let Some(rule) = recipe_rule {
            return Err(TrainerError::Setting { key: "recipe", value: self.recipe.label().to_owned(), rule });
        }
        self.rollouts()?;
        if (self.correction == Correction::Rates) != self.engine.rate_model().is_some() {
            let rule = "does not fit the engine: systems of equations need `rates`, and only they can use it";
            return Err(TrainerError::Setting {
                key: "correction",
                value: self.correction.name().to_owned(),
                rule,
            });
        }
        let at_least_one = [
            ("iterations", self.iterations as usize),
            ("batch", self.batch),
            ("net.hidden", self.net.hidden),
            ("net.layers", self.net.layers),
            ("net.latent", self.net.latent),
        ];
        for (key, value) in at_least_one {
            if value == 0 {
                return Err(TrainerError::Setting {
                    key,
                    value: value.to_string(),
                    rule: "must be at least 1",
                });
            }
        }
        if Limit::Parameters.check(self.max_parameters() as u64).is_err() {
            let NetSettings { hidden, layers, latent, .. } = self.net;
            let value = format!("{hidden} units, {layers} layers, latent {latent}");
            let rule = "too many parameters; lower these sizes, or set AUGSIM_LIMIT_PARAMETERS to allow more";
            return Err(TrainerError::Setting { key: "net", value, rule });
        }
        let positive = [
            ("learning_rate.initial", self.learning_rate.initial),
            ("learning_rate.factor", self.learning_rate.factor),
            ("clip_norm", self.clip_norm.unwrap_or(1.0)),
        ];
        for (key, value) in positive {
            if value <= 0.0 || !value.is_finite() {
                let rule = "must be a positive number";
                return Err(TrainerError::Setting { key, value: value.to_string(), rule });
            }
        }
        let rule = "must not be negative";
        for (key, value) in
            [("adam.weight_decay", self.adam.weight_decay), ("net.sd_floor", self.net.sd_floor)]
        {
            if value < 0.0 || !value.is_finite() {
                return Err(TrainerError::Setting { key, value: value.to_string(), rule });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    //! Contract: oversized nets are rejected before they are built.
    use super::*;
    use crate::nets::Net;
    use augsim_data::random_stream;
    use augsim_nn::Params;
    use augsim_physics::ball::drop_distribution::published_predictor;

    fn settings(recipe: Recipe, hidden: usize, layers: usize, latent: usize) -> Settings {
        let paper = Settings::new(recipe, 10, 1, Engine::PybulletBall(published_predictor()));
        Settings { net: NetSettings { hidden, layers, latent, ..paper.net }, ..paper }
    }

    #[test]
    fn the_bound_is_not_below_the_number_of_parameters() {
        for recipe in [Recipe::Neural, Recipe::Hybrid, Recipe::HybridPlus] {
            for (hidden, layers, latent) in [(1, 1, 1), (16, 2, 4), (200, 1, 1), (4, 3, 150), (128, 2, 128)] {
                let settings = settings(recipe, hidden, layers, latent);
                let mut params = Params::<f32>::new(random_stream(1, "init", 0));
                Net::new(&settings, 2, &mut params);
                assert!(params.values().len() as f64 <= settings.max_parameters(), "{:?}", settings.net);
            }
        }
    }

    #[test]
    fn sizes_beyond_any_memory_are_rejected() {
        for (hidden, layers, latent) in
            [(usize::MAX, 1, 1), (16, usize::MAX, 4), (16, 2, usize::MAX), (5000, 1, 1)]
        {
            let error = settings(Recipe::Neural, hidden, layers, latent).check().unwrap_err().to_string();
            assert!(
                error.contains("too many parameters") && error.contains("AUGSIM_LIMIT_PARAMETERS"),
                "{error}"
            );
        }
    }
}
