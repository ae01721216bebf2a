//! Findings of checks, as values with a sentence.

use super::check::Check;
use super::clock_unit::ClockUnit;
use crate::statistics::digits;
use serde::Serialize;
use thiserror::Error;

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Nothing is computed from such data.
    Refused,
    /// The result says it.
    Warning,
}

/// One thing that is wrong with a set. The sentence names trajectory, time and column, and the remedy; the file stands
/// before it where it is shown.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Finding {
    /// A value that no measurement can have.
    #[error(
        "trajectory `{trajectory}`, t_s = {time_s} s: column `{column}` holds {}, which nothing that is measured in {unit} \
         can be; write SI units, and leave cells empty that were not measured", digits(*value)
    )]
    AbsurdValue {
        /// Trajectory.
        trajectory: String,
        /// Time, s.
        time_s: f64,
        /// Column.
        column: String,
        /// Unit of the column.
        unit: String,
        /// Value.
        value: f64,
    },
    /// A value that stands for "not measured".
    #[error(
        "trajectory `{trajectory}`, t_s = {time_s} s: column `{column}` holds {}, and so in {count} sample(s) of the set, \
         an outlier far from all other values ({} to {}); leave cells empty where nothing was measured",
        digits(*value), digits(others[0]), digits(others[1])
    )]
    SentinelValue {
        /// First trajectory that has it.
        trajectory: String,
        /// Its time, s.
        time_s: f64,
        /// Column.
        column: String,
        /// Value.
        value: f64,
        /// Samples that hold it.
        count: usize,
        /// Smallest and largest of all others.
        others: [f64; 2],
    },
    /// A column of motion without motion.
    #[error(
        "the column `{column}` never changes: it holds {} in all {samples} samples, so it was not measured; export it \
         again, or remove it", digits(*value)
    )]
    ConstantColumn {
        /// Column.
        column: String,
        /// Its value.
        value: f64,
        /// Samples.
        samples: usize,
    },
    /// The same recording under two names.
    #[error(
        "trajectory `{trajectory}` repeats `{original}` sample by sample, so what fits have seen would be held out to judge \
         them{}; it is left out: remove it from the file, or give what was really measured twice with all its digits",
        if *copies > 1 { format!(" ({copies} such copies)") } else { String::new() }
    )]
    RepeatedTrajectory {
        /// First copy.
        trajectory: String,
        /// Trajectory that it repeats.
        original: String,
        /// Copies in the set.
        copies: usize,
    },
    /// A few trajectories in another unit.
    #[error(
        "trajectory `{trajectory}`: column `{column}` spans {} {unit} where the other {others} trajectories stay within {} \
         {unit}, a factor of about {}{}; convert it to the unit of the column's name, or remove it",
        digits(*span), digits(*others_span), digits(*factor), and_more(*alike)
    )]
    MixedUnits {
        /// First such trajectory.
        trajectory: String,
        /// Column.
        column: String,
        /// Unit of the column.
        unit: String,
        /// Span of its values.
        span: f64,
        /// Span of all values of the others.
        others_span: f64,
        /// Ratio of the typical spans.
        factor: f64,
        /// Trajectories that are not like this.
        others: usize,
        /// Trajectories that are.
        alike: usize,
    },
    /// A few trajectories with the clock in another unit.
    #[error(
        "trajectory `{trajectory}`: its time step is {} s, that of the other {others} trajectories {} s, a ratio of about {}, \
         while the columns change alike from sample to sample{}; {}",
        digits(*step_s), digits(*others_step_s), digits(step_s / others_step_s), and_more(*alike),
        clock_remedy(*unit, step_s > others_step_s)
    )]
    MixedClock {
        /// First such trajectory.
        trajectory: String,
        /// Its median time step, s.
        step_s: f64,
        /// Median time step of the others, s.
        others_step_s: f64,
        /// Unit other than seconds that explains the ratio.
        unit: ClockUnit,
        /// Trajectories that are not like this.
        others: usize,
        /// Trajectories that are.
        alike: usize,
    },
    /// One coordinate in another unit.
    #[error(
        "column `{column}` moves {} times as far as `{reference}` and is {} times as noisy, as if it were in another unit; \
         convert it to metres", digits(*span), digits(*noise)
    )]
    ColumnScale {
        /// Column.
        column: String,
        /// Column that it is compared with.
        reference: String,
        /// Ratio of the spans.
        span: f64,
        /// Ratio of the noise.
        noise: f64,
    },
    /// An object that moves further than the rod that pushes it.
    #[error(
        "trajectory `{trajectory}`: the object moves {} m along `{column}` while the rod moves {} m, and so in {share} % of \
         the pushes; one of them is in another unit: convert it to metres", digits(*object_m), digits(*rod_m)
    )]
    ObjectOutrunsRod {
        /// First such push.
        trajectory: String,
        /// Column of the object.
        column: String,
        /// Motion of the object, m.
        object_m: f64,
        /// Path of the rod, m.
        rod_m: f64,
        /// Share of the pushes, per cent.
        share: usize,
    },
    /// Two outputs of the model that are one signal.
    #[error(
        "columns `{}` and `{}`, both outputs of the model, hold the same numbers in all {samples} samples: one signal was written \
         twice; export the wrong one again, or take it out of the model", columns[0], columns[1]
    )]
    DuplicateOutput {
        /// Columns.
        columns: [String; 2],
        /// Samples with values of both.
        samples: usize,
    },
    /// Two inputs of the model that are one signal.
    #[error(
        "columns `{}` and `{}`, both inputs of the model, hold the same numbers in all {samples} samples, so their effects cannot \
         be distinguished; export the wrong one again, or take one out of the model", columns[0], columns[1]
    )]
    DuplicateInput {
        /// Columns.
        columns: [String; 2],
        /// Samples with values of both.
        samples: usize,
    },
    /// An input and an output of the model that are one signal.
    #[error(
        "column `{input}`, an input of the model, holds the same numbers as its output `{output}` in all {samples} samples, as if \
         one signal was written twice; export the wrong one again, or take it out of the model"
    )]
    InputEqualsOutput {
        /// Column of the input.
        input: String,
        /// Column of the output.
        output: String,
        /// Samples with values of both.
        samples: usize,
    },
    /// Two columns that are one signal, where no model says what they are.
    #[error(
        "columns `{}` and `{}` hold the same numbers in all {samples} samples, as if one signal was written twice; export the \
         wrong one again, or remove it", columns[0], columns[1]
    )]
    DuplicateColumn {
        /// Columns.
        columns: [String; 2],
        /// Samples with values of both.
        samples: usize,
    },
    /// A column moved by a row, over the ends of trajectories.
    #[error(
        "trajectory `{trajectory}`, t_s = {time_s} s: column `{column}` holds a value that goes on from the trajectory \
         beside it in the file, and so in {share} % of the trajectories: the column is shifted by a row against the \
         others; align it"
    )]
    ShiftedColumn {
        /// First such trajectory.
        trajectory: String,
        /// Time of the sample, s.
        time_s: f64,
        /// Column.
        column: String,
        /// Share of the trajectories, per cent.
        share: usize,
    },
    /// A height and its velocity that are rows apart.
    #[error(
        "columns `{height}` and `{velocity}` are shifted by {rows} row(s) or more against each other: the height's change agrees \
         with the velocity of that row and not with its own; align them"
    )]
    ShiftedVelocity {
        /// Height.
        height: String,
        /// Velocity.
        velocity: String,
        /// Rows between them, at the least.
        rows: u64,
    },
    /// A velocity that is not the change of the height.
    #[error(
        "column `{velocity}` is not the change of `{height}`: over {} s the height changes by {} m where the velocity \
         makes it {} m (means over the set); check that the two are not swapped and have the same sign and unit",
        digits(*time_s), digits(*height_m), digits(*velocity_m)
    )]
    VelocityDisagrees {
        /// Height.
        height: String,
        /// Velocity.
        velocity: String,
        /// Time over which they are compared, s.
        time_s: f64,
        /// Mean change of the height, m, without sign.
        height_m: f64,
        /// Mean change of the velocity's integral, m, without sign.
        velocity_m: f64,
    },
    /// Degrees in a column of radians.
    #[error(
        "trajectory `{trajectory}`: column `{column}` changes by {} rad while the rod moves {} m, more than a push can turn \
         an object, and reaches {} rad: these are degrees; convert them to radians",
        digits(*change_rad), digits(*rod_m), digits(*largest_rad)
    )]
    AngleInDegrees {
        /// Push that turns most.
        trajectory: String,
        /// Column.
        column: String,
        /// Its change, as written, rad.
        change_rad: f64,
        /// Path of the rod, m.
        rod_m: f64,
        /// Largest angle of the set, as written, rad.
        largest_rad: f64,
    },
    /// Free fall of the whole set that is not the model's.
    #[error(
        "column `{column}` falls with {} m/s² where the model has {} m/s²; {}", digits(*found_m_s2), digits(*expected_m_s2),
        gravity_remedy(found_m_s2 / expected_m_s2)
    )]
    GravityDisagrees {
        /// Column of the height.
        column: String,
        /// Median over the trajectories, m/s², downward positive.
        found_m_s2: f64,
        /// Acceleration that the model has, m/s², downward positive.
        expected_m_s2: f64,
    },
    /// Free fall in another column than that of the height.
    #[error(
        "column `{column}` shows no free fall while `{falling}` falls with {} m/s²; the two are swapped: exchange their names",
        digits(*found_m_s2)
    )]
    SwappedColumns {
        /// Column of the height.
        column: String,
        /// Column that falls.
        falling: String,
        /// Its acceleration, m/s², downward positive.
        found_m_s2: f64,
    },
    /// Free fall of one trajectory that is not that of the rest.
    #[error(
        "trajectory `{trajectory}`: column `{column}` falls with {} m/s² where the others fall with {} m/s²{}; {}",
        digits(*found_m_s2), digits(*others_m_s2), and_more(*alike), gravity_remedy(found_m_s2 / others_m_s2)
    )]
    GravityDiffers {
        /// First such trajectory.
        trajectory: String,
        /// Column of the height.
        column: String,
        /// Its acceleration, m/s², downward positive.
        found_m_s2: f64,
        /// Median over all, m/s².
        others_m_s2: f64,
        /// Trajectories like it.
        alike: usize,
    },
    /// A declared noise as large as the motion.
    #[error(
        "the model declares `{key}` = {} {unit} where `{column}` scatters by {} {unit} and moves by no more than {} {unit}: \
         nothing could be seen beneath it; declare it in {unit}", digits(*declared), digits(*found), digits(*span)
    )]
    DeclaredNoise {
        /// Key of the model file.
        key: &'static str,
        /// Column.
        column: String,
        /// Unit.
        unit: &'static str,
        /// Declared.
        declared: f64,
        /// Seen in the data.
        found: f64,
        /// Typical span of the column within a trajectory.
        span: f64,
    },
    /// A declared noise far above what the data show.
    #[error(
        "the model declares `{key}` = {} {unit} where `{column}` scatters by {} {unit}: it counts as the agreement that is \
         asked for, and smaller effects are not looked for; leave it out to judge by the data's own noise",
        digits(*declared), digits(*found)
    )]
    CoarseTolerance {
        /// Key of the model file.
        key: &'static str,
        /// Column.
        column: String,
        /// Unit.
        unit: &'static str,
        /// Declared.
        declared: f64,
        /// Seen in the data.
        found: f64,
    },
}

fn and_more(alike: usize) -> String {
    match alike {
        0 | 1 => String::new(),
        n => format!(" ({n} trajectories are like it)"),
    }
}

/// The remedy for a clock in `unit`, or in `unit` in the others: in units below the second numbers are too large.
fn clock_remedy(unit: ClockUnit, is_slower: bool) -> String {
    match is_slower == unit.is_finer_than_seconds() {
        true => format!("its clock is in {unit}: convert its `t_s` to seconds"),
        false => format!("the clocks of the others are in {unit}: convert their `t_s` to seconds"),
    }
}

/// The likely cause of an acceleration that is `ratio` times the expected one.
fn gravity_remedy(ratio: f64) -> String {
    let unit = [("inches", 39.37), ("cm", 100.0), ("mm", 1000.0)]
        .into_iter()
        .find(|(_, factor)| (ratio.abs() / factor).ln().abs() < 0.4_f64);
    let up = if ratio < 0.0 { "up must be positive: change the sign" } else { "" };
    match (unit, up) {
        (Some((unit, _)), "") => format!("these are {unit}: convert them to metres"),
        (Some((unit, _)), up) => format!("these are {unit}: convert them to metres; {up}"),
        (None, "") => "check the unit of the heights and of `t_s`".to_owned(),
        (None, up) => up.to_owned(),
    }
}

impl Finding {
    /// The check that found it.
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
            Finding::AngleInDegrees { .. } => Check::AngleInDegrees,
            Finding::GravityDisagrees { .. }
            | Finding::SwappedColumns { .. }
            | Finding::GravityDiffers { .. } => Check::GravityDisagrees,
            Finding::DeclaredNoise { .. } | Finding::CoarseTolerance { .. } => Check::DeclaredNoise,
        }
    }

    /// Whether data with it are refused. A copy can be left out, a tolerance may be meant, and some rigs feed one signal to two
    /// inputs; everything else makes numbers that mean nothing.
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
