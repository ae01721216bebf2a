//! Mistakes in an expression, each with its remedy.

use crate::limits::{EXPRESSION_BYTES, EXPRESSION_DEPTH, FILE_NODES};
use thiserror::Error;

/// A mistake in an expression. Columns count characters from 1.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum Problem {
    #[error("has {bytes} bytes, {EXPRESSION_BYTES} are allowed; name parts of it in [let]")]
    TooLong { bytes: usize },
    #[error("is nested deeper than {EXPRESSION_DEPTH}; name parts of it in [let]")]
    TooDeep,
    #[error(
        "is one too many: the expressions of the file have more than {FILE_NODES} operations; simplify the model"
    )]
    TooManyNodes,
    #[error("is empty; write an expression such as \"2 * pi * t\"")]
    Empty,
    #[error("`{found}` has no meaning in an expression; use + - * / ^ ( ) , numbers, names and functions")]
    UnexpectedCharacter { found: String },
    #[error(
        "`{text}` is not a number; write digits, a point between digits and an exponent, such as 0.5 or 1.5e-3"
    )]
    MalformedNumber { text: String },
    #[error("`)` missing for the `(` at column {column}")]
    UnclosedParenthesis { column: usize },
    #[error("`)` without a `(` before it; remove it or add the `(`")]
    UnmatchedParenthesis,
    #[error("a number, a name or `(` must stand where {found} is")]
    ExpectedValue { found: String },
    #[error("an operator is missing before {found}; write `*` for a product")]
    ExpectedOperator { found: String },
    #[error("unknown name `{name}`{}", suggest(.nearest))]
    UnknownName { name: String, nearest: Option<String> },
    #[error("unknown function `{name}`{}", suggest(.nearest))]
    UnknownFunction { name: String, nearest: Option<String> },
    #[error("`{name}` is not a function; write `*` for a product")]
    NotAFunction { name: String },
    #[error("`{name}` is a function and needs its arguments; write `{name}(…)`")]
    FunctionWithoutArguments { name: String },
    #[error("names `{name}`, which is defined later in [let]; move it up")]
    DefinedLater { name: String },
    #[error("names itself; a value of [let] may use only those above it")]
    NamesItself,
    #[error("`{name}` cannot be used here: {why}")]
    NotHere { name: String, why: &'static str },
    #[error("`{function}` takes {takes} argument{}, {given} given", if *.takes == 1 { "" } else { "s" })]
    Arity { function: &'static str, takes: usize, given: usize },
    #[error("a comparison may stand only as the first argument of `if`, as in if(a < b, x, y)")]
    ComparisonOutside,
    #[error("the first argument of `if` must be a comparison, as in if(a < b, x, y)")]
    ConditionMissing,
    #[error("the first argument of `{function}` must be the name of {of}")]
    NameMissing { function: &'static str, of: &'static str },
    #[error("unknown table `{name}`{}; tables are declared as [tables.NAME] with `at` and `values`", suggest(.nearest))]
    UnknownTable { name: String, nearest: Option<String> },
    #[error("`slope` may be used only in `start`; a rate of change belongs into [rates]")]
    SlopeOutsideStart,
    #[error("{verb} {left} and {right}: `{left_text}` {sign} `{right_text}`")]
    Units {
        verb: &'static str,
        sign: &'static str,
        left: String,
        right: String,
        left_text: String,
        right_text: String,
    },
    #[error("is in {found}, but the rate of `{state}` must be in {expected}; check the factors")]
    RateUnit { state: String, found: String, expected: String },
}

fn suggest(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |n| format!("; did you mean `{n}`?"))
}
