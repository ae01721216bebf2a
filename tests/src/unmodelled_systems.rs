//! Recordings of systems that are not a bouncing ball: tumbling bodies, a pendulum, a spring, changed units.

use augsim_data::{DataError, Dataset, Trajectory, random_stream};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Gravitational acceleration, m/s².
const G: f64 = 9.81;
/// Standard deviation of the measurement noise of every coordinate, m.
const NOISE_M: f64 = 0.001;
/// Sampling rate, Hz.
const RATE_HZ: f64 = 100.0;

/// A vector in space: x, y, z.
type V = [f64; 3];

/// Computes `a + s b`.
fn add(a: V, b: V, s: f64) -> V {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A rigid square (corners in the plane y = 0) or cube that falls and hits the floor with its corners.
struct Body {
    position: V,
    velocity: V,
    /// Angular velocity, rad/s.
    angular_velocity: V,
    corners: Vec<V>,
    /// Moment of inertia per mass, m²; the same about all axes of rotation.
    inertia: f64,
    restitution: f64,
    friction: f64,
}

impl Body {
    /// Advances the body by `dt` (s), with an impulse at its lowest corner if that moves into the floor.
    fn step(&mut self, dt: f64) {
        self.velocity[2] -= G * dt;
        self.position = add(self.position, self.velocity, dt);
        let angle = dot(self.angular_velocity, self.angular_velocity).sqrt() * dt;
        if angle > 0.0 {
            let axis = self.angular_velocity.map(|w| w * dt / angle);
            for r in &mut self.corners {
                // Rodrigues' rotation formula.
                let along = dot(axis, *r) * (1.0 - angle.cos());
                *r = add(add(r.map(|x| x * angle.cos()), cross(axis, *r), angle.sin()), axis, along);
            }
        }
        for _ in 0..4 {
            let lowest =
                self.corners.iter().copied().min_by(|a, b| a[2].total_cmp(&b[2])).unwrap_or([0.0; 3]);
            if self.position[2] + lowest[2] >= 0.0 {
                return;
            }
            self.position[2] -= 0.5 * (self.position[2] + lowest[2]);
            let corner_velocity = add(self.velocity, cross(self.angular_velocity, lowest), 1.0);
            if corner_velocity[2] >= 0.0 {
                return;
            }
            let effective_mass = |n: V| {
                let arm = cross(lowest, n);
                1.0 / (1.0 + dot(arm, arm) / self.inertia)
            };
            let bounce = if corner_velocity[2] < -0.05 { 1.0 + self.restitution } else { 1.0 };
            let normal = -bounce * corner_velocity[2] * effective_mass([0.0, 0.0, 1.0]);
            let slip = [corner_velocity[0], corner_velocity[1], 0.0];
            let speed = dot(slip, slip).sqrt();
            let mut impulse = [0.0, 0.0, normal];
            if speed > 0.0 {
                let direction = slip.map(|x| x / speed);
                let stop = (speed * effective_mass(direction)).min(self.friction * normal);
                impulse = add(impulse, direction, -stop);
            }
            self.velocity = add(self.velocity, impulse, 1.0);
            self.angular_velocity = add(self.angular_velocity, cross(lowest, impulse), 1.0 / self.inertia);
        }
    }
}

/// Adds measurement noise to a value.
fn noisy(rng: &mut Xoshiro256PlusPlus, value: f64) -> f64 {
    let error: f64 = StandardNormal.sample(rng);
    value + NOISE_M * error
}

/// Measured positions of the centres of `count` tumbling squares or cubes, sampled for `length_s` seconds.
fn tumbling(seed: u64, cube: bool, count: usize, length_s: f64) -> Result<Dataset, DataError> {
    let mut rng = random_stream(seed, "tumbling", u64::from(cube));
    let half = if cube { 0.05 } else { 0.04 };
    let mut trajectories = Vec::new();
    for j in 0..count {
        let mut corners = Vec::new();
        for x in [-half, half] {
            for z in [-half, half] {
                match cube {
                    true => corners.extend([[x, -half, z], [x, half, z]]),
                    false => corners.push([x, 0.0, z]),
                }
            }
        }
        let spin = |rng: &mut Xoshiro256PlusPlus| rng.random_range(-8.0..8.0);
        let height = if cube { rng.random_range(0.2..0.5) } else { rng.random_range(0.5..1.2) };
        let mut body = Body {
            position: [0.0, 0.0, height],
            velocity: [rng.random_range(0.2..1.2), if cube { rng.random_range(-0.5..0.5) } else { 0.0 }, 0.0],
            angular_velocity: if cube {
                [spin(&mut rng), spin(&mut rng), spin(&mut rng)]
            } else {
                [0.0, spin(&mut rng), 0.0]
            },
            corners,
            inertia: (2.0 * half).powi(2) / 6.0,
            restitution: 0.6,
            friction: 0.3,
        };
        // Turn the body to a random orientation before the release.
        let (angular_velocity, position) = (body.angular_velocity, body.position);
        (body.velocity[2], body.position[2]) = (0.0, 10.0);
        body.angular_velocity = if cube { [0.7, 0.4, 0.9] } else { [0.0, 1.0, 0.0] };
        for _ in 0..rng.random_range(0..6000) {
            body.velocity[2] = 0.0;
            body.position[2] = 10.0;
            body.step(5e-4);
        }
        (body.angular_velocity, body.position, body.velocity[2]) = (angular_velocity, position, 0.0);
        let samples = (length_s * RATE_HZ) as usize;
        let mut columns = vec![Vec::new(), Vec::new(), Vec::new()];
        for _ in 0..samples {
            columns.iter_mut().zip(body.position).for_each(|(c, p)| c.push(noisy(&mut rng, p)));
            (0..50).for_each(|_| body.step(1.0 / RATE_HZ / 50.0));
        }
        if !cube {
            columns.remove(1);
        }
        let times = (0..samples).map(|k| k as f64 / RATE_HZ).collect();
        trajectories.push(Trajectory::new(format!("{j}"), times, columns)?);
    }
    Dataset::from_names(if cube { &["x_m", "y_m", "z_m"] } else { &["x_m", "z_m"] }, trajectories)
}

/// Measured positions of the centres of squares that tumble in a plane.
///
/// # Errors
/// None in practice: the data are valid.
pub fn tumbling_squares(seed: u64) -> Result<Dataset, DataError> {
    tumbling(seed, false, 20, 1.5)
}

/// Measured positions of the centres of tossed cubes.
///
/// # Errors
/// None in practice: the data are valid.
pub fn tossed_cubes(seed: u64) -> Result<Dataset, DataError> {
    tumbling(seed, true, 30, 0.9)
}

/// Measured positions of a pendulum's bob, or heights of a mass on a spring.
fn swinging(seed: u64, spring: bool) -> Result<Dataset, DataError> {
    let mut rng = random_stream(seed, "swinging", u64::from(spring));
    let mut trajectories = Vec::new();
    for j in 0..16 {
        let (mut angle, mut rate): (f64, f64) = (rng.random_range(0.3..1.2), rng.random_range(-1.0..1.0));
        let mut columns = if spring { vec![Vec::new()] } else { vec![Vec::new(), Vec::new()] };
        for _ in 0..200 {
            match spring {
                true => columns[0].push(noisy(&mut rng, 1.0 + 0.3 * angle)),
                false => {
                    columns[0].push(noisy(&mut rng, 0.5 * angle.sin()));
                    columns[1].push(noisy(&mut rng, 0.5 - 0.5 * angle.cos()));
                }
            }
            for _ in 0..20 {
                let dt = 1.0 / RATE_HZ / 20.0;
                rate -= if spring { 60.0 * angle } else { G / 0.5 * angle.sin() } * dt;
                angle += rate * dt;
            }
        }
        trajectories.push(Trajectory::new(
            format!("{j}"),
            (0..200).map(|k| f64::from(k) / RATE_HZ).collect(),
            columns,
        )?);
    }
    Dataset::from_names(if spring { &["height_m"] } else { &["x_m", "z_m"] }, trajectories)
}

/// Measured positions of a pendulum's bob.
///
/// # Errors
/// None in practice: the data are valid.
pub fn pendulum(seed: u64) -> Result<Dataset, DataError> {
    swinging(seed, false)
}

/// Measured positions of a mass on a spring, in a column named as a height.
///
/// # Errors
/// None in practice: the data are valid.
pub fn spring(seed: u64) -> Result<Dataset, DataError> {
    swinging(seed, true)
}

/// Returns the data with `change(column name, value)` applied to every value.
///
/// # Errors
/// None if the changed values are finite.
pub fn changed(data: &Dataset, change: impl Fn(&str, f64) -> f64) -> Result<Dataset, DataError> {
    let trajectories = data.trajectories().iter().map(|t| {
        let columns = data.columns().iter().zip(t.values());
        let values = columns.map(|(c, v)| v.iter().map(|x| change(c.name(), *x)).collect()).collect();
        t.with_samples(t.time_s().to_vec(), values)
    });
    Dataset::new(data.columns().to_vec(), trajectories.collect::<Result<_, _>>()?)
}
