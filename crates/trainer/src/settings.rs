//! Settings of a training run, with the paper's values as defaults.

use crate::push::PushEngine;
use crate::{EngineSpec, TrainerError};
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
    /// Physics.
    pub engine: EngineSpec,
}

impl Settings {
    /// The settings for the scenario of `engine`: those of [`Settings::ball`] or of [`Settings::push`].
    pub fn new(recipe: Recipe, iterations: u64, seed: u64, engine: EngineSpec) -> Self {
        match engine {
            EngineSpec::Push(engine) => Self::push(recipe, iterations, seed, engine),
            ball => Self::ball(recipe, iterations, seed, ball),
        }
    }

    /// The settings for the bouncing ball (paper, section IV-A): Adam at 1e-3, halved every quarter of
    /// the 10,000 iterations, batch 100, two GRU layers of 16 units, latent 4. `iterations` scales the
    /// schedule with it.
    pub fn ball(recipe: Recipe, iterations: u64, seed: u64, engine: EngineSpec) -> Self {
        let paper = Settings {
            recipe,
            seed,
            iterations,
            batch: 100,
            clip_norm: None,
            learning_rate: StepDecay { initial: 1e-3, factor: 0.5, every: iterations.div_ceil(4).max(1) },
            adam: Adam::default(),
            net: NetSettings { hidden: 16, layers: 2, latent: 4, sd_floor: 1e-6 },
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
    /// deviations. `iterations` scales the schedule with it. Hybrid+: a GRU of 32 units over the features of the
    /// physics' roll-out, one latent of 4 per push, rate 3e-3.
    pub fn push(recipe: Recipe, iterations: u64, seed: u64, engine: PushEngine) -> Self {
        let paper = Settings {
            recipe,
            seed,
            iterations,
            batch: 100,
            clip_norm: Some(100.0),
            learning_rate: StepDecay { initial: 1e-3, factor: 0.5, every: iterations.div_ceil(10).max(1) },
            adam: Adam::default(),
            net: NetSettings { hidden: 16, layers: 2, latent: 16, sd_floor: 1e-3 },
            engine: EngineSpec::Push(engine),
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

    /// Bound from above on the parameters of the net, in floating point, where no product overflows: 16 matrices a
    /// layer between everything that is side by side (three gates, two directions each, of encoder, prior and
    /// decoder are fewer; extractors have at most 32 units, states and conditions together fewer than 32).
    fn most_parameters(&self) -> f64 {
        let NetSettings { hidden, layers, latent, .. } = self.net;
        let width = hidden as f64 + latent as f64 + 64.0;
        16.0 * layers as f64 * width * width
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`TrainerError::Setting`], naming the key.
    pub fn check(&self) -> Result<(), TrainerError> {
        let pushing = matches!(self.engine, EngineSpec::Push(_));
        let foreign = match self.recipe {
            Recipe::NeuralPlus if !pushing => Some("is for pushing only"),
            Recipe::HybridStandardised if pushing => {
                Some("is for the ball only; pushes are always standardised")
            }
            _ => None,
        };
        if let Some(rule) = foreign {
            return Err(TrainerError::Setting { key: "recipe", value: self.recipe.label().to_owned(), rule });
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
