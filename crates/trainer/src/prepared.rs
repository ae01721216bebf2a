//! One trajectory in the form a net reads: targets and conditions per time step.

/// Targets and conditions of one trajectory, row-major in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// Number of rows (time steps).
    pub time: usize,
    /// Width of a target row.
    pub x_width: usize,
    /// Width of a condition row.
    pub u_width: usize,
    /// Targets `[time, x_width]`.
    pub x: Vec<f32>,
    /// Conditions `[time, u_width]`.
    pub u: Vec<f32>,
}
