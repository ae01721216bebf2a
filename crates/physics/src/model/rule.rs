//! Values that messages about a model file carry: the place that is meant, and the rule that a value breaks.

use crate::push::OBJECTS;
use std::fmt;

/// A place in a model file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The keys that stand before any table.
    File,
    /// The table of this name.
    Table(&'static str),
    /// The table of the parameter of this name.
    Parameter(String),
    /// An `[[effect]]` block whose kind is not known yet.
    Effect,
    /// An `[[effect]]` block of this kind.
    EffectOf(&'static str),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => f.write_str("the model file"),
            Place::Table(name) => write!(f, "[{name}]"),
            Place::Parameter(name) => write!(f, "`{name}`"),
            Place::Effect => f.write_str("[[effect]]"),
            Place::EffectOf(kind) => write!(f, "[[effect]] `{kind}`"),
        }
    }
}

/// A rule that values of a key follow, written so that "must be" can stand before it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Rule {
    /// A rule in words.
    Is(&'static str),
    /// The value is one of these words.
    OneOf(Vec<&'static str>),
    /// The value is the name of an object of the laboratory.
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
