//! Pushes made: the truth runs, a sensor looks.

use super::layout::{Planned, Protocol, uniform};
use super::{SupportSheet, map};
use crate::model::PushModel;
use crate::push::planar::{Rotation, Vector, add, scale};
use crate::push::{
    CONTACT_FRICTION, Motion, Object, Path, Pose, Push, PushError, ROD_RADIUS, Run, SUPPORT_FRICTION, Steps,
    StraightPiece, StraightPush, World, simulate,
};
use augsim_data::{DataError, Dataset, Limit, Source, Trajectory, random_stream};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::Serialize;

/// Columns of the data, beside `trajectory` and `t_s`.
pub const COLUMNS: [&str; 5] = ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"];

/// Rest before the push, s.
const BEFORE_S: f64 = 0.05;
/// Rest after it, s: the time in which a fast object coasts.
const AFTER_S: f64 = 0.25;
/// Standard deviations at which the scatter of the object's place is cut.
const CUT: f64 = 3.3;
/// Rates that a sensor may have: below the first a push is over between two samples, Hz.
const LOWEST_RATE_HZ: f64 = 1.0;
/// The simulation takes a step for each sample at least, Hz.
const HIGHEST_RATE_HZ: f64 = 1e5;
/// Patches across the object.
const PATCHES: usize = 8;

/// An order for pushes: layout, object, support, sampling, sensor noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recipe {
    /// The layout.
    pub protocol: Protocol,
    /// Name of the object, one of [`OBJECTS`](crate::push::OBJECTS).
    pub object: String,
    /// The support.
    pub support: SupportSheet,
    /// Number of pushes.
    pub pushes: usize,
    /// Samples per second.
    pub rate_hz: f64,
    /// Standard deviation of the measured position, m.
    pub position_sd_m: f64,
    /// Standard deviation of the measured angle, rad.
    pub angle_sd_rad: f64,
    /// Standard deviation of the object's start position about its nominal place, m.
    pub place_sd_m: f64,
    /// Standard deviation of its start angle, rad. A random layout draws any angle.
    pub place_sd_rad: f64,
    /// Rod speed above which the truth has inertia, m/s.
    pub inertia_above_m_s: f64,
}

impl Recipe {
    /// The recipe of a protocol: motion-capture noise of 0.3 mm and 0.1 degrees.
    pub fn new(protocol: Protocol, object: &Object, support: SupportSheet, pushes: usize) -> Self {
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

/// The truth of one push that was made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Made {
    /// The plan.
    pub planned: Planned,
    /// True start of the object: x, y, m, and angle, rad.
    pub start: [f64; 3],
    /// True end of the object.
    pub end: [f64; 3],
    /// Whether the truth had inertia.
    pub inertia: bool,
}

/// A set of pushes with what is declared and what is true.
#[derive(Clone, Debug)]
pub struct Generated {
    /// `trajectory,t_s` and [`COLUMNS`]; the world frame, pose of the area centroid.
    pub data: Dataset,
    /// The model that is declared.
    pub declared: PushModel,
    /// The truth, push by push.
    pub made: Vec<Made>,
}

/// Why a set cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum LaboratoryError {
    /// No such object.
    #[error("there is no object `{name}`; choose one of {}", crate::push::OBJECTS.join(", "))]
    Object {
        /// The name.
        name: String,
    },
    /// A setting that cannot be.
    #[error("`{setting}` = {value} {rule}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// Rule that the value breaks.
        rule: &'static str,
    },
    /// A path of the rod that is none.
    #[error("the rod's path: give as many x and y as times, finite, and times that increase")]
    Path,
    /// A push that cannot be simulated.
    #[error("push {index}: {source}")]
    Push {
        /// Its index.
        index: usize,
        /// The error of the simulation.
        source: PushError,
    },
    /// The data set refuses it.
    #[error(transparent)]
    Data(#[from] DataError),
}

impl Recipe {
    /// Makes the set. Push i depends on the seed and i alone, whatever the threads.
    ///
    /// # Errors
    /// The object is unknown or a setting makes no sense.
    pub fn generate(&self, seed: u64) -> Result<Generated, LaboratoryError> {
        let object = Object::named(&self.object)
            .ok_or_else(|| LaboratoryError::Object { name: self.object.clone() })?;
        if !(LOWEST_RATE_HZ..=HIGHEST_RATE_HZ).contains(&self.rate_hz) {
            let rule = "must lie between 1 and 100,000 Hz";
            return Err(LaboratoryError::Setting { setting: "rate_hz", value: self.rate_hz, rule });
        }
        for (setting, value) in [
            ("position_sd_m", self.position_sd_m),
            ("angle_sd_rad", self.angle_sd_rad),
            ("place_sd_m", self.place_sd_m),
            ("place_sd_rad", self.place_sd_rad),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                let rule = "must be a finite number that is not negative";
                return Err(LaboratoryError::Setting { setting, value, rule });
            }
        }
        let too_much = |cause| LaboratoryError::Data(DataError::Limit { origin: Source::Memory, cause });
        Limit::Trajectories.check(self.pushes as u64).map_err(too_much)?;
        let mut declared = PushModel::textbook(object.clone());
        declared.parameters[SUPPORT_FRICTION].nominal = self.support.friction;
        declared.position_sd_m = (self.position_sd_m > 0.0).then_some(self.position_sd_m);
        declared.angle_sd_rad = (self.angle_sd_rad > 0.0).then_some(self.angle_sd_rad);
        let truth = Truth::new(self, &object);
        let plans = self.protocol.plan(&object, self.pushes, seed);
        // Without the clearance, which is some millimetres: a limit need not be exact.
        let samples = plans.iter().map(|plan| {
            let push = path(&object, plan, &Pose::new(0.0, 0.0, 0.0), 0.0, 0.0);
            (BEFORE_S + push.duration_s() + AFTER_S) * self.rate_hz + 2.0
        });
        let (longest, all) = samples.fold((0.0, 0.0), |(longest, all), n| (f64::max(longest, n), all + n));
        Limit::Samples.check(longest as u64).map_err(too_much)?;
        Limit::Cells.check((all * COLUMNS.len() as f64) as u64).map_err(too_much)?;
        let rows: Vec<_> = plans
            .par_iter()
            .enumerate()
            .map_init(Run::default, |run, (index, plan)| self.make(&truth, plan, seed, index, run))
            .collect();
        let mut trajectories = Vec::with_capacity(rows.len());
        let mut made = Vec::with_capacity(rows.len());
        for row in rows {
            let (trajectory, one) = row?;
            trajectories.push(trajectory);
            made.push(one);
        }
        Ok(Generated { data: Dataset::from_names(&COLUMNS, trajectories)?, declared, made })
    }

    fn make(
        &self,
        truth: &Truth,
        plan: &Planned,
        seed: u64,
        index: usize,
        run: &mut Run<f64>,
    ) -> Result<(Trajectory, Made), LaboratoryError> {
        let stream = |purpose| random_stream(seed, purpose, index as u64);
        let mut place = stream("push-place");
        let nominal = match self.protocol {
            Protocol::Random => {
                let angle = uniform(&mut place, -std::f64::consts::PI, std::f64::consts::PI);
                Pose::new(0.35, -0.03, angle)
            }
            _ => Pose::new(0.35, -0.03, 0.0),
        };
        let mut scattered = |sd: f64| {
            let x: f64 = StandardNormal.sample(&mut place);
            sd * x.clamp(-CUT, CUT)
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
        // However the object's place is scattered, the rod starts clear of it.
        let reach = world.object().outline.radius();
        let clearance = CUT * (2.0_f64.sqrt() * self.place_sd_m + reach * self.place_sd_rad);
        let off = truth.parameters[ROD_RADIUS] + clearance;
        let path = path(world.object(), plan, &nominal, off, clearance);
        let field = map::draw(
            self.support.friction_scatter,
            self.support.correlation_m,
            start.position,
            plan.travel_m + reach + 0.1,
            &mut stream("push-map"),
        );
        let duration = BEFORE_S + path.duration_s() + AFTER_S;
        let count = (duration * self.rate_hz).ceil() as usize + 1;
        let times: Vec<f64> = (0..count).map(|i| i as f64 / self.rate_hz - BEFORE_S).collect();
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
        let mut sensor = stream("push-noise");
        let mut noise = |sd: f64| {
            let x: f64 = StandardNormal.sample(&mut sensor);
            sd * x
        };
        let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(count); COLUMNS.len()];
        for (pose, &time) in run.poses.iter().zip(&times) {
            let rod = rest_then_push.at(time);
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
        let plain = |p: &Pose<f64>| [p.position[0], p.position[1], p.angle];
        let end = run.poses.last().map_or(plain(&start), plain);
        let made = Made { planned: *plan, start: plain(&start), end, inertia };
        Ok((Trajectory::new(index.to_string(), clock, columns)?, made))
    }
}

/// The true worlds, which differ by inertia, and their parameters.
pub(super) struct Truth {
    quasi_static: World,
    dynamic: World,
    parameters: Vec<f64>,
}

impl Truth {
    /// Steps of its simulations, twice those of the engine's default.
    pub(super) const STEPS: Steps = Steps { travel_m: 1e-3, duration_s: f64::INFINITY, inertial_s: 2e-3 };

    /// The world with inertia or without.
    pub(super) fn world(&self, has_inertia: bool) -> &World {
        if has_inertia { &self.dynamic } else { &self.quasi_static }
    }

    /// Parameters of both worlds.
    pub(super) fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    pub(super) fn new(recipe: &Recipe, object: &Object) -> Self {
        let sheet = &recipe.support;
        let mut quasi_static = World::new(object.clone()).with_patches(PATCHES, |_| 1.0);
        if sheet.anisotropy_ratio != 1.0 {
            quasi_static.add_kind("table-anisotropy");
        }
        let mut parameters = quasi_static.nominal();
        parameters[CONTACT_FRICTION] = sheet.contact_friction;
        parameters[SUPPORT_FRICTION] = sheet.friction;
        if let Some(term) = quasi_static.terms().first() {
            parameters[term.first] = sheet.anisotropy_ratio;
            parameters[term.first + 1] = sheet.anisotropy_angle_rad;
        }
        let mut dynamic = quasi_static.clone();
        dynamic.add_kind("inertia");
        Self { quasi_static, dynamic, parameters }
    }
}

/// The rod's path for an object at its nominal place: it starts `off` its side and goes `clearance` further than planned.
fn path(object: &Object, plan: &Planned, nominal: &Pose<f64>, off: f64, clearance: f64) -> StraightPush {
    let (point, normal) = object.point_on_side(plan.side, plan.fraction);
    let clear = scale(normal, off);
    let direction = Rotation::new(plan.angle_rad).to_world(scale(normal, -1.0));
    StraightPush {
        start_m: nominal.to_world(add(point, clear)),
        direction: Rotation::new(nominal.angle).to_world(direction),
        speed_m_s: plan.speed_m_s,
        acceleration_m_s2: plan.acceleration_m_s2,
        travel_m: plan.travel_m + clearance,
    }
}

/// A push that begins at time 0, at rest before.
#[derive(Clone, Copy, Debug)]
struct Delayed(StraightPush);

impl Delayed {
    fn at(&self, time: f64) -> Vector<f64> {
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

/// Piece of a delayed motion: at rest at the start, then moving.
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
