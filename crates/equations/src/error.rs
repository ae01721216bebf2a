//! Errors in a model file, each with its place and a message that says what to do.

use crate::limits::{MAX_FILE_BYTES, MAX_OPERATIONS};
use crate::text::{Problem, suggest};
use augsim_data::{escape_control_characters, escaped_cause};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use thiserror::Error;

/// Place in a model file: file, line and key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Name of the file, or another name for the source of the text.
    pub file: String,
    /// Line number in the model file, from 1; 0 for a text that is not in a file, such as an option.
    pub line: usize,
    /// Table and key of the error, such as `rates.omega_rad_s`; empty for the file as a whole.
    pub key: String,
}

/// An expression with a part of it marked, for an error message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// Text of the whole expression, of which a part is marked.
    pub text: String,
    /// Index of the first marked byte of the text.
    pub start: usize,
    /// Index of the byte after the last marked one of the text.
    pub end: usize,
}

/// An error that makes a model file unusable.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelError {
    /// Place of the error in the file.
    pub place: Place,
    /// What is wrong in the file.
    pub fault: Box<Fault>,
    /// The expression with the error, and the wrong part marked; `None` if the error is in no expression.
    pub excerpt: Option<Box<Excerpt>>,
}

impl ModelError {
    /// Creates the error of a problem in an expression, with the relevant part marked.
    pub(crate) fn in_expression(place: Place, text: &str, (problem, span): (Problem, Range<usize>)) -> Self {
        let excerpt = Excerpt { text: text.into(), start: span.start, end: span.end };
        ModelError {
            place,
            fault: Box::new(Fault::Expression(problem)),
            excerpt: (!span.is_empty()).then(|| Box::new(excerpt)),
        }
    }
}

impl std::error::Error for ModelError {}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place.line {
            0 => write!(f, "{}: ", self.place.file)?,
            line => write!(f, "{}:{line}: ", self.place.file)?,
        }
        if !self.place.key.is_empty() {
            write!(f, "{}: ", self.place.key)?;
        }
        write!(f, "{}", self.fault)?;
        self.excerpt.as_ref().map_or(Ok(()), |excerpt| write!(f, "{excerpt}"))
    }
}

/// Number of characters of a long expression that are shown before and after the marked part.
const CONTEXT_CHARS: usize = 60;

impl fmt::Display for Excerpt {
    /// Writes the text of the expression and a line of `^` below the marked part.
    ///
    /// A long text is cut around the marked part. Characters that could disturb a terminal become `?`, so
    /// that the columns stay aligned.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let before = self.text.get(..self.start).unwrap_or("").chars().count();
        let marked = self.text.get(self.start..self.end).unwrap_or("").chars().count().max(1);
        let first = before.saturating_sub(CONTEXT_CHARS);
        let shown =
            self.text.chars().skip(first).take(before - first + marked.min(CONTEXT_CHARS) + CONTEXT_CHARS);
        let plain = |c: char| {
            if c.is_whitespace() {
                ' '
            } else if escape_control_characters(&c.to_string()).chars().eq([c]) {
                c
            } else {
                '?'
            }
        };
        let line: String = shown.map(plain).collect();
        write!(f, "\n    {line}\n    {}{}", " ".repeat(before - first), "^".repeat(marked.min(CONTEXT_CHARS)))
    }
}

/// The operating system's error for a model file that cannot be read.
///
/// Two are equal if they are of the same kind.
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

/// What is wrong in a model file.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum Fault {
    #[error("the file cannot be read: {cause}; check the path")]
    Unreadable { cause: ReadFault },
    #[error(
        "the file has {bytes} bytes, but at most {MAX_FILE_BYTES} are allowed; put measured data into a CSV file"
    )]
    FileTooLong { bytes: usize },
    #[error("the file is not valid TOML: {}; `augsim model new pendulum` writes a file to start from", escaped_cause(&cause.message()))]
    Syntax { cause: toml::de::Error },
    #[error("the file cannot be edited as TOML: {}; write the model file again", escaped_cause(&cause.message()))]
    NotEditable { cause: toml_edit::TomlError },
    #[error(transparent)]
    Expression(#[from] Problem),
    #[error("unknown key `{key}`{} (allowed here: {})", suggest(.nearest), known.join(", "))]
    UnknownKey { key: String, nearest: Option<String>, known: Vec<String> },
    #[error("the key `{key}` is missing; add {example}")]
    Missing { key: &'static str, example: &'static str },
    #[error("the table has no entries; add {example}")]
    EmptyTable { example: &'static str },
    #[error("the value must be {expected}")]
    WrongType { expected: &'static str },
    #[error(
        "`{name}` is not a valid name; use letters, digits and `_`, begin with a letter, and use at most 64 characters"
    )]
    MalformedName { name: String },
    #[error("`{name}` is a reserved name; choose another name")]
    ReservedName { name: String },
    #[error("`{name}` is already the name of {other}; choose another name")]
    NameTwice { name: String, other: &'static str },
    #[error("found {found} {what}, but at most {allowed} are allowed; simplify the model")]
    TooMany { what: &'static str, found: usize, allowed: usize },
    #[error("a table needs at least two knots, but {found} {} given", if *.found == 1 { "is" } else { "are" })]
    TooFewKnots { found: usize },
    #[error("the state `{state}` has no rate; add its rate under [rates]")]
    NoRate { state: String },
    #[error("no state is called `{state}`{} (states are declared under [states])", suggest(.nearest))]
    NoSuchState { state: String, nearest: Option<String> },
    #[error(
        "the value {value:?} is outside its bounds [{min:?}, {max:?}]; change it, or widen `min` and `max`"
    )]
    OutsideBounds { value: f64, min: f64, max: f64 },
    #[error(
        "`{name}` is not a rate, an input, an output or a parameter of the model, nor one of the general places force, flow, flow-pair, input, delay, output, output-input, output-state, parameter and reset"
    )]
    NoSuchPlace { name: String },
    #[error("no effect is called `{kind}`{} (`augsim effects --for MODEL.toml` lists all effects; kind \"formula\" takes an expression of your own)", suggest(.nearest))]
    NoSuchEffect { kind: String, nearest: Option<String> },
    #[error("the parameter `{name}` of {kind} is missing; add {name} = {{ nominal = 1.0 }}")]
    MissingParameter { name: String, kind: String },
    #[error("`{kind}` cannot act on `{on}`; it can act on {}", places(possible))]
    CannotActOn { kind: String, on: String, possible: Vec<String> },
    #[error("`{kind}` on `{on}` cannot go with `{with}`; {}", partner_remedy(partners))]
    CannotGoWith { kind: String, on: String, with: String, partners: Vec<String> },
    #[error("min {min:?} must be below max {max:?}; correct the bounds")]
    EmptyBounds { min: f64, max: f64 },
    #[error("the parameter is not used anywhere; remove it or set frozen = true")]
    Unused,
    #[error(
        "the parameter is used only in the start of `{state}`, and a fit estimates the initial state itself; set frozen = true, or write the number there"
    )]
    UsedInStart { state: String },
    #[error(
        "the output does not depend on any state, so nothing can be fitted to it; use a state in its value"
    )]
    NeverChanges,
    #[error(
        "the event sets `{state}`, but its condition `when` still holds afterwards, so it would fire forever; set a state that moves `when` away from 0"
    )]
    FiresForever { state: String },
    #[error(
        "\"{text}\" is not a known unit; write it like \"m/s^2\", \"N s/m\", \"rad/(V s^2)\" or \"V^0.5/s\", and \"1\" for a pure number"
    )]
    UnknownUnit { text: String },
    #[error(
        "models are in SI units, and \"{text}\" is none: write unit = \"{}\"; a column of the data in {text} is converted",
        if si.is_empty() { "1" } else { si }
    )]
    NonSiUnit { text: String, si: String },
    #[error(
        "models are in SI units, and the name ends in {ending}: call it `{si_name}` and give its numbers in that unit; a \
         column of the data that ends in {ending} is converted to it"
    )]
    NonSiEnding { ending: String, si_name: String },
    #[error("{cause}")]
    Robot { cause: String },
    #[error("{cause}")]
    External { cause: String },
    #[error("the value must be positive, but {found:?} is given")]
    NotPositive { found: f64 },
    #[error("the value must be 0 or more, but {found:?} is given")]
    Negative { found: f64 },
    #[error("the knots must increase, but {right:?} follows {left:?}; sort them")]
    KnotsDoNotRise { left: f64, right: f64 },
    #[error("the table has {at} knots and {values} values; give equally many of both, at least two")]
    KnotsUnequal { at: usize, values: usize },
    #[error(
        "`{text}` is not the argument of any sign, step or if in the model; copy the argument exactly as it is in the expression"
    )]
    UnusedWidth { text: String },
    #[error(
        "equations with constraints (differential-algebraic systems) are not supported; solve the constraint and write the solution under [let]"
    )]
    Constraint,
    #[error(
        "the compiled system with its derivatives needs more than {MAX_OPERATIONS} operations; simplify the model"
    )]
    TooLarge,
    #[error(
        "low_pass_hz needs a model without states, such as a robot with measured motion as inputs; declare the filter of the sensor as a state instead"
    )]
    LowPassWithStates,
}

/// Advice for a message: which quantities may be given as `with` for an effect at its place.
fn partner_remedy(partners: &[String]) -> String {
    match partners {
        [] => "leave `with` out".to_owned(),
        partners => format!("it can go with {}", places(partners)),
    }
}

/// Lists quantities that an effect can act on, in quotes; says so if there are none.
fn places(possible: &[String]) -> String {
    let quoted: Vec<String> = possible.iter().map(|place| format!("`{place}`")).collect();
    if quoted.is_empty() { "nothing in this model".to_owned() } else { quoted.join(", ") }
}
