//! Errors in an expression, each with a message that says what to do.

use crate::limits::{MAX_EXPRESSION_BYTES, MAX_EXPRESSION_DEPTH, MAX_FILE_NODES};
use thiserror::Error;

/// What is wrong in an expression. Columns count characters from 1.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum Problem {
    #[error(
        "the expression has {bytes} bytes, but at most {MAX_EXPRESSION_BYTES} are allowed; move parts of it into named values under [let]"
    )]
    TooLong { bytes: usize },
    #[error(
        "the expression is nested more than {MAX_EXPRESSION_DEPTH} levels deep; move parts of it into named values under [let]"
    )]
    TooDeep,
    #[error(
        "with this expression the file has more than {MAX_FILE_NODES} numbers, names and operations; simplify the model"
    )]
    TooManyNodes,
    #[error("the expression is empty; write an expression such as \"2 * pi * t\"")]
    Empty,
    #[error(
        "the character `{found}` is not allowed in an expression; use + - * / ^ ( ) , < > numbers, names and functions"
    )]
    UnexpectedCharacter { found: String },
    #[error(
        "`{text}` is not a number; write digits, with a decimal point and an exponent if needed, such as 0.5 or 1.5e-3"
    )]
    MalformedNumber { text: String },
    #[error("the `(` at column {column} is never closed; add the missing `)`")]
    UnclosedParenthesis { column: usize },
    #[error("this `)` has no matching `(`; remove it or add the `(`")]
    UnmatchedParenthesis,
    #[error("a number, a name or `(` is expected here, but {found} was found")]
    ExpectedValue { found: String },
    #[error("an operator is missing before {found}; write `*` for a product")]
    ExpectedOperator { found: String },
    #[error("unknown name `{name}`{}", suggest(.nearest))]
    UnknownName { name: String, nearest: Option<String> },
    #[error("unknown function `{name}`{remedy}")]
    UnknownFunction { name: String, remedy: String },
    #[error("`{name}` is not a function; write `*` for a product")]
    NotAFunction { name: String },
    #[error("`{name}` is a function and needs its arguments; write `{name}(…)`")]
    FunctionWithoutArguments { name: String },
    #[error("uses `{name}`, which is defined later in [let]; move its definition up")]
    DefinedLater { name: String },
    #[error("uses itself; a value of [let] may use only values that are defined above it")]
    NamesItself,
    #[error("`{name}` cannot be used here: {why}")]
    NotHere { name: String, why: &'static str },
    #[error("`{function}` takes {takes} argument{}, but {given} {} given", if *.takes == 1 { "" } else { "s" }, if *.given == 1 { "is" } else { "are" })]
    Arity { function: &'static str, takes: usize, given: usize },
    #[error("a comparison is allowed only as the first argument of `if`, as in if(a < b, x, y)")]
    ComparisonOutside,
    #[error("a condition must be a comparison such as a < b, as in if(a < b, x, y)")]
    ConditionMissing,
    #[error("the first argument of `{function}` must be the name of {expected}")]
    NameMissing { function: &'static str, expected: &'static str },
    #[error("unknown table `{name}`{} (declare tables as [tables.NAME] with `at` and `values`)", suggest(.nearest))]
    UnknownTable { name: String, nearest: Option<String> },
    #[error("unknown joint `{name}`{} (joints are listed under `joints` of [robot])", suggest(.nearest))]
    UnknownJoint { name: String, nearest: Option<String> },
    #[error(
        "`slope` is allowed only in `start` and in effects on an output; write the rate of a state under [rates]"
    )]
    SlopeOutsideStart,
    #[error(
        "cannot {verb} quantities with the units {} and {}: `{}` {sign} `{}`; make the units agree",
        .left.unit, .right.unit, .left.text, .right.text
    )]
    Units { verb: &'static str, sign: &'static str, left: Box<Side>, right: Box<Side> },
    #[error(
        "the expression has the unit {found}, but the rate of `{state}` must have the unit {expected}; check its factors"
    )]
    RateUnit { state: String, found: String, expected: String },
}

/// One of two operands of a sum, comparison or choice whose units do not match.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Side {
    /// Unit of the operand, as a message shows it.
    pub unit: String,
    /// Text of the operand in the expression.
    pub text: String,
}

/// End of a message that proposes the most similar known name; empty without one.
pub(crate) fn suggest(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |n| format!("; did you mean `{n}`?"))
}
