//! Errors of requests for the next experiment.

use std::fmt;

/// Why the next experiment cannot be designed or judged for a model, a folder or a file of limits.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum NextFault {
    /// The model is a ball or a push.
    BuiltIn,
    /// No parameter of the model has an interval, a covariance or finite bounds.
    NotFitted,
    /// An output of the model has no noise.
    NoNoise { output: String },
    /// The model has no inputs and no start value that can be set.
    NothingToVary,
    /// Two explanations have the same name.
    SameName { name: String },
    /// Explanations have other inputs or outputs than the first one.
    OtherColumns { first: String, columns: Vec<String> },
    /// The folder has no plan.
    NoPlan,
    /// The file of limits is not valid TOML, or has an unknown key.
    Limits { cause: String },
    /// The file of limits names a quantity that the models do not have.
    UnknownName { section: &'static str, name: String, known: Vec<String> },
    /// A range is empty.
    EmptyRange { section: &'static str, name: String },
    /// Limits of an input, the duration or the time between samples are not given, and there are no data.
    NoLimit { what: String, key: String },
    /// A number of the file of limits must be positive.
    NotPositive { key: String },
}

impl fmt::Display for NextFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NextFault::BuiltIn => f.write_str(
                "experiments are designed for models of equations (scenario = \"system\") only; for a ball or pushes, `augsim discover` names \
                 the next experiment in words",
            ),
            NextFault::NotFitted => f.write_str(
                "no parameter has a 95 % interval (ci95), a covariance or finite bounds, so it is not known how well the model is known; calibrate it \
                 first: `augsim fit MODEL DATA --out FOLDER`",
            ),
            NextFault::NoNoise { output } => write!(
                f,
                "the output `{output}` has no measurement noise; calibrate the model first (`augsim fit`), or declare `sd` of the output"
            ),
            NextFault::NothingToVary => f.write_str(
                "the model has no input, and no start value may be set; give ranges of start values in the table [starts] of the limits",
            ),
            NextFault::SameName { name } => write!(f, "there are two explanations `{name}`; rename one of the model files"),
            NextFault::OtherColumns { first, columns } => write!(
                f,
                "the inputs and outputs differ from those of {first}, which are {}; explanations of the same experiment have the same columns",
                columns.join(", ")
            ),
            NextFault::NoPlan => f.write_str("there is no plan.json in the folder; `augsim next` writes one"),
            NextFault::Limits { cause } => write!(f, "{cause}"),
            NextFault::UnknownName { section, name, known } => {
                write!(f, "[{section}] names `{name}`, which no model has; known are {}", known.join(", "))
            }
            NextFault::EmptyRange { section, name } => {
                write!(f, "[{section}] {name}: a range is two numbers, the smaller one first")
            }
            NextFault::NoLimit { what, key } => write!(
                f,
                "{what} is not known; give `{key}` in the file of --limits, or the recordings so far with --data"
            ),
            NextFault::NotPositive { key } => write!(f, "`{key}` must be a positive number"),
        }
    }
}
