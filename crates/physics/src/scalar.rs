//! The arithmetic that the engines are generic over: plain `f64` or forward-mode [`Dual`](crate::Dual).

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number, possibly carrying derivatives.
///
/// Comparisons go through [`value`](Scalar::value): which branch a simulation takes depends on the value alone, and the
/// derivatives are those of the branch taken.
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
    /// How many derivatives it carries.
    const LANES: usize;
    /// Whether it carries derivatives: plain numbers can skip the work that only derivatives need.
    const DIFFERENTIATES: bool = Self::LANES > 0;
    /// A constant: derivative zero.
    fn constant(value: f64) -> Self;
    /// The independent variable of `lane`, at `value`. A lane beyond [`LANES`](Self::LANES) gives a constant.
    fn variable(value: f64, lane: usize) -> Self;
    /// The derivatives, lane by lane; empty for plain numbers.
    fn derivatives(&self) -> &[f64];
    /// The value without derivatives.
    fn value(self) -> f64;
    /// Square root; the derivative at 0 is taken as 0 so that a ball released at contact stays finite.
    fn sqrt(self) -> Self;
    /// Exponential.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Sine.
    fn sin(self) -> Self;
    /// Cosine.
    fn cos(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// Angle of the point (`x`, `self`), rad; the derivative at the origin is taken as 0.
    fn atan2(self, x: Self) -> Self;
    /// Power with a constant exponent.
    fn powf(self, exponent: f64) -> Self;
    /// Zero.
    fn zero() -> Self {
        Self::constant(0.0)
    }
    /// Absolute value by the sign of the value.
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

/// Scalar product of two 3-vectors.
pub fn dot<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product `a × b`.
///
/// ```
/// use augsim_physics::scalar::cross;
/// assert_eq!(cross(&[1.0, 0.0, 0.0], &[0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
/// ```
pub fn cross<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> [S; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + b s`, component by component.
///
/// ```
/// use augsim_physics::scalar::axpy;
/// assert_eq!(axpy(&[1.0, 2.0, 3.0], &[1.0, 0.0, -1.0], 2.0), [3.0, 2.0, 1.0]);
/// ```
pub fn axpy<S: Scalar>(a: &[S; 3], b: &[S; 3], s: S) -> [S; 3] {
    [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s]
}
