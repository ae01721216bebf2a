//! Simulation of a bouncing ball by small Runge-Kutta steps of order four, independent of the engine under
//! test.
//!
//! Contact is located by bisection of the step; no closed-form solution is used.

use super::truth::{Kind, Truth, Unlisted};

/// Length of a step, s.
const STEP: f64 = 1e-3;
/// Gravitational acceleration, m/s².
const G: f64 = 9.81;
/// Radius of the ball, m.
const RADIUS: f64 = 0.02;
/// Moment of inertia divided by mass and squared radius.
const INERTIA: f64 = 0.4;

/// Initial state and conditions of one trajectory.
#[derive(Clone, Debug)]
pub struct Start {
    pub x: f64,
    pub z: f64,
    pub vx: f64,
    pub vz: f64,
    pub spin: f64,
    /// Session time minus its mean, s.
    pub clock: f64,
    /// Session time, s.
    pub session: f64,
    /// Deviations of the restitution, impact by impact.
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

/// The true physics of a set.
pub struct Physics<'a> {
    pub truth: &'a Truth,
    pub restitution: f64,
}

impl Physics<'_> {
    /// Sum of a parameter over the effects that have it.
    fn sum(&self, pick: impl Fn(&Kind) -> Option<f64>) -> f64 {
        self.truth.effects.iter().filter_map(pick).sum()
    }

    /// Acceleration in flight, m/s².
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

    /// State after a Runge-Kutta step of length `h`.
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

    /// Coefficient of restitution of an impact.
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

    /// True positions at `times`.
    pub fn positions(&self, s: &Start, times: &[f64]) -> Vec<(f64, f64)> {
        let tilt = self.sum(|k| if let Kind::Tilt(a) = k { Some(*a) } else { None });
        let tau = self.sum(|k| if let Kind::Contact(t) = k { Some(*t) } else { None });
        let (sin, cos) = tilt.sin_cos();
        let gap = |b: &Ball| b.z * cos - b.x * sin;
        let mut b = Ball { x: s.x, z: s.z, vx: s.vx, vz: s.vz };
        let (mut t, mut spin, mut bounce, mut resting) = (0.0, s.spin, 0, false);
        let mut out = Vec::with_capacity(times.len());
        for &sample_time in times {
            while t < sample_time {
                if resting {
                    t = sample_time;
                    break;
                }
                let h = STEP.min(sample_time - t);
                let next = self.step(&b, spin, t, h);
                if gap(&next) >= 0.0 {
                    b = next;
                    t += h;
                    continue;
                }
                // Locate the contact by bisection of the step.
                let (mut low, mut high) = (0.0, h);
                for _ in 0..45 {
                    let middle = 0.5 * (low + high);
                    if gap(&self.step(&b, spin, t, middle)) >= 0.0 { low = middle } else { high = middle }
                }
                b = self.step(&b, spin, t, low);
                t += low;
                let vn = b.vz * cos - b.vx * sin;
                let vt = b.vx * cos + b.vz * sin;
                let e = self.restitution_at(-vn, b.x, spin, t, bounce, s);
                bounce += 1;
                if -vn * e < 0.02 {
                    resting = true;
                    continue;
                }
                let slip = vt - RADIUS * spin;
                let stick = INERTIA / (1.0 + INERTIA);
                let mut jump = 0.0;
                for k in &self.truth.effects {
                    match *k {
                        Kind::Coulomb(mu) => {
                            jump -= slip.signum() * (mu * (1.0 + e) * -vn).min(stick * slip.abs())
                        }
                        Kind::Grip(kappa) => jump -= kappa * slip,
                        _ => {}
                    }
                }
                spin -= jump / (INERTIA * RADIUS);
                if tau > 0.0 {
                    // The contact is a spring and a damper, integrated in small steps until the ball leaves;
                    // meanwhile the ball slides.
                    let damping = -e.ln() / tau;
                    let stiffness = (std::f64::consts::PI / tau).powi(2) + damping * damping;
                    let (mut depth, mut rate) = (0.0f64, vn);
                    let h = tau / 400.0;
                    let entry = b;
                    let contact_start = t;
                    loop {
                        let a = |d: f64, r: f64| -G - 2.0 * damping * r - stiffness * d;
                        let (k1d, k1r) = (rate, a(depth, rate));
                        let (k2d, k2r) =
                            (rate + h / 2.0 * k1r, a(depth + h / 2.0 * k1d, rate + h / 2.0 * k1r));
                        let (nd, nr) = (depth + h * k2d, rate + h * k2r);
                        if nd >= 0.0 && nr > 0.0 {
                            let part = depth / (depth - nd);
                            t += h * part;
                            rate += (nr - rate) * part;
                            depth = 0.0;
                        } else {
                            t += h;
                            depth = nd;
                            rate = nr;
                        }
                        // Samples during the contact show the ball below the ground.
                        while out.len() < times.len() && times[out.len()] <= t {
                            let along = entry.x + (vt + 0.5 * jump) * (times[out.len()] - contact_start);
                            out.push((along, depth));
                        }
                        if depth == 0.0 || t - contact_start > 3.0 * tau {
                            break;
                        }
                    }
                    b = Ball {
                        x: entry.x + (vt + 0.5 * jump) * (t - contact_start),
                        z: 0.0,
                        vx: vt + jump,
                        vz: rate,
                    };
                    if rate < 0.02 {
                        resting = true;
                    }
                } else {
                    let (n, u) = (-e * vn, vt + jump);
                    b.vx = u * cos - n * sin;
                    b.vz = n * cos + u * sin;
                    let g = gap(&b);
                    b.x += g * sin;
                    b.z -= g * cos;
                }
                if out.len() == times.len() || t > sample_time {
                    break;
                }
            }
            if out.len() < times.len() && times[out.len()] == sample_time {
                out.push((b.x, b.z));
            }
        }
        out.truncate(times.len());
        out
    }
}
