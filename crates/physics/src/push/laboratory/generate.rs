//! Generation of synthetic pushes: true simulation and measurement noise.

use super::layout::{PlannedPush, PushDesign, uniform};
use super::{SupportSheet, map};
use crate::model::PushModel;
use crate::push::planar::{Rotation, Vector, add, scale};
use crate::push::{
    CONTACT_FRICTION_INDEX, Motion, Object, Path, Pose, Push, PushError, ROD_RADIUS_INDEX, Run,
    SUPPORT_FRICTION_INDEX, Steps, StraightPiece, StraightPush, World, simulate,
};
use augsim_data::{DataError, Dataset, Limit, Source, Trajectory, random_stream};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::Serialize;

/// Names of the columns of the data besides `trajectory` and `t_s`.
pub const COLUMNS: [&str; 5] = ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"];

/// Duration of rest that is recorded before the push, s.
const REST_BEFORE_S: f64 = 0.05;
/// Time recorded after the push, s, in which a fast object coasts.
const REST_AFTER_S: f64 = 0.25;
/// Truncation of the random start pose, in standard deviations from its nominal value.
const TRUNCATION_SD: f64 = 3.3;
/// Lowest sampling rate, Hz; below it a push is over between two samples.
const MIN_RATE_HZ: f64 = 1.0;
/// Highest sampling rate, Hz; the simulation takes at least one step per sample.
const MAX_RATE_HZ: f64 = 1e5;
/// Number of patches across the object in the true simulation.
const PATCHES_ACROSS: usize = 8;

/// Specification of a set of pushes: design, object, support, sampling and measurement noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PushRecipe {
    /// Experiment design: contacts, angles, speeds and travel of the pushes.
    pub protocol: PushDesign,
    /// Name of the object, one of [`OBJECTS`](crate::push::OBJECTS).
    pub object: String,
    /// Support surface on which the object slides.
    pub support: SupportSheet,
    /// Number of pushes in the set.
    pub pushes: usize,
    /// Sampling rate of the data, Hz.
    pub rate_hz: f64,
    /// Standard deviation of the measured position, m.
    pub position_sd_m: f64,
    /// Standard deviation of the measured angle, rad.
    pub angle_sd_rad: f64,
    /// Standard deviation of the start position about its nominal value, m.
    pub place_sd_m: f64,
    /// Standard deviation of the start angle, rad; not used by a random design, which draws any angle.
    pub place_sd_rad: f64,
    /// Speed of the rod above which the true object has inertia, m/s.
    pub inertia_above_m_s: f64,
}

impl PushRecipe {
    /// A recipe with default sampling and motion-capture noise of 0.3 mm and 0.1 degrees.
    pub fn new(protocol: PushDesign, object: &Object, support: SupportSheet, pushes: usize) -> Self {
        Self {
            protocol,
            object: object.name.clone(),
            support,
            pushes,
            rate_hz: 100.0,
            position_sd_m: 3e-4,
            angle_sd_rad: 0.1_f64.to_radians(),
            place_sd_m: 3e-4,
            place_sd_rad: 0.3_f64.to_radians(),
            inertia_above_m_s: 0.05,
        }
    }
}

/// True values of one generated push: plan, start and end pose, inertia.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GeneratedTruth {
    /// The commanded push: contact, angle, speed and travel.
    pub planned: PlannedPush,
    /// True start pose of the object: x, m, y, m, and angle, rad.
    pub start: [f64; 3],
    /// True end pose of the object: x, m, y, m, and angle, rad.
    pub end: [f64; 3],
    /// Whether the object had inertia in this push.
    pub inertia: bool,
}

/// A generated set of pushes with its declared model and its true values.
#[derive(Clone, Debug)]
pub struct Generated {
    /// Data of all pushes: [`COLUMNS`] in the world frame; the pose is that of the area centroid.
    pub data: Dataset,
    /// The declared model, whose physics differs from the truth.
    pub declared: PushModel,
    /// True values of each push.
    pub truths: Vec<GeneratedTruth>,
}

/// Reason why a set of pushes cannot be generated.
#[derive(Debug, thiserror::Error)]
pub enum LaboratoryError {
    /// The object of the recipe is not built in.
    #[error("there is no object `{name}`; choose one of {}", crate::push::OBJECTS.join(", "))]
    Object {
        /// Name of the unknown object.
        name: String,
    },
    /// A setting of the recipe is out of range.
    #[error("`{setting}` = {value} {rule}")]
    Setting {
        /// Name of the setting that is out of range.
        setting: &'static str,
        /// Value of the setting.
        value: f64,
        /// Rule that the value of the setting violates.
        rule: &'static str,
    },
    /// The path of the rod in `simulate_along` is malformed.
    #[error(
        "the path of the rod is malformed; give one finite x and y for each time, and strictly increasing times"
    )]
    Path,
    /// A push of the set cannot be simulated.
    #[error("push {index}: {source}")]
    Push {
        /// Index of the push that cannot be simulated.
        index: usize,
        /// Error of the simulation of that push.
        source: PushError,
    },
    /// The data set of the generated pushes cannot be built.
    #[error(transparent)]
    Data(#[from] DataError),
}

impl PushRecipe {
    /// Generates the set of pushes; push i depends only on the seed and i, for any number of threads.
    ///
    /// # Errors
    /// The object is unknown, a setting is out of range, a limit is exceeded, or a push cannot be simulated.
    pub fn generate(&self, seed: u64) -> Result<Generated, LaboratoryError> {
        let object = Object::named(&self.object)
            .ok_or_else(|| LaboratoryError::Object { name: self.object.clone() })?;
        if !(MIN_RATE_HZ..=MAX_RATE_HZ).contains(&self.rate_hz) {
            let rule = "must be between 1 and 100,000 Hz";
            return Err(LaboratoryError::Setting { setting: "rate_hz", value: self.rate_hz, rule });
        }
        for (setting, value) in [
            ("position_sd_m", self.position_sd_m),
            ("angle_sd_rad", self.angle_sd_rad),
            ("place_sd_m", self.place_sd_m),
            ("place_sd_rad", self.place_sd_rad),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                let rule = "must be finite and not negative";
                return Err(LaboratoryError::Setting { setting, value, rule });
            }
        }
        let limit_error = |cause| LaboratoryError::Data(DataError::Limit { origin: Source::Memory, cause });
        Limit::Trajectories.check(self.pushes as u64).map_err(limit_error)?;
        let mut declared = PushModel::textbook(object.clone());
        declared.parameters[SUPPORT_FRICTION_INDEX].nominal = self.support.friction;
        declared.position_sd_m = (self.position_sd_m > 0.0).then_some(self.position_sd_m);
        declared.angle_sd_rad = (self.angle_sd_rad > 0.0).then_some(self.angle_sd_rad);
        let truth = Truth::new(self, &object);
        let plans = self.protocol.plan(&object, self.pushes, seed);
        // The estimate leaves out the clearance of some millimetres; the limits need not be exact.
        let samples = plans.iter().map(|plan| {
            let push = path(&object, plan, &Pose::new(0.0, 0.0, 0.0), 0.0, 0.0);
            (REST_BEFORE_S + push.duration_s() + REST_AFTER_S) * self.rate_hz + 2.0
        });
        let (longest, total) =
            samples.fold((0.0, 0.0), |(longest, total), n| (f64::max(longest, n), total + n));
        Limit::Samples.check(longest as u64).map_err(limit_error)?;
        Limit::Cells.check((total * COLUMNS.len() as f64) as u64).map_err(limit_error)?;
        let rows: Vec<_> = plans
            .par_iter()
            .enumerate()
            .map_init(Run::default, |run, (index, plan)| self.make(&truth, plan, seed, index, run))
            .collect();
        let mut trajectories = Vec::with_capacity(rows.len());
        let mut made = Vec::with_capacity(rows.len());
        for row in rows {
            let (trajectory, push_truth) = row?;
            trajectories.push(trajectory);
            made.push(push_truth);
        }
        Ok(Generated { data: Dataset::from_names(&COLUMNS, trajectories)?, declared, truths: made })
    }

    /// Plans and simulates push `index`, and adds measurement noise.
    fn make(
        &self,
        truth: &Truth,
        plan: &PlannedPush,
        seed: u64,
        index: usize,
        run: &mut Run<f64>,
    ) -> Result<(Trajectory, GeneratedTruth), LaboratoryError> {
        let stream = |purpose| random_stream(seed, purpose, index as u64);
        let mut place_rng = stream("push-place");
        let nominal = match self.protocol {
            PushDesign::Random => {
                let angle = uniform(&mut place_rng, -std::f64::consts::PI, std::f64::consts::PI);
                Pose::new(0.35, -0.03, angle)
            }
            _ => Pose::new(0.35, -0.03, 0.0),
        };
        let mut scattered = |sd: f64| {
            let x: f64 = StandardNormal.sample(&mut place_rng);
            sd * x.clamp(-TRUNCATION_SD, TRUNCATION_SD)
        };
        let start = Pose {
            position: [
                nominal.position[0] + scattered(self.place_sd_m),
                nominal.position[1] + scattered(self.place_sd_m),
            ],
            angle: nominal.angle + scattered(self.place_sd_rad),
        };
        let inertia = plan.speed_m_s > self.inertia_above_m_s;
        let world = truth.world(inertia);
        // The clearance covers any truncated scatter of the start pose, so the rod never starts inside the
        // object.
        let radius = world.object().outline.radius();
        let clearance = TRUNCATION_SD * (2.0_f64.sqrt() * self.place_sd_m + radius * self.place_sd_rad);
        let start_distance = truth.parameters[ROD_RADIUS_INDEX] + clearance;
        let path = path(world.object(), plan, &nominal, start_distance, clearance);
        let field = map::draw(
            self.support.friction_scatter,
            self.support.correlation_m,
            start.position,
            plan.travel_m + radius + 0.1,
            &mut stream("push-map"),
        );
        let duration = REST_BEFORE_S + path.duration_s() + REST_AFTER_S;
        let count = (duration * self.rate_hz).ceil() as usize + 1;
        let times: Vec<f64> = (0..count).map(|i| i as f64 / self.rate_hz - REST_BEFORE_S).collect();
        let rest_then_push = Delayed(path);
        let push = Push {
            world,
            parameters: &truth.parameters,
            start,
            path: &rest_then_push,
            field: field.as_ref(),
            steps: Truth::STEPS,
        };
        simulate(&push, &times, run).map_err(|source| LaboratoryError::Push { index, source })?;
        let mut noise_rng = stream("push-noise");
        let mut noise = |sd: f64| {
            let x: f64 = StandardNormal.sample(&mut noise_rng);
            sd * x
        };
        let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(count); COLUMNS.len()];
        for (pose, &time) in run.poses.iter().zip(&times) {
            let rod = rest_then_push.position(time);
            let row = [
                rod[0],
                rod[1],
                pose.position[0] + noise(self.position_sd_m),
                pose.position[1] + noise(self.position_sd_m),
                pose.angle + noise(self.angle_sd_rad),
            ];
            columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        }
        let clock = (0..count).map(|i| i as f64 / self.rate_hz).collect();
        let as_array = |p: &Pose<f64>| [p.position[0], p.position[1], p.angle];
        let end = run.poses.last().map_or(as_array(&start), as_array);
        let made = GeneratedTruth { planned: *plan, start: as_array(&start), end, inertia };
        Ok((Trajectory::new(index.to_string(), clock, columns)?, made))
    }
}

/// The true objects and effects of the generated pushes, with and without inertia, and their parameters.
pub(super) struct Truth {
    quasi_static: World,
    dynamic: World,
    parameters: Vec<f64>,
}

impl Truth {
    /// Bounds on the sub-steps of the true simulations, twice as long as the default.
    pub(super) const STEPS: Steps = Steps { travel_m: 1e-3, duration_s: f64::INFINITY, inertial_s: 2e-3 };

    /// The true object and effects, with inertia or without.
    pub(super) fn world(&self, has_inertia: bool) -> &World {
        if has_inertia { &self.dynamic } else { &self.quasi_static }
    }

    /// Parameter values of both true worlds.
    pub(super) fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Builds the true objects and effects that a recipe describes.
    pub(super) fn new(recipe: &PushRecipe, object: &Object) -> Self {
        let support = &recipe.support;
        let mut quasi_static = World::new(object.clone()).with_patches(PATCHES_ACROSS, |_| 1.0);
        if support.anisotropy_ratio != 1.0 {
            quasi_static.add_kind("table-anisotropy");
        }
        let mut parameters = quasi_static.nominal();
        parameters[CONTACT_FRICTION_INDEX] = support.contact_friction;
        parameters[SUPPORT_FRICTION_INDEX] = support.friction;
        if let Some(term) = quasi_static.terms().first() {
            parameters[term.first] = support.anisotropy_ratio;
            parameters[term.first + 1] = support.anisotropy_angle_rad;
        }
        let mut dynamic = quasi_static.clone();
        dynamic.add_kind("inertia");
        Self { quasi_static, dynamic, parameters }
    }
}

/// Path of the rod for a planned push of an object at its nominal pose.
///
/// It starts `start_distance` from the side and travels `clearance` further than planned.
fn path(
    object: &Object,
    plan: &PlannedPush,
    nominal: &Pose<f64>,
    start_distance: f64,
    clearance: f64,
) -> StraightPush {
    let (point, normal) = object.point_on_side(plan.side, plan.fraction);
    let clear = scale(normal, start_distance);
    let direction = Rotation::new(plan.angle_rad).to_world(scale(normal, -1.0));
    StraightPush {
        start_m: nominal.to_world(add(point, clear)),
        direction: Rotation::new(nominal.angle).to_world(direction),
        speed_m_s: plan.speed_m_s,
        acceleration_m_s2: plan.acceleration_m_s2,
        travel_m: plan.travel_m + clearance,
    }
}

/// A straight push that begins at time 0, with the rod at rest before.
#[derive(Clone, Copy, Debug)]
struct Delayed(StraightPush);

impl Delayed {
    /// Position of the rod at `time` (s), m.
    fn position(&self, time: f64) -> Vector<f64> {
        Path::<f64>::piece(self, time).position(time)
    }
}

impl Path<f64> for Delayed {
    type MotionPiece = DelayedPiece;
    fn piece(&self, time: f64) -> DelayedPiece {
        if time < 0.0 {
            DelayedPiece::Rest(self.0.start_m)
        } else {
            DelayedPiece::Moving(Path::<f64>::piece(&self.0, time))
        }
    }
    fn end_of_piece(&self, time: f64) -> f64 {
        if time < 0.0 { 0.0 } else { Path::<f64>::end_of_piece(&self.0, time) }
    }
}

/// One piece of a [`Delayed`] push: rest before it, or motion.
#[derive(Clone, Copy, Debug)]
enum DelayedPiece {
    Rest(Vector<f64>),
    Moving(StraightPiece),
}

impl Motion<f64> for DelayedPiece {
    fn position(&self, time: f64) -> Vector<f64> {
        match self {
            DelayedPiece::Rest(place) => *place,
            DelayedPiece::Moving(piece) => piece.position(time),
        }
    }
    fn velocity(&self, time: f64) -> Vector<f64> {
        match self {
            DelayedPiece::Rest(_) => [0.0; 2],
            DelayedPiece::Moving(piece) => piece.velocity(time),
        }
    }
}
