//! Simulates measured pushes for a given true effect, and writes a model file that does not declare the
//! effect.

use super::dissipation::Surface;
use super::integrate::{HALF_M, ROD_M, World};
use augsim_data::{DataError, Dataset, Trajectory, random_stream};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use std::f64::consts::PI;

/// True effect of a set of pushes, with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PushKind {
    ExactSurface,
    Superellipsoid(f64),
    PressureOffset(f64, f64),
    TableAnisotropy(f64, f64),
    ObjectAnisotropy(f64, f64),
    FrictionGradient(f64, f64),
    ContactSlip(f64),
    TipOffset(f64, f64),
    /// Registration error between the frames of rod and object: relative scale, and angle, rad.
    FrameRegistration(f64, f64),
    RodCompliance(f64),
    PoseOffset(f64, f64),
    PoseLatency(f64),
    TableTilt(f64, f64),
    PushHeight(f64),
    /// Scatter of the centre of pressure: standard deviation between pushes, m, and mean, m.
    FrictionScatter(f64, [f64; 2]),
}

impl PushKind {
    /// Kind of the effect, as the library and answers name it.
    pub fn name(&self) -> &'static str {
        match self {
            PushKind::ExactSurface => "exact-surface",
            PushKind::Superellipsoid(_) => "superelliptic-surface",
            PushKind::PressureOffset(..) => "pressure-offset",
            PushKind::TableAnisotropy(..) => "table-anisotropy",
            PushKind::ObjectAnisotropy(..) => "object-anisotropy",
            PushKind::FrictionGradient(..) => "friction-gradient",
            PushKind::ContactSlip(_) => "contact-friction-slip",
            PushKind::TipOffset(..) => "tip-offset",
            PushKind::FrameRegistration(..) => "frame-registration",
            PushKind::RodCompliance(_) => "rod-compliance",
            PushKind::PoseOffset(..) => "pose-offset",
            PushKind::PoseLatency(_) => "pose-latency",
            PushKind::TableTilt(..) => "table-tilt",
            PushKind::PushHeight(_) => "push-height",
            PushKind::FrictionScatter(..) => "friction-scatter",
        }
    }
}

/// True effect and parameters of a set of pushes.
#[derive(Clone, Debug)]
pub struct PushTruth {
    pub effect: Option<PushKind>,
    /// Whether the true friction is summed over patches instead of computed in closed form.
    ///
    /// The model then declares `exact-surface`, except for [`PushKind::ExactSurface`].
    pub patches: bool,
    pub c_m: f64,
    pub contact_friction: f64,
    pub pushes: usize,
}

/// A generated set of pushes with its truth, which a test must not read before the verdict.
pub struct SealedPushes {
    pub data: Dataset,
    pub model: String,
    truth: PushTruth,
}

impl SealedPushes {
    /// The true effect and parameters; a test reads them only after the verdict.
    pub fn truth(&self) -> &PushTruth {
        &self.truth
    }
}

/// Draws effect number `which`: typical sizes, varied by about a third, in random directions.
fn effect(rng: &mut Xoshiro256PlusPlus, which: usize) -> PushKind {
    let vary = rng.random_range(0.75..1.33);
    let turn = rng.random_range(-PI..PI);
    let vector = |size: f64| (size * vary * turn.cos(), size * vary * turn.sin());
    match which % 15 {
        0 => PushKind::ExactSurface,
        1 => PushKind::Superellipsoid(1.7),
        2 => {
            let (x, y) = vector(3e-3);
            PushKind::PressureOffset(x, y)
        }
        3 => PushKind::TableAnisotropy(1.0 + 0.25 * vary, 0.5 * turn),
        4 => PushKind::ObjectAnisotropy(1.0 + 0.25 * vary, 0.5 * turn),
        5 => {
            let (x, y) = vector(1.0);
            PushKind::FrictionGradient(x, y)
        }
        6 => PushKind::ContactSlip(20.0 * vary),
        7 => {
            let (x, y) = vector(0.6e-3);
            PushKind::TipOffset(x, y)
        }
        8 => PushKind::RodCompliance(1.25e-4 * vary),
        9 => {
            let (x, y) = vector(1.2e-3);
            PushKind::PoseOffset(x, y)
        }
        10 => PushKind::PoseLatency(0.02 * vary),
        11 => PushKind::TableTilt(0.0175 * vary, turn),
        12 => PushKind::PushHeight(0.01 * vary),
        13 => PushKind::FrameRegistration(0.008 * vary * turn.cos(), 0.01 * vary * turn.sin()),
        _ => PushKind::FrictionScatter(2e-3 * vary, [0.0; 2]),
    }
}

/// Draws the truth of `pushes` pushes; `which` selects the effect, `None` for no effect.
pub fn draw_push(rng: &mut Xoshiro256PlusPlus, which: Option<usize>, pushes: usize) -> PushTruth {
    let effect = which.map(|w| effect(rng, w));
    let exact = effect == Some(PushKind::ExactSurface);
    let is_superellipsoid = matches!(effect, Some(PushKind::Superellipsoid(_)));
    PushTruth {
        effect,
        patches: exact || (rng.random_bool(0.5) && !is_superellipsoid),
        c_m: rng.random_range(0.031..0.039),
        contact_friction: rng.random_range(0.2..0.35),
        pushes,
    }
}

/// Standard deviation of the noise of a measured position, m.
const POSITION_SD_M: f64 = 3e-4;
/// Standard deviation of the noise of a measured angle, rad.
const ANGLE_SD_RAD: f64 = 0.1 * PI / 180.0;
/// Travel of the rod in one push, m.
const TRAVEL_M: f64 = 0.15;
/// Number of samples per push.
const SAMPLES: usize = 150;

/// Simulates and measures the set of pushes with this truth.
///
/// # Errors
/// None for a truth from [`draw_push`].
pub fn seal_pushes(truth: PushTruth, seed: u64) -> Result<SealedPushes, DataError> {
    let surface = match (truth.effect, truth.patches) {
        (Some(PushKind::Superellipsoid(p)), _) => Surface::Superellipsoid(truth.c_m, p),
        (_, true) => Surface::square(2.0 * HALF_M),
        _ => Surface::Ellipsoid(truth.c_m),
    };
    let stretch = match truth.effect {
        Some(PushKind::TableAnisotropy(ratio, angle) | PushKind::ObjectAnisotropy(ratio, angle)) => {
            let (s, c) = angle.sin_cos();
            let (a, b) = (ratio.sqrt(), 1.0 / ratio.sqrt());
            [[a * c * c + b * s * s, (a - b) * c * s], [(a - b) * c * s, a * s * s + b * c * c]]
        }
        _ => [[1.0, 0.0], [0.0, 1.0]],
    };
    let world = World { truth: &truth, surface, stretch, centre: [0.0; 2] };
    let trajectories: Result<Vec<Trajectory>, DataError> =
        (0..truth.pushes).into_par_iter().map(|j| push(&world, seed, j)).collect();
    let names = ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"];
    let declared = if truth.patches && truth.effect != Some(PushKind::ExactSurface) {
        "[[effect]]\nkind = \"exact-surface\"\n"
    } else {
        ""
    };
    let model = format!(
        "scenario = \"push\"\nobject = \"rect1\"\n[parameters]\nc_m = {{ nominal = 0.0344, min = 0.01, max = 0.1 }}\n\
         contact_friction = {{ nominal = 0.25, min = 0.0, max = 1.0 }}\nrod_radius_m = 0.00475\nsupport_friction = 0.15\n\
         mass_kg = 0.8374\n[sensor]\nposition_sd_m = {POSITION_SD_M}\nangle_sd_rad = {ANGLE_SD_RAD}\n{declared}"
    );
    Ok(SealedPushes { data: Dataset::from_names(&names, trajectories?)?, model, truth })
}

/// Simulates and measures push number `j`.
fn push(world: &World<'_>, seed: u64, j: usize) -> Result<Trajectory, DataError> {
    let mut rng = random_stream(seed, "sealed push", j as u64);
    let normal = |rng: &mut Xoshiro256PlusPlus| -> f64 { StandardNormal.sample(rng) };
    let start = [rng.random_range(-0.2..0.2), rng.random_range(-0.2..0.2), rng.random_range(-PI..PI)];
    let (side, face_position) = (rng.random_range(0..4), HALF_M * rng.random_range(-0.8..0.8));
    let push_angle = rng.random_range(-1.05..1.05);
    let speed = [0.01, 0.02, 0.05][rng.random_range(0..3)];
    // The rod starts 2 mm before the face, so that an offset of the rod does not make it start inside.
    let face_angle = 0.5 * PI * f64::from(side);
    let distance = HALF_M + ROD_M + 2e-3;
    let (s, c) = (face_angle + start[2]).sin_cos();
    let from = [start[0] + distance * c - face_position * s, start[1] + distance * s + face_position * c];
    let (ds, dc) = (face_angle + start[2] + PI + push_angle).sin_cos();
    let u = [speed * dc, speed * ds];
    let duration = TRAVEL_M / speed;
    let times: Vec<f64> = (0..SAMPLES).map(|k| 1.03 * duration * k as f64 / (SAMPLES - 1) as f64).collect();
    let (delay, pose_offset) = match world.truth.effect {
        Some(PushKind::PoseLatency(d)) => (d, [0.0; 2]),
        Some(PushKind::PoseOffset(x, y)) => (0.0, [x, y]),
        _ => (0.0, [0.0; 2]),
    };
    let true_times: Vec<f64> = times.iter().map(|t| (t - delay).max(0.0)).collect();
    let centre = match world.truth.effect {
        Some(PushKind::PressureOffset(x, y)) => [x, y],
        Some(PushKind::FrictionScatter(sd, mean)) => {
            let mut rng = random_stream(seed, "sealed centre", j as u64);
            mean.map(|m| m + sd * normal(&mut rng))
        }
        _ => [0.0; 2],
    };
    let world = World { centre, surface: world.surface.clone(), ..*world };
    let poses = world.poses(start, from, u, duration, &true_times);
    let mut columns = vec![Vec::new(); 5];
    for (t, pose) in times.iter().zip(&poses) {
        let t = t.min(duration);
        let (s, c) = pose[2].sin_cos();
        let values = [
            from[0] + u[0] * t,
            from[1] + u[1] * t,
            pose[0] + c * pose_offset[0] - s * pose_offset[1] + POSITION_SD_M * normal(&mut rng),
            pose[1] + s * pose_offset[0] + c * pose_offset[1] + POSITION_SD_M * normal(&mut rng),
            pose[2] + ANGLE_SD_RAD * normal(&mut rng),
        ];
        columns.iter_mut().zip(values).for_each(|(c, v)| c.push(v));
    }
    Trajectory::new(format!("{j}"), times, columns)
}
