//! The ball as a [`System`]: its schema, and the conversion of tasks to throws.

use super::covariates;
use super::designs::designs;
use super::effects::{self, Feature, SCATTER_SPEC, Table as TableLaw, Target as TableTarget};
use super::objection::{objection, too_few_heights};
use super::plausibility::{foreign_records_objection, implausible};
use super::preconditions::Preconditions;
use super::residual_axes::residual_axes;
use super::scene::floor_height;
use super::segmentation::segment;
use super::tables::tables;
use super::{Axes, FLOOR, GRAVITY, LawRef, Offsets, RADIUS, RESTITUTION, Run, State, Throw, World, simulate};
use crate::Scalar;
use crate::lanes::{seeded, store, with_lanes};
use crate::library::Location;
use crate::model::Release;
use augsim_system::{
    Augment, Channel, Describe, Designs, Effect, ErrorFigure, Event, EventSchema, InitialValue, ModelTerm,
    Objection, Parameter, Prepare, Quantity, Record, Scatter, Schema, Seed, Simulate, Simulated,
    SimulationError, State as StateSchema, System, SystemError, Table, Target, Task, in_blocks,
};
use std::sync::Arc;

/// Maximum number of derivatives in one simulation; tasks with more are computed in blocks.
const MAX_LANES: usize = 40;

/// A ball that falls, flies and bounces, as a [`System`].
///
/// States are the measured coordinates of the lowest point (m), then their velocities (m/s); channels are the
/// measured coordinates. Events are impacts; their parameter is the restitution.
#[derive(Clone, Debug)]
pub struct Ball {
    schema: Arc<Schema>,
    library: Arc<[Effect]>,
    world: World,
    parameters: Vec<Parameter>,
    laws: Vec<ModelTerm>,
    released_at_rest: bool,
    declaration: BallDeclaration,
    /// Whether the model declares a radius of the ball.
    has_radius: bool,
    /// Height of the floor estimated from the records, m; `None` unless it is calibrated.
    detected_floor_m: Option<f64>,
}

/// What a model file of the ball declares besides parameters and simulated effects.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BallDeclaration {
    /// Whether the model declares the restitution; without it there are no impacts.
    pub bounces: bool,
    /// Whether the model declares the height of the floor.
    pub floor: bool,
    /// Kinds of the declared effects, including the random scatter.
    pub kinds: Vec<String>,
    /// Declared standard deviation of the measured position, m; `None` if not declared.
    pub position_sd_m: Option<f64>,
    /// Declared random scatter of the restitution; `None` if not declared.
    pub scatter: Option<Scatter>,
    /// Name of the height column of 1-D data, if it is not `height_m`.
    pub height_column: Option<String>,
}

/// Largest difference of estimated and declared floor height, m, without calibrating the floor height.
///
/// Smaller differences are left to the effect `height-offset`: they arise, for example, where the centre of
/// the ball was tracked instead of its lowest point. Applies to models that do not declare the floor height.
const MAX_FLOOR_DIFFERENCE_M: f64 = 0.05;

/// Minimum number of measured heights of a usable record.
const MIN_HEIGHTS: usize = 8;

impl Ball {
    /// Builds the ball from its effects (`world`) and its parameters, in the order of the parameter vector.
    ///
    /// A radius of 0 (unknown) becomes 1 m; without recorded spin the simulated positions do not depend on
    /// it.
    pub fn new(
        world: World,
        mut parameters: Vec<Parameter>,
        release: Release,
        declaration: BallDeclaration,
    ) -> Self {
        let has_radius = parameters.get(RADIUS).is_some_and(|radius| radius.nominal > 0.0);
        if let Some(radius) = parameters.get_mut(RADIUS)
            && !has_radius
        {
            radius.nominal = 1.0;
        }
        let library = effects::all::<f64>().iter().map(|e| Effect::from(e.spec())).collect();
        let released_at_rest = release == Release::Rest;
        Self {
            schema: Arc::new(schema(world.axes, released_at_rest, &declaration)),
            library,
            world,
            parameters,
            laws: Vec::new(),
            released_at_rest,
            declaration,
            has_radius,
            detected_floor_m: None,
        }
    }

    /// Height of the floor before any fit, m: estimated from the records, else declared.
    fn floor_m(&self) -> f64 {
        self.detected_floor_m.unwrap_or(self.parameters[FLOOR].nominal)
    }

    /// Simulates a task in the scalar `S`, which carries one derivative per seed of the task.
    fn run<S: Scalar>(&self, task: &Task<'_>, out: &mut Simulated) {
        let axes = self.world.axes.indices();
        let (record, times) = (task.record, task.times());
        let mut values = task.parameters.to_vec();
        if let Some(radius) = covariates::radius_m(record) {
            values[RADIUS] = radius;
        }
        let parameters: Vec<S> =
            seeded(&values, task.seeds, |s| if let Seed::Parameter(i) = s { Some(i) } else { None });
        let start: Vec<S> =
            seeded(task.start, task.seeds, |s| if let Seed::Start(i) = s { Some(i) } else { None });
        let covariates = covariates::values_or_zero(record);
        // A ball that is released at rest is released at time 0, whether there is a sample at that time or
        // not.
        let starts_at_release = self.released_at_rest && task.window.start == 0;
        let start_time = if starts_at_release { 0.0 } else { times.first().copied().unwrap_or(0.0) };
        let mut state = State { time: S::constant(start_time), ..State::at_rest(S::zero()) };
        state.spin = covariates.spin_rad_s.map(S::constant);
        for (i, &axis) in axes.iter().enumerate() {
            (state.position[axis], state.velocity[axis]) = (start[i], start[axes.len() + i]);
        }
        let offset = |s: Seed| if let Seed::Offset(i) = s { Some(i) } else { None };
        let xi: Vec<S> = match task.offsets {
            augsim_system::Offsets::None => Vec::new(),
            augsim_system::Offsets::Shared(x) => seeded(&[x], task.seeds, offset),
            augsim_system::Offsets::PerEvent(list) => seeded(list, task.seeds, offset),
        };
        let offsets = match (task.offsets, xi.first()) {
            (_, None) => Offsets::None,
            (augsim_system::Offsets::Shared(_), Some(&x)) => Offsets::Shared(x),
            (_, Some(_)) => Offsets::PerImpact(&xi),
        };
        let mut run = Run {
            positions: Vec::with_capacity(times.len()),
            velocities: Vec::new(),
            impacts: Vec::new(),
            rest_time: None,
        };
        let throw = Throw {
            world: &self.world,
            parameters: &parameters,
            start: state,
            covariates: &covariates,
            offsets,
            velocities: false,
        };
        simulate(&throw, times, &mut run);
        out.reset(times.len(), axes.len(), task.seeds.len(), Feature::ALL.len());
        for (k, position) in run.positions.iter().enumerate() {
            axes.iter().enumerate().for_each(|(c, &axis)| store(out, k, c, position[axis]));
        }
        for (index, impact) in run.impacts.iter().enumerate() {
            let length = |v: [S; 3]| v.iter().map(|x| x.value() * x.value()).sum::<f64>().sqrt();
            let features = Feature::ALL.iter().map(|feature| match feature {
                Feature::Time => impact.time.value(),
                Feature::Clock => impact.time.value() + covariates.clock_s,
                Feature::Bounce => index as f64,
                Feature::NormalSpeed => impact.speed_in.value(),
                Feature::TangentialSpeed | Feature::VelocityX => impact.tangential[0].value(),
                Feature::Slip => impact.slip[0].value(),
                Feature::Spin => length(impact.spin),
                Feature::X => impact.position[0].value(),
                Feature::Y => impact.position[1].value(),
                Feature::Z => impact.position[2].value(),
                // These features are not defined at impacts.
                Feature::Speed | Feature::VelocityZ => f64::NAN,
            });
            out.push_event(impact.time.value(), features);
        }
    }
}

impl Simulate for Ball {
    fn schema(&self) -> &Schema {
        &self.schema
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        task.check(&self.schema, self.parameters.len())?;
        in_blocks(task, MAX_LANES, out, |task, out| {
            with_lanes!(task.seeds.len(), [4, 8, 12, 16, 24; 40], S => self.run::<S>(task, out));
            Ok(())
        })
    }
}

impl Augment for Ball {
    fn library(&self) -> &[Effect] {
        &self.library
    }

    fn terms(&self) -> &[ModelTerm] {
        &self.laws
    }

    fn augmented(&self, laws: &[ModelTerm]) -> Result<Arc<dyn System>, SystemError> {
        let mut ball = self.clone();
        for law in laws {
            match law {
                ModelTerm::Effect(index) => {
                    let count = self.library.len();
                    let missing = SystemError::Effect { index: *index, count };
                    let effect = self.library.get(*index).ok_or(missing)?;
                    ball.world.add(LawRef::Listed(*index), effect.parameters.len());
                    ball.parameters.extend(effect.parameters.iter().map(Parameter::added));
                }
                ModelTerm::Table(table) => {
                    let missing = SystemError::Table { target: table.target, against: table.feature };
                    let target = *TableTarget::ALL.get(table.target).ok_or(missing)?;
                    let against = *Feature::ALL.get(table.feature).ok_or(missing)?;
                    let shape = TableLaw { target, feature: against, first: table.first, last: table.last };
                    ball.world.add(LawRef::Table(shape), table.knots);
                    ball.parameters.extend((0..table.knots).map(Parameter::knot));
                }
            }
            ball.laws.push(law.clone());
        }
        Ok(Arc::new(ball))
    }

    fn can_search_effect(&self, effect: usize, records: &[&Record]) -> bool {
        let preconditions = Preconditions {
            axes: self.world.axes,
            released_at_rest: self.released_at_rest,
            has_radius: self.has_radius,
            parameters: &self.parameters,
            kinds: &self.declaration.kinds,
        };
        preconditions.allows(effect, records)
    }

    fn candidate_tables(&self, records: &[&Record], events: &[Vec<Event>]) -> Vec<Table> {
        let floor_m = self.floor_m();
        tables(self.world.axes, floor_m, !self.parameters[RESTITUTION].frozen, records, events)
    }
}

impl Prepare for Ball {
    fn covariates(&self, constant: &dyn Fn(&str) -> Option<f64>) -> Vec<f64> {
        covariates::from_columns(constant)
    }

    fn prepare(&self, record: &mut Record, sd: &[f64]) -> Result<(), Objection> {
        let (Some(heights), Some(&sigma)) = (record.values.last(), sd.last()) else {
            return Err(too_few_heights());
        };
        if heights.iter().filter(|z| z.is_finite()).count() == 0 {
            return Err(too_few_heights());
        }
        segment(record, self.parameters[GRAVITY].nominal.max(0.1), sigma, self.declaration.bounces);
        let remaining = record.values.last().map_or(0, |z| z.iter().filter(|z| z.is_finite()).count());
        if remaining < MIN_HEIGHTS || record.smooth_segments.is_empty() {
            return Err(too_few_heights());
        }
        Ok(())
    }

    fn with_scene_from_data(&self, records: &[&Record]) -> Option<Arc<dyn System>> {
        let seen = floor_height(records, self.parameters[GRAVITY].nominal)?;
        let floor = &self.parameters[FLOOR];
        let is_elsewhere = (seen - floor.nominal).abs() > MAX_FLOOR_DIFFERENCE_M && !self.declaration.floor;
        if floor.frozen && !is_elsewhere {
            return None;
        }
        let mut ball = self.clone();
        ball.parameters[FLOOR].frozen = false;
        ball.detected_floor_m = Some(seen);
        Some(Arc::new(ball))
    }

    fn start_value(&self, parameter: usize) -> Option<f64> {
        self.detected_floor_m.filter(|_| parameter == FLOOR)
    }

    fn objection(&self, records: &[Record], sd: &[f64]) -> Option<Objection> {
        objection(&self.parameters, records, sd.last().copied().unwrap_or(0.0))
    }
}

impl Describe for Ball {
    fn quantity(&self, parameter: usize) -> Quantity {
        let Some(p) = self.parameters.get(parameter) else { return Quantity::new("", "") };
        match self.world.owner(parameter) {
            Some(kind) => {
                let spec =
                    effects::spec_of(kind).and_then(|s| s.parameters.iter().find(|q| q.name == p.name));
                Quantity::new(&format!("{kind}.{}", p.name), spec.map_or("", |q| q.unit))
            }
            None => {
                let unit = match p.name.as_str() {
                    "gravity_m_s2" => "m/s²",
                    "radius_m" | "floor_height_m" => "m",
                    _ => "",
                };
                Quantity::new(&p.name, unit)
            }
        }
    }

    fn residual_axes(&self, record: &Record, events: &[Event]) -> Vec<(String, Vec<f64>)> {
        residual_axes(record, events)
    }

    fn candidate_experiments(&self, records: &[&Record], step_s: f64) -> Designs {
        designs(self.schema.channels.len(), self.floor_m(), self.released_at_rest, records, step_s)
    }

    fn foreign_records_objection(&self, records: &[&Record], sd: &[f64]) -> Option<Objection> {
        foreign_records_objection(&self.parameters, records, sd.last().copied().unwrap_or(0.0))
    }

    fn implausible_values_objection(&self, values: &[f64]) -> Option<Objection> {
        implausible(&self.parameters, values)
    }
}

/// Schema of the ball for data with these axes.
fn schema(axes: Axes, released_at_rest: bool, declaration: &BallDeclaration) -> Schema {
    let height = declaration.height_column.as_deref().unwrap_or("height_m");
    let columns: &[&str] = match axes {
        Axes::Vertical => &[height],
        Axes::Plane => &["x_m", "z_m"],
        Axes::Space => &["x_m", "y_m", "z_m"],
    };
    let positions = columns.iter().enumerate().map(|(channel, column)| StateSchema {
        quantity: Quantity::new(column.trim_end_matches("_m"), "m"),
        initial: InitialValue::Measured(channel),
    });
    let velocities = columns.iter().map(|column| StateSchema {
        quantity: Quantity::new(&format!("velocity of {}", column.trim_end_matches("_m")), "m/s"),
        initial: if released_at_rest { InitialValue::Fixed(0.0) } else { InitialValue::Free },
    });
    let features = Feature::ALL.iter().map(|a| Quantity::new(a.name(), a.unit()));
    let targets = TableTarget::ALL.iter().map(|t| Target {
        typical: 1.0,
        quantity: Quantity::new(t.name(), t.unit()),
        location: t.location().name().into(),
        costly: t.location() == Location::Flight,
    });
    Schema {
        system: "ball".into(),
        record: ["trajectory".into(), "trajectories".into()],
        states: positions.chain(velocities).collect(),
        channels: columns
            .iter()
            .map(|c| Channel {
                column: c.to_string(),
                unit: "m".into(),
                sd: declaration.position_sd_m,
                ..Channel::default()
            })
            .collect(),
        inputs: Vec::new(),
        covariates: covariates::quantities(),
        clock: Some(covariates::CLOCK),
        features: features.collect(),
        targets: targets.collect(),
        error_figures: vec![ErrorFigure {
            name: "position".into(),
            channels: (0..columns.len()).collect(),
            unit: ("mm".into(), 1e3),
            is_euclidean: false,
        }],
        horizons_s: Vec::new(),
        record_random_effect: None,
        event: Some(EventSchema {
            nouns: ["impact".into(), "impacts".into()],
            parameter: RESTITUTION,
            scatter: Effect::from(&SCATTER_SPEC),
            declared: declaration.scatter,
            // A moving floor changes the rebound speed by its own velocity; relative to the impact speed,
            // that change decreases with the impact speed.
            periodic_scale_feature: Feature::ALL.iter().position(|a| *a == Feature::NormalSpeed),
        }),
        conditions: ["heights", "speeds", "spins"].map(String::from).to_vec(),
    }
}
