//! Computes an operation on single numbers.
//!
//! The lanes run exactly this function, so that constants folded by the compiler have the same bits as
//! results of the engine.

use crate::compile::Code;
use crate::math;

/// Computes an operation that needs nothing but its operands `a`, `b`, `c`; 0 for other operations.
#[inline(always)]
pub(crate) fn evaluate(code: Code, a: f64, b: f64, c: f64) -> f64 {
    match code {
        Code::Add => a + b,
        Code::Subtract => a - b,
        Code::Multiply => a * b,
        Code::Divide => a / b,
        Code::Negate => -a,
        Code::MultiplyAdd => a.mul_add(b, c),
        Code::MultiplySubtract => a.mul_add(b, -c),
        Code::SubtractProduct => (-a).mul_add(b, c),
        Code::Minimum => {
            if b < a {
                b
            } else {
                a
            }
        }
        Code::Maximum => {
            if b > a {
                b
            } else {
                a
            }
        }
        Code::Absolute => a.abs(),
        Code::Select => {
            if a > 0.0 {
                b
            } else {
                c
            }
        }
        Code::Sqrt => if a < 0.0 { 0.0 } else { a }.sqrt(),
        Code::Exp => math::exp(a),
        Code::Ln => math::ln(a),
        Code::Sin => math::sin(a),
        Code::Cos => math::cos(a),
        Code::Tan => math::sin(a) / math::cos(a),
        Code::Tanh => math::tanh(a),
        Code::Cbrt => a.cbrt(),
        Code::Asin => a.asin(),
        Code::Acos => a.acos(),
        Code::Atan => a.atan(),
        Code::Sinh => a.sinh(),
        Code::Cosh => a.cosh(),
        Code::Atan2 => a.atan2(b),
        Code::Hypot => a.hypot(b),
        Code::Power => a.powf(b),
        Code::Constant
        | Code::State
        | Code::Input
        | Code::InputSlope
        | Code::Time
        | Code::Parameter
        | Code::Width
        | Code::Table
        | Code::TableSlope
        | Code::Argument
        | Code::External
        | Code::ExternalDerivative => 0.0,
    }
}
