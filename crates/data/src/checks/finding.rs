//! Findings of the checks, with their messages.

use super::check::Check;
use super::clock_unit::ClockUnit;
use crate::statistics::digits;
use serde::Serialize;
use thiserror::Error;

/// Severity of a suspicious property of a data set: refused, or used with a warning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The data set is refused.
    Refused,
    /// The data set is used, and the result shows a warning.
    Warning,
}

/// One suspicious property of a data set.
///
/// The message states trajectory, time, column and remedy; the caller puts the file name before it.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Finding {
    /// A value is too large for any measurement in SI units.
    #[error(
        "trajectory `{trajectory}`, t_s = {time_s} s: column `{column}` holds {}, which is too large for a measurement \
         in {unit}; convert the values to SI units, and leave cells empty where nothing was measured", digits(*value)
    )]
    AbsurdValue {
        /// Identifier of the trajectory with the value.
        trajectory: String,
        /// Time of the sample with the value, s.
        time_s: f64,
        /// Name of the column with the value.
        column: String,
        /// Symbol of the unit of the column.
        unit: String,
        /// Value that is too large, in the unit of the column.
        value: f64,
    },
    /// A value far outside the range of all others, such as 9999, stands for "not measured".
    #[error(
        "trajectory `{trajectory}`, t_s = {time_s} s: column `{column}` holds {}, as in {count} sample(s) of the set: \
         an outlier far from all other values ({} to {}), which probably stands for `not measured`; leave cells empty \
         where nothing was measured",
        digits(*value), digits(others[0]), digits(others[1])
    )]
    SentinelValue {
        /// Identifier of the first trajectory that has the value.
        trajectory: String,
        /// Time of the first sample that has the value, s.
        time_s: f64,
        /// Name of the column with the value.
        column: String,
        /// Value that stands for "not measured".
        value: f64,
        /// Number of samples of the set that hold the value.
        count: usize,
        /// Smallest and largest of all other values of the column.
        others: [f64; 2],
    },
    /// A position, an angle or a velocity is constant.
    #[error(
        "the column `{column}` never changes: it holds {} in all {samples} samples, so it was not measured; export it \
         again, or remove it", digits(*value)
    )]
    ConstantColumn {
        /// Name of the column that is constant.
        column: String,
        /// Value that the column has in all samples.
        value: f64,
        /// Number of measured samples of the column.
        samples: usize,
    },
    /// Two trajectories are the same recording.
    #[error(
        "trajectory `{trajectory}` repeats `{original}` sample by sample{}, so a model could be tested on data that it \
         was fitted to; it is left out: remove it from the file, or, if it was measured separately, write its values \
         with all their digits",
        if *copies > 1 { format!(" (one of {copies} copies in the set)") } else { String::new() }
    )]
    RepeatedTrajectory {
        /// Identifier of the first trajectory that copies another one.
        trajectory: String,
        /// Identifier of the trajectory that is copied.
        original: String,
        /// Number of trajectories of the set that copy another one.
        copies: usize,
    },
    /// A column is in another unit in a few trajectories than in all others.
    #[error(
        "trajectory `{trajectory}`: column `{column}` spans {} {unit}, but the other {others} trajectories stay within \
         {} {unit}, a factor of about {}{}; convert it to the unit in the name of the column, or remove it",
        digits(*span), digits(*others_span), digits(*factor), and_more(*alike)
    )]
    MixedUnits {
        /// Identifier of the first trajectory in another unit.
        trajectory: String,
        /// Name of the column that is in another unit.
        column: String,
        /// Symbol of the unit of the column.
        unit: String,
        /// Span of the values of that trajectory.
        span: f64,
        /// Span of all values of the trajectories in the usual unit.
        others_span: f64,
        /// Median span of the trajectories in another unit, divided by that of the others.
        factor: f64,
        /// Number of trajectories in the usual unit.
        others: usize,
        /// Number of trajectories in another unit.
        alike: usize,
    },
    /// A few trajectories have their times in another unit than all others.
    #[error(
        "trajectory `{trajectory}`: its time step is {} s, but that of the other {others} trajectories is {} s, a ratio \
         of about {}, although the columns change equally from sample to sample{}; {}",
        digits(*step_s), digits(*others_step_s), digits(step_s / others_step_s), and_more(*alike),
        clock_remedy(*unit, step_s > others_step_s)
    )]
    MixedClock {
        /// Identifier of the first trajectory whose clock differs.
        trajectory: String,
        /// Median time step of that trajectory, s.
        step_s: f64,
        /// Median time step of the trajectories with the usual clock, s.
        others_step_s: f64,
        /// Unit other than seconds that explains the ratio of the two time steps.
        unit: ClockUnit,
        /// Number of trajectories with the usual clock.
        others: usize,
        /// Number of trajectories whose clock is in that unit.
        alike: usize,
    },
    /// A coordinate is in another unit than the others of its frame.
    #[error(
        "column `{column}` moves {} times as far as `{reference}` and is {} times as noisy, so it is probably in another \
         unit; convert it to metres", digits(*span), digits(*noise)
    )]
    ColumnScale {
        /// Name of the column that is in another unit.
        column: String,
        /// Name of the coordinate that it is compared with, the least noisy one.
        reference: String,
        /// Span of the column divided by that of the reference column.
        span: f64,
        /// Noise of the column divided by that of the reference column.
        noise: f64,
    },
    /// An object moves further than the rod that pushes it.
    #[error(
        "trajectory `{trajectory}`: the object moves {} m along `{column}` while the rod moves only {} m, as in {share} % \
         of the pushes; one of them is in another unit: convert it to metres", digits(*object_m), digits(*rod_m)
    )]
    ObjectOutrunsRod {
        /// Identifier of the first push in which the object moves further than the rod.
        trajectory: String,
        /// Name of the column with the coordinate of the object.
        column: String,
        /// Span of the object's coordinate in that push, m.
        object_m: f64,
        /// Length of the path of the rod in that push, m.
        rod_m: f64,
        /// Share of the pushes in which the object moves further than the rod, per cent.
        share: usize,
    },
    /// Two columns that the model reads as outputs hold the same signal.
    #[error(
        "columns `{}` and `{}`, both outputs of the model, hold the same numbers in all {samples} samples: one signal was \
         written twice; export the wrong one again, or remove it from the model", columns[0], columns[1]
    )]
    DuplicateOutput {
        /// Names of the two columns that hold the same signal.
        columns: [String; 2],
        /// Number of samples at which both columns have a value.
        samples: usize,
    },
    /// Two columns that the model reads as inputs hold the same signal.
    #[error(
        "columns `{}` and `{}`, both inputs of the model, hold the same numbers in all {samples} samples, so their \
         effects cannot be distinguished; export the wrong one again, or remove one from the model", columns[0], columns[1]
    )]
    DuplicateInput {
        /// Names of the two columns that hold the same signal.
        columns: [String; 2],
        /// Number of samples at which both columns have a value.
        samples: usize,
    },
    /// A column of an input and a column of an output of the model hold the same signal.
    #[error(
        "column `{input}`, an input of the model, holds the same numbers as its output `{output}` in all {samples} \
         samples: one signal was probably written twice; export the wrong one again, or remove it from the model"
    )]
    InputEqualsOutput {
        /// Name of the input column.
        input: String,
        /// Name of the output column.
        output: String,
        /// Number of samples at which both columns have a value.
        samples: usize,
    },
    /// Two columns hold the same signal, and no model states whether they are inputs or outputs.
    #[error(
        "columns `{}` and `{}` hold the same numbers in all {samples} samples: one signal was probably written twice; \
         export the wrong one again, or remove it", columns[0], columns[1]
    )]
    DuplicateColumn {
        /// Names of the two columns that hold the same signal.
        columns: [String; 2],
        /// Number of samples at which both columns have a value.
        samples: usize,
    },
    /// A column is shifted by a row of the file, so that values belong to the neighbouring trajectory.
    #[error(
        "trajectory `{trajectory}`, t_s = {time_s} s: column `{column}` holds a value that continues the neighbouring \
         trajectory in the file, as in {share} % of the trajectories: the column is shifted by a row relative to the \
         others; align it"
    )]
    ShiftedColumn {
        /// Identifier of the first trajectory that shows the shift.
        trajectory: String,
        /// Time of the sample that belongs to the neighbouring trajectory, s.
        time_s: f64,
        /// Name of the column that is shifted.
        column: String,
        /// Share of the trajectory boundaries that show the shift, per cent.
        share: usize,
    },
    /// A height column and its velocity column are shifted by rows relative to each other.
    #[error(
        "columns `{height}` and `{velocity}` are shifted by {rows} row(s) or more relative to each other: the change of \
         the height agrees with the velocity of that row and not with that of its own row; align them"
    )]
    ShiftedVelocity {
        /// Name of the height column.
        height: String,
        /// Name of the velocity column.
        velocity: String,
        /// Minimum number of rows by which the columns are shifted.
        rows: u64,
    },
    /// A velocity column is not the rate of change of the height column.
    #[error(
        "column `{velocity}` is not the rate of change of `{height}`: in {} s the height changes by {} m, but the \
         velocity integrates to {} m (means over the set); check that the two columns are not swapped and have the \
         same sign and unit",
        digits(*time_s), digits(*height_m), digits(*velocity_m)
    )]
    VelocityDisagrees {
        /// Name of the height column.
        height: String,
        /// Name of the velocity column.
        velocity: String,
        /// Mean duration over which height change and velocity integral are compared, s.
        time_s: f64,
        /// Mean absolute change of the height over that duration, m.
        height_m: f64,
        /// Mean absolute integral of the velocity over that duration, m.
        velocity_m: f64,
    },
    /// A column of radians holds degrees.
    #[error(
        "trajectory `{trajectory}`: column `{column}` changes by {} rad while the rod moves {} m, more than a push can turn \
         an object, and reaches {} rad: the values are degrees; convert them to radians",
        digits(*change_rad), digits(*rod_m), digits(*largest_rad)
    )]
    AngleInDegrees {
        /// Identifier of the push with the largest rotation for the path of its rod.
        trajectory: String,
        /// Name of the column of angles.
        column: String,
        /// Change of the angle in that push, as written in the file (declared as rad).
        change_rad: f64,
        /// Length of the path of the rod in that push, m.
        rod_m: f64,
        /// Largest absolute angle of the set, as written in the file (declared as rad).
        largest_rad: f64,
    },
    /// A model of equations fits columns of radians only if their values are taken as degrees.
    #[error(
        "column {} reaches {} rad, and the model fits short windows of the data with 1/{ratio:.0} of the residual if the values are \
         degrees: call the column {}, which is converted",
        quoted(columns, str::to_owned), digits(*largest_rad), quoted(columns, degree_name)
    )]
    AngleOfModelInDegrees {
        /// Names of the columns that hold degrees, the angles before the angular rates.
        columns: Vec<String>,
        /// Largest value of the first column, as written in the file (declared as rad).
        largest_rad: f64,
        /// Residual of the model with the values read as radians, divided by that with degrees.
        ratio: f64,
    },
    /// An angle jumps by a full turn, because the sensor returns it within one turn.
    #[error(
        "trajectory `{trajectory}`, t_s = {time_s} s: column `{column}` jumps by a full turn, as at {jumps} place(s) of the \
         set, while the motion continues: the angle is wrapped; {}",
        wrap_remedy(*is_output)
    )]
    AngleWrap {
        /// Identifier of the first trajectory with a jump.
        trajectory: String,
        /// Time of the first jump in that trajectory, s.
        time_s: f64,
        /// Name of the column of angles.
        column: String,
        /// Number of jumps by a full turn in the whole set.
        jumps: usize,
        /// Whether the column is an output of the model, which may be declared periodic.
        is_output: bool,
    },
    /// A column of kelvins holds degrees Celsius.
    #[error(
        "column `{column}` holds {} K ({} K at least){}: the values are probably degrees Celsius; call the column `{}`, \
         which is converted, or add 273.15",
        digits(*typical_kelvin), digits(*smallest_kelvin),
        declared_kelvin.map_or_else(String::new, |t| format!(", but the model declares temperatures such as {} K", digits(t))),
        celsius_name(column)
    )]
    CelsiusInKelvin {
        /// Name of the column of temperatures.
        column: String,
        /// Median of the values as written in the file, K.
        typical_kelvin: f64,
        /// Smallest value as written in the file, K.
        smallest_kelvin: f64,
        /// Temperature that the model declares, K, nearest to the median read as degrees Celsius; `None` without one.
        declared_kelvin: Option<f64>,
    },
    /// The free-fall acceleration of the set differs from the gravity of the model.
    #[error(
        "column `{column}` falls at {} m/s², but the gravity of the model is {} m/s²; {}", digits(*found_m_s2), digits(*expected_m_s2),
        gravity_remedy(found_m_s2 / expected_m_s2)
    )]
    GravityDisagrees {
        /// Name of the height column.
        column: String,
        /// Median free-fall acceleration over the trajectories, m/s², downward positive.
        found_m_s2: f64,
        /// Gravity of the model, m/s², downward positive.
        expected_m_s2: f64,
    },
    /// Not the height column but another one shows free fall, so that the two are swapped.
    #[error(
        "column `{column}` shows no free fall, but `{falling}` falls at {} m/s²; the two columns are swapped: exchange \
         their names",
        digits(*found_m_s2)
    )]
    SwappedColumns {
        /// Name of the height column.
        column: String,
        /// Name of the column that shows the free fall.
        falling: String,
        /// Acceleration of the falling column, m/s², downward positive.
        found_m_s2: f64,
    },
    /// The free-fall acceleration of one trajectory differs from that of the others.
    #[error(
        "trajectory `{trajectory}`: column `{column}` falls at {} m/s², but the others fall at {} m/s²{}; {}",
        digits(*found_m_s2), digits(*others_m_s2), and_more(*alike), gravity_remedy(found_m_s2 / others_m_s2)
    )]
    GravityDiffers {
        /// Identifier of the first trajectory that falls differently.
        trajectory: String,
        /// Name of the height column.
        column: String,
        /// Acceleration of that trajectory, m/s², downward positive.
        found_m_s2: f64,
        /// Median acceleration over all trajectories, m/s², downward positive.
        others_m_s2: f64,
        /// Number of trajectories that fall differently.
        alike: usize,
    },
    /// The declared measurement noise is as large as the motion.
    #[error(
        "the model declares `{key}` = {} {unit}, but the noise of `{column}` is {} {unit} and its motion only {} {unit}, \
         so no motion would be visible; declare it in {unit}", digits(*declared), digits(*found), digits(*span)
    )]
    DeclaredNoise {
        /// Key of the model file that declares the noise.
        key: &'static str,
        /// Name of the column that the declared noise is compared with.
        column: String,
        /// Symbol of the unit of the noise.
        unit: &'static str,
        /// Standard deviation of the noise that the model declares.
        declared: f64,
        /// Standard deviation of the noise that was estimated from the data.
        found: f64,
        /// Typical span of the column within a trajectory.
        span: f64,
    },
    /// The declared measurement noise is far above the noise of the data.
    #[error(
        "the model declares `{key}` = {} {unit}, but the noise of `{column}` is {} {unit}: the declared value is used as \
         a tolerance, and smaller effects are not searched for; leave it out to use the noise of the data",
        digits(*declared), digits(*found)
    )]
    CoarseTolerance {
        /// Key of the model file that declares the noise.
        key: &'static str,
        /// Name of the column that the declared noise is compared with.
        column: String,
        /// Symbol of the unit of the noise.
        unit: &'static str,
        /// Standard deviation of the noise that the model declares.
        declared: f64,
        /// Standard deviation of the noise that was estimated from the data.
        found: f64,
    },
}

/// Remedy, for the message, of an angle that jumps by a full turn.
fn wrap_remedy(is_output: bool) -> &'static str {
    match is_output {
        true => {
            "declare `period_rad = 6.283185307179586` for this output of the model, or unwrap the column (numpy.unwrap) before \
             reading it"
        }
        false => "unwrap the column (numpy.unwrap) before reading it",
    }
}

/// Renames a column of radians as one of degrees: `angle_rad` becomes `angle_deg`.
fn degree_name(column: &str) -> String {
    match (column.strip_suffix("_rad_s"), column.strip_suffix("_rad")) {
        (Some(name), _) => format!("{name}_deg_s"),
        (None, name) => format!("{}_deg", name.unwrap_or(column)),
    }
}

/// Column names, changed by `name`, in backquotes and joined by commas.
fn quoted(columns: &[String], name: impl Fn(&str) -> String) -> String {
    columns.iter().map(|column| format!("`{}`", name(column))).collect::<Vec<_>>().join(", ")
}

/// Renames a column of kelvins as one of degrees Celsius: `wall_K` becomes `wall_degC`.
fn celsius_name(column: &str) -> String {
    format!("{}_degC", column.strip_suffix("_K").unwrap_or(column))
}

/// Text in parentheses with the number of trajectories like the reported one; empty for 0 or 1.
fn and_more(alike: usize) -> String {
    match alike {
        0 | 1 => String::new(),
        n => format!(" ({n} trajectories are like this)"),
    }
}

/// Remedy, for the message, of a clock in `unit`: that of the reported trajectory or that of the others.
fn clock_remedy(unit: ClockUnit, has_longer_step: bool) -> String {
    // In units shorter than a second the numbers, and so the steps, are too large.
    match has_longer_step == unit.is_finer_than_seconds() {
        true => format!("its clock is in {unit}: convert its `t_s` to seconds"),
        false => format!("the clocks of the others are in {unit}: convert their `t_s` to seconds"),
    }
}

/// Probable cause and remedy, for the message, of an acceleration that is `ratio` times the expected one.
fn gravity_remedy(ratio: f64) -> String {
    let unit = [("inches", 39.37), ("cm", 100.0), ("mm", 1000.0)]
        .into_iter()
        .find(|(_, factor)| (ratio.abs() / factor).ln().abs() < 0.4_f64);
    let up = if ratio < 0.0 { "up must be positive: change the sign" } else { "" };
    match (unit, up) {
        (Some((unit, _)), "") => format!("the values are in {unit}: convert them to metres"),
        (Some((unit, _)), up) => format!("the values are in {unit}: convert them to metres; {up}"),
        (None, "") => "check the unit of the heights and of `t_s`".to_owned(),
        (None, up) => up.to_owned(),
    }
}

impl Finding {
    /// Check that led to the finding.
    pub fn check(&self) -> Check {
        match self {
            Finding::AbsurdValue { .. } => Check::AbsurdValue,
            Finding::SentinelValue { .. } => Check::SentinelValue,
            Finding::ConstantColumn { .. } => Check::ConstantColumn,
            Finding::RepeatedTrajectory { .. } => Check::RepeatedTrajectory,
            Finding::MixedUnits { .. } => Check::MixedUnits,
            Finding::MixedClock { .. } => Check::MixedClock,
            Finding::DuplicateOutput { .. }
            | Finding::DuplicateInput { .. }
            | Finding::InputEqualsOutput { .. }
            | Finding::DuplicateColumn { .. } => Check::DuplicateColumn,
            Finding::ColumnScale { .. } | Finding::ObjectOutrunsRod { .. } => Check::ColumnScale,
            Finding::ShiftedColumn { .. } | Finding::ShiftedVelocity { .. } => Check::ShiftedColumn,
            Finding::VelocityDisagrees { .. } => Check::VelocityDisagrees,
            Finding::AngleInDegrees { .. } | Finding::AngleOfModelInDegrees { .. } => Check::AngleInDegrees,
            Finding::AngleWrap { .. } => Check::AngleWrap,
            Finding::CelsiusInKelvin { .. } => Check::CelsiusInKelvin,
            Finding::GravityDisagrees { .. }
            | Finding::SwappedColumns { .. }
            | Finding::GravityDiffers { .. } => Check::GravityDisagrees,
            Finding::DeclaredNoise { .. } | Finding::CoarseTolerance { .. } => Check::DeclaredNoise,
        }
    }

    /// Whether the finding refuses the data set or only adds a warning.
    ///
    /// It is a warning where the data remain usable: a copy can be left out, a tolerance may be intended, and
    /// some experiments feed one signal to two inputs. With all other findings the results would be
    /// meaningless.
    pub fn severity(&self) -> Severity {
        match self {
            Finding::RepeatedTrajectory { .. }
            | Finding::CoarseTolerance { .. }
            | Finding::DuplicateInput { .. }
            | Finding::InputEqualsOutput { .. }
            | Finding::DuplicateColumn { .. } => Severity::Warning,
            _ => Severity::Refused,
        }
    }
}
