//! Pushing with one rod as an engine that nets correct.
//!
//! Quasi-static motion with an ellipsoidal limit surface (Lynch, Maekawa and Tanie 1992), and the effects
//! that a discovery has added.

use super::motion::EngineModel;
use crate::push::{ACTIONS, STATES};
use augsim_physics::model::PushModel;
use augsim_physics::push::effects::index_of;
use augsim_physics::push::{
    C_INDEX, CONTACT_FRICTION_INDEX, Instant, Pose, Push, ROD_RADIUS_INDEX, Recorded, Run,
    SUPPORT_FRICTION_INDEX, Steps, World, simulate,
};

/// Maximum distance that the rod moves in a simulation step, m.
const MAX_TRAVEL_M: f64 = 1e-3;

/// Simulates how the rod of a model file pushes its object, with any outline.
#[derive(Debug, Clone)]
pub(crate) struct ModelPush {
    world: World,
    parameters: Vec<f64>,
    left_out: Vec<String>,
}

impl ModelPush {
    /// Creates the engine of a model, at the nominal values of its parameters and effects.
    pub fn new(model: &PushModel) -> Self {
        let (world, parameters) = model.world();
        let left_out = model.effects.iter().filter(|b| index_of(&b.kind).is_none());
        ModelPush { world, parameters, left_out: left_out.map(|b| b.kind.clone()).collect() }
    }

    /// Ratio c of maximum moment to maximum force of the limit surface of friction, m.
    pub fn c_m(&self) -> f64 {
        self.parameters[C_INDEX]
    }

    /// Friction coefficient between rod and object.
    pub fn contact_friction(&self) -> f64 {
        self.parameters[CONTACT_FRICTION_INDEX]
    }

    /// Radius of the rod, m.
    pub fn rod_radius_m(&self) -> f64 {
        self.parameters[ROD_RADIUS_INDEX]
    }

    /// Friction coefficient between the pushed object and its support.
    /// Quasi-static motion does not depend on it; the nets' features use it for the coasting distance.
    pub fn support_friction(&self) -> f64 {
        self.parameters[SUPPORT_FRICTION_INDEX]
    }

    /// The pushed object and its effects.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Simulates poses and contact states along rod positions `actions [time, (x, y, t)]` from pose `start`.
    /// Where measured rod and object overlap at the start, because of noise or an offset between clocks, the
    /// engine moves the object out.
    pub fn follow(&self, start: &[f64], actions: &[f64]) -> Vec<(Pose<f64>, Instant<f64>)> {
        let column = |j: usize| -> Vec<f64> { actions.chunks_exact(3).map(|a| a[j]).collect() };
        let (x, y, t) = (column(0), column(1), column(2));
        let first = Pose::new(start[0], start[1], start[2]);
        let mut run = Run::default();
        let is_simulated = Recorded::new(&t, &x, &y).is_some_and(|path| {
            let steps = Steps { travel_m: MAX_TRAVEL_M, ..Steps::default() };
            let push = Push {
                world: &self.world,
                parameters: &self.parameters,
                start: first,
                path: &path,
                field: None,
                steps,
            };
            simulate(&push, &t, &mut run).is_ok()
        });
        if is_simulated {
            return run.poses.into_iter().zip(run.instants).collect();
        }
        // The rod starts deep inside the object: simulating one straight interval at a time resolves any
        // overlap.
        step_by_step(&self.world, &self.parameters, first, actions)
    }

    /// Simulates the object's poses `[time, 3]` from pose `start`, along the rod positions `actions`.
    pub fn poses(&self, start: &[f64], actions: &[f64]) -> Vec<f64> {
        self.follow(start, actions)
            .iter()
            .flat_map(|(p, _)| [p.position[0], p.position[1], p.angle])
            .collect()
    }
}

impl EngineModel for ModelPush {
    fn columns(&self) -> Vec<&str> {
        STATES.to_vec()
    }

    fn action_columns(&self) -> Vec<&str> {
        ACTIONS.to_vec()
    }

    fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
        next.copy_from_slice(&self.poses(state, &[from, to].concat())[3..6]);
    }

    fn rollout(&self, start: &[f64], actions: &[f64], _: usize) -> Vec<f64> {
        self.poses(start, actions)
    }

    fn ignored_effects(&self) -> &[String] {
        &self.left_out
    }
}

fn step_by_step(
    world: &World,
    parameters: &[f64],
    start: Pose<f64>,
    actions: &[f64],
) -> Vec<(Pose<f64>, Instant<f64>)> {
    let mut stepper = augsim_physics::push::Stepper::new(
        world,
        parameters,
        Steps { travel_m: MAX_TRAVEL_M, ..Steps::default() },
    );
    let rows: Vec<&[f64]> = actions.chunks_exact(3).collect();
    let mut out = Vec::with_capacity(rows.len());
    let (mut pose, mut twist) = (start, augsim_physics::push::Twist::zero());
    let Some(first) = rows.first() else { return out };
    out.push((pose, stepper.instant(&pose, [first[0], first[1]], [0.0; 2])));
    for w in rows.windows(2) {
        let duration = (w[1][2] - w[0][2]).max(1e-6);
        let next = stepper.step(pose, twist, [w[0][0], w[0][1]], [w[1][0], w[1][1]], duration);
        (pose, twist) = (next.pose, next.twist);
        out.push((pose, next.instant));
    }
    out
}
