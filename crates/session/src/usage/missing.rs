//! Settings, data and files that a request needs but does not give.

use std::fmt;

/// What a request needs but does not give.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Missing {
    /// The request lacks the folder of the measured data sets of a reproduction.
    MeasuredSets { scenario: &'static str },
    /// The request lacks a physics model of the system in the data.
    Model { data: String },
    /// The run to be saved has no configuration.
    Configuration,
    /// The table in memory that the run was trained on cannot be read again.
    Table { name: String },
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Missing::MeasuredSets { scenario } => {
                write!(
                    f,
                    "reproduce {scenario} needs measured data; give the folder of the data sets with --data"
                )
            }
            Missing::Model { data } => write!(
                f,
                "{data}: no physics model is given; give a model file (--model FILE), the folder of a discovery (--residual-of RUN), or \
                 --pybullet-ball for the bouncing ball of the paper"
            ),
            Missing::Configuration => {
                f.write_str("the run has no configuration, so it cannot be saved; copy its folder instead")
            }
            Missing::Table { name } => {
                write!(
                    f,
                    "this run was trained on a table in memory, {name}, which cannot be read again; give the data as a file"
                )
            }
        }
    }
}
