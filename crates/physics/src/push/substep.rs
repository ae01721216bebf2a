//! Dense output of a quasi-static sub-step: a cubic Hermite interpolant of the pose.
//!
//! Samples can thus lie inside a sub-step instead of at its end.
//!
//! Source: Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, 1993, II.6 (third order in
//! the length of the sub-step).

use super::planar::{Pose, Twist};
use crate::Scalar;

/// One sub-step of the object: at rest until `start`, then from one pose and twist to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Substep<S> {
    /// Time at which the motion of the object begins, s.
    pub start: S,
    /// Duration of the motion after `start`, s.
    pub duration: S,
    /// Pose of the object at the start of the motion.
    pub start_pose: Pose<S>,
    /// Pose of the object at the end of the sub-step.
    pub end_pose: Pose<S>,
    /// Twist of the object at the start of the motion.
    pub start_twist: Twist<S>,
    /// Twist of the object at the end of the sub-step.
    pub end_twist: Twist<S>,
}

impl<S: Scalar> Substep<S> {
    /// A sub-step in which the object does not move.
    pub fn at_rest(pose: Pose<S>, start: S, duration: S) -> Self {
        let twist = Twist::zero();
        Self { start, duration, start_pose: pose, end_pose: pose, start_twist: twist, end_twist: twist }
    }

    /// Pose of the object at `time`, s, interpolated in the sub-step.
    pub fn pose_at(&self, time: S) -> Pose<S> {
        let elapsed = time - self.start;
        if elapsed.value() <= 0.0 {
            return self.start_pose;
        }
        let s = elapsed / self.duration;
        let remaining = S::constant(1.0) - s;
        // Hermite weights of the change in pose and of the velocities at both ends.
        let pose_weight = s * s * (remaining * 2.0 + 1.0);
        let (start_weight, end_weight) = (elapsed * remaining * remaining, elapsed * s * remaining);
        let blend = |a: S, b: S, u: S, v: S| a + (b - a) * pose_weight + u * start_weight - v * end_weight;
        let [x, y] = [0, 1].map(|i| {
            let (u, v) = (self.start_twist.velocity[i], self.end_twist.velocity[i]);
            blend(self.start_pose.position[i], self.end_pose.position[i], u, v)
        });
        let angle = blend(
            self.start_pose.angle,
            self.end_pose.angle,
            self.start_twist.rotation,
            self.end_twist.rotation,
        );
        Pose { position: [x, y], angle }
    }
}
