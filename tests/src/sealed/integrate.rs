//! Simulation of a bouncing ball by small Runge-Kutta steps of order four, independent of the engine under
//! test.
//!
//! Contact is located by bisection of the step; no closed-form solution is used.

use super::truth::{Kind, Truth, Unlisted};

/// Length of an integration step, s.
const STEP: f64 = 1e-3;
/// Gravitational acceleration, m/s².
const G: f64 = 9.81;
/// Radius of the ball, m.
const RADIUS: f64 = 0.02;
/// Moment of inertia of the ball divided by mass and squared radius.
const INERTIA: f64 = 0.4;

/// Initial state of one trajectory, and its deviations from the nominal conditions.
#[derive(Clone, Debug)]
pub struct Start {
    pub x: f64,
    pub z: f64,
    pub vx: f64,
    pub vz: f64,
    pub spin: f64,
    /// Time of the release relative to the middle of the session of recordings, s.
    pub clock: f64,
    /// Time of the release since the session of recordings began, s.
    pub session: f64,
    /// Deviations of the coefficient of restitution, one per impact.
    pub offsets: Vec<f64>,
}

/// Position and velocity of the ball.
#[derive(Clone, Copy)]
struct Ball {
    x: f64,
    z: f64,
    vx: f64,
    vz: f64,
}

/// The true physics of a generated set.
pub struct Physics<'a> {
    pub truth: &'a Truth,
    pub restitution: f64,
}

impl Physics<'_> {
    /// Sum of the parameter that `pick` selects, over the effects that have it.
    fn sum(&self, pick: impl Fn(&Kind) -> Option<f64>) -> f64 {
        self.truth.effects.iter().filter_map(pick).sum()
    }

    /// Acceleration of the ball in flight, `(horizontal, vertical)`, m/s².
    fn acceleration(&self, b: &Ball, spin: f64, t: f64) -> (f64, f64) {
        let (mut ax, mut az) = (0.0, -G);
        let speed = b.vx.hypot(b.vz);
        for k in &self.truth.effects {
            match *k {
                Kind::QuadraticDrag(k) => {
                    ax -= k * speed * b.vx;
                    az -= k * speed * b.vz;
                }
                Kind::LinearDrag(c) => {
                    ax -= c * b.vx;
                    az -= c * b.vz;
                }
                Kind::VerticalAcceleration(a) => az += a,
                Kind::HorizontalAcceleration(a) => ax += a,
                Kind::Magnus(s) => {
                    ax += s * spin * b.vz;
                    az -= s * spin * b.vx;
                }
                _ => {}
            }
        }
        match self.truth.unlisted {
            Some(Unlisted::DragCrisis(k)) if speed > 2.5 => {
                ax -= k * (speed - 2.5) * b.vx;
                az -= k * (speed - 2.5) * b.vz;
            }
            Some(Unlisted::Tether(k)) => az -= k * (b.z - 1.0),
            Some(Unlisted::Gust(a)) => ax += a * (2.0 * std::f64::consts::PI * 1.5 * t).sin(),
            _ => {}
        }
        (ax, az)
    }

    /// State of the ball after a Runge-Kutta step of length `h` (s).
    fn step(&self, b: &Ball, spin: f64, t: f64, h: f64) -> Ball {
        let f = |b: &Ball, t: f64| {
            let (ax, az) = self.acceleration(b, spin, t);
            Ball { x: b.vx, z: b.vz, vx: ax, vz: az }
        };
        let add = |b: &Ball, d: &Ball, h: f64| Ball {
            x: b.x + h * d.x,
            z: b.z + h * d.z,
            vx: b.vx + h * d.vx,
            vz: b.vz + h * d.vz,
        };
        let k1 = f(b, t);
        let k2 = f(&add(b, &k1, h / 2.0), t + h / 2.0);
        let k3 = f(&add(b, &k2, h / 2.0), t + h / 2.0);
        let k4 = f(&add(b, &k3, h), t + h);
        let mix = |p: fn(&Ball) -> f64| p(&k1) + 2.0 * p(&k2) + 2.0 * p(&k3) + p(&k4);
        Ball {
            x: b.x + h / 6.0 * mix(|k| k.x),
            z: b.z + h / 6.0 * mix(|k| k.z),
            vx: b.vx + h / 6.0 * mix(|k| k.vx),
            vz: b.vz + h / 6.0 * mix(|k| k.vz),
        }
    }

    /// Coefficient of restitution of an impact at normal speed `speed` (m/s) and place `x` (m).
    fn restitution_at(&self, speed: f64, x: f64, spin: f64, t: f64, bounce: usize, s: &Start) -> f64 {
        let mut e = self.restitution;
        for k in &self.truth.effects {
            match *k {
                Kind::SpeedLinear(b) => e -= b * (speed - 3.0),
                Kind::Drift(d) => e += d * (t + s.clock),
                Kind::Position(q) => e += q * x,
                _ => {}
            }
        }
        match self.truth.unlisted {
            Some(Unlisted::FloorStep(d)) if x > 1.0 => e += d,
            Some(Unlisted::FloorSine(a)) => {
                e += a * (2.0 * std::f64::consts::PI * (s.session + t) / 300.0).sin()
            }
            Some(Unlisted::SpinLoss(c)) => e -= c * spin.abs(),
            Some(Unlisted::Fatigue(d)) => e -= d * bounce as f64,
            _ => {}
        }
        e *= (speed / 3.0).powf(-self.sum(|k| if let Kind::SpeedPower(p) = k { Some(*p) } else { None }));
        (e + s.offsets.get(bounce).copied().unwrap_or(0.0)).clamp(0.02, 0.99)
    }

    /// Simulates the ball from `start` and returns its noise-free positions `(x, z)` at `times` (s), m.
    pub fn positions(&self, start: &Start, times: &[f64]) -> Vec<(f64, f64)> {
        let mut motion = Motion::new(self, start, times);
        for &sample_time in times {
            motion.advance_to(sample_time);
            if motion.next_sample_time() == Some(sample_time) {
                motion.samples.push((motion.ball.x, motion.ball.z));
            }
        }
        motion.samples.truncate(times.len());
        motion.samples
    }
}

/// A plane floor that may be tilted, by sine and cosine of the angle.
#[derive(Clone, Copy)]
struct Floor {
    sin: f64,
    cos: f64,
}

impl Floor {
    /// Height of the ball above the floor, m.
    fn gap(&self, b: &Ball) -> f64 {
        b.z * self.cos - b.x * self.sin
    }
}

/// Velocities and restitution of one impact on the floor.
struct Impact {
    /// Velocity normal to the floor before the impact, m/s; negative.
    normal: f64,
    /// Velocity along the floor before the impact, m/s.
    tangential: f64,
    /// Coefficient of restitution of this impact.
    restitution: f64,
    /// Change of the velocity along the floor by the impact, m/s.
    jump: f64,
}

/// State of a simulation, with the positions sampled so far.
struct Motion<'a> {
    physics: &'a Physics<'a>,
    start: &'a Start,
    times: &'a [f64],
    floor: Floor,
    /// Duration of a contact with the floor, s; 0 for instantaneous impacts.
    contact_s: f64,
    ball: Ball,
    time: f64,
    spin: f64,
    bounces: usize,
    is_resting: bool,
    samples: Vec<(f64, f64)>,
}

impl<'a> Motion<'a> {
    fn new(physics: &'a Physics<'a>, start: &'a Start, times: &'a [f64]) -> Self {
        let tilt = physics.sum(|k| if let Kind::Tilt(a) = k { Some(*a) } else { None });
        let contact_s = physics.sum(|k| if let Kind::Contact(t) = k { Some(*t) } else { None });
        let (sin, cos) = tilt.sin_cos();
        Motion {
            physics,
            start,
            times,
            floor: Floor { sin, cos },
            contact_s,
            ball: Ball { x: start.x, z: start.z, vx: start.vx, vz: start.vz },
            time: 0.0,
            spin: start.spin,
            bounces: 0,
            is_resting: false,
            samples: Vec::with_capacity(times.len()),
        }
    }

    /// Time of the next sample, s; `None` after the last one.
    fn next_sample_time(&self) -> Option<f64> {
        self.times.get(self.samples.len()).copied()
    }

    /// Advances the simulation to `sample_time`, or to the end of a contact that lasts longer.
    fn advance_to(&mut self, sample_time: f64) {
        while self.time < sample_time {
            if self.is_resting {
                self.time = sample_time;
                break;
            }
            let h = STEP.min(sample_time - self.time);
            let next = self.physics.step(&self.ball, self.spin, self.time, h);
            if self.floor.gap(&next) >= 0.0 {
                self.ball = next;
                self.time += h;
                continue;
            }
            self.advance_to_contact(h);
            let Some(impact) = self.start_impact() else { continue };
            if self.contact_s > 0.0 {
                self.slide_through_contact(&impact);
            } else {
                self.rebound(&impact);
            }
            if self.next_sample_time().is_none() || self.time > sample_time {
                break;
            }
        }
    }

    /// Advances to the first contact with the floor within `h` seconds, which is located by bisection.
    fn advance_to_contact(&mut self, h: f64) {
        let after = |h: f64| self.physics.step(&self.ball, self.spin, self.time, h);
        let (mut low, mut high) = (0.0, h);
        for _ in 0..45 {
            let middle = 0.5 * (low + high);
            if self.floor.gap(&after(middle)) >= 0.0 { low = middle } else { high = middle }
        }
        self.ball = after(low);
        self.time += low;
    }

    /// Computes the impact and changes the spin of the ball; `None` if the ball comes to rest.
    fn start_impact(&mut self) -> Option<Impact> {
        let (b, Floor { sin, cos }) = (self.ball, self.floor);
        let normal = b.vz * cos - b.vx * sin;
        let tangential = b.vx * cos + b.vz * sin;
        let e = self.physics.restitution_at(-normal, b.x, self.spin, self.time, self.bounces, self.start);
        self.bounces += 1;
        if -normal * e < 0.02 {
            self.is_resting = true;
            return None;
        }
        let slip = tangential - RADIUS * self.spin;
        let stick = INERTIA / (1.0 + INERTIA);
        let mut jump = 0.0;
        for k in &self.physics.truth.effects {
            match *k {
                Kind::Coulomb(mu) => {
                    jump -= slip.signum() * (mu * (1.0 + e) * -normal).min(stick * slip.abs())
                }
                Kind::Grip(kappa) => jump -= kappa * slip,
                _ => {}
            }
        }
        self.spin -= jump / (INERTIA * RADIUS);
        Some(Impact { normal, tangential, restitution: e, jump })
    }

    /// Integrates a contact, on which the ball slides, as a spring and a damper until it leaves the floor.
    fn slide_through_contact(&mut self, impact: &Impact) {
        let damping = -impact.restitution.ln() / self.contact_s;
        let stiffness = (std::f64::consts::PI / self.contact_s).powi(2) + damping * damping;
        let (mut depth, mut rate) = (0.0f64, impact.normal);
        let h = self.contact_s / 400.0;
        let (entry_x, contact_start) = (self.ball.x, self.time);
        let mean_tangential = impact.tangential + 0.5 * impact.jump;
        let x_at = |t: f64| entry_x + mean_tangential * (t - contact_start);
        loop {
            let a = |d: f64, r: f64| -G - 2.0 * damping * r - stiffness * d;
            let (k1d, k1r) = (rate, a(depth, rate));
            let (k2d, k2r) = (rate + h / 2.0 * k1r, a(depth + h / 2.0 * k1d, rate + h / 2.0 * k1r));
            let (next_depth, next_rate) = (depth + h * k2d, rate + h * k2r);
            if next_depth >= 0.0 && next_rate > 0.0 {
                let part = depth / (depth - next_depth);
                self.time += h * part;
                rate += (next_rate - rate) * part;
                depth = 0.0;
            } else {
                self.time += h;
                depth = next_depth;
                rate = next_rate;
            }
            // Samples during the contact show the ball below the ground.
            while let Some(t) = self.next_sample_time().filter(|t| *t <= self.time) {
                self.samples.push((x_at(t), depth));
            }
            if depth == 0.0 || self.time - contact_start > 3.0 * self.contact_s {
                break;
            }
        }
        self.ball = Ball { x: x_at(self.time), z: 0.0, vx: impact.tangential + impact.jump, vz: rate };
        if rate < 0.02 {
            self.is_resting = true;
        }
    }

    /// Applies an instantaneous impact to the velocities and moves the ball onto the floor.
    fn rebound(&mut self, impact: &Impact) {
        let Floor { sin, cos } = self.floor;
        let (n, u) = (-impact.restitution * impact.normal, impact.tangential + impact.jump);
        self.ball.vx = u * cos - n * sin;
        self.ball.vz = n * cos + u * sin;
        let gap = self.floor.gap(&self.ball);
        self.ball.x += gap * sin;
        self.ball.z -= gap * cos;
    }
}
