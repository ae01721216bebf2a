//! Settings of a training run, with the paper's values as defaults.

use crate::TrainerError;
use crate::engine::{Engine, ModelPush};
use augsim_data::Limit;
use augsim_nn::{Adam, StepDecay};
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
}

impl Recipe {
    /// Name in tables.
    pub fn label(self) -> &'static str {
        match self {
            Recipe::Neural => "Neural",
            Recipe::Hybrid => "Hybrid",
            Recipe::HybridStandardised => "Hybrid-std",
            Recipe::HybridPlus => "Hybrid+",
            Recipe::NeuralPlus => "Neural+",
        }
    }
}

/// What of the physics is corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Correction {
    /// Single steps, each from the state that was predicted last; the paper's nets give states outright.
    Step,
    /// The whole roll-out from the first state under the actions: for states that are too noisy to start a step from.
    Rollout,
}

/// Sizes of a net.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NetSettings {
    /// Units of every GRU layer.
    pub hidden: usize,
    /// GRU layers.
    pub layers: usize,
    /// Latent size: per time step for the DCVRNN, per trajectory for Hybrid+.
    pub latent: usize,
    /// Added to every learned standard deviation, in the net's units.
    pub sd_floor: f64,
}

/// Everything that decides a training run, besides its data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Net and data flow.
    pub recipe: Recipe,
    /// Seed of every random draw.
    pub seed: u64,
    /// Iterations.
    pub iterations: u64,
    /// Trajectories per iteration.
    pub batch: usize,
    /// Largest norm of the gradient; longer ones are shortened to it. Absent: no limit.
    pub clip_norm: Option<f64>,
    /// Learning rate.
    pub learning_rate: StepDecay,
    /// Optimiser.
    pub adam: Adam,
    /// Net.
    pub net: NetSettings,
    /// What of the physics is corrected.
    pub correction: Correction,
    /// Physics.
    pub engine: Engine,
}

impl Settings {
    /// The paper's settings for an engine: single steps are corrected, or roll-outs where a rod's path is known beforehand.
    /// `iterations` scales the schedule with it.
    pub fn new(recipe: Recipe, iterations: u64, seed: u64, engine: Engine) -> Self {
        match engine.pushing() {
            Some(_) => Self::of_rollouts(recipe, iterations, seed, engine),
            None => Self::of_steps(recipe, iterations, seed, engine),
        }
    }

    /// The settings for the bouncing ball (paper, section IV-A): Adam at 1e-3, halved every quarter of
    /// the 10,000 iterations, batch 100, two GRU layers of 16 units, latent 4.
    fn of_steps(recipe: Recipe, iterations: u64, seed: u64, engine: Engine) -> Self {
        let paper = Settings {
            recipe,
            seed,
            iterations,
            batch: 100,
            clip_norm: None,
            learning_rate: StepDecay { initial: 1e-3, factor: 0.5, every: iterations.div_ceil(4).max(1) },
            adam: Adam::default(),
            net: NetSettings { hidden: 16, layers: 2, latent: 4, sd_floor: 1e-6 },
            correction: Correction::Step,
            engine,
        };
        match recipe {
            Recipe::Neural | Recipe::Hybrid => paper,
            Recipe::HybridStandardised => Settings {
                learning_rate: StepDecay { initial: 3e-3, factor: 0.5, every: iterations.div_ceil(8).max(1) },
                ..paper
            },
            Recipe::HybridPlus | Recipe::NeuralPlus => Settings {
                clip_norm: Some(100.0),
                learning_rate: StepDecay { initial: 3e-3, factor: 0.5, every: iterations.div_ceil(8).max(1) },
                net: NetSettings { hidden: 32, layers: 1, latent: 2, sd_floor: 1e-2 },
                ..paper
            },
        }
    }

    /// The settings for planar pushing (paper, section IV-B): Adam at 1e-3, halved every tenth of the 50,000
    /// iterations, batch 100, feature extractors of 32 and 16, two GRU layers of 16 units, latent 16, learned
    /// deviations. Hybrid+: a GRU of 32 units over the features of the
    /// physics' roll-out, one latent of 4 per push, rate 3e-3.
    fn of_rollouts(recipe: Recipe, iterations: u64, seed: u64, engine: Engine) -> Self {
        let paper = Settings {
            recipe,
            seed,
            iterations,
            batch: 100,
            clip_norm: Some(100.0),
            learning_rate: StepDecay { initial: 1e-3, factor: 0.5, every: iterations.div_ceil(10).max(1) },
            adam: Adam::default(),
            net: NetSettings { hidden: 16, layers: 2, latent: 16, sd_floor: 1e-3 },
            correction: Correction::Rollout,
            engine,
        };
        match recipe {
            // Hybrid-std is refused by `check`.
            Recipe::Neural | Recipe::Hybrid | Recipe::HybridStandardised => paper,
            Recipe::HybridPlus | Recipe::NeuralPlus => Settings {
                learning_rate: StepDecay { initial: 3e-3, factor: 0.5, every: iterations.div_ceil(8).max(1) },
                net: NetSettings { hidden: 32, layers: 1, latent: 4, sd_floor: 1e-3 },
                ..paper
            },
        }
    }

    /// At least as many parameters as the net has, in floating point, where no product overflows.
    ///
    /// Let w be the units, the latent and 64 for all else that enters a layer (states, conditions, extractors of at
    /// most 32). Three recurrent nets of three gates have fewer than 9 w^2 parameters a layer; the rest of 16 w^2
    /// is for heads, extractors and biases.
    fn most_parameters(&self) -> f64 {
        let NetSettings { hidden, layers, latent, .. } = self.net;
        let width = hidden as f64 + latent as f64 + 64.0;
        16.0 * layers as f64 * width * width
    }

    /// The pushing whose roll-outs are corrected; none where single steps are.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if roll-outs are to be corrected and the engine has no rod.
    pub(crate) fn rollouts(&self) -> Result<Option<&ModelPush>, TrainerError> {
        let rule = "needs an engine of an object and a rod; correct single steps of any other";
        let missing = TrainerError::Setting { key: "correction", value: "rollout".to_owned(), rule };
        match self.correction {
            Correction::Step => Ok(None),
            Correction::Rollout => self.engine.pushing().ok_or(missing).map(Some),
        }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`TrainerError::Setting`], naming the key.
    pub fn check(&self) -> Result<(), TrainerError> {
        let foreign = match (self.recipe, self.correction) {
            (Recipe::NeuralPlus, Correction::Step) => Some("is for pushing only"),
            (Recipe::HybridStandardised, Correction::Rollout) => {
                Some("is for the ball only; pushes are always standardised")
            }
            _ => None,
        };
        if let Some(rule) = foreign {
            return Err(TrainerError::Setting { key: "recipe", value: self.recipe.label().to_owned(), rule });
        }
        self.rollouts()?;
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
        if Limit::Parameters.check(self.most_parameters() as u64).is_err() {
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
    //! Contract: a net is refused by its sizes before it is made, and the bound that refuses it lies above every net.
    use super::*;
    use crate::nets::Net;
    use augsim_data::random_stream;
    use augsim_nn::Params;
    use augsim_physics::ball::paper_law::paper_engine;

    fn settings(recipe: Recipe, hidden: usize, layers: usize, latent: usize) -> Settings {
        let paper = Settings::new(recipe, 10, 1, Engine::PybulletBall(paper_engine()));
        Settings { net: NetSettings { hidden, layers, latent, ..paper.net }, ..paper }
    }

    #[test]
    fn no_net_has_more_parameters_than_its_bound() {
        for recipe in [Recipe::Neural, Recipe::Hybrid, Recipe::HybridPlus] {
            for (hidden, layers, latent) in [(1, 1, 1), (16, 2, 4), (200, 1, 1), (4, 3, 150), (128, 2, 128)] {
                let settings = settings(recipe, hidden, layers, latent);
                let mut params = Params::<f32>::new(random_stream(1, "init", 0));
                Net::new(&settings, 2, &mut params);
                assert!(params.values().len() as f64 <= settings.most_parameters(), "{:?}", settings.net);
            }
        }
    }

    #[test]
    fn sizes_that_no_machine_holds_are_refused() {
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
