//! The gates of a GRU in SIMD lanes.
//!
//! ```text
//! (1)  sigmoid(a) = 1 / (1 + 2^t),    t = -a log2(e)
//! (2)  tanh(a) = 1 - 2 / (1 + 2^t),   t = 2 a log2(e)
//! ```
//!
//! The factors of t are included in the weights, and functions are computed in pairs, so that two can share
//! one division. Absolute errors are at most 3e-7, tested against f64 over all floats. Where t is clamped to
//! +-43 the error is 2^-43.

use super::vector::Vector;

/// Factor that is included in the weights of the reset and update gates: -log2(e).
pub(crate) const SIGMOID_SCALE: f32 = -std::f32::consts::LOG2_E;
/// Factor that is included in the weights of the candidate state: 2 log2(e).
pub(crate) const TANH_SCALE: f32 = 2.0 * std::f32::consts::LOG2_E;

/// Logistic functions of two arguments, which have been multiplied by [`SIGMOID_SCALE`].
#[inline(always)]
pub(crate) fn sigmoids<S: Vector>(simd: S, a: S::f32s, b: S::f32s) -> (S::f32s, S::f32s) {
    simd.over_one_plus_exp2(1.0, a, b)
}

/// Hyperbolic tangents of two arguments, which have been multiplied by [`TANH_SCALE`].
#[inline(always)]
pub(crate) fn tanhs<S: Vector>(simd: S, a: S::f32s, b: S::f32s) -> (S::f32s, S::f32s) {
    let (a, b) = simd.over_one_plus_exp2(-2.0, a, b);
    let one = simd.splat_f32s(1.0);
    (simd.add_f32s(one, a), simd.add_f32s(one, b))
}

#[cfg(test)]
mod tests {
    //! Contract: the error bound in the module's documentation holds over all floats (every exponent,
    //! denormals and infinities) at every level of this machine.
    use super::*;
    use crate::simd::{Kernel, Level};

    struct Both<'a>(&'a [f32], &'a mut [f32], &'a mut [f32]);

    impl Kernel for Both<'_> {
        #[inline(always)]
        fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
            for ((x, s), t) in self.0.iter().zip(self.1).zip(self.2) {
                let scaled = |by: f32| simd.splat_f32s(x * by);
                let zero = simd.splat_f32s(0.0);
                let first = |v: S::f32s| simd.reduce_max_f32s(v);
                *s = first(sigmoids(simd, scaled(SIGMOID_SCALE), zero).0);
                *t = first(tanhs(simd, zero, scaled(TANH_SCALE)).1);
            }
        }
    }

    #[test]
    fn sigmoid_and_tanh_are_within_3e_7_over_all_floats() {
        // Every 4099th float (a prime number, so that mantissas vary), and a fine grid where the functions
        // are not flat.
        let mut x: Vec<f32> = (0..=u32::MAX).step_by(4099).map(f32::from_bits).collect();
        x.extend((-200_000..=200_000).map(|i| i as f32 * 1e-4));
        x.extend([0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-45, -1e-45]);
        x.retain(|v| !v.is_nan());
        let (mut s, mut t) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        for level in Level::available() {
            level.run(16, Both(&x, &mut s, &mut t));
            for ((x, s), t) in x.iter().zip(&s).zip(&t) {
                let wide = f64::from(*x);
                let sigmoid = 1.0 / (1.0 + (-wide).exp());
                assert!((f64::from(*s) - sigmoid).abs() <= 3e-7, "{level:?}: sigmoid({x}) = {s}");
                assert!((f64::from(*t) - wide.tanh()).abs() <= 3e-7, "{level:?}: tanh({x}) = {t}");
                assert!((0.0..=1.0).contains(s) && (-1.0..=1.0).contains(t));
            }
        }
    }
}
