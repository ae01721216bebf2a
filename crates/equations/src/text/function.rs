//! The functions that an expression may call.

use crate::compile::Code;

/// A mathematical function of one to three numbers that an expression may call.
///
/// `if`, `table` and `slope` have their own syntax and are not listed here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is the function of its name")]
pub enum Function {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Ln,
    Sqrt,
    Cbrt,
    Atan2,
    Hypot,
    Abs,
    Min,
    Max,
    Clamp,
    Relu,
    Deadzone,
    Sign,
    Step,
}

/// Name in an expression, function, and number of arguments, of every function.
const FUNCTIONS: [(&str, Function, usize); 23] = [
    ("sin", Function::Sin, 1),
    ("cos", Function::Cos, 1),
    ("tan", Function::Tan, 1),
    ("asin", Function::Asin, 1),
    ("acos", Function::Acos, 1),
    ("atan", Function::Atan, 1),
    ("sinh", Function::Sinh, 1),
    ("cosh", Function::Cosh, 1),
    ("tanh", Function::Tanh, 1),
    ("exp", Function::Exp, 1),
    ("ln", Function::Ln, 1),
    ("sqrt", Function::Sqrt, 1),
    ("cbrt", Function::Cbrt, 1),
    ("atan2", Function::Atan2, 2),
    ("hypot", Function::Hypot, 2),
    ("abs", Function::Abs, 1),
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
    ("clamp", Function::Clamp, 3),
    ("relu", Function::Relu, 1),
    ("deadzone", Function::Deadzone, 2),
    ("sign", Function::Sign, 1),
    ("step", Function::Step, 1),
];

/// Names of the calls that have their own syntax.
pub(crate) const SPECIAL: [&str; 6] =
    ["if", "table", "slope", "inverse_dynamics", "forward_dynamics", "external_rate"];

/// Names that no quantity of a model may have, besides the names of functions.
const RESERVED: [&str; 12] =
    ["t", "pi", "e", "and", "or", "not", "true", "false", "trajectory", "group", "t_s", "start_time_s"];

impl Function {
    /// Finds the function with this name; `None` if there is none.
    pub fn named(name: &str) -> Option<Function> {
        FUNCTIONS.iter().find(|(n, ..)| *n == name).map(|(_, f, _)| *f)
    }

    /// Name of the function in an expression.
    pub fn name(self) -> &'static str {
        FUNCTIONS.iter().find(|(_, f, _)| *f == self).map_or("", |(n, ..)| n)
    }

    /// Number of arguments of the function.
    pub fn arity(self) -> usize {
        FUNCTIONS.iter().find(|(_, f, _)| *f == self).map_or(1, |(.., n)| *n)
    }

    /// Whether the function is discontinuous, so that it is smoothed in a rate.
    pub(crate) fn jumps(self) -> bool {
        matches!(self, Function::Sign | Function::Step)
    }

    /// Computes the function for the arguments `z`, without smoothing.
    pub(crate) fn value(self, z: &[f64]) -> f64 {
        let evaluate =
            |code: Code| crate::machine::evaluate(code, z[0], z.get(1).copied().unwrap_or(0.0), 0.0);
        match self {
            Function::Sin => evaluate(Code::Sin),
            Function::Cos => evaluate(Code::Cos),
            Function::Tan => evaluate(Code::Tan),
            Function::Asin => evaluate(Code::Asin),
            Function::Acos => evaluate(Code::Acos),
            Function::Atan => evaluate(Code::Atan),
            Function::Sinh => evaluate(Code::Sinh),
            Function::Cosh => evaluate(Code::Cosh),
            Function::Tanh => evaluate(Code::Tanh),
            Function::Exp => evaluate(Code::Exp),
            Function::Ln => evaluate(Code::Ln),
            Function::Sqrt => evaluate(Code::Sqrt),
            Function::Cbrt => evaluate(Code::Cbrt),
            Function::Atan2 => evaluate(Code::Atan2),
            Function::Hypot => evaluate(Code::Hypot),
            Function::Abs => evaluate(Code::Absolute),
            Function::Min => evaluate(Code::Minimum),
            Function::Max => evaluate(Code::Maximum),
            Function::Clamp => z[0].max(z[1]).min(z[2]),
            Function::Relu => z[0].max(0.0),
            Function::Deadzone => z[0] - z[0].max(-z[1]).min(z[1]),
            Function::Sign => {
                if z[0] == 0.0 {
                    0.0
                } else {
                    z[0].signum()
                }
            }
            Function::Step => f64::from(u8::from(z[0] > 0.0)),
        }
    }

    /// Lists the names of all functions and of the calls with their own syntax.
    pub(crate) fn names() -> impl Iterator<Item = &'static str> {
        FUNCTIONS.iter().map(|(n, ..)| *n).chain(SPECIAL)
    }
}

/// Names of functions in other languages, and how to write each here.
const INSTEAD: [(&[&str], &str); 17] = [
    (&["log", "loge"], "`ln(x)`"),
    (&["log10", "lg"], "`ln(x) / ln(10)`"),
    (&["log2", "ld"], "`ln(x) / ln(2)`"),
    (&["log1p"], "`ln(1 + x)`"),
    (&["expm1"], "`exp(x) - 1`"),
    (&["pow", "power"], "`x^y`"),
    (&["sqr", "square"], "`x^2`"),
    (&["fabs", "absolute", "magnitude"], "`abs(x)`"),
    (&["sgn", "signum"], "`sign(x)`"),
    (&["heaviside", "unitstep"], "`step(x)`"),
    (&["tg"], "`tan(x)`"),
    (&["arcsin", "arsin"], "`asin(x)`"),
    (&["arccos", "arcos"], "`acos(x)`"),
    (&["arctan", "arctg"], "`atan(x)`"),
    (&["arctan2"], "`atan2(y, x)`"),
    (&["sec"], "`1 / cos(x)`"),
    (&["where", "ifelse", "piecewise"], "`if(condition, a, b)`"),
];

/// How to write here the function that `name` means in other languages; `None` if that is not known.
pub(crate) fn instead_of(name: &str) -> Option<&'static str> {
    let name = name.to_ascii_lowercase();
    INSTEAD.iter().find(|(names, _)| names.contains(&name.as_str())).map(|(_, text)| *text)
}

/// Whether `name` is reserved, so that no quantity of a model may have it.
pub(crate) fn is_reserved(name: &str) -> bool {
    name.starts_with('_') || RESERVED.contains(&name) || Function::names().any(|n| n == name)
}
