//! Mistakes in a model file, each with its place and its remedy.

use crate::limits::{FILE_BYTES, OPERATIONS};
use crate::text::Problem;
use augsim_data::{printable, shown_cause};
use std::fmt;
use std::sync::Arc;
use thiserror::Error;

/// Where in a model file something is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file, or another name for where the text came from.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Table and key, such as `rates.omega_rad_s`; empty for the file as a whole.
    pub key: String,
}

/// A part of an expression to be marked in its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// The expression.
    pub text: String,
    /// First marked byte.
    pub start: usize,
    /// Byte behind the last marked one.
    pub end: usize,
}

/// A model file that cannot be used.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelError {
    /// Place in the file.
    pub place: Place,
    /// The mistake.
    pub fault: Box<Fault>,
    /// The text that it lies in.
    pub excerpt: Option<Box<Excerpt>>,
}

impl std::error::Error for ModelError {}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: ", self.place.file, self.place.line)?;
        if !self.place.key.is_empty() {
            write!(f, "{}: ", self.place.key)?;
        }
        write!(f, "{}", self.fault)?;
        self.excerpt.as_ref().map_or(Ok(()), |excerpt| write!(f, "{excerpt}"))
    }
}

/// Characters of an expression that are shown before and behind the marked ones.
const SHOWN: usize = 60;

impl fmt::Display for Excerpt {
    /// The text and a line of `^` below the marked part; a long text is cut around it, and what could disturb a
    /// terminal becomes `?`, so that columns stay true.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let before = self.text.get(..self.start).unwrap_or("").chars().count();
        let marked = self.text.get(self.start..self.end).unwrap_or("").chars().count().max(1);
        let first = before.saturating_sub(SHOWN);
        let shown = self.text.chars().skip(first).take(before - first + marked.min(SHOWN) + SHOWN);
        let plain = |c: char| {
            if c.is_whitespace() {
                ' '
            } else if printable(&c.to_string()).chars().eq([c]) {
                c
            } else {
                '?'
            }
        };
        let line: String = shown.map(plain).collect();
        write!(f, "\n    {line}\n    {}{}", " ".repeat(before - first), "^".repeat(marked.min(SHOWN)))
    }
}

/// The system's answer to a file that cannot be read. Two are equal when they are of one kind.
#[derive(Debug, Clone)]
pub struct ReadFault(pub Arc<std::io::Error>);

impl PartialEq for ReadFault {
    fn eq(&self, other: &Self) -> bool {
        self.0.kind() == other.0.kind()
    }
}

impl fmt::Display for ReadFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A mistake, with its remedy.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum Fault {
    #[error("cannot be read: {cause}; check the path")]
    Unreadable { cause: ReadFault },
    #[error("has {bytes} bytes, {FILE_BYTES} are allowed; put measured data into a CSV file")]
    FileTooLong { bytes: usize },
    #[error("not valid TOML: {}; `augsim model new pendulum` writes a file to start from", shown_cause(&cause.message()))]
    Syntax { cause: toml::de::Error },
    #[error("not TOML that can be edited: {}; write the model anew", shown_cause(&cause.message()))]
    NotEditable { cause: toml_edit::TomlError },
    #[error(transparent)]
    Expression(#[from] Problem),
    #[error("unknown key `{key}`{}; known here: {}", suggest(.nearest), known.join(", "))]
    UnknownKey { key: String, nearest: Option<String>, known: Vec<String> },
    #[error("lacks `{key}`; add {example}")]
    Missing { key: &'static str, example: &'static str },
    #[error("must be {expected}")]
    WrongType { expected: &'static str },
    #[error("`{name}` is no name; use letters, digits and `_`, beginning with a letter, at most 64 of them")]
    MalformedName { name: String },
    #[error("`{name}` has a meaning of its own; choose another name")]
    ReservedName { name: String },
    #[error("`{name}` is already the name of {other}; choose another name")]
    NameTwice { name: String, other: &'static str },
    #[error("{found} {of}, at most {allowed} are possible; simplify the model")]
    TooMany { of: &'static str, found: usize, allowed: usize },
    #[error("`{state}` has no rate; add it under [rates]")]
    NoRate { state: String },
    #[error("no state is called `{state}`; declare it under [states]{}", suggest(.nearest))]
    NoSuchState { state: String, nearest: Option<String> },
    #[error("nominal {nominal:?} is outside [{min:?}, {max:?}]; change it or widen min and max")]
    OutsideBounds { nominal: f64, min: f64, max: f64 },
    #[error(
        "`{name}` is neither a rate, an input, an output nor a parameter of the model, nor one of force, flow, flow-pair, input, delay, output, output-input, output-state, parameter and reset"
    )]
    NoSuchPlace { name: String },
    #[error("no effect is called `{kind}`{}; `augsim effects --for MODEL.toml` lists them, and \"formula\" takes one of your own", suggest(.nearest))]
    NoSuchEffect { kind: String, nearest: Option<String> },
    #[error("lacks `{name}`, a parameter of {kind}; add {name} = {{ nominal = 1.0 }}")]
    MissingParameter { name: String, kind: String },
    #[error("`{kind}` cannot be on `{on}`; it can be on {}", places(possible))]
    NotThere { kind: String, on: String, possible: Vec<String> },
    #[error("min {min:?} is not below max {max:?}; exchange them")]
    EmptyBounds { min: f64, max: f64 },
    #[error("used nowhere; remove it or set frozen = true")]
    Unused,
    #[error("never changes with the state: nothing can be fitted from it; use a state in its value")]
    NeverChanges,
    #[error(
        "sets `{state}` but `when` still holds there: it would fire for ever; set a state that moves `when` away from 0"
    )]
    FiresForEver { state: String },
    #[error(
        "\"{text}\" is no unit that is known; write it like \"m/s^2\", \"N s/m\", \"rad/(V s^2)\" or \"V^0.5/s\", and \"1\" for a pure number"
    )]
    UnknownUnit { text: String },
    #[error("must be positive, {found:?} given")]
    NotPositive { found: f64 },
    #[error("must be 0 or more, {found:?} given")]
    Negative { found: f64 },
    #[error("knots must rise: {right:?} follows {left:?}; sort `at`")]
    KnotsDoNotRise { left: f64, right: f64 },
    #[error("has {at} knots and {values} values; give as many of one as of the other, at least two")]
    KnotsUnequal { at: usize, values: usize },
    #[error("`{text}` stands in no sign, step or if of the model; write the argument as it stands there")]
    UnusedWidth { text: String },
    #[error(
        "equations with constraints (differential-algebraic systems) are not supported; solve the constraint and write its result in [let]"
    )]
    Constraint,
    #[error(
        "the compiled system with its derivatives needs more than {OPERATIONS} operations; simplify the model"
    )]
    TooLarge,
}

/// The places, or that there are none.
fn places(possible: &[String]) -> String {
    let quoted: Vec<String> = possible.iter().map(|place| format!("`{place}`")).collect();
    if quoted.is_empty() { "nothing in this model".to_owned() } else { quoted.join(", ") }
}

fn suggest(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |n| format!("; did you mean `{n}`?"))
}
