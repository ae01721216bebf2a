//! State of the ball at one instant, and covariates of a trajectory.

use crate::Scalar;

/// Which of the three coordinates of the ball the data contain.
///
/// `z` points up. The tracked point is the lowest point of the ball, so that contact is at height 0 above the
/// floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// A drop: only the height `z` is measured (`height_m`).
    Vertical,
    /// A throw in the plane: `x` and `z` are measured; the spin is about `+y`.
    Plane,
    /// A throw in space: `x`, `y` and `z` are measured.
    Space,
}

impl Axes {
    /// Indices of the measured coordinates in a 3-vector, in the order of the channels.
    pub fn indices(self) -> &'static [usize] {
        match self {
            Axes::Vertical => &[2],
            Axes::Plane => &[0, 2],
            Axes::Space => &[0, 1, 2],
        }
    }

    /// Number of measured coordinates.
    pub fn count(self) -> usize {
        self.indices().len()
    }
}

/// State of the ball at one time: position, velocity and spin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<S> {
    /// Time of the state since the release, s.
    pub time: S,
    /// Position of the lowest point of the ball, m.
    pub position: [S; 3],
    /// Velocity of the ball, m/s.
    pub velocity: [S; 3],
    /// Angular velocity of the ball, rad/s.
    pub spin: [S; 3],
}

impl<S: Scalar> State<S> {
    /// A ball at rest without spin at time 0, `height` (m) above the ground.
    pub fn at_rest(height: S) -> Self {
        let zero = S::zero();
        Self { time: zero, position: [zero, zero, height], velocity: [zero; 3], spin: [zero; 3] }
    }
}

/// Quantities recorded for a trajectory that are constant over it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Covariates {
    /// Session time of the release, s, relative to the reference time of the session clock.
    pub clock_s: f64,
    /// Spin of the ball at the release, rad/s.
    pub spin_rad_s: [f64; 3],
    /// Cross-section area divided by mass, m²/kg; 0 if size or mass is unknown.
    pub area_per_mass_m2_kg: f64,
}
