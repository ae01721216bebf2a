//! Planar pushing as a [`System`]: schema, simulation of one window, and data checks.

use super::covariates::residual_axes;
use super::effects;
use super::engine::{Push as Pushed, Steps};
use super::objection::{objection, too_short};
use super::path::Recorded;
use super::planar::Pose;
use super::poses::simulate_poses;
use super::preconditions::can_search_effect;
use super::segments;
use super::top_view::top_view;
use super::world::World;
use crate::Scalar;
use crate::lanes::{seeded, store, with_lanes};
use augsim_system::{
    Augment, Channel, Describe, Effect, ErrorFigure, Event, InitialValue, Input, InputInterpolation,
    ModelTerm, Objection, Parameter, Polar, Prepare, Quantity, Record, RecordRandomEffect, Schema, Seed,
    Simulate, Simulated, SimulationError, State, System, SystemError, Task, TopView, in_blocks,
};
use std::f64::consts::{FRAC_PI_4, PI, TAU};
use std::sync::Arc;

/// Maximum number of derivatives in one simulation; more are computed in blocks.
///
/// Only two lane counts are compiled, because the contact solver takes long to compile.
const MAX_LANES: usize = 16;

/// Sub-steps of fits and forecasts; the pose is within 10 µm of the finest over a push of 15 cm.
const FIT_STEPS: Steps = Steps { travel_m: 2e-3, duration_s: f64::INFINITY, inertial_s: 2e-3 };

/// An object on a table, pushed by a rod, as a [`System`].
///
/// States and channels are the pose as the sensor reports it (m, m, rad). The input is the position of the
/// rod's centre, linear between its samples. Windows that do not begin a record start with the push in
/// progress.
#[derive(Clone, Debug)]
pub struct Pushing {
    schema: Arc<Schema>,
    library: Arc<[Effect]>,
    world: World,
    declares: Arc<PushDeclaration>,
    parameters: Vec<Parameter>,
    laws: Vec<ModelTerm>,
}

/// What a model file of pushing declares besides its parameters: effects and noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PushDeclaration {
    /// Kinds of the model's effects, including the scatter of friction.
    pub effect_kinds: Vec<String>,
    /// Declared standard deviation of the position sensor, m; `None` if not declared.
    pub position_sd_m: Option<f64>,
    /// Declared standard deviation of the angle sensor, rad; `None` if not declared.
    pub angle_sd_rad: Option<f64>,
    /// Standard deviation of the centre of pressure between pushes, m; `None` if not declared.
    pub scatter_sd_m: Option<f64>,
    /// 95 % confidence interval of `scatter_sd_m`, m; `None` if the file has none.
    pub scatter_ci95_m: Option<[f64; 2]>,
}

/// Accuracy of rod positions, outlines and integration, in m and rad.
const RESOLUTION: f64 = 1e-5;

impl Pushing {
    /// A system of the object and effects of `world`, with one parameter per entry of the parameter vector.
    pub fn new(world: World, parameters: Vec<Parameter>, declares: PushDeclaration) -> Self {
        let library = effects::all::<f64>().iter().map(|e| Effect::from(e.spec())).collect();
        let (schema, declares) = (Arc::new(schema(&world, &declares)), Arc::new(declares));
        Self { schema, library, world, declares, parameters, laws: Vec::new() }
    }

    /// Simulates one window in the scalar `S`, which carries one derivative per seed of the task.
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
            steps: FIT_STEPS,
        };
        let mut poses = Vec::with_capacity(task.window.len());
        let is_mid_motion = task.window.start > 0 || task.record.is_mid_motion;
        simulate_poses(&push, task.times(), is_mid_motion, &mut poses)
            .map_err(|e| SimulationError::Engine(Box::new(e)))?;
        out.reset(task.window.len(), 3, task.seeds.len(), 0);
        for (k, pose) in poses.iter().enumerate() {
            store(out, k, 0, pose.position[0]);
            store(out, k, 1, pose.position[1]);
            store(out, k, 2, pose.angle);
        }
        Ok(())
    }
}

impl Simulate for Pushing {
    fn schema(&self) -> &Schema {
        &self.schema
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        task.check(&self.schema, self.parameters.len())?;
        in_blocks(
            task,
            MAX_LANES,
            out,
            |task, out| with_lanes!(task.seeds.len(), [8; 16], S => self.run::<S>(task, out)),
        )
    }

    fn resolution(&self, _channel: usize) -> f64 {
        RESOLUTION
    }
}

impl Augment for Pushing {
    fn library(&self) -> &[Effect] {
        &self.library
    }

    fn terms(&self) -> &[ModelTerm] {
        &self.laws
    }

    fn augmented(&self, laws: &[ModelTerm]) -> Result<Arc<dyn System>, SystemError> {
        let mut pushing = self.clone();
        for law in laws {
            match law {
                ModelTerm::Effect(index) => {
                    let missing = SystemError::Effect { index: *index, count: self.library.len() };
                    let effect = self.library.get(*index).ok_or(missing)?;
                    pushing.world.add(*index);
                    pushing.parameters.extend(effect.parameters.iter().map(Parameter::added));
                }
                ModelTerm::Table(t) => {
                    return Err(SystemError::Table { target: t.target, against: t.feature });
                }
            }
            pushing.laws.push(law.clone());
        }
        Ok(Arc::new(pushing))
    }

    fn null_points(&self, effect: usize) -> Vec<Vec<f64>> {
        let Some(effect) = self.library.get(effect) else { return Vec::new() };
        let nulls: Vec<f64> = effect.parameters.iter().map(|p| p.null).collect();
        match (effect.polar, &nulls[..]) {
            // The direction is undefined at the null value, so try directions over half a turn in four steps.
            (Some(Polar::Axis), &[amount, _]) => {
                (0..4).map(|k| vec![amount, FRAC_PI_4 * f64::from(k) - FRAC_PI_4]).collect()
            }
            (Some(Polar::Direction), &[amount, _]) => {
                (0..4).map(|k| vec![amount, FRAC_PI_4 * f64::from(k)]).collect()
            }
            _ => vec![nulls],
        }
    }

    fn can_search_effect(&self, effect: usize, records: &[&Record]) -> bool {
        can_search_effect(effect, &self.parameters, &self.declares, records)
    }

    /// Returns false: model files of pushing give an effect one value for all groups.
    fn can_vary_by_group(&self, _effect: usize) -> bool {
        false
    }
}

impl Prepare for Pushing {
    fn prepare(&self, record: &mut Record, sd: &[f64]) -> Result<(), Objection> {
        let estimated_sd = sd.iter().take(2).fold(0.0_f64, |a, b| a.max(*b));
        let position_sd_m = self.declares.position_sd_m.unwrap_or(0.0).max(estimated_sd);
        if segments::split(record, position_sd_m) { Ok(()) } else { Err(too_short()) }
    }

    fn objection(&self, records: &[Record], _sd: &[f64]) -> Option<Objection> {
        objection(&self.world, &self.parameters, &self.declares, records)
    }
}

impl Describe for Pushing {
    fn quantity(&self, parameter: usize) -> Quantity {
        let Some(p) = self.parameters.get(parameter) else { return Quantity::new("", "") };
        let owner = self.world.terms().iter().find(|t| (t.first..t.first + t.count).contains(&parameter));
        match owner.and_then(|term| self.library.get(term.effect).map(|effect| (term, effect))) {
            Some((term, effect)) => {
                let unit = effect.parameters.get(parameter - term.first).map_or("", |q| &q.unit);
                Quantity::new(&format!("{}.{}", effect.kind, p.name), unit)
            }
            None => {
                let unit = match p.name.as_str() {
                    "c_m" | "rod_radius_m" => "m",
                    "mass_kg" => "kg",
                    _ => "",
                };
                Quantity::new(&p.name, unit)
            }
        }
    }

    fn residual_axes(&self, record: &Record, _events: &[Event]) -> Vec<(String, Vec<f64>)> {
        residual_axes(record)
    }

    fn scene(&self, record: &Record, times: &[f64], values: &[f64]) -> Option<TopView> {
        top_view(&self.world, record, times, values)
    }
}

/// Schema of pushing: states, channels, inputs, error measures and random effects.
fn schema(world: &World, declares: &PushDeclaration) -> Schema {
    let pose = [("x", "m"), ("y", "m"), ("theta", "rad")];
    let channel = |(name, unit): (&str, &str)| {
        let sd = if unit == "rad" { declares.angle_sd_rad } else { declares.position_sd_m };
        Channel {
            column: format!("{name}_{unit}"),
            unit: unit.into(),
            period: (unit == "rad").then_some(TAU),
            sd,
            max_sd: None,
            min_sd: sd,
            update_column: Some("object_new".into()),
        }
    };
    let measure = |name: &str, channels: &[usize], unit: &str, factor: f64| ErrorFigure {
        name: name.into(),
        channels: channels.to_vec(),
        unit: (unit.into(), factor),
        is_euclidean: true,
    };
    let centre = world.terms().iter().find(|t| Some(t.effect) == effects::index_of(SCATTERED_EFFECT));
    Schema {
        system: "push".into(),
        record: ["push".into(), "pushes".into()],
        states: pose
            .iter()
            .enumerate()
            .map(|(c, (name, unit))| State {
                quantity: Quantity::new(name, unit),
                initial: InitialValue::Measured(c),
            })
            .collect(),
        channels: pose.into_iter().map(channel).collect(),
        inputs: vec![Input {
            columns: vec!["pusher_x_m".into(), "pusher_y_m".into()],
            interpolation: InputInterpolation::Linear,
            update_column: Some("pusher_new".into()),
        }],
        features: vec![
            Quantity::new("time", "s"),
            Quantity::new("heading", "rad"),
            Quantity::new("speed", "m/s"),
        ],
        horizons_s: vec![0.5, 1.0, 2.0],
        error_figures: vec![
            measure("position", &[0, 1], "mm", 1e3),
            measure("rotation", &[2], "degrees", 180.0 / PI),
        ],
        record_random_effect: effects::index_of(SCATTERED_EFFECT).map(|through| RecordRandomEffect {
            effect: through,
            parameters: centre.map(|t| t.first..t.first + t.count),
            scatter: Effect::from(&effects::SCATTER_SPEC),
            declared: declares.scatter_sd_m,
            declared_ci95: declares.scatter_ci95_m,
        }),
        conditions: ["start orientations", "contact offsets", "angles", "speeds"].map(String::from).to_vec(),
        ..Schema::default()
    }
}

/// Kind of the effect whose parameters, a centre of pressure, may scatter randomly between pushes.
const SCATTERED_EFFECT: &str = "pressure-offset";
