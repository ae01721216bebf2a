//! `SWEEP.toml`: a command, options that all tasks share, lists to cross, and the scores to look at.

use super::fault::{OptionFault, SweepFault};
use augsim_data::read_text;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A sweep as it was written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepFile {
    /// Command and what stands beside it, such as `reproduce push`.
    pub command: String,
    /// Options that every task has.
    #[serde(default)]
    pub options: BTreeMap<String, toml::Value>,
    /// Lists; every combination of their values is a task.
    #[serde(default)]
    pub cross: BTreeMap<String, toml::Value>,
    /// JSONPath (RFC 9535) into a task's result by the name of the column that it fills.
    #[serde(default)]
    pub scores: BTreeMap<String, String>,
}

/// A value of an option.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// Given or not.
    Flag(bool),
    /// A whole number.
    Integer(i64),
    /// Another number, always finite.
    Number(f64),
    /// A word.
    Text(String),
    /// An option that is given several times.
    Several(Vec<Value>),
}

impl Value {
    /// The words that stand for it on a command line.
    pub fn words(&self) -> Vec<String> {
        match self {
            Value::Several(all) => all.iter().flat_map(Value::words).collect(),
            one => vec![one.to_string()],
        }
    }

    /// The number that it is.
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
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, is no TOML, or has other keys than these.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let file = || path.to_owned();
        let text = read_text(path).map_err(|cause| SweepFault::Unreadable { file: file(), cause })?;
        toml::from_str(&text).map_err(|cause: toml::de::Error| {
            let line = cause.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
            SweepFault::Grammar { file: file(), line, cause: Box::new(cause) }.into()
        })
    }
}

/// Name of an option as the command line has it: `train_size` stands for `train-size`.
pub fn dashed(name: &str) -> String {
    name.replace('_', "-")
}

/// A value of TOML.
///
/// # Errors
/// It is a date, a table, an empty list or not finite.
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
