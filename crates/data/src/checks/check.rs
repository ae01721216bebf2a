//! The checks and their names.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A check of suspicious data; its name is the argument of `--accept`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Check {
    /// Values that are too large for any measurement in SI units.
    AbsurdValue,
    /// A value far outside the range of all others, such as 9999, that stands for "not measured".
    SentinelValue,
    /// A position, an angle or a velocity that is constant.
    ConstantColumn,
    /// A recording that occurs twice in the data set, under two names.
    RepeatedTrajectory,
    /// A few trajectories in another unit than the others.
    MixedUnits,
    /// A few trajectories whose clock is in another unit than that of the others.
    MixedClock,
    /// A coordinate that is in another unit than the other coordinates.
    ColumnScale,
    /// Two columns that hold the same signal.
    DuplicateColumn,
    /// A column that is shifted by a row relative to the other columns.
    ShiftedColumn,
    /// A velocity that is not the rate of change of the height.
    VelocityDisagrees,
    /// An angle in degrees in a column of radians.
    AngleInDegrees,
    /// An angle that jumps by a full turn.
    AngleWrap,
    /// Degrees Celsius in a column of kelvins.
    CelsiusInKelvin,
    /// A free fall that disagrees with the model's gravity: another unit, upside down, or swapped columns.
    GravityDisagrees,
    /// A declared measurement noise as large as the motion.
    DeclaredNoise,
}

impl Check {
    /// Name of the check on the command line and in results, such as `sentinel-value`.
    pub fn name(self) -> &'static str {
        match self {
            Check::AbsurdValue => "absurd-value",
            Check::SentinelValue => "sentinel-value",
            Check::ConstantColumn => "constant-column",
            Check::RepeatedTrajectory => "repeated-trajectory",
            Check::MixedUnits => "mixed-units",
            Check::MixedClock => "mixed-clock",
            Check::ColumnScale => "column-scale",
            Check::DuplicateColumn => "duplicate-column",
            Check::ShiftedColumn => "shifted-column",
            Check::VelocityDisagrees => "velocity-disagrees",
            Check::AngleInDegrees => "angle-in-degrees",
            Check::AngleWrap => "angle-wrap",
            Check::CelsiusInKelvin => "celsius-in-kelvin",
            Check::GravityDisagrees => "gravity-disagrees",
            Check::DeclaredNoise => "declared-noise",
        }
    }

    /// Whether the check compares the data with a model and finds nothing without one.
    pub fn needs_model(self) -> bool {
        matches!(self, Check::GravityDisagrees | Check::DeclaredNoise)
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
