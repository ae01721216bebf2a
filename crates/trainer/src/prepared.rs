//! One trajectory in the form a net reads: targets and conditions per time step.

/// Targets and conditions (net inputs) of one trajectory, row-major in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// Number of rows (time steps) of targets and conditions.
    pub time: usize,
    /// Number of targets per row.
    pub x_width: usize,
    /// Number of conditions (net inputs) per row.
    pub u_width: usize,
    /// Targets that the net shall predict, `[time, x_width]`.
    pub x: Vec<f32>,
    /// Conditions (net inputs), `[time, u_width]`.
    pub u: Vec<f32>,
}
