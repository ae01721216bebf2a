//! Quasi-static motion over a sub-step as a cubic, so that sub-steps need not end where samples are asked for.
//!
//! Source: Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, 1993, II.6 (cubic Hermite interpolation, of
//! third order in the sub-step).

use super::planar::{Pose, Twist};
use crate::Scalar;

/// A sub-step: at rest until `start`, then from one pose and twist to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc<S> {
    /// When the motion begins, s.
    pub start: S,
    /// How long it takes, s.
    pub duration: S,
    pub from: Pose<S>,
    pub to: Pose<S>,
    pub begins: Twist<S>,
    pub ends: Twist<S>,
}

impl<S: Scalar> Arc<S> {
    /// Nothing moves.
    pub fn still(pose: Pose<S>, start: S, duration: S) -> Self {
        Self { start, duration, from: pose, to: pose, begins: Twist::zero(), ends: Twist::zero() }
    }

    /// The pose at a time of the sub-step.
    pub fn at(&self, time: S) -> Pose<S> {
        let since = time - self.start;
        if since.value() <= 0.0 {
            return self.from;
        }
        let s = since / self.duration;
        let left = S::constant(1.0) - s;
        // Weights of the change in pose and of the two velocities.
        let rise = s * s * (left * 2.0 + 1.0);
        let (first, last) = (since * left * left, since * s * left);
        let blend = |a: S, b: S, u: S, v: S| a + (b - a) * rise + u * first - v * last;
        let [x, y] = [0, 1].map(|i| {
            let (u, v) = (self.begins.velocity[i], self.ends.velocity[i]);
            blend(self.from.position[i], self.to.position[i], u, v)
        });
        let angle = blend(self.from.angle, self.to.angle, self.begins.rotation, self.ends.rotation);
        Pose { position: [x, y], angle }
    }
}
