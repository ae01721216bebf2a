//! Physical violations in sampled trajectories of a ball or a push.
//!
//! A ball below the ground or gaining energy in a rebound; a rod that penetrates the object, an object that
//! moves before contact.

use crate::engine::{Engine, ModelPush};
use crate::{Samples, Task};
use augsim_physics::push::Pose;

/// Tolerated ground penetration, m: the engine's solver accepts some, and sensors round.
const PENETRATION_TOLERANCE_M: f64 = 1e-3;
/// Energy gain of a rebound that is tolerated as rounding, J/kg.
const ENERGY_TOLERANCE: f64 = 1e-2;
/// Gap below which rod and object count as in contact, m: about twice the noise of a pose.
pub(crate) const TOUCH_M: f64 = 7e-4;

/// Physical violations in the samples of one trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Violations {
    /// Violations by a ball over flat ground.
    Ball {
        /// Share of sampled states that lie deeper below the ground than one time step at the highest possible speed.
        ///
        /// That is how deep a time-stepping engine may let the ball sink.
        under_share: f64,
        /// Mean excess over the allowed depth (one time step at the highest possible speed), m.
        /// Mean over the states that exceed it; 0 without any.
        under_m: f64,
        /// Share of rebounds that end with more energy than they began with; 0 without rebounds.
        gain_share: f64,
    },
    /// Violations by an object pushed by a rod.
    Push {
        /// Largest penetration of the object by the rod on a trajectory, m, mean over the samples.
        overlap_m: f64,
        /// Largest distance of the object from its initial position before contact, m, mean over the samples.
        ///
        /// A path length would accumulate the noise of every pose instead.
        untouched_m: f64,
    },
}

/// Measures the violations of a forecast of a ball over flat ground or a push; else `None`.
pub fn violations(engine: &Engine, task: Task<'_>, samples: &Samples) -> Option<Violations> {
    if let Some(push) = engine.push_model() {
        return Some(push_violations(push, task, samples));
    }
    Some(ball_violations(&BallLimits::for_engine(engine, task.start)?, task, samples))
}

/// Bounds on depth and energy of a ball, given its initial state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BallLimits {
    gravity: f64,
    step_s: f64,
    /// Height of the ground in the coordinates of the data, m.
    ground_m: f64,
    /// Largest allowed depth below the ground, m: one time step at the highest possible speed.
    max_depth: f64,
    /// Whether the engine runs a model file, whose effects may add energy (a moving table, an updraught).
    has_effects: bool,
}

impl BallLimits {
    /// Computes the bounds for states (height, m; velocity, m/s) over flat ground; `None` for other states.
    pub fn for_engine(engine: &Engine, start: &[f64]) -> Option<Self> {
        let (gravity, step_s) = (engine.expected().gravity_m_s2?, engine.step_s()?);
        let ground_m = engine.ground_m()?;
        let &[height, velocity] = start else { return None };
        let fastest = (velocity.powi(2) + 2.0 * gravity * (height - ground_m).max(0.0)).sqrt();
        let has_effects = engine.model().is_some();
        Some(BallLimits { gravity, step_s, ground_m, max_depth: step_s * fastest, has_effects })
    }

    /// Largest energy, J/kg, after a rebound from the state `before`.
    ///
    /// Exceeds the energy of `before`, because PyBullet's ball keeps falling within the step before it
    /// rebounds.
    fn max_energy(&self, before: [f64; 2]) -> f64 {
        self.energy(before) + self.gravity * self.step_s * before[1].abs()
    }

    /// Mechanical energy of the ball relative to the ground, per kilogram of its mass, J/kg.
    fn energy(&self, [height, velocity]: [f64; 2]) -> f64 {
        0.5 * velocity * velocity + self.gravity * (height - self.ground_m)
    }

    /// Moves the state `after` to the nearest one that the bounds allow as a successor of `before`.
    ///
    /// If the engine has effects of a model file, a state may go as far as `expected`, the engine's own step.
    /// For PyBullet's ball it may not, because that engine adds energy when it pushes the ball out of the
    /// ground.
    pub fn allowed(&self, before: [f64; 2], expected: [f64; 2], after: [f64; 2]) -> [f64; 2] {
        let (mut lowest, mut max_energy) = (self.ground_m - self.max_depth, self.max_energy(before));
        if self.has_effects {
            (lowest, max_energy) = (lowest.min(expected[0]), max_energy.max(self.energy(expected)));
        }
        let height = after[0].max(lowest);
        let is_rebound = before[1] < 0.0 && after[1] > 0.0;
        if !is_rebound || self.energy([height, after[1]]) <= max_energy {
            return [height, after[1]];
        }
        [height, (2.0 * (max_energy - self.energy([height, 0.0]))).max(0.0).sqrt()]
    }
}

/// Counts depth and energy violations in samples `[time, 2, sample]` of a ball.
fn ball_violations(limits: &BallLimits, task: Task<'_>, samples: &Samples) -> Violations {
    let n = samples.count;
    let state =
        |t: usize, sample: usize| [0, 1].map(|j: usize| f64::from(samples.values[(t * 2 + j) * n + sample]));
    let (mut under, mut depth, mut rebounds, mut gains) = (0.0, 0.0, 0.0, 0.0);
    for sample in 0..n {
        for t in 0..task.time {
            let below = limits.ground_m - state(t, sample)[0] - (limits.max_depth + PENETRATION_TOLERANCE_M);
            if below > 0.0 {
                under += 1.0;
                depth += below;
            }
            if t == 0 {
                continue;
            }
            let (before, after) = (state(t - 1, sample), state(t, sample));
            if before[1] < 0.0 && after[1] > 0.0 {
                rebounds += 1.0;
                let is_gain = limits.energy(after) > limits.max_energy(before) + ENERGY_TOLERANCE;
                gains += f64::from(u8::from(is_gain));
            }
        }
    }
    Violations::Ball {
        under_share: under / (n * task.time) as f64,
        under_m: if under > 0.0 { depth / under } else { 0.0 },
        gain_share: if rebounds > 0.0 { gains / rebounds } else { 0.0 },
    }
}

/// Computes the gap, m, and the unit vector from object to rod, for the rod at sample `t` and an object pose.
///
/// The gap is negative if they overlap.
pub(crate) fn gap(push: &ModelPush, task: &Task<'_>, t: usize, [x, y, angle]: [f64; 3]) -> (f64, [f64; 2]) {
    let pose = Pose::new(x, y, angle);
    let rod = [task.actions[3 * t], task.actions[3 * t + 1]];
    let nearest = push.world().object().outline.nearest(pose.to_body(rod));
    let (sin, cos) = angle.sin_cos();
    let [a, b] = nearest.outward;
    (nearest.distance - push.rod_radius_m(), [cos * a - sin * b, sin * a + cos * b])
}

/// Measures penetration and motion before contact in samples `[time, 3, sample]` of a push.
fn push_violations(push: &ModelPush, task: Task<'_>, samples: &Samples) -> Violations {
    let n = samples.count;
    let (mut overlap, mut untouched) = (0.0, 0.0);
    for sample in 0..n {
        let pose = |t: usize| [0, 1, 2].map(|j| f64::from(samples.values[(t * 3 + j) * n + sample]));
        let (mut max_overlap, mut has_touched, mut max_shift) = (0.0_f64, false, 0.0_f64);
        for t in 0..task.time {
            let (gap, _) = gap(push, &task, t, pose(t));
            max_overlap = max_overlap.max(-gap);
            has_touched |= gap < TOUCH_M;
            if !has_touched {
                let [x, y, _] = pose(t);
                max_shift = (x - task.start[0]).hypot(y - task.start[1]).max(max_shift);
            }
        }
        overlap += max_overlap;
        untouched += max_shift;
    }
    Violations::Push { overlap_m: overlap / n as f64, untouched_m: untouched / n as f64 }
}

#[cfg(test)]
mod tests {
    //! Contract: violations agree with hand calculation, and the engine itself has none.
    use super::*;
    use augsim_physics::ball::bullet::BulletBall;

    fn drop(values: Vec<f32>) -> Violations {
        let engine = Engine::PybulletBall(BulletBall::default());
        let task = Task { start: &[1.0, 0.0], actions: &[], time: values.len() / 2, index: 0 };
        violations(&engine, task, &Samples { count: 1, values }).expect("a ball over flat ground")
    }

    #[test]
    fn a_state_beyond_the_bounds_is_moved_to_the_nearest_allowed_one() {
        let engine = Engine::PybulletBall(BulletBall::default());
        let limits = BallLimits::for_engine(&engine, &[1.0, 0.0]).expect("a ball over flat ground");
        let free = [0.5, -3.0];
        assert_eq!(limits.allowed([0.6, -2.9], free, free), free);
        // One time step at the highest speed below the ground, and no deeper.
        let deep = limits.allowed([0.05, -4.4], [0.01, 2.0], [-0.5, -4.5]);
        assert!((deep[0] + limits.max_depth).abs() < 1e-12 && deep[1] == -4.5, "{deep:?}");
        let fast = limits.allowed([0.05, -3.0], [0.05, 2.0], [0.05, 9.0]);
        assert!((limits.energy(fast) - limits.max_energy([0.05, -3.0])).abs() < 1e-9, "{fast:?}");
        // Effects of a model file may add energy, and then the net may as well.
        let risen =
            BallLimits { has_effects: true, ..limits }.allowed([0.05, -3.0], [0.05, 9.0], [0.05, 8.9]);
        assert_eq!(risen, [0.05, 8.9]);
    }

    #[test]
    fn the_engine_violates_nothing() {
        let engine = Engine::PybulletBall(BulletBall::default());
        let path = engine.rollout(&[4.5, 0.0], &[], 400);
        let task = Task { start: &[4.5, 0.0], actions: &[], time: 400, index: 0 };
        let samples = Samples { count: 1, values: path.iter().map(|v| *v as f32).collect() };
        let none = Violations::Ball { under_share: 0.0, under_m: 0.0, gain_share: 0.0 };
        assert_eq!(violations(&engine, task, &samples), Some(none));
    }

    #[test]
    fn depth_and_energy_gains_agree_with_hand_calculation() {
        // Half of the states are 0.5 m below the ground; one step at the highest speed from 1 m is 4.427 m/s
        // / 60.
        let Violations::Ball { under_share, under_m, gain_share } = drop(vec![1.0, -3.0, -0.5, 4.0]) else {
            panic!("a ball")
        };
        let depth = 0.5 - (2.0 * 9.8_f64).sqrt() / 60.0 - 1e-3;
        assert!(under_share == 0.5 && (under_m - depth).abs() < 1e-6, "{under_share} {under_m}");
        // Energy 9.8 + 4.5 before, 8 - 4.9 after: no gain. From 0.1 m with 3 m/s to 4 m/s there is one.
        assert_eq!(gain_share, 0.0);
        let Violations::Ball { gain_share, .. } = drop(vec![0.1, -3.0, 0.1, 4.0]) else { panic!("a ball") };
        assert_eq!(gain_share, 1.0);
    }
}
