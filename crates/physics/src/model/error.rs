//! Errors in model files, each with file, line and remedy.

use super::{Place, Rule};
use augsim_data::{escaped_cause, escaped_short, unreadable_text};
use std::fmt;
use thiserror::Error;

/// Why a model file cannot be used; every message names file, line and remedy.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The file cannot be read.
    #[error("{file}: {}", unreadable_text(cause))]
    Read {
        /// The file.
        file: String,
        /// The reason.
        cause: std::io::Error,
    },
    /// The file has no keys.
    #[error(
        "{file}: the model file is empty; it begins with `scenario = \"ball\"` or `scenario = \"push\"`, followed by a \
         [parameters] table"
    )]
    Empty {
        /// The file.
        file: String,
    },
    /// The file is not valid TOML.
    #[error(
        "{file}:{line}: not valid TOML: {}; a model file looks like `scenario = \"ball\"` followed by a [parameters] table",
        escaped_cause(&cause.message())
    )]
    Syntax {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Error of the TOML parser.
        cause: Box<toml::de::Error>,
    },
    /// A key is unknown.
    #[error("{file}:{line}: unknown key `{}` in {place}; {known}", escaped_short(key))]
    UnknownKey {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// Its location.
        place: Place,
        /// The keys that are allowed there.
        known: Box<KnownKeys>,
    },
    /// An effect is not in the library.
    #[error("{file}:{line}: unknown effect kind `{}`; did you mean `{}`?", escaped_short(kind), nearest.join("` or `"))]
    UnknownKind {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The kind.
        kind: String,
        /// Similar kinds of the library.
        nearest: Vec<&'static str>,
    },
    /// A required key is missing.
    #[error("{file}:{line}: {place} lacks `{key}`; add `{example}`")]
    Missing {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Location of the missing key.
        place: Place,
        /// The key.
        key: &'static str,
        /// A line that fixes it.
        example: &'static str,
    },
    /// A value has the wrong type or breaks a rule.
    #[error("{file}:{line}: `{}` must be {rule}", escaped_short(key))]
    WrongType {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// The rule that it breaks.
        rule: Rule,
    },
    /// A value is outside its bounds.
    #[error(
        "{file}:{line}: `{key}` = {value} is outside [{min}, {max}]; change the value or widen min and max"
    )]
    OutOfBounds {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// The value.
        value: f64,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// Two effects exclude each other.
    #[error("{file}:{line}: `{kind}` and `{other}` describe the same thing; keep one of them")]
    Conflict {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The later kind.
        kind: &'static str,
        /// The earlier kind.
        other: String,
    },
}

/// The allowed keys at one location of a model file, for suggestions.
#[derive(Debug, PartialEq)]
pub struct KnownKeys {
    /// The allowed key with the most similar spelling.
    pub nearest: &'static str,
    /// All allowed keys.
    pub all: Vec<&'static str>,
}

impl fmt::Display for KnownKeys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "did you mean `{}`? Allowed keys: {}", self.nearest, self.all.join(", "))
    }
}
