//! Parts of error messages about model files: the location, and the rule that a value breaks.

use crate::push::OBJECTS;
use std::fmt;

/// Place in a model file, for error messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// Top-level keys of the file, before any table.
    File,
    /// Table of the file with this name.
    Table(&'static str),
    /// Table of the parameter with this name.
    Parameter(String),
    /// Block `[[effect]]` with an unknown kind.
    Effect,
    /// Block `[[effect]]` of this kind.
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

/// Rule for the value of a key, displayed as the continuation of "must be".
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Rule that this text states.
    Is(&'static str),
    /// Rule that the value is one of these strings.
    OneOf(Vec<&'static str>),
    /// Rule that the value is the name of a built-in object.
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
