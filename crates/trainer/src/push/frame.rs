//! The frame in which the nets see a push: that of the object's initial pose.
//!
//! Forecasts therefore do not depend on where on the table, or at which angle, the push happens.

/// Position and angle of a push's frame (that of the initial pose) in the frame of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartFrame {
    origin: [f64; 2],
    start_angle: f64,
    cos: f64,
    sin: f64,
}

impl StartFrame {
    /// Creates the frame of the pose `start` with its axes turned by a further `turn`, rad.
    /// Angles are counted from that of the pose, whatever `turn` is.
    pub fn new(start: &[f64], turn: f64) -> Self {
        let (sin, cos) = (start[2] + turn).sin_cos();
        StartFrame { origin: [start[0], start[1]], start_angle: start[2], cos, sin }
    }

    /// Transforms a point from the data's frame to this frame, m.
    pub fn point(&self, p: [f64; 2]) -> [f64; 2] {
        self.vector([p[0] - self.origin[0], p[1] - self.origin[1]])
    }

    /// Transforms a vector from the data's frame to this frame.
    pub fn vector(&self, v: [f64; 2]) -> [f64; 2] {
        [self.cos * v[0] + self.sin * v[1], self.cos * v[1] - self.sin * v[0]]
    }

    /// Transforms a vector of this frame back to the data's frame.
    pub fn vector_back(&self, v: [f64; 2]) -> [f64; 2] {
        [self.cos * v[0] - self.sin * v[1], self.sin * v[0] + self.cos * v[1]]
    }

    /// Transforms a pose from the data's frame to this frame: position in m, angle from the initial one in rad.
    pub fn pose(&self, pose: &[f64]) -> [f64; 3] {
        let [x, y] = self.point([pose[0], pose[1]]);
        [x, y, pose[2] - self.start_angle]
    }

    /// Transforms a pose of this frame back to the data's frame.
    pub fn pose_back(&self, pose: [f64; 3]) -> [f64; 3] {
        let [x, y] = self.vector_back([pose[0], pose[1]]);
        [self.origin[0] + x, self.origin[1] + y, self.start_angle + pose[2]]
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the transformation and its inverse cancel, and the initial pose is the origin.
    use super::*;

    #[test]
    fn transform_and_inverse_cancel() {
        let start = [0.35, -0.03, 0.7];
        for turn in [0.0, 1.3] {
            let frame = StartFrame::new(&start, turn);
            assert_eq!(frame.pose(&start), [0.0; 3]);
            let pose = [0.4, 0.1, -0.2];
            let back = frame.pose_back(frame.pose(&pose));
            assert!(back.iter().zip(pose).all(|(b, p)| (b - p).abs() < 1e-15), "{back:?}");
        }
    }
}
