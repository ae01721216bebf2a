//! Checks of suspicious data: valid files whose values contradict their column names or units.
//!
//! Each check is one file with a constant for each threshold, the figure that led to it, and a function
//! `run`. It takes the data set and what a model expects of it, and returns its findings. A new check is one
//! file, a variant of [`Check`] and of [`Finding`], and a line in `CHECKS`. The list has the order of the
//! messages: mistakes that would confuse later checks, such as sentinel values, come first.

mod absurd_value;
mod angle_in_degrees;
mod angle_wrap;
mod celsius_in_kelvin;
mod check;
mod check_data;
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

pub use check::Check;
pub use check_data::{AcceptedChecks, CheckedData, Warning, check_data};
pub use clock_unit::ClockUnit;
pub use finding::{Finding, Severity};
pub(crate) use gravity_disagrees::free_motion_acceleration;
pub use suspicious::SuspiciousData;

/// Properties of the data that a model declares; `None` or empty where it declares none or there is no model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExpectedData {
    /// Gravity of the model, m/s², downward positive.
    pub gravity_m_s2: Option<f64>,
    /// Declared standard deviation of the noise of measured positions, m.
    pub position_sd_m: Option<f64>,
    /// Declared standard deviation of the noise of measured angles, rad.
    pub angle_sd_rad: Option<f64>,
    /// Names of the columns that the model reads as outputs.
    pub outputs: Vec<String>,
    /// Names of the columns that the model reads as inputs.
    pub inputs: Vec<String>,
    /// Names of the columns of angles that the model declares as periodic.
    pub periodic: Vec<String>,
    /// Temperatures that the model declares, K.
    pub temperatures_kelvin: Vec<f64>,
}

type RunCheck = fn(&Dataset, &ExpectedData) -> Vec<Finding>;

/// Every check with the mistake that it looks for, in the order of the messages.
const CHECKS: [(Check, &str, RunCheck); 15] = [
    (Check::AbsurdValue, "values above 1e12 in SI units", absurd_value::run),
    (
        Check::SentinelValue,
        "a value far outside the range of all others (9999 for `not measured`)",
        sentinel_value::run,
    ),
    (Check::ConstantColumn, "a position, angle or velocity that is constant", constant_column::run),
    (Check::RepeatedTrajectory, "the same recording under two names", repeated_trajectory::run),
    (Check::MixedUnits, "a few trajectories in another unit", mixed_units::run),
    (Check::MixedClock, "a few trajectories with the clock in another unit", mixed_clock::run),
    (Check::ColumnScale, "one coordinate in another unit than the others", column_scale::run),
    (Check::DuplicateColumn, "one signal in two columns", duplicate_column::run),
    (Check::ShiftedColumn, "a column shifted by a row relative to the others", shifted_column::run),
    (
        Check::VelocityDisagrees,
        "a velocity that is not the rate of change of the height",
        velocity_disagrees::run,
    ),
    (Check::AngleInDegrees, "degrees in a column of radians", angle_in_degrees::run),
    (Check::AngleWrap, "an angle that jumps by a full turn", angle_wrap::run),
    (Check::CelsiusInKelvin, "degrees Celsius in a column of kelvins", celsius_in_kelvin::run),
    (
        Check::GravityDisagrees,
        "a free fall that differs from the gravity of the model",
        gravity_disagrees::run,
    ),
    (Check::DeclaredNoise, "a declared measurement noise as large as the motion", declared_noise::run),
];

impl Check {
    /// All checks, in the order of their messages.
    pub fn all() -> impl Iterator<Item = Check> {
        CHECKS.iter().map(|(check, ..)| *check)
    }

    /// Finds the check called `name`, such as `sentinel-value`; `None` where there is none.
    pub fn named(name: &str) -> Option<Check> {
        Check::all().find(|check| check.name() == name)
    }
}

/// Result of one check of a data set; `findings` is empty where the data pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Check that was run.
    pub check: Check,
    /// Description of the mistake that the check looks for.
    pub looks_for: &'static str,
    /// Findings of the check.
    pub findings: Vec<Finding>,
}

/// Runs all checks on `data`; `expected` are the properties of the data that a model declares.
pub fn run_checks(data: &Dataset, expected: &ExpectedData) -> Vec<Outcome> {
    let outcome = |&(check, looks_for, run): &(Check, &'static str, RunCheck)| Outcome {
        check,
        looks_for,
        findings: run(data, expected),
    };
    CHECKS.iter().map(outcome).collect()
}
