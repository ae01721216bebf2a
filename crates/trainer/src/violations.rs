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
const TOUCH_M: f64 = 7e-4;

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
    let (gravity, step_s) = (engine.expected().gravity_m_s2?, engine.step_s()?);
    (task.start.len() == 2).then(|| bounced(gravity, step_s, task, samples))
}

fn bounced(gravity: f64, step_s: f64, task: Task<'_>, samples: &Samples) -> Violations {
    let n = samples.count;
    let at = |t: usize, j: usize, sample: usize| f64::from(samples.values[(t * 2 + j) * n + sample]);
    let fastest = (task.start[1].powi(2) + 2.0 * gravity * task.start[0].max(0.0)).sqrt();
    let deepest = step_s * fastest + SLOP_M;
    let (mut under, mut depth, mut rebounds, mut gains) = (0.0, 0.0, 0.0, 0.0);
    for sample in 0..n {
        for t in 0..task.time {
            let below = -at(t, 0, sample) - deepest;
            if below > 0.0 {
                under += 1.0;
                depth += below;
            }
            if t == 0 {
                continue;
            }
            let (before, after) = (at(t - 1, 1, sample), at(t, 1, sample));
            if before < 0.0 && after > 0.0 {
                rebounds += 1.0;
                let energy = |t: usize| 0.5 * at(t, 1, sample).powi(2) + gravity * at(t, 0, sample);
                // Within the step the ball falls on: it arrives with more speed than it had before.
                let allowed = energy(t - 1) + gravity * step_s * before.abs() + ENERGY_SLOP;
                gains += f64::from(u8::from(energy(t) > allowed));
            }
        }
    }
    Violations::Ball {
        under_share: under / (n * task.time) as f64,
        under_m: if under > 0.0 { depth / under } else { 0.0 },
        gain_share: if rebounds > 0.0 { gains / rebounds } else { 0.0 },
    }
}

fn pushed(push: &ModelPush, task: Task<'_>, samples: &Samples) -> Violations {
    let (n, outline) = (samples.count, &push.world().object().outline);
    let (mut overlap, mut untouched) = (0.0, 0.0);
    for sample in 0..n {
        let pose = |t: usize| [0, 1, 2].map(|j| f64::from(samples.values[(t * 3 + j) * n + sample]));
        let (mut deepest, mut touched, mut way) = (0.0_f64, false, 0.0_f64);
        for t in 0..task.time {
            let [x, y, angle] = pose(t);
            let rod = [task.actions[3 * t], task.actions[3 * t + 1]];
            let gap = outline.nearest(Pose::new(x, y, angle).to_body(rod)).distance - push.rod_radius_m();
            deepest = deepest.max(-gap);
            touched |= gap < TOUCH_M;
            if !touched {
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
