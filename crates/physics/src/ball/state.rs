//! State of a ball at one instant, and covariates of one trajectory.

use crate::Scalar;

/// Which of the three coordinates the data have. Heights are `z`, up; the ball's lowest point is followed, contact at 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// A drop: `z` alone (`height_m`).
    Vertical,
    /// A throw in the plane: `x`, `z`; spin about `+y`.
    Plane,
    /// A flight in space: `x`, `y`, `z`.
    Space,
}

impl Axes {
    /// Indices of the observed coordinates in a 3-vector, in the order of the channels.
    pub fn indices(self) -> &'static [usize] {
        match self {
            Axes::Vertical => &[2],
            Axes::Plane => &[0, 2],
            Axes::Space => &[0, 1, 2],
        }
    }

    /// Number of observed coordinates.
    pub fn count(self) -> usize {
        self.indices().len()
    }
}

/// Position (m), velocity (m/s) and spin (rad/s) at a time (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<S> {
    /// Seconds since the release.
    pub time: S,
    /// Lowest point of the ball, m.
    pub position: [S; 3],
    /// Velocity, m/s.
    pub velocity: [S; 3],
    /// Angular velocity, rad/s.
    pub spin: [S; 3],
}

impl<S: Scalar> State<S> {
    /// A ball at rest, without spin, `height` metres above the ground at time zero.
    pub fn at_rest(height: S) -> Self {
        let zero = S::zero();
        Self { time: zero, position: [zero, zero, height], velocity: [zero; 3], spin: [zero; 3] }
    }
}

/// Recorded properties of a whole trajectory, beside its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Covariates {
    /// Session time of the release minus the session's reference time, s.
    pub clock_s: f64,
    /// Spin at the release, rad/s.
    pub spin_rad_s: [f64; 3],
    /// Area of the ball's cross-section over its mass, m²/kg; 0 where size or mass is not known.
    pub area_per_mass_m2_kg: f64,
}
