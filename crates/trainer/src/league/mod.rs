//! The classes that people would use instead of ours: one file each, with its loss or fit and its forecast.
//!
//! A class is a constant [`Class`], an entry in the table of `recipe.rs` and a line in `classes.rs`. A class that learns by gradients implements [`Learned`] and
//! has a variant of [`LearnedNet`]; one that is fitted directly implements [`Fitted`]. Both are trained, saved, resumed and scored as
//! every other recipe is.

mod calibrated;
mod classes;
mod contact;
mod convex_quartic;
mod ensemble;
mod feed_forward;
mod gp_residual;
mod predicted_parameters;
pub(crate) mod reads;
mod recurrent;
mod rigid_flow;
mod states;
mod strides;
mod trained;
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

use crate::league::reads::Reads;
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

/// Sizes and schedule that a class begins with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan {
    /// Units of each hidden layer.
    pub hidden: usize,
    /// Added to learned deviations, in the units of what is given.
    pub sd_floor: f64,
    /// Learning rate at the beginning; it is halved eight times.
    pub learning_rate: f64,
}

/// How the net of a class is made.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    FeedForward,
    /// Gaussians of the mixture; 1 is a plain Gaussian head.
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
    /// Fitted directly, in one iteration.
    Fitted(fn(&Settings) -> Result<Arc<dyn Fitted>, TrainerError>),
}

/// A model class.
#[derive(Debug)]
pub(crate) struct Class {
    pub kind: Kind,
    pub reads: Reads,
    pub plan: Plan,
    /// Whether it is made for an object and a rod.
    pub pushing_only: bool,
}

impl Class {
    /// The rule that an engine breaks which the class cannot work with.
    pub fn refuses(&self, engine: &Engine) -> Option<&'static str> {
        (self.pushing_only && engine.pushing().is_none()).then_some("is for pushing only")
    }

    /// The settings that a run of `recipe` begins with.
    pub fn settings(&self, recipe: Recipe, iterations: u64, seed: u64, engine: Engine) -> Settings {
        let iterations = if matches!(self.kind, Kind::Fitted(_)) { 1 } else { iterations };
        let Plan { hidden, sd_floor, learning_rate } = self.plan;
        Settings {
            recipe,
            seed,
            iterations,
            batch: if engine.rates().is_some() { 32 } else { 100 },
            clip_norm: Some(100.0),
            learning_rate: StepDecay {
                initial: learning_rate,
                factor: 0.5,
                every: iterations.div_ceil(8).max(1),
            },
            adam: Adam::default(),
            net: NetSettings { hidden, layers: 1, latent: 1, sd_floor },
            correction: Correction::of(&engine),
            engine,
        }
    }
}

/// The extents of a net: state columns and width of a condition row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extents {
    /// State columns.
    pub state: usize,
    /// Width of a condition row.
    pub condition: usize,
}

/// A class that learns by gradients.
pub trait Learned {
    /// Rows of noise that a sequence of `time` rows takes in training, and values per row.
    fn noise_rows(&self, _time: usize) -> (usize, usize) {
        (0, 0)
    }

    /// Whether every forecast from the same start is the same.
    fn is_deterministic(&self) -> bool {
        false
    }

    /// Records the loss of a tile: a sum over its trajectories.
    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError>;

    /// Trajectories from a first state under its actions.
    fn forecast(&self, trained: Trained<'_>, task: Task<'_>, samples: usize)
    -> Result<Samples, TrainerError>;
}

/// A class that is fitted directly.
pub trait Fitted: Debug + Send + Sync {
    /// Names and numbers of its parameters.
    fn parameters(&self) -> Vec<(&'static str, usize)>;

    /// Whether every forecast from the same start is the same.
    fn is_deterministic(&self) -> bool {
        false
    }

    /// The parameters that fit the training set, in the order of [`parameters`](Self::parameters), and the mean square of what they
    /// leave.
    fn fit(&self, settings: &Settings, train: &Sequences) -> Result<(Vec<f64>, f64), TrainerError>;

    /// Trajectories from a first state under its actions.
    fn forecast(&self, trained: Trained<'_>, task: Task<'_>, samples: usize)
    -> Result<Samples, TrainerError>;
}

/// The net of a class.
#[derive(Debug, Clone)]
pub enum ClassNet {
    /// It learns by gradients.
    Learned(Box<LearnedNet>, Extents),
    /// It is fitted directly.
    Fitted(FittedNet, Extents),
}

/// A class that is fitted directly, with the parameters that a run holds.
#[derive(Debug, Clone)]
pub struct FittedNet(Option<Arc<dyn Fitted>>);

/// Makes the enumeration of the nets that learn, with what each of them does.
macro_rules! learned {
    ($($variant:ident($net:ty),)*) => {
        /// A net that learns by gradients.
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
    /// Registers the net of a class.
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
                // An engine that the class cannot work with is refused by the settings' check, before a net is made.
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

    /// The loss of a tile; 0 for a class that is fitted directly.
    pub(crate) fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        match self {
            ClassNet::Learned(net, _) => net.loss(tape, p, tile),
            ClassNet::Fitted(..) => {
                let zero = tape.constant(&[], &[T::ZERO])?;
                Ok(LossVars { total: zero, kl: zero, misfit: zero })
            }
        }
    }

    pub(crate) fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        // Rates of equations may be given a start of each sample.
        let is_one = task.start.len() == trained.settings.engine.columns().len();
        let samples = if self.is_deterministic() && is_one { 1 } else { samples };
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

    /// Fits the parameters to a training set; the mean square of what they leave.
    pub(crate) fn fit(
        &self,
        settings: &Settings,
        train: &Sequences,
        params: &mut Params<f32>,
    ) -> Result<f64, TrainerError> {
        let (values, left) = self.class()?.fit(settings, train)?;
        params.values_mut().iter_mut().zip(values).for_each(|(to, v)| *to = v as f32);
        Ok(left)
    }
}

/// The loss of a Gaussian for each target, weighted by the predicted variance (beta-NLL with beta = 1, Seitzer et al. 2022): without
/// the weight nets call impacts unpredictable and stop learning them, as for Hybrid+.
fn gaussian_loss<T: Scalar>(
    tape: &mut Tape<T>,
    x: Var,
    law: Gaussian,
    mask: Option<Var>,
) -> Result<LossVars, TensorError> {
    let nll = tape.gaussian_nll(x, law.mean, law.sd)?;
    let sd = tape.detach(law.sd)?;
    let variance = tape.mul(sd, sd)?;
    let weighted = tape.mul(nll, variance)?;
    let total = masked_sum(tape, weighted, mask)?;
    let misfit = masked_sum(tape, nll, mask)?;
    Ok(LossVars { total, kl: zero(tape)?, misfit })
}

/// Targets `[time, S, lane]`, the first features of the conditions `[time, U, lane]`, and the mask of a tile.
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

pub(crate) fn zero<T: Scalar>(tape: &mut Tape<T>) -> Result<Var, TensorError> {
    tape.constant(&[], &[T::ZERO])
}
