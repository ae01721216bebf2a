//! Settings with invalid values.

use std::fmt;

/// A setting with an invalid value, as the user gave it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Setting {
    /// An option of the command line and its value: `--samples 0`.
    Option { name: &'static str, value: String },
    /// A keyword argument of a call and its value: `iterations = 0`.
    Keyword { name: &'static str, value: String },
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Setting::Option { name, value } => write!(f, "{name} {value}"),
            Setting::Keyword { name, value } => write!(f, "{name} = {value}"),
        }
    }
}

/// Valid values of a setting, as the message states them.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Takes {
    /// The setting takes a positive number.
    Positive,
    /// The setting takes a positive number of seconds.
    PositiveSeconds,
    /// The setting takes a whole number of at least 1.
    AtLeastOne,
    /// The setting takes a whole number from 1 to a limit.
    AtMost { most: usize },
    /// The setting takes a number of training pushes, at most the number that exist.
    TrainingPushes { there: usize },
    /// The setting takes a finite number, which the given word is not.
    Finite { word: String },
    /// The setting takes a name and a value, as in the example.
    Assignment { example: &'static str },
    /// The setting takes the length of a prefix.
    PrefixLength,
    /// The setting takes the standard deviation of a sensor.
    Deviation,
}

impl fmt::Display for Takes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Takes::Positive => f.write_str("must be a positive number"),
            Takes::PositiveSeconds => f.write_str("give a positive number of seconds"),
            Takes::AtLeastOne => f.write_str("give at least one"),
            Takes::AtMost { most } => write!(f, "give at most {most}"),
            Takes::TrainingPushes { there } => write!(f, "there are {there} training pushes"),
            Takes::Finite { word } => write!(f, "{word} is not a finite number"),
            Takes::Assignment { example } => write!(f, "write a name, = and a value, such as {example}"),
            Takes::PrefixLength => {
                f.write_str("give a number of samples, such as 65, or seconds, such as 0.5s")
            }
            Takes::Deviation => f.write_str("give a standard deviation of 0 or more, or COLUMN=NUMBER"),
        }
    }
}
