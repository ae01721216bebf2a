//! Forward-mode automatic differentiation: dual numbers with a fixed number of derivatives.

use crate::Scalar;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A value with its derivatives with respect to `N` independent variables.
///
/// The lanes are a plain array, so that the compiler vectorises every operation. The derivative of the result
/// follows from the chain rule, e.g. (x y)' = x' y + x y'. Source: Griewank and Walther, Evaluating
/// Derivatives, 2008, chapter 3 (forward mode).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// Function value, without derivatives.
    pub value: f64,
    /// Derivative with respect to each independent variable.
    pub d: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// Independent variable with this value: derivative number `lane` is 1, the others are 0.
    ///
    /// A constant (all derivatives 0) if `lane` is not below `N`.
    ///
    /// ```
    /// use augsim_physics::{Dual, Scalar};
    /// let v = Dual::<1>::variable(3.0, 0);
    /// let energy = v * v * Dual::constant(0.5);
    /// assert_eq!((energy.value(), energy.derivatives()), (4.5, &[3.0][..]));
    /// ```
    pub fn variable(value: f64, lane: usize) -> Self {
        let mut d = [0.0; N];
        if let Some(slot) = d.get_mut(lane) {
            *slot = 1.0;
        }
        Self { value, d }
    }

    /// Applies the chain rule for a function f of one variable, given f (`value`) and f' (`slope`) there.
    #[inline(always)]
    fn chain(mut self, value: f64, slope: f64) -> Self {
        self.value = value;
        self.d.iter_mut().for_each(|d| *d *= slope);
        self
    }
}

/// Applies the chain rule to `M` functions with known values and partial derivatives in `K` inputs.
///
/// Cheaper than evaluating long functions in dual numbers when they have few inputs.
#[inline]
pub(crate) fn chained<S: Scalar, const K: usize, const M: usize>(
    inputs: [S; K],
    values: [f64; M],
    slopes: [[f64; K]; M],
) -> [S; M] {
    // Value 0 with the derivatives of the input.
    let changes = inputs.map(|x| x - x.value());
    std::array::from_fn(|m| {
        let mut sum = S::constant(values[m]);
        changes.iter().zip(slopes[m]).for_each(|(x, slope)| sum += *x * slope);
        sum
    })
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: Self) -> Self {
        self.value += o.value;
        self.d.iter_mut().zip(&o.d).for_each(|(a, b)| *a += b);
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, o: Self) -> Self {
        self.value -= o.value;
        self.d.iter_mut().zip(&o.d).for_each(|(a, b)| *a -= b);
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
    fn mul(mut self, o: Self) -> Self {
        let (a, b) = (self.value, o.value);
        self.d.iter_mut().zip(&o.d).for_each(|(x, y)| *x = *x * b + a * y);
        self.value = a * b;
        self
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(mut self, o: Self) -> Self {
        // (x / y)' = (x' - (x / y) y') / y: one division for all lanes.
        let r = 1.0 / o.value;
        self.value *= r;
        let v = self.value;
        self.d.iter_mut().zip(&o.d).for_each(|(x, y)| *x = (*x - v * y) * r);
        self
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: f64) -> Self {
        self.value += o;
        self
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, o: f64) -> Self {
        self.value -= o;
        self
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self.chain(self.value * o, o)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        self.value += o.value;
        self.d.iter_mut().zip(&o.d).for_each(|(a, b)| *a += b);
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        self.value -= o.value;
        self.d.iter_mut().zip(&o.d).for_each(|(a, b)| *a -= b);
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const LANES: usize = N;
    fn constant(value: f64) -> Self {
        Self { value, d: [0.0; N] }
    }
    fn variable(value: f64, lane: usize) -> Self {
        Dual::variable(value, lane)
    }
    fn derivatives(&self) -> &[f64] {
        &self.d
    }
    fn value(self) -> f64 {
        self.value
    }
    fn sqrt(self) -> Self {
        let root = self.value.max(0.0).sqrt();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }
    fn exp(self) -> Self {
        let e = self.value.exp();
        self.chain(e, e)
    }
    fn ln(self) -> Self {
        self.chain(self.value.ln(), 1.0 / self.value)
    }
    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }
    fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }
    fn tanh(self) -> Self {
        let t = self.value.tanh();
        self.chain(t, 1.0 - t * t)
    }
    fn atan2(mut self, x: Self) -> Self {
        let (y, square) = (self.value, self.value * self.value + x.value * x.value);
        let r = if square > 0.0 { 1.0 / square } else { 0.0 };
        self.d.iter_mut().zip(&x.d).for_each(|(dy, dx)| *dy = (*dy * x.value - y * dx) * r);
        self.value = y.atan2(x.value);
        self
    }
    fn powf(self, exponent: f64) -> Self {
        self.chain(self.value.powf(exponent), exponent * self.value.powf(exponent - 1.0))
    }
}

#[cfg(test)]
mod tests {
    //! Every operation propagates the derivative of the function it computes. Checked against central
    //! differences with a step at which truncation and rounding errors both stay below 1e-8 relative.
    use super::*;

    fn composite<S: Scalar>(x: S, y: S) -> S {
        let smooth = (x - y).tanh() + (x * 2.0).atan2(y) - y.powf(1.7);
        (x * y + 2.0).sqrt() / ((x.sin() + y.cos()) * 0.5 + 3.0) - (x.abs().ln() - y).exp() * 0.1
            + smooth * 0.3
    }

    #[test]
    fn every_operation_agrees_with_central_differences() {
        let (x, y) = (0.7, 1.9);
        let exact = composite(Dual::<2>::variable(x, 0), Dual::<2>::variable(y, 1));
        let h = 1e-6;
        let dx = (composite(x + h, y) - composite(x - h, y)) / (2.0 * h);
        let dy = (composite(x, y + h) - composite(x, y - h)) / (2.0 * h);
        assert_eq!(exact.value, composite(x, y));
        assert!((exact.d[0] - dx).abs() < 1e-8, "{} {dx}", exact.d[0]);
        assert!((exact.d[1] - dy).abs() < 1e-8, "{} {dy}", exact.d[1]);
    }

    #[test]
    fn chained_gives_the_derivatives_of_direct_evaluation() {
        let (x, y) = (Dual::<5>::variable(0.7, 1), Dual::<5>::variable(1.9, 4));
        let (u, v) = (x * y, x - y * 2.0);
        let inner = composite(Dual::<2>::variable(u.value, 0), Dual::variable(v.value, 1).abs());
        let [chained] = chained([u, v], [inner.value], [inner.d]);
        let direct = composite(u, v.abs());
        assert_eq!(chained.value, direct.value);
        (0..5).for_each(|i| assert!((chained.d[i] - direct.d[i]).abs() < 1e-14));
    }

    #[test]
    fn variable_with_lane_out_of_range_is_a_constant() {
        assert_eq!(Dual::<2>::variable(3.0, 9), Dual::constant(3.0));
    }
}
