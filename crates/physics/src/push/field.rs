//! A map of relative friction over the table.

use super::planar::Vector;

/// Relative friction on a square grid: bilinear between nodes, constant beyond the edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    low_m: Vector<f64>,
    pitch_m: f64,
    nodes: usize,
    values: Vec<f64>,
}

impl Field {
    /// A map of `nodes × nodes` friction values, row by row (x fastest).
    ///
    /// `low_m` is the corner with the smallest coordinates and `pitch_m` the distance between nodes. Returns
    /// `None` if the number of values does not match or a value is not positive.
    pub fn new(low_m: Vector<f64>, pitch_m: f64, nodes: usize, values: Vec<f64>) -> Option<Self> {
        let fits = nodes >= 2 && values.len() == nodes * nodes && pitch_m > 0.0;
        (fits && values.iter().all(|v| *v > 0.0)).then_some(Self { low_m, pitch_m, nodes, values })
    }

    /// Relative friction of the table at `place`, m, in the world frame.
    pub fn factor(&self, place: Vector<f64>) -> f64 {
        let last = (self.nodes - 1) as f64;
        let cell = |axis: usize| {
            let u = ((place[axis] - self.low_m[axis]) / self.pitch_m).clamp(0.0, last);
            let i = (u as usize).min(self.nodes - 2);
            (i, u - i as f64)
        };
        let ((i, u), (j, v)) = (cell(0), cell(1));
        let node = |i: usize, j: usize| self.values[j * self.nodes + i];
        (1.0 - v) * ((1.0 - u) * node(i, j) + u * node(i + 1, j))
            + v * ((1.0 - u) * node(i, j + 1) + u * node(i + 1, j + 1))
    }
}
