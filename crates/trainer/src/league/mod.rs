//! The benchmark league: alternative model classes to compare Hybrid+ with, one file each.
//!
//! A class is a constant [`Class`], an entry in the table of `recipe.rs` and a line in `classes.rs`. A class
//! that is trained by gradients implements [`Learned`] and has a variant of [`LearnedNet`]; one that is
//! fitted directly implements [`Fitted`]. Both are trained, saved, resumed and scored like every other
//! recipe.

mod calibrated;
mod classes;
mod contact;
mod convex_quartic;
mod ensemble;
mod feed_forward;
mod gp_residual;
pub(crate) mod inputs;
mod predicted_parameters;
mod recurrent;
mod rigid_flow;
mod strides;
mod trained;
mod trajectories;
mod vrnn;

pub(crate) use calibrated::CALIBRATED;
pub(crate) use convex_quartic::{CONVEX_QUARTIC, CONVEX_QUARTIC_DRAWN};
pub(crate) use ensemble::{ENSEMBLE, ENSEMBLE_RESIDUAL};
pub(crate) use feed_forward::{FEED_FORWARD, FEED_FORWARD_RESIDUAL};
pub(crate) use gp_residual::{GP_RESIDUAL, GP_RESIDUAL_MEAN};
pub(crate) use predicted_parameters::{PREDICTED_PARAMETERS, PREDICTED_PARAMETERS_ERROR};
pub(crate) use recurrent::{MIXTURE_RESIDUAL, RECURRENT_RESIDUAL};
pub(crate) use rigid_flow::RIGID_FLOW;
pub use trained::Trained;
pub(crate) use vrnn::{CONDITIONAL_VRNN, VRNN};

use crate::league::inputs::ClassInputs;
use crate::nets::tile::{LossVars, Tile, mask_of, masked_sum};
use crate::recipe::Recipe;
use crate::settings::{Correction, NetSettings, Settings};
use crate::{Engine, Samples, Sequences, Task, TrainerError};
use augsim_nn::{Adam, Bound, Gaussian, Init, Params, StepDecay};
use augsim_tensor::{Scalar, Tape, TensorError, Var};
use ensemble::Ensemble;
use feed_forward::FeedForward;
use predicted_parameters::PredictedParameters;
use recurrent::Recurrent;
use rigid_flow::RigidFlow;
use std::fmt::Debug;
use std::sync::Arc;
use vrnn::Vrnn;

/// Default sizes and learning rate of a model class.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Defaults {
    /// Default number of units of each hidden layer.
    pub hidden: usize,
    /// Default lower bound that is added to learned standard deviations, in units of the targets.
    pub sd_floor: f64,
    /// Default initial learning rate; it is halved every eighth of the iterations.
    pub learning_rate: f64,
}

/// Which net or direct fit a model class uses.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    FeedForward,
    /// A recurrent net whose output is a mixture of `components` Gaussians; 1 for a plain Gaussian.
    Recurrent {
        components: usize,
    },
    Ensemble,
    Vrnn {
        conditional: bool,
    },
    PredictedParameters {
        with_error: bool,
    },
    RigidFlow,
    /// A model that is fitted directly, in one iteration; the function builds it.
    Fitted(fn(&Settings) -> Result<Arc<dyn Fitted>, TrainerError>),
}

/// A model class of the benchmark league.
#[derive(Debug)]
pub(crate) struct Class {
    pub kind: Kind,
    pub inputs: ClassInputs,
    pub defaults: Defaults,
    /// Whether the class supports pushing only.
    pub is_pushing_only: bool,
}

impl Class {
    /// Reason why the class cannot work with an engine; `None` if it can.
    pub fn rejection_reason(&self, engine: &Engine) -> Option<&'static str> {
        (self.is_pushing_only && engine.push_model().is_none()).then_some("is for pushing only")
    }

    /// Creates the default settings of a run of `recipe`, which has this class.
    pub fn settings(&self, recipe: Recipe, iterations: u64, seed: u64, engine: Engine) -> Settings {
        let iterations = if matches!(self.kind, Kind::Fitted(_)) { 1 } else { iterations };
        let Defaults { hidden, sd_floor, learning_rate } = self.defaults;
        Settings {
            recipe,
            seed,
            iterations,
            batch: if engine.rate_model().is_some() { 32 } else { 100 },
            clip_norm: Some(100.0),
            learning_rate: StepDecay {
                initial: learning_rate,
                factor: 0.5,
                every: iterations.div_ceil(8).max(1),
            },
            adam: Adam::default(),
            net: NetSettings { hidden, layers: 1, latent: 1, sd_floor },
            correction: Correction::for_engine(&engine),
            engine,
        }
    }
}

/// Numbers of targets and of inputs per row of a net.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extents {
    /// Number of targets per row (state columns).
    pub state: usize,
    /// Number of conditions (net inputs) per row.
    pub condition: usize,
}

/// A model class that is trained by gradients.
pub trait Learned {
    /// Number of rows of noise in training for a sequence of `time` rows, and number of noise values per row.
    fn noise_rows(&self, _time: usize) -> (usize, usize) {
        (0, 0)
    }

    /// Whether forecasts from the same task are always identical.
    fn is_deterministic(&self) -> bool {
        false
    }

    /// Records the loss of a batch tile on the tape, summed over its trajectories.
    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError>;

    /// Draws `samples` trajectories from the forecast of a task.
    fn forecast(&self, trained: Trained<'_>, task: Task<'_>, samples: usize)
    -> Result<Samples, TrainerError>;
}

/// A model class that is fitted directly instead of by gradients.
pub trait Fitted: Debug + Send + Sync {
    /// Names of the fitted parameters, with the number of values of each.
    fn parameters(&self) -> Vec<(&'static str, usize)>;

    /// Whether forecasts from the same task are always identical.
    fn is_deterministic(&self) -> bool {
        false
    }

    /// Fits the parameters to a training set; returns them with the mean square residual.
    ///
    /// They are in the order of [`parameters`](Self::parameters).
    fn fit(&self, settings: &Settings, train: &Sequences) -> Result<(Vec<f64>, f64), TrainerError>;

    /// Draws `samples` trajectories from the forecast of a task.
    fn forecast(&self, trained: Trained<'_>, task: Task<'_>, samples: usize)
    -> Result<Samples, TrainerError>;
}

/// The net or direct fit of a class, with the widths of its rows.
#[derive(Debug, Clone)]
pub enum ClassNet {
    /// A net that is trained by gradients.
    Learned(Box<LearnedNet>, Extents),
    /// A model that is fitted directly.
    Fitted(FittedNet, Extents),
}

/// A directly fitted model; `None` if the engine does not suit its class.
#[derive(Debug, Clone)]
pub struct FittedNet(Option<Arc<dyn Fitted>>);

/// Defines the enum [`LearnedNet`] and dispatches the methods of [`Learned`] to its variants.
macro_rules! learned {
    ($($variant:ident($net:ty),)*) => {
        /// A net of a league class that is trained by gradients, one variant per class.
        #[derive(Debug, Clone)]
        pub enum LearnedNet {
            $($variant($net),)*
        }

        impl LearnedNet {
            fn noise_rows(&self, time: usize) -> (usize, usize) {
                match self { $(LearnedNet::$variant(net) => net.noise_rows(time),)* }
            }

            fn is_deterministic(&self) -> bool {
                match self { $(LearnedNet::$variant(net) => net.is_deterministic(),)* }
            }

            fn loss<T: Scalar>(&self, tape: &mut Tape<T>, p: &Bound, tile: Tile<'_, T>) -> Result<LossVars, TensorError> {
                match self { $(LearnedNet::$variant(net) => net.loss(tape, p, tile),)* }
            }

            fn forecast(&self, trained: Trained<'_>, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
                match self { $(LearnedNet::$variant(net) => net.forecast(trained, task, samples),)* }
            }
        }
    };
}

learned! {
    FeedForward(FeedForward),
    Recurrent(Recurrent),
    Ensemble(Ensemble),
    Vrnn(Vrnn),
    PredictedParameters(PredictedParameters),
    RigidFlow(RigidFlow),
}

impl ClassNet {
    /// Builds the net or direct fit of a class, and registers its parameters.
    pub(crate) fn new<T: Scalar>(
        class: &Class,
        settings: &Settings,
        extents: Extents,
        params: &mut Params<T>,
    ) -> Self {
        let learned = match class.kind {
            Kind::FeedForward => LearnedNet::FeedForward(FeedForward::new(settings, extents, params)),
            Kind::Recurrent { components } => {
                LearnedNet::Recurrent(Recurrent::new(settings, extents, components, params))
            }
            Kind::Ensemble => LearnedNet::Ensemble(Ensemble::new(settings, extents, params)),
            Kind::Vrnn { conditional } => LearnedNet::Vrnn(Vrnn::new(settings, extents, conditional, params)),
            Kind::PredictedParameters { with_error } => LearnedNet::PredictedParameters(
                PredictedParameters::new(settings, extents, with_error, params),
            ),
            Kind::RigidFlow => LearnedNet::RigidFlow(RigidFlow::new(settings, extents, params)),
            Kind::Fitted(make) => {
                // An engine that does not suit the class was already rejected by `Settings::check`.
                let class = make(settings).ok();
                for (name, count) in class.iter().flat_map(|c| c.parameters()) {
                    params.add(name.to_owned(), &[count], Init::Constant(0.0));
                }
                return ClassNet::Fitted(FittedNet(class), extents);
            }
        };
        ClassNet::Learned(Box::new(learned), extents)
    }

    pub(crate) fn extents(&self) -> Extents {
        match self {
            ClassNet::Learned(_, extents) | ClassNet::Fitted(_, extents) => *extents,
        }
    }

    pub(crate) fn noise_rows(&self, time: usize) -> (usize, usize) {
        match self {
            ClassNet::Learned(net, _) => net.noise_rows(time),
            ClassNet::Fitted(..) => (0, 0),
        }
    }

    pub(crate) fn is_deterministic(&self) -> bool {
        match self {
            ClassNet::Learned(net, _) => net.is_deterministic(),
            ClassNet::Fitted(net, _) => net.0.as_ref().is_some_and(|net| net.is_deterministic()),
        }
    }

    /// Records the loss of a batch tile; 0 for a class that is fitted directly.
    pub(crate) fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        match self {
            ClassNet::Learned(net, _) => net.loss(tape, p, tile),
            ClassNet::Fitted(..) => {
                let zero = zero(tape)?;
                Ok(LossVars { total: zero, kl: zero, negative_ln_likelihood: zero })
            }
        }
    }

    pub(crate) fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        // A deterministic class needs one sample, unless each sample has its own initial state (systems of
        // equations).
        let has_one_start = task.start.len() == trained.settings.engine.columns().len();
        let samples = if self.is_deterministic() && has_one_start { 1 } else { samples };
        match self {
            ClassNet::Learned(net, _) => net.forecast(trained, task, samples),
            ClassNet::Fitted(net, _) => net.class()?.forecast(trained, task, samples),
        }
    }
}

impl FittedNet {
    fn class(&self) -> Result<&dyn Fitted, TrainerError> {
        self.0.as_deref().ok_or_else(|| crate::Difference::OtherSystem.into())
    }

    /// Fits the parameters of a directly fitted model to a training set; returns the mean square residual.
    pub(crate) fn fit(
        &self,
        settings: &Settings,
        train: &Sequences,
        params: &mut Params<f32>,
    ) -> Result<f64, TrainerError> {
        let (values, mean_square) = self.class()?.fit(settings, train)?;
        params.values_mut().iter_mut().zip(values).for_each(|(to, v)| *to = v as f32);
        Ok(mean_square)
    }
}

/// Records the Gaussian loss of a tile, weighted by the predicted variance.
///
/// This is beta-NLL with beta = 1 (Seitzer et al. 2022).
///
/// Without the weight nets predict a large variance at impacts and stop learning them, as Hybrid+ would.
fn gaussian_loss<T: Scalar>(
    tape: &mut Tape<T>,
    x: Var,
    predicted: Gaussian,
    mask: Option<Var>,
) -> Result<LossVars, TensorError> {
    let nll = tape.gaussian_nll(x, predicted.mean, predicted.sd)?;
    let sd = tape.detach(predicted.sd)?;
    let variance = tape.mul(sd, sd)?;
    let weighted = tape.mul(nll, variance)?;
    let total = masked_sum(tape, weighted, mask)?;
    let total_nll = masked_sum(tape, nll, mask)?;
    Ok(LossVars { total, kl: zero(tape)?, negative_ln_likelihood: total_nll })
}

/// Records a batch tile's targets `[time, S, lane]`, conditions `[time, U, lane]` and mask on the tape.
pub(crate) fn operands<T: Scalar>(
    tape: &mut Tape<T>,
    tile: &Tile<'_, T>,
    Extents { state, condition }: Extents,
) -> Result<(Var, Var, Option<Var>), TensorError> {
    let x = tape.constant(&[tile.time, state, tile.lanes], tile.x)?;
    let u = tape.constant(&[tile.time, condition, tile.lanes], tile.u)?;
    let mask = mask_of(tape, tile)?;
    Ok((x, u, mask))
}

/// Records the scalar 0 on the tape.
pub(crate) fn zero<T: Scalar>(tape: &mut Tape<T>) -> Result<Var, TensorError> {
    tape.constant(&[], &[T::ZERO])
}
