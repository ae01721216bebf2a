//! Planar poses and the frames of push data.
//!
//! Every set is recorded in one planar frame, that of the robot's base, and kept there: "world". z points up,
//! angles turn counter-clockwise. [`in_start_frame`] moves each trajectory so that it begins with the object
//! at the origin, unturned, as most learned models of pushing want it.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::trajectory::Trajectory;

/// Position and angle in the plane, m and rad; also the transformation from its own frame to the world.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlanarPose {
    /// Position, m.
    pub x_m: f64,
    /// Position, m.
    pub y_m: f64,
    /// Angle, counter-clockwise, rad.
    pub theta_rad: f64,
}

impl PlanarPose {
    /// A vector (a direction, a force) of this frame, in the world.
    pub fn rotate(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.theta_rad.sin_cos();
        [c * x - s * y, s * x + c * y]
    }

    /// A vector of the world, in this frame.
    pub fn rotate_back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.theta_rad.sin_cos();
        [c * x + s * y, c * y - s * x]
    }

    /// A point of this frame, in the world, m.
    pub fn point(&self, point_m: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.rotate(point_m);
        [self.x_m + x, self.y_m + y]
    }

    /// A point of the world, in this frame, m.
    pub fn point_back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.rotate_back([x - self.x_m, y - self.y_m])
    }
}

/// Push data with each trajectory in the frame of the object's first measured pose: rod, pose and force.
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
        let mut pairs = |[x, y]: [usize; 2], moved: &dyn Fn([f64; 2]) -> [f64; 2]| {
            let both = values[x].iter().zip(&values[y]).map(|(&x, &y)| moved([x, y]));
            (values[x], values[y]) = both.map(|[x, y]| (x, y)).unzip();
        };
        points.iter().for_each(|&point| pairs(point, &|p| start.point_back(p)));
        force.iter().for_each(|&force| pairs(force, &|f| start.rotate_back(f)));
        values[theta].iter_mut().for_each(|angle| *angle -= start.theta_rad);
        t.with_samples(t.time_s().to_vec(), values)
    };
    let trajectories = data.trajectories().iter().map(moved).collect::<Result<Vec<_>, _>>()?;
    Dataset::with_origin(data.columns().to_vec(), trajectories, data.origin().clone())
}
