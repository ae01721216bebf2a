//! Pushing behind [`System`]: its schema, and one window of a push as a task.

use super::effects;
use super::engine::{Push as Pushed, Steps};
use super::path::Recorded;
use super::planar::Pose;
use super::poses::simulate_poses;
use super::world::World;
use crate::Scalar;
use crate::model::Parameter;
use crate::system::{
    Begin, Between, Channel, Effect, Input, Law, Measure, Quantity, Schema, Seed, Simulated, SimulationError,
    State, System, SystemError, Task, in_blocks, seeded, with_lanes,
};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Most derivatives of one simulation: more run in blocks. Two widths, because the contact solver compiles long.
const WIDEST: usize = 16;

/// Rod travel in a sub-step, m: within 10 µm of the finest over a push of 15 cm.
const STEPS: Steps = Steps { travel_m: 2e-3, duration_s: f64::INFINITY, inertial_s: 2e-3 };

/// An object on a table, pushed by a rod, as a [`System`].
///
/// States are the pose as the sensor reports it (m, m, rad), and so are the channels; the input is the rod's centre, in
/// straight lines between its samples. Windows that do not begin a record are under way.
#[derive(Clone, Debug)]
pub struct Pushing {
    schema: Arc<Schema>,
    library: Arc<[Effect]>,
    world: World,
    parameters: Vec<Parameter>,
    laws: Vec<Law>,
}

impl Pushing {
    /// The pushes of a declared world with these parameters, one for each place of the world's vector.
    pub fn new(world: World, parameters: Vec<Parameter>) -> Self {
        let library = effects::all::<f64>().iter().map(|e| Effect::from(e.spec())).collect();
        Self { schema: Arc::new(schema()), library, world, parameters, laws: Vec::new() }
    }

    /// Simulates in the scalar whose lanes are the seeds of the task.
    fn run<S: Scalar>(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        let parameters: Vec<S> =
            seeded(task.parameters, task.seeds, |s| if let Seed::Parameter(i) = s { Some(i) } else { None });
        let start: Vec<S> =
            seeded(task.start, task.seeds, |s| if let Seed::Start(i) = s { Some(i) } else { None });
        let rod = &task.record.inputs[0];
        let path = match &rod.values[..] {
            [x, y] => Recorded::new(&rod.times, x, y),
            _ => None,
        };
        let path = path.ok_or_else(|| SimulationError::Task {
            system: self.schema.system.clone(),
            part: "finite positions of the rod at increasing times, in columns",
            expected: 2,
            found: rod.values.len(),
        })?;
        let push = Pushed {
            world: &self.world,
            parameters: &parameters,
            start: Pose::new(start[0], start[1], start[2]),
            path: &path,
            field: None,
            steps: STEPS,
        };
        let mut poses = Vec::with_capacity(task.window.len());
        simulate_poses(&push, task.times(), task.window.start > 0, &mut poses)
            .map_err(|e| SimulationError::Engine(Box::new(e)))?;
        out.reset(task.window.len(), 3, task.seeds.len(), 0);
        for (k, pose) in poses.iter().enumerate() {
            out.set(k, 0, pose.position[0]);
            out.set(k, 1, pose.position[1]);
            out.set(k, 2, pose.angle);
        }
        Ok(())
    }
}

impl System for Pushing {
    fn schema(&self) -> &Schema {
        &self.schema
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn library(&self) -> &[Effect] {
        &self.library
    }

    fn laws(&self) -> &[Law] {
        &self.laws
    }

    fn augmented(&self, laws: &[Law]) -> Result<Arc<dyn System>, SystemError> {
        let mut pushing = self.clone();
        for law in laws {
            match law {
                Law::Effect(index) => {
                    let missing = SystemError::Effect { index: *index, count: self.library.len() };
                    let effect = self.library.get(*index).ok_or(missing)?;
                    pushing.world.add(*index);
                    pushing.parameters.extend(effect.parameters.iter().map(Parameter::added));
                }
                Law::Table(t) => {
                    return Err(SystemError::Table { target: t.target, against: t.against });
                }
            }
            pushing.laws.push(law.clone());
        }
        Ok(Arc::new(pushing))
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        task.check(&self.schema, self.parameters.len())?;
        in_blocks(
            task,
            WIDEST,
            out,
            |task, out| with_lanes!(task.seeds.len(), [8; 16], S => self.run::<S>(task, out)),
        )
    }
}

fn schema() -> Schema {
    let pose = [("x", "m"), ("y", "m"), ("theta", "rad")];
    let channel = |(name, unit): (&str, &str)| Channel {
        column: format!("{name}_{unit}"),
        unit: unit.into(),
        period: (unit == "rad").then_some(TAU),
        sd: None,
        sd_at_most: None,
    };
    let measure = |name: &str, channels: &[usize], unit: &str, factor: f64| Measure {
        name: name.into(),
        channels: channels.to_vec(),
        unit: (unit.into(), factor),
    };
    Schema {
        system: "push".into(),
        record: ["push".into(), "pushes".into()],
        states: pose
            .iter()
            .enumerate()
            .map(|(c, (name, unit))| State { quantity: Quantity::new(name, unit), begin: Begin::Measured(c) })
            .collect(),
        channels: pose.into_iter().map(channel).collect(),
        inputs: vec![Input {
            columns: vec!["pusher_x_m".into(), "pusher_y_m".into()],
            between: Between::Linear,
        }],
        features: vec![
            Quantity::new("time", "s"),
            Quantity::new("heading", "rad"),
            Quantity::new("speed", "m/s"),
        ],
        measures: vec![
            measure("position", &[0, 1], "mm", 1e3),
            measure("rotation", &[2], "degrees", 180.0 / PI),
        ],
        ..Schema::default()
    }
}
