//! The functions that an expression may call.

use crate::compile::Code;

/// A function of one or more numbers. `if`, `table` and `slope` have a syntax of their own and are not among them.
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

/// Name in the text, function, number of arguments.
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

/// Words that call something by a syntax of their own.
pub(crate) const SPECIAL: [&str; 3] = ["if", "table", "slope"];

/// Names with a meaning that no quantity of a model may bear, beside those of functions.
const RESERVED: [&str; 12] =
    ["t", "pi", "e", "and", "or", "not", "true", "false", "trajectory", "group", "t_s", "start_time_s"];

impl Function {
    /// The function of that name.
    pub fn named(name: &str) -> Option<Function> {
        FUNCTIONS.iter().find(|(n, ..)| *n == name).map(|(_, f, _)| *f)
    }

    /// Its name in an expression.
    pub fn name(self) -> &'static str {
        FUNCTIONS.iter().find(|(_, f, _)| *f == self).map_or("", |(n, ..)| n)
    }

    /// How many arguments it takes.
    pub fn arity(self) -> usize {
        FUNCTIONS.iter().find(|(_, f, _)| *f == self).map_or(1, |(.., n)| *n)
    }

    /// Whether its value jumps, so that it is smoothed in a rate.
    pub(crate) fn jumps(self) -> bool {
        matches!(self, Function::Sign | Function::Step)
    }

    /// Its value for arguments `z`; jumps are sharp.
    pub(crate) fn value(self, z: &[f64]) -> f64 {
        let one = |code: Code| crate::machine::evaluate(code, z[0], z.get(1).copied().unwrap_or(0.0), 0.0);
        match self {
            Function::Sin => one(Code::Sin),
            Function::Cos => one(Code::Cos),
            Function::Tan => one(Code::Tan),
            Function::Asin => one(Code::Asin),
            Function::Acos => one(Code::Acos),
            Function::Atan => one(Code::Atan),
            Function::Sinh => one(Code::Sinh),
            Function::Cosh => one(Code::Cosh),
            Function::Tanh => one(Code::Tanh),
            Function::Exp => one(Code::Exp),
            Function::Ln => one(Code::Ln),
            Function::Sqrt => one(Code::Sqrt),
            Function::Cbrt => one(Code::Cbrt),
            Function::Atan2 => one(Code::Atan2),
            Function::Hypot => one(Code::Hypot),
            Function::Abs => one(Code::Absolute),
            Function::Min => one(Code::Minimum),
            Function::Max => one(Code::Maximum),
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

    /// The names of all, with those of a syntax of their own.
    pub(crate) fn names() -> impl Iterator<Item = &'static str> {
        FUNCTIONS.iter().map(|(n, ..)| *n).chain(SPECIAL)
    }
}

/// Whether no quantity may bear that name.
pub(crate) fn is_reserved(name: &str) -> bool {
    name.starts_with('_') || RESERVED.contains(&name) || Function::names().any(|n| n == name)
}
