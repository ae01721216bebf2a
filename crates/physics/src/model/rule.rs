//! Parts of error messages about model files: the location, and the rule that a value breaks.

use crate::push::OBJECTS;
use std::fmt;

/// A place in a model file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The top-level keys, before any table.
    File,
    /// The table with this name.
    Table(&'static str),
    /// The table of the parameter with this name.
    Parameter(String),
    /// An `[[effect]]` block whose kind is unknown.
    Effect,
    /// An `[[effect]]` block of this kind.
    EffectOfKind(&'static str),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => f.write_str("the model file"),
            Place::Table(name) => write!(f, "[{name}]"),
            Place::Parameter(name) => write!(f, "`{name}`"),
            Place::Effect => f.write_str("[[effect]]"),
            Place::EffectOfKind(kind) => write!(f, "[[effect]] `{kind}`"),
        }
    }
}

/// A rule for the value of a key, displayed as the continuation of "must be".
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Any rule, as text.
    Is(&'static str),
    /// One of these strings.
    OneOf(Vec<&'static str>),
    /// The name of a known object.
    Object,
}

impl From<&'static str> for Rule {
    fn from(words: &'static str) -> Self {
        Rule::Is(words)
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Rule::Is(words) => f.write_str(words),
            Rule::OneOf(words) => write!(f, "one of \"{}\"", words.join("\", \"")),
            Rule::Object => {
                let names = OBJECTS.join("\", \"");
                write!(f, "one of \"{names}\"; give any other outline as polygon_m = [[x, y], …] in metres")
            }
        }
    }
}
