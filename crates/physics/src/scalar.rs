//! The number type of the engines: `f64`, or [`Dual`](crate::Dual) with derivatives.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number that may carry derivatives.
///
/// Comparisons use [`value`](Scalar::value): the value alone decides which branch a simulation takes, and the
/// derivatives are those of that branch.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// Number of derivatives that the scalar carries; 0 for `f64`.
    const LANES: usize;
    /// Whether the scalar carries derivatives; `f64` code can skip work that only derivatives need.
    const DIFFERENTIATES: bool = Self::LANES > 0;
    /// A constant with this value and zero derivatives.
    fn constant(value: f64) -> Self;
    /// Independent variable with this value: derivative number `lane` is 1, the others are 0.
    ///
    /// A constant (all derivatives 0) if `lane` is not below [`LANES`](Self::LANES).
    fn variable(value: f64, lane: usize) -> Self;
    /// Derivatives of this number, one per lane; empty for `f64`.
    fn derivatives(&self) -> &[f64];
    /// Value of this number, without its derivatives.
    fn value(self) -> f64;
    /// Square root of this number, 0 for negative values.
    ///
    /// Its derivative at 0 is set to 0, so that a ball released at contact has finite derivatives.
    fn sqrt(self) -> Self;
    /// Exponential function of this number.
    fn exp(self) -> Self;
    /// Natural logarithm of this number.
    fn ln(self) -> Self;
    /// Sine of this angle in rad.
    fn sin(self) -> Self;
    /// Cosine of this angle in rad.
    fn cos(self) -> Self;
    /// Hyperbolic tangent of this number.
    fn tanh(self) -> Self;
    /// Angle from the x axis to the point (`x`, `self`), rad; the derivative at the origin is set to 0.
    fn atan2(self, x: Self) -> Self;
    /// This number to the power of a constant exponent.
    fn powf(self, exponent: f64) -> Self;
    /// The number 0, with zero derivatives.
    fn zero() -> Self {
        Self::constant(0.0)
    }
    /// Absolute value: the number, negated (with its derivatives) if [`value`](Self::value) is negative.
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
}

impl Scalar for f64 {
    const LANES: usize = 0;
    fn constant(value: f64) -> Self {
        value
    }
    fn variable(value: f64, _lane: usize) -> Self {
        value
    }
    fn derivatives(&self) -> &[f64] {
        &[]
    }
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> Self {
        self.max(0.0).sqrt()
    }
    fn exp(self) -> Self {
        self.exp()
    }
    fn ln(self) -> Self {
        self.ln()
    }
    fn sin(self) -> Self {
        self.sin()
    }
    fn cos(self) -> Self {
        self.cos()
    }
    fn tanh(self) -> Self {
        self.tanh()
    }
    fn atan2(self, x: Self) -> Self {
        self.atan2(x)
    }
    fn powf(self, exponent: f64) -> Self {
        self.powf(exponent)
    }
}

/// Dot product of the 3-vectors `a` and `b`.
pub fn dot<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product `a × b` of two 3-vectors.
///
/// ```
/// use augsim_physics::scalar::cross;
/// assert_eq!(cross(&[1.0, 0.0, 0.0], &[0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
/// ```
pub fn cross<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> [S; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Computes `a + b s` for 3-vectors `a`, `b` and a scalar `s`.
///
/// ```
/// use augsim_physics::scalar::axpy;
/// assert_eq!(axpy(&[1.0, 2.0, 3.0], &[1.0, 0.0, -1.0], 2.0), [3.0, 2.0, 1.0]);
/// ```
pub fn axpy<S: Scalar>(a: &[S; 3], b: &[S; 3], s: S) -> [S; 3] {
    [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s]
}
