//! Operations on tensors: one file each, with the forward pass and the vector-Jacobian product.
//!
//! To add an operation, write a file with `impl Tape` (forward pass) and `vjp`, a variant of [`Op`] with its
//! name, a line in [`vjp`], and a case in the gradient checks.

mod add;
mod broadcast;
mod concat;
mod detach;
mod div;
mod elementwise;
mod exp;
mod external;
mod gaussian_kl;
mod gaussian_nll;
mod gru_composed;
pub(crate) mod gru_sequence;
mod linear;
mod ln;
mod matmul;
mod mean;
mod mul;
mod neg;
mod reshape;
mod scale;
mod shift;
mod sigmoid;
mod slice;
mod softplus;
mod sqrt;
mod squared_error;
mod stack;
mod sub;
mod sum;
mod tanh;

use crate::{Scalar, Tape, Var};

/// The operation that produced a tensor on the tape, with its operands.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Op {
    Leaf,
    Add(Var, Var),
    Sub(Var, Var),
    Mul(Var, Var),
    Div(Var, Var),
    Neg(Var),
    Scale(Var, f64),
    Shift(Var),
    Exp(Var),
    Ln(Var),
    Sqrt(Var),
    Tanh(Var),
    Sigmoid(Var),
    Softplus(Var),
    Matmul(Var, Var),
    Broadcast(Var),
    Reshape(Var),
    Sum(Var, usize),
    SumAll(Var),
    Mean(Var, usize),
    MeanAll(Var),
    Slice { a: Var, axis: usize, start: usize },
    Concat { first: usize, count: usize, axis: usize },
    Stack { first: usize, count: usize },
    Linear { x: Var, w: Var, b: Var, tanh: bool },
    Gru { x: Var, h0: Option<Var>, w: gru_sequence::GruVars },
    GaussianKl { mean_q: Var, sd_q: Var, mean_p: Var, sd_p: Var },
    GaussianNll { x: Var, mean: Var, sd: Var },
    SquaredError(Var, Var),
    External(Var),
}

/// Defines [`Op::name`] and the list of all names from one table, so that the list is complete.
macro_rules! names {
    ($($pattern:pat => $name:literal,)*) => {
        /// Names of all operations on tensors, as errors and [`Tape::operation`] give them.
        ///
        /// The first, `leaf`, stands for constants and variables.
        pub const OPERATIONS: &[&str] = &[$($name),*];

        impl Op {
            /// Name of the operation, as in error messages.
            pub(crate) fn name(self) -> &'static str {
                match self {
                    $($pattern => $name,)*
                }
            }
        }
    };
}

names! {
    Op::Leaf => "leaf",
    Op::Add(..) => "add",
    Op::Sub(..) => "sub",
    Op::Mul(..) => "mul",
    Op::Div(..) => "div",
    Op::Neg(..) => "neg",
    Op::Scale(..) => "scale",
    Op::Shift(..) => "shift",
    Op::Exp(..) => "exp",
    Op::Ln(..) => "ln",
    Op::Sqrt(..) => "sqrt",
    Op::Tanh(..) => "tanh",
    Op::Sigmoid(..) => "sigmoid",
    Op::Softplus(..) => "softplus",
    Op::Matmul(..) => "matmul",
    Op::Broadcast(..) => "broadcast_to",
    Op::Reshape(..) => "reshape",
    Op::Sum(..) => "sum",
    Op::SumAll(..) => "sum_all",
    Op::Mean(..) => "mean",
    Op::MeanAll(..) => "mean_all",
    Op::Slice { .. } => "slice",
    Op::Concat { .. } => "concat",
    Op::Stack { .. } => "stack_time",
    Op::Linear { tanh: false, .. } => "linear",
    Op::Linear { tanh: true, .. } => "linear_tanh",
    Op::Gru { .. } => "gru_sequence",
    Op::GaussianKl { .. } => "gaussian_kl",
    Op::GaussianNll { .. } => "gaussian_nll",
    Op::SquaredError(..) => "squared_error",
    Op::External(..) => "external",
}

/// Runs the vector-Jacobian product of `op`: adds the gradients of its operands, given that of its output.
pub(crate) fn vjp<T: Scalar>(tape: &mut Tape<T>, op: Op, out: Var, grad: &[T]) {
    match op {
        Op::Leaf => {}
        Op::Add(a, b) => add::vjp(tape, a, b, grad),
        Op::Sub(a, b) => sub::vjp(tape, a, b, grad),
        Op::Mul(a, b) => mul::vjp(tape, a, b, grad),
        Op::Div(a, b) => div::vjp(tape, a, b, grad),
        Op::Neg(a) => neg::vjp(tape, a, grad),
        Op::Scale(a, factor) => scale::vjp(tape, a, factor, grad),
        Op::Shift(a) => shift::vjp(tape, a, grad),
        Op::Exp(a) => exp::vjp(tape, a, out, grad),
        Op::Ln(a) => ln::vjp(tape, a, grad),
        Op::Sqrt(a) => sqrt::vjp(tape, a, out, grad),
        Op::Tanh(a) => tanh::vjp(tape, a, out, grad),
        Op::Sigmoid(a) => sigmoid::vjp(tape, a, out, grad),
        Op::Softplus(a) => softplus::vjp(tape, a, grad),
        Op::Matmul(a, b) => matmul::vjp(tape, a, b, grad),
        Op::Broadcast(a) => broadcast::vjp(tape, a, out, grad),
        Op::Reshape(a) => reshape::vjp(tape, a, grad),
        Op::Sum(a, axis) => sum::vjp(tape, a, axis, grad),
        Op::SumAll(a) => sum::vjp_all(tape, a, grad),
        Op::Mean(a, axis) => mean::vjp(tape, a, axis, grad),
        Op::MeanAll(a) => mean::vjp_all(tape, a, grad),
        Op::Slice { a, axis, start } => slice::vjp(tape, a, axis, start, out, grad),
        Op::Concat { first, count, axis } => concat::vjp(tape, first, count, axis, out, grad),
        Op::Stack { first, count } => stack::vjp(tape, first, count, grad),
        Op::Linear { x, w, b, tanh } => linear::vjp(tape, [x, w, b], tanh, out, grad),
        Op::Gru { x, h0, w } => gru_sequence::vjp(tape, x, h0, w, out, grad),
        Op::GaussianKl { mean_q, sd_q, mean_p, sd_p } => {
            gaussian_kl::vjp(tape, [mean_q, sd_q, mean_p, sd_p], grad);
        }
        Op::GaussianNll { x, mean, sd } => gaussian_nll::vjp(tape, x, mean, sd, grad),
        Op::SquaredError(x, mean) => squared_error::vjp(tape, x, mean, grad),
        Op::External(x) => external::vjp(tape, x, out, grad),
    }
}
