//! PyBullet's time-stepping scheme for a ball that falls vertically on flat ground, reproduced exactly.
//!
//! A sphere without spin on the vertical axis: mass cancels and friction does not act, so the state is the
//! height of the centre and the velocity. With the step dt, the damping k and the gap d between ball and
//! ground, one step is
//!
//! 1. v ← v - dt (g + v (k + k |v|)),
//! 2. in contact: v ← max(v, r - c/dt), where r = max(-e v, 0) if |v| ≥ 0.2 m/s, else 0, and
//!    c = d + 1e-5 m if that is positive, else 0.08 (d + 1e-5 m),
//! 3. z ← z + v dt.
//!
//! Source: bullet3 at commit 6c888f4ab (PyBullet 3.2.7, double precision):
//! `btMultiBody::computeAccelerations` (damping), `btMultiBodyConstraintSolver` (restitution, penetration),
//! `PhysicsServerCommandProcessor` (slop, threshold, ERP). Its purpose is to regenerate data made with
//! PyBullet; its physical accuracy is low, see [`step`](BulletBall::step).

use serde::{Deserialize, Serialize};

/// Bullet's default damping, the single-precision literal `0.04f` stored as a double.
///
/// It differs by 9e-10 from the double 0.04, which `changeDynamics(linearDamping=0.04)` sets.
pub const DEFAULT_DAMPING: f64 = 0.04_f32 as f64;

/// Speed of the ball at contact below which it does not rebound, m/s; the literal `0.2f`.
const RESTITUTION_THRESHOLD: f64 = 0.2_f32 as f64;
/// Fraction of the penetration that the solver removes in one step (contact ERP).
const CONTACT_ERP: f64 = 0.08;
/// Penetration that the solver does not correct, m (`m_linearSlop` of the PyBullet server).
const LINEAR_SLOP: f64 = 1e-5;

/// Collision shape of the ground, which decides at which gap a contact is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ground {
    /// Ground of `plane.urdf`: a box inside a compound shape; contact requires overlap.
    PlaneUrdf,
    /// Ground `GEOM_PLANE`: contacts are reported up to 0.02 sqrt(3) R above it, R the radius of the ball.
    ///
    /// They slow the ball down before it reaches the ground.
    GeomPlane,
}

/// State of the ball in the PyBullet scheme: height of the centre and velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BulletState {
    /// Height of the ball's centre above the ground, m.
    pub centre_m: f64,
    /// Vertical velocity of the ball, m/s, positive upwards.
    pub velocity_m_s: f64,
}

/// Parameters of a vertical drop in the PyBullet scheme: ground, ball, gravity, damping and time step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BulletBall {
    /// Collision shape of the ground.
    pub ground: Ground,
    /// Radius of the ball, m.
    pub radius_m: f64,
    /// Gravitational acceleration, m/s², positive downwards.
    pub gravity_m_s2: f64,
    /// Damping k: the acceleration is -v (k + k |v|), with k in 1/s in the first and in 1/m in the second
    /// term.
    pub damping: f64,
    /// Restitution of the contact: the product of the restitutions of ball and ground.
    pub restitution: f64,
    /// Time step of the simulation, s.
    pub step_s: f64,
}

impl Default for BulletBall {
    /// Ball of radius 0.5 m, gravity 9.8 m/s², `plane.urdf`, Bullet's damping, restitution 0.65, 60 Hz.
    fn default() -> Self {
        BulletBall {
            ground: Ground::PlaneUrdf,
            radius_m: 0.5,
            gravity_m_s2: 9.8,
            damping: DEFAULT_DAMPING,
            restitution: 0.65,
            step_s: 1.0 / 60.0,
        }
    }
}

impl BulletBall {
    /// Advances `state` by one step (semi-implicit Euler).
    ///
    /// Contact is detected at the position before the step; then come gravity and damping, the contact
    /// impulse, and the new position.
    ///
    /// Two properties of the scheme are visible in the data. A ball that is detected at a depth d below the
    /// ground leaves with e|v| + 0.08 d/dt, so that the rebound depends on the phase of the time grid; the
    /// effective restitution is e + 0.04 on average at 60 Hz. And at 60 Hz a ball with e >= 0.5 never comes
    /// to rest, because after two steps of fall it is faster than the restitution threshold.
    ///
    /// The order of operations is Bullet's, without fused multiply-add, so that `GEOM_PLANE` is bit-identical
    /// to PyBullet.
    #[inline]
    pub fn step(&self, state: &mut BulletState) {
        self.step_with(self.restitution, state);
    }

    /// [`step`](Self::step) with the given restitution, for ensembles of balls that differ only in it.
    #[inline]
    pub fn step_with(&self, restitution: f64, state: &mut BulletState) {
        let BulletState { centre_m: z, velocity_m_s: mut v } = *state;
        let (dt, k) = (self.step_s, self.damping);
        let gap = z - self.radius_m;
        let touching = gap < self.reach();
        v += dt * (-self.gravity_m_s2 - v * (k + k * v.abs()));
        let rebound = keep_if(v.abs() >= RESTITUTION_THRESHOLD, positive(-restitution * v));
        let distance = gap + LINEAR_SLOP;
        // Above the ground the whole gap may be closed in this step, below it 8 % of the penetration are
        // corrected.
        let closing = keep_if(distance > 0.0, distance) + keep_if(distance <= 0.0, distance * CONTACT_ERP);
        // The contact force can push but not pull.
        v += keep_if(touching, positive(rebound - v - closing / dt));
        *state = BulletState { centre_m: z + v * dt, velocity_m_s: v };
    }

    /// Gap between ball and ground below which a contact is reported, m.
    #[inline]
    fn reach(&self) -> f64 {
        match self.ground {
            // The smallest positive number: `gap < reach` then means `gap <= 0`.
            Ground::PlaneUrdf => f64::from_bits(1),
            Ground::GeomPlane => 0.02 * 3.0_f64.sqrt() * self.radius_m,
        }
    }

    /// Simulates a drop from rest at `centre_m`; returns `steps + 1` pairs of height (m) and velocity (m/s).
    pub fn simulate(&self, centre_m: f64, steps: usize) -> Vec<(f64, f64)> {
        let mut state = BulletState { centre_m, velocity_m_s: 0.0 };
        let mut path = Vec::with_capacity(steps + 1);
        path.push((state.centre_m, state.velocity_m_s));
        for _ in 0..steps {
            self.step(&mut state);
            path.push((state.centre_m, state.velocity_m_s));
        }
        path
    }

    /// Simulates from an initial height of the ball's underside; returns heights (m) and velocities (m/s).
    ///
    /// Each has `samples` elements; the first one is the initial state.
    ///
    /// ```
    /// use augsim_physics::ball::bullet::BulletBall;
    /// let ball = BulletBall { damping: 0.0, ..BulletBall::default() };
    /// let [height, velocity] = ball.simulate_underside(4.0, 0.0, 31);
    /// // Semi-implicit Euler falls half a step further than the parabola: g t (t + dt) / 2 after 0.5 s.
    /// assert!((height[30] - (4.0 - 0.5 * 9.8 * 0.5 * (0.5 + 1.0 / 60.0))).abs() < 1e-9);
    /// assert!((velocity[30] + 9.8 * 0.5).abs() < 1e-9);
    /// ```
    pub fn simulate_underside(&self, height_m: f64, velocity_m_s: f64, samples: usize) -> [Vec<f64>; 2] {
        let mut state = BulletState { centre_m: height_m + self.radius_m, velocity_m_s };
        let mut path = [Vec::with_capacity(samples), Vec::with_capacity(samples)];
        for sample in 0..samples {
            if sample > 0 {
                self.step(&mut state);
            }
            path[0].push(state.centre_m - self.radius_m);
            path[1].push(state.velocity_m_s);
        }
        path
    }
}

/// Returns `x` if the condition holds, else 0, without a branch.
///
/// A branch would prevent the vectorisation of loops over ensembles, and would be mispredicted at every
/// bounce.
#[inline]
fn keep_if(condition: bool, x: f64) -> f64 {
    f64::from_bits(x.to_bits() & u64::from(condition).wrapping_neg())
}

/// Positive part of `x`: max(x, 0).
#[inline]
fn positive(x: f64) -> f64 {
    keep_if(x > 0.0, x)
}

#[cfg(test)]
mod tests {
    //! Properties of the scheme that have a closed form. Equality with PyBullet is tested against its output
    //! in `tests/it/bullet_golden.rs`.
    use super::*;

    fn undamped(restitution: f64) -> BulletBall {
        BulletBall { damping: 0.0, restitution, ..BulletBall::default() }
    }

    #[test]
    fn free_fall_matches_the_closed_form_of_semi_implicit_euler() {
        // v_n = -g n dt, z_n = z_0 - g dt^2 n (n + 1) / 2.
        let ball = undamped(0.5);
        let path = ball.simulate(5.0, 50);
        for (n, (z, v)) in path.into_iter().enumerate() {
            let n = n as f64;
            let fallen = 9.8 / 3600.0 * n * (n + 1.0) / 2.0;
            // Each step rounds z (about 5) and v (about 8) once: 50 steps of half an ulp.
            assert!((z - (5.0 - fallen)).abs() <= 50.0 * 5.0 * f64::EPSILON);
            assert!((v + 9.8 * n / 60.0).abs() <= 50.0 * 8.0 * f64::EPSILON);
        }
    }

    #[test]
    fn penetration_increases_the_rebound_speed() {
        let ball = undamped(0.6);
        let mut state = BulletState { centre_m: 0.5 - 0.03, velocity_m_s: -6.0 };
        ball.step(&mut state);
        let arriving = 6.0 + 9.8 / 60.0;
        let expected = 0.6 * arriving + 0.08 * (0.03 - 1e-5) * 60.0;
        // Three roundings of numbers below 8.
        assert!((state.velocity_m_s - expected).abs() < 3.0 * 8.0 * f64::EPSILON);
    }

    #[test]
    fn slow_ball_comes_to_rest_one_slop_below_the_ground() {
        let path = undamped(0.4).simulate(0.51, 600);
        let (z, v) = path[600];
        assert!((z - 0.5 + 1e-5).abs() < 1e-12 && v.abs() < 1e-12, "{z} {v}");
    }

    #[test]
    fn at_60_hz_a_ball_with_high_restitution_never_rests() {
        let path = undamped(0.65).simulate(5.0, 4000);
        let fastest = path[3900..].iter().map(|(_, v)| v.abs()).fold(0.0, f64::max);
        assert!(fastest > 0.2, "{fastest}");
    }

    #[test]
    fn speculative_contact_slows_the_ball_above_the_ground() {
        let start = BulletState { centre_m: 0.51, velocity_m_s: -6.0 };
        let (mut urdf, mut plane) = (start, start);
        undamped(0.5).step(&mut urdf);
        BulletBall { ground: Ground::GeomPlane, ..undamped(0.5) }.step(&mut plane);
        assert!(urdf.velocity_m_s < -6.0);
        assert!(plane.velocity_m_s > 0.0);
    }
}
