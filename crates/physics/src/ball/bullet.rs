//! PyBullet's stepping of a ball that falls on flat ground, formula for formula.
//!
//! One sphere as a multibody without spin, released on the vertical: mass cancels and friction never
//! acts, so the state is the height of the centre and the velocity. Source: bullet3 at commit
//! 6c888f4ab (PyBullet 3.2.7, double precision): `btMultiBody::computeAccelerations` (damping),
//! `btMultiBodyConstraintSolver` (restitution, penetration), `PhysicsServerCommandProcessor` (slop,
//! threshold, ERP). It exists to regenerate data made with PyBullet; as physics it is crude, see
//! [`step`](BulletBall::step).

use serde::{Deserialize, Serialize};

/// Bullet's default damping, the single-precision literal `0.04f` stored in a double. It differs
/// from the double 0.04 (what `changeDynamics(linearDamping=0.04)` sets) by 9e-10.
pub const DEFAULT_DAMPING: f64 = 0.04_f32 as f64;

/// Below this speed at contact, m/s, nothing rebounds; the literal `0.2f`.
const RESTITUTION_THRESHOLD: f64 = 0.2_f32 as f64;
/// Part of the penetration that the solver removes in one step (contact ERP).
const CONTACT_ERP: f64 = 0.08;
/// Penetration that is left alone, m (`m_linearSlop` of the PyBullet server).
const LINEAR_SLOP: f64 = 1e-5;

/// How the ground was made, which decides when a contact is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ground {
    /// `plane.urdf`: a box inside a compound; a contact needs overlap.
    PlaneUrdf,
    /// `GEOM_PLANE`: contacts are reported from 0.02 sqrt(3) R above the ground (speculative), which
    /// takes speed from the ball before it arrives.
    GeomPlane,
}

/// Centre height and velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BulletState {
    /// Height of the centre above the ground, m.
    pub centre_m: f64,
    /// Velocity, m/s, up positive.
    pub velocity_m_s: f64,
}

/// Parameters of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BulletBall {
    /// Kind of ground.
    pub ground: Ground,
    /// Radius, m.
    pub radius_m: f64,
    /// Gravity, m/s^2, positive downwards.
    pub gravity_m_s2: f64,
    /// Linear damping k: the acceleration is -v (k + k |v|), so k stands for both 1/s and 1/m.
    pub damping: f64,
    /// Product of the ball's and the ground's restitution.
    pub restitution: f64,
    /// Step, s.
    pub step_s: f64,
}

impl Default for BulletBall {
    /// The bouncing-ball scene: radius 0.5 m, 9.8 m/s^2, `plane.urdf`, Bullet's damping, restitution
    /// 0.65, 60 Hz.
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
    /// Advances `state` by one step: contact from the position before the step, then gravity and
    /// damping, then the contact impulse, then the position (semi-implicit Euler).
    ///
    /// Two properties of the scheme show in the data. A ball detected at a depth d below the ground
    /// leaves with e|v| + 0.08 d/dt, so the rebound depends on the phase of the step grid: e + 0.04
    /// on average at 60 Hz. And at 60 Hz a ball with e >= 0.5 never rests, because two steps of fall
    /// already exceed the restitution threshold.
    ///
    /// The order of operations is Bullet's, without fused multiply-add: `GEOM_PLANE` agrees with
    /// PyBullet to the last bit.
    #[inline]
    pub fn step(&self, state: &mut BulletState) {
        self.step_with(self.restitution, state);
    }

    /// [`step`](Self::step) with another restitution, for ensembles that differ in it alone.
    #[inline]
    pub fn step_with(&self, restitution: f64, state: &mut BulletState) {
        let BulletState { centre_m: z, velocity_m_s: mut v } = *state;
        let (dt, k) = (self.step_s, self.damping);
        let gap = z - self.radius_m;
        let touching = gap < self.reach();
        v += dt * (-self.gravity_m_s2 - v * (k + k * v.abs()));
        let rebound = keep_if(v.abs() >= RESTITUTION_THRESHOLD, positive(-restitution * v));
        let distance = gap + LINEAR_SLOP;
        // Above the ground all of the distance may be closed in this step, below it 8 %.
        let closing = keep_if(distance > 0.0, distance) + keep_if(distance <= 0.0, distance * CONTACT_ERP);
        // The contact may push, never pull.
        v += keep_if(touching, positive(rebound - v - closing / dt));
        *state = BulletState { centre_m: z + v * dt, velocity_m_s: v };
    }

    /// Gap below which a contact is reported, m.
    #[inline]
    fn reach(&self) -> f64 {
        match self.ground {
            // Below the smallest positive number: at or below 0.
            Ground::PlaneUrdf => f64::from_bits(1),
            Ground::GeomPlane => 0.02 * 3.0_f64.sqrt() * self.radius_m,
        }
    }

    /// A drop at rest from `centre_m`: (centre height m, velocity m/s) of the start and after each of
    /// `steps` steps, `steps + 1` pairs.
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

    /// Heights of the underside, m, and velocities, m/s, from the given start, which is sample 0:
    /// `samples` of each.
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

/// `x` or 0, by masking its bits: a branch here would keep loops over ensembles from becoming vector
/// code, and is mispredicted at every bounce.
#[inline]
fn keep_if(condition: bool, x: f64) -> f64 {
    f64::from_bits(x.to_bits() & u64::from(condition).wrapping_neg())
}

/// max(x, 0).
#[inline]
fn positive(x: f64) -> f64 {
    keep_if(x > 0.0, x)
}

#[cfg(test)]
mod tests {
    //! Contract: the scheme's own laws, where they have a closed form; equality with PyBullet is
    //! tested against its output in `tests/it/bullet_golden.rs`.
    use super::*;

    fn undamped(restitution: f64) -> BulletBall {
        BulletBall { damping: 0.0, restitution, ..BulletBall::default() }
    }

    #[test]
    fn free_fall_is_the_closed_form_of_semi_implicit_euler() {
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
    fn an_impact_adds_the_penetration_over_time_to_the_rebound() {
        let ball = undamped(0.6);
        let mut state = BulletState { centre_m: 0.5 - 0.03, velocity_m_s: -6.0 };
        ball.step(&mut state);
        let arriving = 6.0 + 9.8 / 60.0;
        let expected = 0.6 * arriving + 0.08 * (0.03 - 1e-5) * 60.0;
        // Three roundings of numbers below 8.
        assert!((state.velocity_m_s - expected).abs() < 3.0 * 8.0 * f64::EPSILON);
    }

    #[test]
    fn a_slow_contact_rests_one_slop_below_the_ground() {
        let path = undamped(0.4).simulate(0.51, 600);
        let (z, v) = path[600];
        assert!((z - 0.5 + 1e-5).abs() < 1e-12 && v.abs() < 1e-12, "{z} {v}");
    }

    #[test]
    fn at_60_hz_a_lively_ball_hops_for_ever() {
        let path = undamped(0.65).simulate(5.0, 4000);
        let fastest = path[3900..].iter().map(|(_, v)| v.abs()).fold(0.0, f64::max);
        assert!(fastest > 0.2, "{fastest}");
    }

    #[test]
    fn speculative_contact_slows_the_ball_before_it_arrives() {
        let start = BulletState { centre_m: 0.51, velocity_m_s: -6.0 };
        let (mut urdf, mut plane) = (start, start);
        undamped(0.5).step(&mut urdf);
        BulletBall { ground: Ground::GeomPlane, ..undamped(0.5) }.step(&mut plane);
        assert!(urdf.velocity_m_s < -6.0);
        assert!(plane.velocity_m_s > 0.0);
    }
}
