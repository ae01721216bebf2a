//! Suspicious data: sets that every reader accepts and that cannot be what their names say.
//!
//! One file a check, all alike: a constant for each threshold with the figure that led to it, and `look`, which takes the
//! set and what a model expects of it and gives what it finds. A further check is one file, a variant of [`Check`] and of
//! [`Finding`], and a line in `LIST`. The order of the list is that of the messages: what spoils later checks (sentinels)
//! comes first.

mod absurd_value;
mod admit;
mod angle_in_degrees;
mod check;
mod clock_unit;
mod column_scale;
mod constant_column;
mod declared_noise;
mod duplicate_column;
mod finding;
mod gravity_disagrees;
mod measured;
mod mixed_clock;
mod mixed_units;
mod repeated_trajectory;
mod sentinel_value;
mod shifted_column;
pub(crate) mod suspicious;
mod velocity_disagrees;

use crate::dataset::Dataset;

pub use admit::{Accepted, Admitted, Warning, admit};
pub use check::Check;
pub use clock_unit::ClockUnit;
pub use finding::{Finding, Severity};
pub(crate) use gravity_disagrees::curvature;
pub use suspicious::SuspiciousData;

/// Statements of a model about the data that it is to explain; `None` where it says nothing or there is no model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Expected {
    /// Gravity, m/s², downward positive.
    pub gravity_m_s2: Option<f64>,
    /// Standard deviation of measured positions, m.
    pub position_sd_m: Option<f64>,
    /// Standard deviation of measured angles, rad.
    pub angle_sd_rad: Option<f64>,
    /// Columns that the model reads as outputs.
    pub outputs: Vec<String>,
    /// Columns that the model reads as inputs.
    pub inputs: Vec<String>,
}

type Look = fn(&Dataset, &Expected) -> Vec<Finding>;

/// Every check with what it looks for and how.
const LIST: [(Check, &str, Look); 13] = [
    (Check::AbsurdValue, "values beyond 1e12 of an SI unit", absurd_value::look),
    (
        Check::SentinelValue,
        "one value far outside of all others (9999 for `not measured`)",
        sentinel_value::look,
    ),
    (Check::ConstantColumn, "a position, angle or velocity that never changes", constant_column::look),
    (Check::RepeatedTrajectory, "the same recording under two names", repeated_trajectory::look),
    (Check::MixedUnits, "a few trajectories in another unit", mixed_units::look),
    (Check::MixedClock, "a few trajectories with the clock in another unit", mixed_clock::look),
    (Check::ColumnScale, "one coordinate in another unit than the others", column_scale::look),
    (Check::DuplicateColumn, "one signal in two columns", duplicate_column::look),
    (Check::ShiftedColumn, "a column moved by a row against the others", shifted_column::look),
    (Check::VelocityDisagrees, "a velocity that is not the change of the height", velocity_disagrees::look),
    (Check::AngleInDegrees, "degrees in a column of radians", angle_in_degrees::look),
    (Check::GravityDisagrees, "free fall other than the model's", gravity_disagrees::look),
    (Check::DeclaredNoise, "a declared noise as large as the motion", declared_noise::look),
];

impl Check {
    /// All checks, in the order of their messages.
    pub fn all() -> impl Iterator<Item = Check> {
        LIST.iter().map(|(check, ..)| *check)
    }

    /// The check called `name`, such as `sentinel-value`.
    pub fn named(name: &str) -> Option<Check> {
        Check::all().find(|check| check.name() == name)
    }
}

/// Outcome of one check; no finding where the data pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The check.
    pub check: Check,
    /// The mistake that it looks for, in words.
    pub looks_for: &'static str,
    /// Its finding.
    pub findings: Vec<Finding>,
}

/// Runs every check on `data`, with what a model expects of it.
pub fn run_checks(data: &Dataset, expected: &Expected) -> Vec<Outcome> {
    let run = |&(check, looks_for, look): &(Check, &'static str, Look)| Outcome {
        check,
        looks_for,
        findings: look(data, expected),
    };
    LIST.iter().map(run).collect()
}
