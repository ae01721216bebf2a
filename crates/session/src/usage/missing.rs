//! Settings, data and files that a request needs and does not name.

use std::fmt;

/// Something without which a request cannot be done.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Missing {
    /// The folder of the measured sets that a reproduction reads.
    MeasuredSets { scenario: &'static str },
    /// The model of the things that move in the data.
    Model { data: String },
    /// The configuration of a run that is to be saved.
    Configuration,
    /// The table in memory that a run was trained on.
    Table { name: String },
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Missing::MeasuredSets { scenario } => {
                write!(f, "reproduce {scenario} reads measured data: give the folder of the sets with --data")
            }
            Missing::Model { data } => write!(
                f,
                "{data}: nothing says what moves here; name the model file (--model FILE) or the folder of a discovery \
                 (--residual-of RUN); --pybullet-ball is the ball of the paper's experiment"
            ),
            Missing::Configuration => f.write_str("the run has no configuration; copy its folder"),
            Missing::Table { name } => {
                write!(f, "the data of this run were a table in memory, {name}; it cannot be read again")
            }
        }
    }
}
