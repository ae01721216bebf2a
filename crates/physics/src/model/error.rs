//! Errors in model files, each with file, line and remedy.

use super::{Place, Rule};
use augsim_data::{escaped_cause, escaped_short, unreadable_text};
use std::fmt;
use thiserror::Error;

/// Reason why a model file cannot be used; every message names file, line and remedy.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The model file cannot be read.
    #[error("{file}: {}", unreadable_text(cause))]
    Read {
        /// Path of the file that cannot be read.
        file: String,
        /// Error of the operating system.
        cause: std::io::Error,
    },
    /// The model file has no keys.
    #[error(
        "{file}: the model file is empty; it begins with `scenario = \"ball\"` or `scenario = \"push\"`, followed by a \
         [parameters] table"
    )]
    Empty {
        /// Path of the empty file.
        file: String,
    },
    /// The model file is not valid TOML.
    #[error(
        "{file}:{line}: not valid TOML: {}; a model file looks like `scenario = \"ball\"` followed by a [parameters] table",
        escaped_cause(&cause.message())
    )]
    Syntax {
        /// Path of the file that is not valid TOML.
        file: String,
        /// Line of the syntax error, from 1.
        line: usize,
        /// Error message of the TOML parser.
        cause: Box<toml::de::Error>,
    },
    /// The model file has an unknown key.
    #[error("{file}:{line}: unknown key `{}` in {place}; {known}", escaped_short(key))]
    UnknownKey {
        /// Path of the file with the unknown key.
        file: String,
        /// Line of the unknown key, from 1.
        line: usize,
        /// The unknown key.
        key: String,
        /// Table or block that contains the unknown key.
        place: Place,
        /// Keys that are allowed in that table or block.
        known: Box<KnownKeys>,
    },
    /// The model file names an effect that is not in the library.
    #[error("{file}:{line}: unknown effect kind `{}`; did you mean `{}`?", escaped_short(kind), nearest.join("` or `"))]
    UnknownKind {
        /// Path of the file with the unknown effect.
        file: String,
        /// Line of the unknown effect, from 1.
        line: usize,
        /// Kind of effect that is not in the library.
        kind: String,
        /// Kinds of the library with a similar name.
        nearest: Vec<&'static str>,
    },
    /// A required key is missing in the model file.
    #[error("{file}:{line}: {place} lacks `{key}`; add `{example}`")]
    Missing {
        /// Path of the file without the key.
        file: String,
        /// Line of the table without the key, from 1.
        line: usize,
        /// Table or block where the key is missing.
        place: Place,
        /// Name of the missing key.
        key: &'static str,
        /// Example of a line that adds the missing key.
        example: &'static str,
    },
    /// A value of the model file has the wrong type or breaks a rule.
    #[error("{file}:{line}: `{}` must be {rule}", escaped_short(key))]
    WrongType {
        /// Path of the file with the wrong value.
        file: String,
        /// Line of the wrong value, from 1.
        line: usize,
        /// Key of the wrong value.
        key: String,
        /// Rule that the value breaks.
        rule: Rule,
    },
    /// A parameter value is outside its bounds.
    #[error(
        "{file}:{line}: `{key}` = {value} is outside [{min}, {max}]; change the value or widen min and max"
    )]
    OutOfBounds {
        /// Path of the file with the value.
        file: String,
        /// Line of the value, from 1.
        line: usize,
        /// Key of the value.
        key: String,
        /// Value outside its bounds.
        value: f64,
        /// Lower bound of the value.
        min: f64,
        /// Upper bound of the value.
        max: f64,
    },
    /// Two effects of a model exclude each other.
    #[error("{file}:{line}: `{kind}` and `{other}` describe the same thing; keep one of them")]
    Conflict {
        /// Path of the file with both effects.
        file: String,
        /// Line of the later effect, from 1.
        line: usize,
        /// Kind of the later effect.
        kind: &'static str,
        /// Kind of the earlier effect.
        other: String,
    },
}

/// Keys that are allowed at one location of a model file, for suggestions.
#[derive(Debug, PartialEq)]
pub struct KnownKeys {
    /// Allowed key whose spelling is most similar to the unknown one.
    pub nearest: &'static str,
    /// All keys that are allowed there.
    pub all: Vec<&'static str>,
}

impl fmt::Display for KnownKeys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "did you mean `{}`? Allowed keys: {}", self.nearest, self.all.join(", "))
    }
}
