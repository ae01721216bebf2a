//! The ball of a model file as an engine: what the nets correct when a discovery has come before them.

use augsim_physics::ball::{Axes, Covariates, GRAVITY, Offsets, Run, State, Throw, World, simulate};
use augsim_physics::effects::{Against, Location, Needs, SCATTER_KIND, spec_of};
use augsim_physics::model::{EffectBlock, Model};
use serde::{Deserialize, Serialize};

/// Kind of contacts that last.
const CONTACT_KIND: &str = "contact-duration";

/// The exact engine of a model file for a ball that moves up and down (`height_m`, `velocity_m_s`), at the nominal values
/// of its parameters, one step of the data at a time.
///
/// Laws of flight and of impact act. What the sensor adds is no part of the state, and the scatter of the restitution is
/// for the net to learn: both are left out. A state below the ground, which noise makes, counts as on the ground. A step
/// of its own cannot know that a contact has begun before it, so single steps bounce in an instant where the model has
/// contacts that last; a [`rollout`](Self::rollout) follows them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Declared", into = "Declared")]
pub struct ModelBall {
    declared: Declared,
    /// World and parameters of a roll-out.
    whole: (World, Vec<f64>),
    /// World and parameters of single steps.
    step: (World, Vec<f64>),
}

/// What configurations and checkpoints hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Declared {
    /// Seconds from one sample to the next.
    step_s: f64,
    /// Text of the model file.
    model: String,
}

/// Why a model cannot be stepped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BallModelError {
    /// The step makes no sense.
    #[error("a step of {step_s} s must be a positive number")]
    Step {
        /// The step.
        step_s: f64,
    },
    /// A law that height and velocity do not decide.
    #[error(
        "effect `{kind}` depends on {what}, which height and velocity do not tell; take it out of the model file, or \
         find a model without it (`discover`)"
    )]
    Hidden {
        /// Kind of the effect.
        kind: String,
        /// What it depends on.
        what: &'static str,
    },
    /// The text is no model file.
    #[error("{text}")]
    File {
        /// What is wrong with it.
        text: String,
    },
}

impl ModelBall {
    /// The engine of `model` with steps of `step_s` seconds.
    ///
    /// # Errors
    /// [`BallModelError`], where a law depends on more than height and velocity, or the step is not positive.
    pub fn new(model: &Model, step_s: f64) -> Result<Self, BallModelError> {
        if !(step_s > 0.0 && step_s.is_finite()) {
            return Err(BallModelError::Step { step_s });
        }
        if let Some((kind, what)) = model.effects.iter().find_map(hidden) {
            return Err(BallModelError::Hidden { kind: kind.to_owned(), what });
        }
        let world = |keep: &dyn Fn(&EffectBlock) -> bool| {
            let effects = model.effects.iter().filter(|b| moves(b) && keep(b)).cloned().collect();
            Model { effects, ..model.clone() }.world(Axes::Vertical)
        };
        let (whole, step) = (world(&|_| true), world(&|b| b.kind != CONTACT_KIND));
        Ok(ModelBall { declared: Declared { step_s, model: model.to_toml() }, whole, step })
    }

    /// Kinds of `model` that take no part: what the sensor adds, and scatter.
    pub fn left_out(model: &Model) -> impl Iterator<Item = &str> {
        model.effects.iter().filter(|b| !moves(b)).map(|b| b.kind.as_str())
    }

    /// Seconds from one state to the next.
    pub fn step_s(&self) -> f64 {
        self.declared.step_s
    }

    /// Gravity of the model, m/s², downward positive.
    pub(crate) fn gravity_m_s2(&self) -> f64 {
        self.step.1[GRAVITY]
    }

    /// Height, m, and velocity, m/s, one step after `state`.
    pub(crate) fn step(&self, state: &[f64], next: &mut [f64]) {
        let run = run(&self.step, state, &[self.declared.step_s]);
        (next[0], next[1]) = (run.positions[0][2], run.velocities[0][2]);
    }

    /// Heights and velocities `[time, 2]` from `start`, which is the first of them.
    pub(crate) fn rollout(&self, start: &[f64], time: usize) -> Vec<f64> {
        let times: Vec<f64> = (0..time).map(|t| t as f64 * self.declared.step_s).collect();
        let run = run(&self.whole, start, &times);
        let mut out: Vec<f64> =
            run.positions.iter().zip(&run.velocities).flat_map(|(p, v)| [p[2], v[2]]).collect();
        // The start is what was measured, also where that is below the ground.
        out[..2].copy_from_slice(start);
        out
    }
}

/// Positions and velocities at `times` from height and velocity at time zero.
fn run((world, parameters): &(World, Vec<f64>), state: &[f64], times: &[f64]) -> Run<f64> {
    let start = State { velocity: [0.0, 0.0, state[1]], ..State::at_rest(state[0].max(0.0)) };
    let covariates = Covariates::default();
    let throw =
        Throw { world, parameters, start, covariates: &covariates, offsets: Offsets::None, velocities: true };
    let mut run = Run::default();
    simulate(&throw, times, &mut run);
    run
}

/// Whether an effect changes the motion, and not at random.
fn moves(block: &EffectBlock) -> bool {
    block.kind != SCATTER_KIND && location(block) != Some(Location::Sensor)
}

fn location(block: &EffectBlock) -> Option<Location> {
    match &block.table {
        Some(table) => Some(table.target.location()),
        None => spec_of(&block.kind).map(|s| s.location),
    }
}

/// Kind of an effect that depends on more than height and velocity, and what that is.
fn hidden(block: &EffectBlock) -> Option<(&str, &'static str)> {
    if !moves(block) {
        return None;
    }
    let what = match &block.table {
        Some(table) => match table.against {
            Against::Time => Some("the time since the release"),
            Against::Clock => Some("the clock of the session"),
            Against::Bounce => Some("the number of the bounce"),
            Against::Slip | Against::Spin => Some("the spin"),
            Against::X | Against::Y | Against::VelocityX | Against::TangentialSpeed => {
                Some("motion along the ground")
            }
            Against::NormalSpeed | Against::Speed | Against::Z | Against::VelocityZ => None,
        },
        // What acts through another effect (a wind through the drag) shows in the height alone as well.
        None if spec_of(&block.kind)?.joins.is_some() => None,
        None => match spec_of(&block.kind)?.needs {
            Needs::Horizontal | Needs::Slip | Needs::Lateral => Some("motion along the ground"),
            Needs::Spin | Needs::SpinInSpace => Some("the spin"),
            Needs::StartTime => Some("the clock of the session"),
            Needs::AreaPerMass => Some("the ball's size and mass"),
            Needs::Nothing | Needs::ReleaseAtRest | Needs::Coasting => None,
        },
    };
    what.map(|what| (block.kind.as_str(), what))
}

impl TryFrom<Declared> for ModelBall {
    type Error = BallModelError;
    fn try_from(declared: Declared) -> Result<Self, BallModelError> {
        let model = Model::parse(&declared.model, "model of the run")
            .map_err(|e| BallModelError::File { text: e.to_string() })?;
        Self::new(&model, declared.step_s)
    }
}

impl From<ModelBall> for Declared {
    fn from(ball: ModelBall) -> Self {
        ball.declared
    }
}
