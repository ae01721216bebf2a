//! Planar poses and the frames of push data.
//!
//! Every set is recorded in the frame of the robot's base, which is the world frame: z points up, and angles
//! are positive counter-clockwise. [`in_start_frame`] transforms each trajectory so that the object begins at
//! the origin with angle 0, as most learned models of pushing expect it.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::trajectory::Trajectory;

/// Pose in the plane (position and angle), and the transformation from the frame at this pose to the world.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlanarPose {
    /// Position of the frame's origin along x, m.
    pub x_m: f64,
    /// Position of the frame's origin along y, m.
    pub y_m: f64,
    /// Angle of the frame, counter-clockwise, rad.
    pub theta_rad: f64,
}

impl PlanarPose {
    /// Transforms a vector (such as a force) from the frame at this pose to the world.
    pub fn rotate(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.theta_rad.sin_cos();
        [c * x - s * y, s * x + c * y]
    }

    /// Transforms a vector from the world to the frame at this pose.
    pub fn rotate_back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.theta_rad.sin_cos();
        [c * x + s * y, c * y - s * x]
    }

    /// Transforms a point (m) from the frame at this pose to the world.
    pub fn point(&self, point_m: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.rotate(point_m);
        [self.x_m + x, self.y_m + y]
    }

    /// Transforms a point (m) from the world to the frame at this pose.
    pub fn point_back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.rotate_back([x - self.x_m, y - self.y_m])
    }
}

/// Transforms rod, object pose and force of each trajectory to the frame of the object's first measured pose.
///
/// # Errors
/// A column of push data (`pusher_x_m`, `pusher_y_m`, `x_m`, `y_m`, `theta_rad`) is missing.
pub fn in_start_frame(data: &Dataset) -> Result<Dataset, DataError> {
    let theta = data.column_index("theta_rad")?;
    let object = [data.column_index("x_m")?, data.column_index("y_m")?];
    let points = [object, [data.column_index("pusher_x_m")?, data.column_index("pusher_y_m")?]];
    let force = match data.has_column("force_x_N") {
        true => Some([data.column_index("force_x_N")?, data.column_index("force_y_N")?]),
        false => None,
    };
    let moved = |t: &Trajectory| {
        let mut values = t.values().to_vec();
        let first = (0..t.len()).find(|&k| values[theta][k].is_finite()).unwrap_or(0);
        let start = PlanarPose {
            x_m: values[object[0]][first],
            y_m: values[object[1]][first],
            theta_rad: values[theta][first],
        };
        let mut transform = |[x, y]: [usize; 2], map: &dyn Fn([f64; 2]) -> [f64; 2]| {
            let both = values[x].iter().zip(&values[y]).map(|(&x, &y)| map([x, y]));
            (values[x], values[y]) = both.map(|[x, y]| (x, y)).unzip();
        };
        points.iter().for_each(|&point| transform(point, &|p| start.point_back(p)));
        force.iter().for_each(|&force| transform(force, &|f| start.rotate_back(f)));
        values[theta].iter_mut().for_each(|angle| *angle -= start.theta_rad);
        t.with_samples(t.time_s().to_vec(), values)
    };
    let trajectories = data.trajectories().iter().map(moved).collect::<Result<Vec<_>, _>>()?;
    Dataset::with_origin(data.columns().to_vec(), trajectories, data.origin().clone())
}
