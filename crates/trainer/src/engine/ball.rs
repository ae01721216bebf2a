//! The ball of a model file as a physics engine whose steps nets correct.

use super::error::EngineError;
use super::motion::EngineModel;
use augsim_data::checks::ExpectedData;
use augsim_physics::ball::effects::{Feature, SCATTER_KIND, spec_of};
use augsim_physics::ball::{
    Axes, Covariates, FLOOR, GRAVITY, Offsets, RESTITUTION, Run, State, Throw, World, simulate,
};
use augsim_physics::library::{Location, Needs};
use augsim_physics::model::{EffectBlock, Model};

/// Name of the kind of effect that gives contacts a duration.
const CONTACT_KIND: &str = "contact-duration";
/// Name of the kind of effect that adds a constant error to measured heights.
const HEIGHT_OFFSET_KIND: &str = "height-offset";

/// Typical spread of restitutions between trajectories: the unit in which a net changes the restitution.
pub(super) const RESTITUTION_SPREAD: f64 = 0.1;
/// Step of the central differences with respect to the restitution.
const RESTITUTION_STEP: f64 = 0.01;

/// State columns of a ball that moves only vertically.
pub(super) const COLUMNS: [&str; 2] = ["height_m", "velocity_m_s"];
/// State columns of a throw in a plane.
const PLANE: [&str; 4] = ["x_m", "z_m", "velocity_x_m_s", "velocity_z_m_s"];
/// State columns of a throw in space.
const SPACE: [&str; 6] = ["x_m", "y_m", "z_m", "velocity_x_m_s", "velocity_y_m_s", "velocity_z_m_s"];

/// Simulates the ball of a model file exactly, one sample interval at a time or a whole roll-out.
///
/// States are those of the data: a constant height error of the model shifts the ground instead. A state
/// below the ground, which measurement noise causes, counts as on the ground. A single step cannot know
/// that a contact began before it, so single steps treat lasting contacts as instantaneous; a roll-out
/// simulates them.
#[derive(Debug)]
pub(super) struct ModelBall {
    /// Time from one sample to the next, s.
    step_s: f64,
    axes: Axes,
    /// Height of the ground in the coordinates of the data, m.
    ground_m: f64,
    expected: ExpectedData,
    left_out: Vec<String>,
    contact_s: Option<f64>,
    /// Simulated world and parameter values of a whole roll-out.
    rollout_model: (World, Vec<f64>),
    /// Simulated world and parameter values of single steps, without contact durations.
    step_model: (World, Vec<f64>),
}

impl ModelBall {
    /// Creates the engine of `model`, which steps by `step_s` seconds.
    ///
    /// # Errors
    /// [`EngineError`] if the step is not positive, or an effect depends on more than the states.
    pub fn new(model: &Model, axes: Axes, step_s: f64) -> Result<Self, EngineError> {
        if !(step_s > 0.0 && step_s.is_finite()) {
            return Err(EngineError::Step { step_s });
        }
        if let Some((kind, what)) = model.effects.iter().find_map(|b| unobserved_quantity(b, axes)) {
            return Err(EngineError::Hidden { kind: kind.to_owned(), what });
        }
        let world_with = |keep: &dyn Fn(&EffectBlock) -> bool| {
            let effects =
                model.effects.iter().filter(|b| is_deterministic_motion(b) && keep(b)).cloned().collect();
            Model { effects, ..model.clone() }.world(axes)
        };
        let is_contact = |b: &&EffectBlock| b.kind == CONTACT_KIND;
        let contact = model.effects.iter().find(is_contact).and_then(|b| b.parameters.first());
        let offset =
            model.effects.iter().find(|b| b.kind == HEIGHT_OFFSET_KIND).and_then(|b| b.parameters.first());
        let is_simulated = |b: &EffectBlock| is_deterministic_motion(b) || b.kind == HEIGHT_OFFSET_KIND;
        Ok(ModelBall {
            step_s,
            axes,
            ground_m: offset.map_or(0.0, |b| b.nominal),
            expected: ExpectedData { gravity_m_s2: model.expected().gravity_m_s2, ..ExpectedData::default() },
            left_out: model.effects.iter().filter(|b| !is_simulated(b)).map(|b| b.kind.clone()).collect(),
            contact_s: contact.map(|tau| tau.nominal),
            rollout_model: world_with(&|_| true),
            step_model: world_with(&|b| b.kind != CONTACT_KIND),
        })
    }
}

impl ModelBall {
    /// Whether a step from a state may reach the ground.
    /// Tests twice the distance of a free fall, so that drag and other effects of flight do not matter.
    fn may_bounce(&self, state: &[f64]) -> bool {
        let axes = self.axes.indices();
        let Some(up) = axes.iter().position(|&a| a == UP) else { return true };
        let (_, parameters) = &self.step_model;
        let height = state[up] - self.ground_m - parameters[FLOOR];
        let falls = self.step_s * (0.5 * parameters[GRAVITY] * self.step_s - state[axes.len() + up]);
        height < 2.0 * falls
    }

    /// Simulates states at `times` from a state at time zero, one row of positions and velocities per time.
    fn run(&self, (world, parameters): (&World, &[f64]), state: &[f64], times: &[f64]) -> Vec<f64> {
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

/// Index of the vertical coordinate in a position.
const UP: usize = 2;

impl EngineModel for ModelBall {
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

    fn expected(&self) -> ExpectedData {
        self.expected.clone()
    }

    fn ground_m(&self) -> Option<f64> {
        let (_, parameters) = &self.step_model;
        matches!(self.axes, Axes::Vertical).then(|| self.ground_m + parameters[FLOOR])
    }

    fn step(&self, state: &[f64], _: &[f64], _: &[f64], next: &mut [f64]) {
        let (world, parameters) = &self.step_model;
        next.copy_from_slice(&self.run((world, parameters), state, &[self.step_s]));
    }

    fn sensitivity_count(&self) -> usize {
        1
    }

    fn trajectory_sensitivities(&self, state: &[f64], _: &[f64], _: &[f64], changes: &mut [f64]) {
        if !self.may_bounce(state) {
            changes.fill(0.0);
            return;
        }
        let (world, parameters) = &self.step_model;
        let [above, below] = [1.0, -1.0].map(|side| {
            let mut moved = parameters.clone();
            moved[RESTITUTION] += side * RESTITUTION_STEP;
            self.run((world, &moved), state, &[self.step_s])
        });
        for ((change, above), below) in changes.iter_mut().zip(above).zip(below) {
            *change = RESTITUTION_SPREAD * (above - below) / (2.0 * RESTITUTION_STEP);
        }
    }

    fn rollout(&self, start: &[f64], _: &[f64], time: usize) -> Vec<f64> {
        let times: Vec<f64> = (0..time).map(|t| t as f64 * self.step_s).collect();
        let (world, parameters) = &self.rollout_model;
        let mut out = self.run((world, parameters), start, &times);
        // The first row is the measured state, also where that is below the ground.
        out[..start.len()].copy_from_slice(start);
        out
    }

    fn ignored_effects(&self) -> &[String] {
        &self.left_out
    }

    fn contact_duration_s(&self) -> Option<f64> {
        self.contact_s
    }
}

/// Whether an effect changes the ball's motion deterministically (not a sensor or random effect).
fn is_deterministic_motion(block: &EffectBlock) -> bool {
    block.kind != SCATTER_KIND && location(block) != Some(Location::Sensor)
}

fn location(block: &EffectBlock) -> Option<Location> {
    match &block.table {
        Some(table) => Some(table.target.location()),
        None => spec_of(&block.kind).map(|s| s.location),
    }
}

/// Finds a quantity that an effect depends on and that the states along `axes` do not contain.
/// Returns the kind of the effect and the quantity; `None` if the states suffice.
fn unobserved_quantity(block: &EffectBlock, axes: Axes) -> Option<(&str, &'static str)> {
    if !is_deterministic_motion(block) {
        return None;
    }
    let what = match &block.table {
        Some(table) => match table.feature {
            Feature::Time => Some("the time since the release"),
            Feature::Clock => Some("the clock of the session"),
            Feature::Bounce => Some("the number of the bounce"),
            Feature::Slip | Feature::Spin => Some("the spin"),
            Feature::X | Feature::VelocityX | Feature::TangentialSpeed if axes == Axes::Vertical => {
                Some("motion along the ground")
            }
            Feature::Y if axes != Axes::Space => Some("motion across the plane"),
            Feature::X | Feature::Y | Feature::VelocityX | Feature::TangentialSpeed => None,
            Feature::NormalSpeed | Feature::Speed | Feature::Z | Feature::VelocityZ => None,
        },
        // An effect that acts through another one (wind through drag) is visible in the height alone as
        // well.
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
            Needs::Nothing | Needs::ReleaseAtRest | Needs::Coasting | Needs::PerTrajectory => None,
        },
    };
    what.map(|what| (block.kind.as_str(), what))
}

#[cfg(test)]
mod tests {
    //! Contract: the sensitivity to the restitution matches finite differences and is zero in the air.
    use super::*;
    use augsim_physics::ball::bullet::BulletBall;

    /// Change of a step's next state when the restitution increases from 0.5 by [`RESTITUTION_SPREAD`].
    fn unit_difference(step: &dyn Fn(f64, &mut [f64; 2])) -> [f64; 2] {
        let [mut less, mut more] = [[0.0; 2]; 2];
        step(0.5, &mut less);
        step(0.5 + RESTITUTION_SPREAD, &mut more);
        [more[0] - less[0], more[1] - less[1]]
    }

    #[test]
    fn restitution_sensitivities_match_finite_differences() {
        let step_s = 1.0 / 60.0;
        let text = |restitution: f64| {
            format!(
                "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = {{ nominal = 9.81, frozen = true }}\nrestitution = \
                 {restitution}\n"
            )
        };
        let exact = |restitution: f64| {
            let model = Model::parse(&text(restitution), "model.toml").unwrap();
            ModelBall::new(&model, Axes::Vertical, step_s).unwrap()
        };
        let bullet = |restitution: f64| BulletBall { restitution, ..BulletBall::default() };
        // In the air, about to touch, a little below the ground, at rest on it.
        for state in [[2.0, -3.0], [0.05, -6.0], [-0.02, -8.0], [0.0, 0.0]] {
            let bullet_difference =
                unit_difference(&|e, next| EngineModel::step(&bullet(e), &state, &[], &[], next));
            let model_difference = unit_difference(&|e, next| exact(e).step(&state, &[], &[], next));
            let (mut bullet_changes, mut model_changes) = ([0.0; 2], [0.0; 2]);
            bullet(0.5).trajectory_sensitivities(&state, &[], &[], &mut bullet_changes);
            exact(0.5).trajectory_sensitivities(&state, &[], &[], &mut model_changes);
            for j in 0..2 {
                assert!(
                    (bullet_changes[j] - bullet_difference[j]).abs() < 1e-12,
                    "{state:?}: {bullet_changes:?} {bullet_difference:?}"
                );
                // Gravity acts after the bounce for a time that does not depend on the restitution, so the
                // step is linear.
                assert!(
                    (model_changes[j] - model_difference[j]).abs() < 1e-9,
                    "{state:?}: {model_changes:?} {model_difference:?}"
                );
            }
            let is_in_the_air = state[0] > 1.0;
            assert_eq!(
                model_changes == [0.0; 2],
                is_in_the_air || state == [0.0; 2],
                "{state:?}: {model_changes:?}"
            );
        }
    }
}
