//! Mistakes in a model file, each with file, line and remedy.

use super::{Place, Rule};
use augsim_data::{shown, shown_cause};
use std::fmt;
use thiserror::Error;

/// A model file that cannot be used. Every message names the file, the line and the remedy.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {cause}; check the path")]
    Read {
        /// The file.
        file: String,
        /// The reason.
        cause: std::io::Error,
    },
    /// No key at all.
    #[error(
        "{file}: the model file is empty; it begins with `scenario = \"ball\"` or `scenario = \"push\"`, followed by a \
         [parameters] table"
    )]
    Empty {
        /// The file.
        file: String,
    },
    /// Not TOML.
    #[error(
        "{file}:{line}: not valid TOML: {}; a model file looks like `scenario = \"ball\"` followed by a [parameters] table",
        shown_cause(&cause.message())
    )]
    Syntax {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Error of the TOML reader.
        cause: Box<toml::de::Error>,
    },
    /// A key that nothing reads.
    #[error("{file}:{line}: unknown key `{}` in {place}; {known}", shown(key))]
    UnknownKey {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// Where it stands.
        place: Place,
        /// The keys that are known there.
        known: Box<KnownKeys>,
    },
    /// An effect that the library does not have.
    #[error("{file}:{line}: unknown effect kind `{}`; did you mean `{}`?", shown(kind), nearest.join("` or `"))]
    UnknownKind {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The kind.
        kind: String,
        /// The known kinds that it may have meant.
        nearest: Vec<&'static str>,
    },
    /// Something that must be there is not.
    #[error("{file}:{line}: {place} lacks `{key}`; add `{example}`")]
    Missing {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Where it is missing.
        place: Place,
        /// The key.
        key: &'static str,
        /// A line that would do.
        example: &'static str,
    },
    /// A value of the wrong kind.
    #[error("{file}:{line}: `{}` must be {rule}", shown(key))]
    WrongType {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// Rule that the value breaks.
        rule: Rule,
    },
    /// A value outside its bounds.
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
    /// Two blocks that cannot stand together.
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

/// The keys that are known in one place of a model file.
#[derive(Debug, PartialEq)]
pub struct KnownKeys {
    /// The one that is spelt most like the key that was found.
    pub nearest: &'static str,
    /// All of them.
    pub all: Vec<&'static str>,
}

impl fmt::Display for KnownKeys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "did you mean `{}`? Known here: {}", self.nearest, self.all.join(", "))
    }
}
