//! The ball of a model file as the nets use it.

use super::error::EngineError;
use super::motion::Motion;
use augsim_data::checks::Expected;
use augsim_physics::ball::{Axes, Covariates, FLOOR, Offsets, Run, State, Throw, World, simulate};
use augsim_physics::effects::{Against, Location, Needs, SCATTER_KIND, spec_of};
use augsim_physics::model::{EffectBlock, Model};

/// Kind of contacts that last.
const CONTACT_KIND: &str = "contact-duration";
/// Kind of a floor that is not at height 0 of the data.
const OFFSET_KIND: &str = "height-offset";

/// State columns of a ball that moves up and down.
pub(super) const COLUMNS: [&str; 2] = ["height_m", "velocity_m_s"];
/// State columns of a throw in the plane.
const PLANE: [&str; 4] = ["x_m", "z_m", "velocity_x_m_s", "velocity_z_m_s"];
/// State columns of a throw in space.
const SPACE: [&str; 6] = ["x_m", "y_m", "z_m", "velocity_x_m_s", "velocity_y_m_s", "velocity_z_m_s"];

/// The exact engine of a model file for a ball, one step of the data at a time.
///
/// States are those of the data: where the model says that heights are off by a constant, the ground lies at it. A state below
/// the ground, which noise makes, counts as on the ground. A step of its own cannot know that a contact has
/// begun before it, so single steps bounce in an instant where the model has contacts that last; a roll-out follows them.
#[derive(Debug)]
pub(super) struct ModelBall {
    /// Seconds from one sample to the next.
    step_s: f64,
    axes: Axes,
    /// Height of the ground in the data, m.
    ground_m: f64,
    expected: Expected,
    left_out: Vec<String>,
    contact_s: Option<f64>,
    /// World and parameters of a roll-out.
    whole: (World, Vec<f64>),
    /// World and parameters of single steps.
    step: (World, Vec<f64>),
}

impl ModelBall {
    /// The engine of `model` with steps of `step_s` seconds.
    pub fn new(model: &Model, axes: Axes, step_s: f64) -> Result<Self, EngineError> {
        if !(step_s > 0.0 && step_s.is_finite()) {
            return Err(EngineError::Step { step_s });
        }
        if let Some((kind, what)) = model.effects.iter().find_map(|b| hidden(b, axes)) {
            return Err(EngineError::Hidden { kind: kind.to_owned(), what });
        }
        let world = |keep: &dyn Fn(&EffectBlock) -> bool| {
            let effects = model.effects.iter().filter(|b| moves(b) && keep(b)).cloned().collect();
            Model { effects, ..model.clone() }.world(axes)
        };
        let lasts = |b: &&EffectBlock| b.kind == CONTACT_KIND;
        let contact = model.effects.iter().find(lasts).and_then(|b| b.parameters.first());
        let offset = model.effects.iter().find(|b| b.kind == OFFSET_KIND).and_then(|b| b.parameters.first());
        let takes_part = |b: &EffectBlock| moves(b) || b.kind == OFFSET_KIND;
        Ok(ModelBall {
            step_s,
            axes,
            ground_m: offset.map_or(0.0, |b| b.nominal),
            expected: Expected { gravity_m_s2: model.expected().gravity_m_s2, ..Expected::default() },
            left_out: model.effects.iter().filter(|b| !takes_part(b)).map(|b| b.kind.clone()).collect(),
            contact_s: contact.map(|tau| tau.nominal),
            whole: world(&|_| true),
            step: world(&|b| b.kind != CONTACT_KIND),
        })
    }
}

impl ModelBall {
    /// Positions and velocities at `times` from a state at time zero, as rows of states.
    fn run(&self, (world, parameters): &(World, Vec<f64>), state: &[f64], times: &[f64]) -> Vec<f64> {
        let axes = self.axes.indices();
        let mut start = State::at_rest(0.0);
        for (i, &axis) in axes.iter().enumerate() {
            (start.position[axis], start.velocity[axis]) = (state[i], state[axes.len() + i]);
        }
        start.position[UP] = (start.position[UP] - self.ground_m).max(parameters[FLOOR]);
        let covariates = Covariates::default();
        let throw = Throw {
            world,
            parameters,
            start,
            covariates: &covariates,
            offsets: Offsets::None,
            velocities: true,
        };
        let mut run = Run::default();
        simulate(&throw, times, &mut run);
        let mut rows = Vec::with_capacity(times.len() * 2 * axes.len());
        for (position, velocity) in run.positions.iter().zip(&run.velocities) {
            rows.extend(
                axes.iter().map(|&a| if a == UP { position[a] + self.ground_m } else { position[a] }),
            );
            rows.extend(axes.iter().map(|&a| velocity[a]));
        }
        rows
    }
}

/// The axis that points up.
const UP: usize = 2;

impl Motion for ModelBall {
    fn columns(&self) -> Vec<&str> {
        match self.axes {
            Axes::Vertical => COLUMNS.to_vec(),
            Axes::Plane => PLANE.to_vec(),
            Axes::Space => SPACE.to_vec(),
        }
    }

    fn step_s(&self) -> Option<f64> {
        Some(self.step_s)
    }

    fn expected(&self) -> Expected {
        self.expected
    }

    fn ground_m(&self) -> Option<f64> {
        let (_, parameters) = &self.step;
        matches!(self.axes, Axes::Vertical).then(|| self.ground_m + parameters[FLOOR])
    }

    fn step(&self, state: &[f64], _: &[f64], _: &[f64], next: &mut [f64]) {
        next.copy_from_slice(&self.run(&self.step, state, &[self.step_s]));
    }

    fn rollout(&self, start: &[f64], _: &[f64], time: usize) -> Vec<f64> {
        let times: Vec<f64> = (0..time).map(|t| t as f64 * self.step_s).collect();
        let mut out = self.run(&self.whole, start, &times);
        // The start is what was measured, also where that is below the ground.
        out[..start.len()].copy_from_slice(start);
        out
    }

    fn left_out(&self) -> &[String] {
        &self.left_out
    }

    fn contact_s(&self) -> Option<f64> {
        self.contact_s
    }
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

/// Kind of an effect that depends on more than the states along these axes, and what that is.
fn hidden(block: &EffectBlock, axes: Axes) -> Option<(&str, &'static str)> {
    if !moves(block) {
        return None;
    }
    let what = match &block.table {
        Some(table) => match table.against {
            Against::Time => Some("the time since the release"),
            Against::Clock => Some("the clock of the session"),
            Against::Bounce => Some("the number of the bounce"),
            Against::Slip | Against::Spin => Some("the spin"),
            Against::X | Against::VelocityX | Against::TangentialSpeed if axes == Axes::Vertical => {
                Some("motion along the ground")
            }
            Against::Y if axes != Axes::Space => Some("motion across the plane"),
            Against::X | Against::Y | Against::VelocityX | Against::TangentialSpeed => None,
            Against::NormalSpeed | Against::Speed | Against::Z | Against::VelocityZ => None,
        },
        // What acts through another effect (a wind through the drag) shows in the height alone as well.
        None if spec_of(&block.kind)?.joins.is_some() => None,
        None => match spec_of(&block.kind)?.needs {
            Needs::Horizontal | Needs::Slip | Needs::Lateral if axes == Axes::Vertical => {
                Some("motion along the ground")
            }
            Needs::Slip => Some("the spin"),
            Needs::Lateral if axes == Axes::Plane => Some("motion across the plane"),
            Needs::Horizontal | Needs::Lateral => None,
            Needs::Spin | Needs::SpinInSpace => Some("the spin"),
            Needs::StartTime => Some("the clock of the session"),
            Needs::AreaPerMass => Some("the ball's size and mass"),
            Needs::Nothing | Needs::ReleaseAtRest | Needs::Coasting | Needs::OfEach => None,
        },
    };
    what.map(|what| (block.kind.as_str(), what))
}
