//! Sweep file (TOML): command, fixed options, lists of values to combine, and scores.

use super::fault::{OptionFault, SweepFault};
use augsim_data::read_text;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Content of a sweep file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepFile {
    /// Command that all tasks run, with its positional words, such as `reproduce push`.
    pub command: String,
    /// Options with one value that all tasks share.
    #[serde(default)]
    pub options: BTreeMap<String, toml::Value>,
    /// Lists of values of further options. Each combination of values is one task.
    #[serde(default)]
    pub cross: BTreeMap<String, toml::Value>,
    /// JSONPath (RFC 9535) of each score in a task's result, by column name.
    #[serde(default)]
    pub scores: BTreeMap<String, String>,
}

/// A value of an option in a sweep file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A flag that is given or not.
    Flag(bool),
    /// An integer value.
    Integer(i64),
    /// A finite floating-point number.
    Number(f64),
    /// A text, such as a name or a path.
    Text(String),
    /// Several values, for an option that a command line may give several times.
    Several(Vec<Value>),
}

impl Value {
    /// Returns the option's values as command line words.
    pub fn command_line_words(&self) -> Vec<String> {
        match self {
            Value::Several(all) => all.iter().flat_map(Value::command_line_words).collect(),
            one => vec![one.to_string()],
        }
    }

    /// Returns the value as a number; `None` if it is a flag, a text or a list.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Integer(v) => Some(*v as f64),
            Value::Number(v) => Some(*v),
            _ => None,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Flag(v) => write!(f, "{v}"),
            Value::Integer(v) => write!(f, "{v}"),
            Value::Number(v) => write!(f, "{v}"),
            Value::Text(v) => f.write_str(v),
            Value::Several(all) => {
                let words: Vec<String> = all.iter().map(ToString::to_string).collect();
                f.write_str(&words.join(" "))
            }
        }
    }
}

impl SweepFile {
    /// Reads and parses a sweep file.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML or has unknown keys.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let file = || path.to_owned();
        let text = read_text(path).map_err(|cause| SweepFault::Unreadable { file: file(), cause })?;
        toml::from_str(&text).map_err(|cause: toml::de::Error| {
            let line = cause.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
            SweepFault::Grammar { file: file(), line, cause: Box::new(cause) }.into()
        })
    }
}

/// Converts an option name to its command line form: `train_size` to `train-size`.
pub fn dashed(name: &str) -> String {
    name.replace('_', "-")
}

/// Converts a TOML value to the value of an option.
///
/// # Errors
/// The value is a date, a table, an empty or nested list, or not finite.
pub fn value(from: &toml::Value) -> Result<Value, OptionFault> {
    match from {
        toml::Value::Boolean(v) => Ok(Value::Flag(*v)),
        toml::Value::Integer(v) => Ok(Value::Integer(*v)),
        toml::Value::Float(v) if v.is_finite() => Ok(Value::Number(*v)),
        toml::Value::Float(v) => Err(OptionFault::NotFinite { value: *v }),
        toml::Value::String(v) => Ok(Value::Text(v.clone())),
        toml::Value::Array(all) if all.is_empty() => Err(OptionFault::EmptyList),
        toml::Value::Array(all) if all.iter().any(toml::Value::is_array) => Err(OptionFault::Nested),
        toml::Value::Array(all) => all.iter().map(value).collect::<Result<_, _>>().map(Value::Several),
        toml::Value::Datetime(_) | toml::Value::Table(_) => Err(OptionFault::NoValueOfOption),
    }
}
