//! Violations of mechanics in sampled trajectories: a ball below the ground or gaining energy in a rebound, a rod inside the object, an
//! object that moves before it is touched.

use crate::engine::{Engine, ModelPush};
use crate::{Samples, Task};
use augsim_physics::push::Pose;

/// Allowance for the ground, m: what the engine's solver leaves alone and sensors round to.
const SLOP_M: f64 = 1e-3;
/// Energy that a rebound may seem to gain by rounding, J/kg.
const ENERGY_SLOP: f64 = 1e-2;
/// Gap at which rod and object count as touching, m: twice the noise of a pose or so.
pub(crate) const TOUCH_M: f64 = 7e-4;

/// Violations of mechanics in the samples of one trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Violations {
    /// A ball over flat ground.
    Ball {
        /// Share of the samples that lie deeper than a step of the fastest fall from the start, which is how deep an engine that
        /// goes by steps may let the ball in.
        under_share: f64,
        /// Mean over those samples of how much deeper, m; 0 without any.
        under_m: f64,
        /// Share of the rebounds that leave with more energy than they came with; 0 without any.
        gain_share: f64,
    },
    /// An object and a rod.
    Push {
        /// Largest overlap of rod and object on a trajectory, m, mean over the samples.
        overlap_m: f64,
        /// Largest distance of the object from its first place before the rod first touches it, m, mean over the samples: a way would
        /// add up the noise of every pose.
        untouched_m: f64,
    },
}

/// The violations of a forecast; none for a system of which no such law is known.
pub fn violations(engine: &Engine, task: Task<'_>, samples: &Samples) -> Option<Violations> {
    if let Some(push) = engine.pushing() {
        return Some(pushed(push, task, samples));
    }
    Some(bounced(&BallLimits::of(engine, task.start)?, task, samples))
}

/// The limits that ground and energy set a ball from a first state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BallLimits {
    gravity: f64,
    step_s: f64,
    /// Height of the ground in the data, m.
    ground_m: f64,
    /// How far below the ground a step of the fastest fall reaches, m.
    deepest: f64,
    /// Whether the engine has laws of a model file, which may feed energy (a table that moves, an updraught).
    has_laws: bool,
}

impl BallLimits {
    /// For states of height, m, and velocity, m/s, over flat ground; none for others.
    pub fn of(engine: &Engine, start: &[f64]) -> Option<Self> {
        let (gravity, step_s) = (engine.expected().gravity_m_s2?, engine.step_s()?);
        let ground_m = engine.ground_m()?;
        let &[height, velocity] = start else { return None };
        let fastest = (velocity.powi(2) + 2.0 * gravity * (height - ground_m).max(0.0)).sqrt();
        let has_laws = engine.model().is_some();
        Some(BallLimits { gravity, step_s, ground_m, deepest: step_s * fastest, has_laws })
    }

    /// Most energy, J/kg, that a rebound from the state `before` leaves with: within the step the ball falls on, and arrives with more
    /// speed than it had before.
    fn most_energy(&self, before: [f64; 2]) -> f64 {
        self.energy(before) + self.gravity * self.step_s * before[1].abs()
    }

    fn energy(&self, [height, velocity]: [f64; 2]) -> f64 {
        0.5 * velocity * velocity + self.gravity * (height - self.ground_m)
    }

    /// The state nearest to `after` that ground and energy allow behind `before`. Where laws of a model file take the next state,
    /// `expected`, further, this one may go as far. PyBullet's ball may not: it gains energy where it is pushed out of the ground.
    pub fn allowed(&self, before: [f64; 2], expected: [f64; 2], after: [f64; 2]) -> [f64; 2] {
        let (mut deepest, mut most) = (self.ground_m - self.deepest, self.most_energy(before));
        if self.has_laws {
            (deepest, most) = (deepest.min(expected[0]), most.max(self.energy(expected)));
        }
        let height = after[0].max(deepest);
        let rebounds = before[1] < 0.0 && after[1] > 0.0;
        if !rebounds || self.energy([height, after[1]]) <= most {
            return [height, after[1]];
        }
        [height, (2.0 * (most - self.energy([height, 0.0]))).max(0.0).sqrt()]
    }
}

fn bounced(limits: &BallLimits, task: Task<'_>, samples: &Samples) -> Violations {
    let n = samples.count;
    let at =
        |t: usize, sample: usize| [0, 1].map(|j: usize| f64::from(samples.values[(t * 2 + j) * n + sample]));
    let (mut under, mut depth, mut rebounds, mut gains) = (0.0, 0.0, 0.0, 0.0);
    for sample in 0..n {
        for t in 0..task.time {
            let below = limits.ground_m - at(t, sample)[0] - (limits.deepest + SLOP_M);
            if below > 0.0 {
                under += 1.0;
                depth += below;
            }
            if t == 0 {
                continue;
            }
            let (before, after) = (at(t - 1, sample), at(t, sample));
            if before[1] < 0.0 && after[1] > 0.0 {
                rebounds += 1.0;
                gains += f64::from(u8::from(limits.energy(after) > limits.most_energy(before) + ENERGY_SLOP));
            }
        }
    }
    Violations::Ball {
        under_share: under / (n * task.time) as f64,
        under_m: if under > 0.0 { depth / under } else { 0.0 },
        gain_share: if rebounds > 0.0 { gains / rebounds } else { 0.0 },
    }
}

/// Gap between the rod at sample `t` and the object at a pose, m, and the direction from the object to the rod; negative where they
/// overlap.
pub(crate) fn gap(push: &ModelPush, task: &Task<'_>, t: usize, [x, y, angle]: [f64; 3]) -> (f64, [f64; 2]) {
    let pose = Pose::new(x, y, angle);
    let rod = [task.actions[3 * t], task.actions[3 * t + 1]];
    let nearest = push.world().object().outline.nearest(pose.to_body(rod));
    let (sin, cos) = angle.sin_cos();
    let [a, b] = nearest.outward;
    (nearest.distance - push.rod_radius_m(), [cos * a - sin * b, sin * a + cos * b])
}

fn pushed(push: &ModelPush, task: Task<'_>, samples: &Samples) -> Violations {
    let n = samples.count;
    let (mut overlap, mut untouched) = (0.0, 0.0);
    for sample in 0..n {
        let pose = |t: usize| [0, 1, 2].map(|j| f64::from(samples.values[(t * 3 + j) * n + sample]));
        let (mut deepest, mut touched, mut way) = (0.0_f64, false, 0.0_f64);
        for t in 0..task.time {
            let (gap, _) = gap(push, &task, t, pose(t));
            deepest = deepest.max(-gap);
            touched |= gap < TOUCH_M;
            if !touched {
                let [x, y, _] = pose(t);
                way = (x - task.start[0]).hypot(y - task.start[1]).max(way);
            }
        }
        overlap += deepest;
        untouched += way;
    }
    Violations::Push { overlap_m: overlap / n as f64, untouched_m: untouched / n as f64 }
}

#[cfg(test)]
mod tests {
    //! Contract: each violation by hand, and none for the engine itself.
    use super::*;
    use augsim_physics::ball::bullet::BulletBall;

    fn drop(values: Vec<f32>) -> Violations {
        let engine = Engine::PybulletBall(BulletBall::default());
        let task = Task { start: &[1.0, 0.0], actions: &[], time: values.len() / 2, index: 0 };
        violations(&engine, task, &Samples { count: 1, values }).expect("a ball over flat ground")
    }

    #[test]
    fn a_state_is_moved_to_the_nearest_that_ground_and_energy_allow() {
        let engine = Engine::PybulletBall(BulletBall::default());
        let limits = BallLimits::of(&engine, &[1.0, 0.0]).expect("a ball over flat ground");
        let free = [0.5, -3.0];
        assert_eq!(limits.allowed([0.6, -2.9], free, free), free);
        // A step of the fastest fall below the ground, and no deeper.
        let deep = limits.allowed([0.05, -4.4], [0.01, 2.0], [-0.5, -4.5]);
        assert!((deep[0] + limits.deepest).abs() < 1e-12 && deep[1] == -4.5, "{deep:?}");
        let fast = limits.allowed([0.05, -3.0], [0.05, 2.0], [0.05, 9.0]);
        assert!((limits.energy(fast) - limits.most_energy([0.05, -3.0])).abs() < 1e-9, "{fast:?}");
        // Laws of a model may feed energy, and then so may the net.
        let risen = BallLimits { has_laws: true, ..limits }.allowed([0.05, -3.0], [0.05, 9.0], [0.05, 8.9]);
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
    fn depth_and_gains_by_hand() {
        // Half of the samples lie 0.5 m below the ground; a step of the fastest fall from 1 m is 4.427 m/s / 60.
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
