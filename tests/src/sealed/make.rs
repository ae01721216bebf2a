//! Simulates measurements for given true effects, and writes a model file that declares none of these
//! effects.

use super::integrate::{Physics, Start};
use super::truth::{Kind, Scene, Truth, Unlisted};
use augsim_data::{DataError, Dataset, Trajectory};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A generated data set with its truth, which a test must not read before the verdict of the discovery.
pub struct Sealed {
    /// Simulated measurements, without the truth.
    pub data: Dataset,
    /// Text of the model file, which declares none of the true effects.
    pub model: String,
    truth: Truth,
}

impl Sealed {
    /// The true effects and noise; a test reads them only after the verdict.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }
}

/// Text of the model file: gravity, a restitution to calibrate, and position noise of `sd_m` (m).
pub fn model_text(scene: &Scene, sd_m: f64) -> String {
    let release = if scene.at_rest { "rest" } else { "free" };
    let geometry = if scene.plane { "radius_m = 0.02\ninertia_ratio = 0.4\n" } else { "" };
    format!(
        "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = {{ nominal = 9.81, frozen = true }}\n\
         restitution = {{ nominal = 0.65, min = 0.0, max = 1.0 }}\n{geometry}[sensor]\nposition_sd_m = {sd_m:?}\n[release]\nkind = \"{release}\"\n"
    )
}

/// Draws a standard normal number.
fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}

/// A smooth residual at `times` (s), in standard deviations of the noise.
///
/// It is the sum of three waves with random amplitudes and phases over a record of `length_s`, s.
fn wobble(rng: &mut Xoshiro256PlusPlus, amplitude: f64, times: &[f64], length_s: f64) -> Vec<f64> {
    let waves: Vec<(f64, f64)> =
        (0..3).map(|_| (amplitude * normal(rng), rng.random_range(0.0..std::f64::consts::TAU))).collect();
    let residual_at = |t: f64| {
        let angle = |n: usize| std::f64::consts::PI * (n + 1) as f64 * t / length_s;
        waves.iter().enumerate().map(|(n, (a, phase))| a * (angle(n) + phase).sin()).sum()
    };
    times.iter().map(|&t| residual_at(t)).collect()
}

/// Simulates and measures the data set of a scene and a truth.
///
/// # Errors
/// None for a scene from [`draw`](super::draw).
pub fn seal(scene: &Scene, truth: Truth, rng: &mut Xoshiro256PlusPlus) -> Result<Sealed, DataError> {
    let laboratory = Laboratory { scene, truth: &truth };
    let trajectories = (0..scene.trajectories).map(|index| laboratory.trajectory(index, rng));
    let trajectories = trajectories.collect::<Result<_, _>>()?;
    let names: &[&str] = if scene.plane {
        &["x_m", "z_m", "start_time_s", "spin_rad_s"]
    } else {
        &["height_m", "start_time_s"]
    };
    Ok(Sealed {
        data: Dataset::from_names(names, trajectories)?,
        model: model_text(scene, scene.noise_m / truth.declared_ratio),
        truth,
    })
}

/// Simulates and measures the trajectories of one scene (recording conditions) with one truth.
struct Laboratory<'a> {
    scene: &'a Scene,
    truth: &'a Truth,
}

impl Laboratory<'_> {
    /// Parameter value of the first true effect that `pick` accepts; 0 if there is none.
    fn parameter(&self, pick: impl Fn(&Kind) -> Option<f64>) -> f64 {
        self.truth.effects.iter().find_map(pick).unwrap_or(0.0)
    }

    /// Simulates and measures the trajectory with number `index`.
    fn trajectory(&self, index: usize, rng: &mut Xoshiro256PlusPlus) -> Result<Trajectory, DataError> {
        let start = self.draw_start(index, rng);
        let times = self.draw_times(rng);
        let true_positions = self.true_positions(&start, &times, rng);
        let (mut xs, mut zs) = self.measure(&true_positions, rng);
        if self.truth.wobble > 0.0 {
            let length_s = times.last().copied().unwrap_or(1.0);
            for channel in [&mut xs, &mut zs] {
                let smooth = wobble(rng, self.truth.wobble, &times, length_s);
                channel.iter_mut().zip(smooth).for_each(|(v, w)| *v += self.scene.noise_m * w);
            }
        }
        let count = times.len();
        let constant = |v: f64| vec![v; count];
        let values = if self.scene.plane {
            vec![xs, zs, constant(start.session), constant(start.spin)]
        } else {
            vec![zs, constant(start.session)]
        };
        Trajectory::new(format!("{index}"), times, values)
    }

    /// Draws initial state, time of release in the session, and deviations of restitution of a trajectory.
    fn draw_start(&self, index: usize, rng: &mut Xoshiro256PlusPlus) -> Start {
        let scene = self.scene;
        let per_impact = self.parameter(|k| if let Kind::ScatterImpact(s) = k { Some(*s) } else { None });
        let per_trajectory =
            self.parameter(|k| if let Kind::ScatterTrajectory(s) = k { Some(*s) } else { None });
        let pause = 1200.0 / scene.trajectories as f64;
        let session = index as f64 * pause + rng.random_range(0.0..0.5 * pause);
        let shared = per_trajectory * normal(rng);
        Start {
            x: if scene.plane { rng.random_range(-0.3..0.3) } else { 0.0 },
            z: rng.random_range(0.4..2.2),
            vx: if scene.plane { rng.random_range(0.2..1.8) } else { 0.0 },
            vz: if scene.at_rest { 0.0 } else { rng.random_range(-1.0..1.5) },
            spin: if scene.plane { rng.random_range(-80.0..80.0) } else { 0.0 },
            clock: session - 600.0,
            session,
            offsets: (0..40).map(|_| shared + per_impact * normal(rng)).collect(),
        }
    }

    /// Draws the nominal sample times, s. Irregular sets lack some samples and have uneven intervals.
    fn draw_times(&self, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let scene = self.scene;
        let n = (rng.random_range(1.5..2.6) * scene.rate_hz) as usize;
        let mut times: Vec<f64> = Vec::new();
        for k in 0..n {
            if scene.irregular && rng.random_bool(0.05) {
                continue;
            }
            let uneven = if scene.irregular { rng.random_range(0.0..0.3) } else { 0.0 };
            times.push((k as f64 + uneven) / scene.rate_hz);
        }
        times
    }

    /// True positions `(x, z)`, m, at the true sample times: the nominal `times` with latency and jitter.
    fn true_positions(&self, start: &Start, times: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<(f64, f64)> {
        let latency = self.parameter(|k| if let Kind::Latency(s) = k { Some(*s) } else { None });
        let jitter_s = self.truth.jitter_s;
        let true_times: Vec<f64> = times.iter().map(|t| t - latency + jitter_s * normal(rng)).collect();
        // The simulation needs increasing times, but jitter may exchange neighbours.
        let mut order: Vec<usize> = (0..true_times.len()).collect();
        order.sort_by(|&a, &b| true_times[a].total_cmp(&true_times[b]));
        let sorted: Vec<f64> = order.iter().map(|&i| true_times[i].max(0.0)).collect();
        let physics = Physics { truth: self.truth, restitution: self.scene.restitution };
        let positions = physics.positions(start, &sorted);
        let mut true_positions = vec![(0.0, 0.0); true_times.len()];
        order.iter().zip(positions).for_each(|(&i, p)| true_positions[i] = p);
        true_positions
    }

    /// Measures positions `(x, z)` with distortions, noise and outliers of the camera; returns `(all x, all
    /// z)`.
    fn measure(&self, positions: &[(f64, f64)], rng: &mut Xoshiro256PlusPlus) -> (Vec<f64>, Vec<f64>) {
        let (scene, truth) = (self.scene, self.truth);
        let offset = self.parameter(|k| if let Kind::HeightOffset(s) = k { Some(*s) } else { None });
        let roll = self.parameter(|k| if let Kind::Roll(s) = k { Some(*s) } else { None });
        let (mut ex, mut ez) = (0.0, 0.0);
        let rho = truth.correlation;
        let innovation = (1.0 - rho * rho).sqrt();
        let (mut xs, mut zs) = (Vec::new(), Vec::new());
        for (k, &(x, z)) in positions.iter().enumerate() {
            let innovation_scale = if k == 0 { 1.0 } else { innovation };
            ex = rho * ex + innovation_scale * normal(rng);
            ez = rho * ez + innovation_scale * normal(rng);
            let mut spike = || {
                if rng.random::<f64>() < truth.outliers { 12.0 * normal(rng) } else { 0.0 }
            };
            let (sx, sz) = (spike(), spike());
            let distorted = match truth.unlisted {
                Some(Unlisted::Lens(a)) => z + a * (z - 0.7).powi(3),
                _ => z,
            };
            xs.push(x * roll.cos() - distorted * roll.sin() + scene.noise_m * (ex + sx));
            zs.push(x * roll.sin() + distorted * roll.cos() + offset + scene.noise_m * (ez + sz));
        }
        (xs, zs)
    }
}
