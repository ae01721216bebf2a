//! Elementwise activations and Gaussian losses in SIMD lanes, with vector-Jacobian products.
//!
//! Each takes one pass over memory. Reference: [`super::pointwise_reference`]. Error bounds, tested against
//! f64 over all floats: `ln` 2 ulp, `tanh` 4e-7 relative, `softplus` 4e-7 relative to max(1, |y|).

use super::activation::{LN1P_POLY, TANH_CLAMP, TANH_P, TANH_Q};
use super::exp2::{exp2, one_plus_exp2};
use super::gates::SIGMOID_SCALE;
use super::lanes::{at_least, at_most};
use super::vector::Vector;
use crate::simd::{Kernel, Level};
use pulp::Simd;
use std::marker::PhantomData;

/// Elementwise functions: `OUT` output values from `IN` input values.
trait Pointwise<const IN: usize, const OUT: usize> {
    /// Evaluates the functions in every SIMD lane.
    fn evaluate<S: Simd>(simd: S, x: [S::f32s; IN]) -> [S::f32s; OUT];
}

/// Kernel that applies elementwise functions to slices of equal lengths.
struct PointwiseKernel<'a, F, const IN: usize, const OUT: usize> {
    inputs: [&'a [f32]; IN],
    outputs: [&'a mut [f32]; OUT],
    /// Whether each output is overwritten instead of added to.
    fresh: [bool; OUT],
    function: PhantomData<F>,
}

impl<F: Pointwise<IN, OUT>, const IN: usize, const OUT: usize> Kernel for PointwiseKernel<'_, F, IN, OUT> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        let PointwiseKernel { inputs, outputs, fresh, function: _ } = self;
        let inputs = inputs.map(|x| S::as_simd_f32s(x));
        let mut outputs = outputs.map(|y| S::as_mut_simd_f32s(y));
        let whole = outputs.iter().map(|y| y.0.len()).min().unwrap_or(0);
        for i in 0..whole {
            let mut x = [simd.splat_f32s(0.0); IN];
            for (x, from) in x.iter_mut().zip(&inputs) {
                *x = from.0[i];
            }
            let y = F::evaluate(simd, x);
            for ((to, y), fresh) in outputs.iter_mut().zip(y).zip(fresh) {
                let slot = &mut to.0[i];
                *slot = if fresh { y } else { simd.add_f32s(*slot, y) };
            }
        }
        if outputs.iter().all(|y| y.1.is_empty()) {
            return;
        }
        let mut x = [simd.splat_f32s(0.0); IN];
        for (x, from) in x.iter_mut().zip(&inputs) {
            *x = simd.partial_load_f32s(from.1);
        }
        let y = F::evaluate(simd, x);
        for ((to, y), fresh) in outputs.iter_mut().zip(y).zip(fresh) {
            let y = if fresh { y } else { simd.add_f32s(simd.partial_load_f32s(to.1), y) };
            simd.partial_store_f32s(to.1, y);
        }
    }
}

/// Applies elementwise functions to slices, with the SIMD instruction set of this process.
fn apply<F: Pointwise<IN, OUT>, const IN: usize, const OUT: usize>(
    _: F,
    inputs: [&[f32]; IN],
    outputs: [&mut [f32]; OUT],
    fresh: [bool; OUT],
) {
    Level::current().run(usize::MAX, PointwiseKernel { inputs, outputs, fresh, function: PhantomData::<F> });
}

/// Polynomial for (ln(1 + t) - t + t^2 / 2) / t^3 on [sqrt(1/2) - 1, sqrt(2) - 1], highest power first.
///
/// Minimax with a relative error of the logarithm of 3.3e-8.
const LN: [f32; 7] = [
    8.917_883e-2,
    -1.435_02e-1,
    1.487_695_6e-1,
    -1.656_563_4e-1,
    1.996_539_8e-1,
    -2.500_174_6e-1,
    3.333_386e-1,
];
const LN_2: f32 = std::f32::consts::LN_2;

/// Natural logarithm in every SIMD lane.
#[inline(always)]
pub(crate) fn ln<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let (k, bits) = (|c: f32| simd.splat_f32s(c), |c: u32| simd.splat_u32s(c));
    // Denormals are scaled up by 2^23, because their mantissas have no leading one.
    let is_denormal = simd.less_than_f32s(x, k(f32::MIN_POSITIVE));
    let scaled = simd.select_f32s(is_denormal, simd.mul_f32s(x, k(8_388_608.0)), x);
    let bias = simd.select_f32s(is_denormal, k(-(8_388_608.0 + 127.0 + 23.0)), k(-(8_388_608.0 + 127.0)));
    // x = 2^n (1 + t) with 1 + t between sqrt(1/2) and sqrt(2).
    let half_root = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    let shifted = simd.add_u32s(simd.transmute_u32s_f32s(scaled), bits(1.0_f32.to_bits() - half_root));
    let exponent = simd.wrapping_dyn_shr_u32s(shifted, bits(23));
    let n = simd.add_f32s(simd.transmute_f32s_u32s(simd.or_u32s(exponent, bits(0x4b00_0000))), bias);
    let mantissa = simd.add_u32s(simd.and_u32s(shifted, bits(0x007f_ffff)), bits(half_root));
    let t = simd.sub_f32s(simd.transmute_f32s_u32s(mantissa), k(1.0));
    let mut p = k(LN[0]);
    for &c in &LN[1..] {
        p = simd.mul_add_e_f32s(p, t, k(c));
    }
    let square = simd.mul_f32s(t, t);
    let tail = simd.mul_f32s(square, simd.mul_add_e_f32s(p, t, k(-0.5)));
    let y = simd.mul_add_e_f32s(n, k(LN_2), simd.add_f32s(tail, t));
    // Special cases: 0, infinity, negative numbers and NaN.
    let is_finite = simd.less_than_f32s(x, k(f32::INFINITY));
    let is_positive = simd.greater_than_f32s(x, k(0.0));
    let is_zero = simd.equal_f32s(x, k(0.0));
    let y = simd.select_f32s(is_finite, y, x);
    let special = simd.select_f32s(is_zero, k(f32::NEG_INFINITY), k(f32::NAN));
    simd.select_f32s(is_positive, y, special)
}

/// Softplus in every SIMD lane: ln(1 + exp(x)) = max(x, 0) + ln(1 + exp(-|x|)).
#[inline(always)]
pub(super) fn softplus_at<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let u = exp2(simd, simd.mul_f32s(simd.abs_f32s(x), simd.splat_f32s(SIGMOID_SCALE)));
    let mut p = simd.splat_f32s(LN1P_POLY[0]);
    for &c in &LN1P_POLY[1..] {
        p = simd.mul_add_e_f32s(p, u, simd.splat_f32s(c));
    }
    simd.mul_add_e_f32s(u, p, at_least(simd, x, 0.0))
}

struct Softplus;
impl Pointwise<1, 1> for Softplus {
    #[inline(always)]
    fn evaluate<S: Simd>(simd: S, [x]: [S::f32s; 1]) -> [S::f32s; 1] {
        [softplus_at(simd, x)]
    }
}

/// Hyperbolic tangent in every SIMD lane, by the rational approximation of [`super::activation::tanh`].
#[inline(always)]
pub(super) fn tanh_at<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let x = at_most(simd, at_least(simd, x, -TANH_CLAMP), TANH_CLAMP);
    let s = simd.mul_f32s(x, x);
    let mut p = simd.splat_f32s(TANH_P[0]);
    for &c in &TANH_P[1..] {
        p = simd.mul_add_e_f32s(p, s, simd.splat_f32s(c));
    }
    let mut q = simd.splat_f32s(TANH_Q[0]);
    for &c in &TANH_Q[1..] {
        q = simd.mul_add_e_f32s(q, s, simd.splat_f32s(c));
    }
    simd.div_f32s(simd.mul_f32s(x, p), q)
}

struct Tanh;
impl Pointwise<1, 1> for Tanh {
    #[inline(always)]
    fn evaluate<S: Simd>(simd: S, [x]: [S::f32s; 1]) -> [S::f32s; 1] {
        [tanh_at(simd, x)]
    }
}

/// Vector-Jacobian product of softplus: g sigmoid(x), with g the gradient of softplus(x).
struct SoftplusVjp;
impl Pointwise<2, 1> for SoftplusVjp {
    #[inline(always)]
    fn evaluate<S: Simd>(simd: S, [x, g]: [S::f32s; 2]) -> [S::f32s; 1] {
        let d = one_plus_exp2(simd, simd.mul_f32s(x, simd.splat_f32s(SIGMOID_SCALE)));
        [simd.div_f32s(g, d)]
    }
}

struct Kl;
impl Pointwise<4, 1> for Kl {
    #[inline(always)]
    fn evaluate<S: Simd>(simd: S, [mq, sq, mp, sp]: [S::f32s; 4]) -> [S::f32s; 1] {
        let half = simd.splat_f32s(0.5);
        let inverse = simd.div_f32s(simd.splat_f32s(1.0), sp);
        let ratio = simd.mul_f32s(sq, inverse);
        let shift = simd.mul_f32s(simd.sub_f32s(mq, mp), inverse);
        let squares = simd.mul_add_e_f32s(ratio, ratio, simd.mul_f32s(shift, shift));
        let half_squares = simd.mul_f32s(half, simd.sub_f32s(squares, simd.splat_f32s(1.0)));
        [simd.sub_f32s(half_squares, ln(simd, ratio))]
    }
}

struct KlVjp;
impl Pointwise<5, 4> for KlVjp {
    #[inline(always)]
    fn evaluate<S: Simd>(simd: S, [mq, sq, mp, sp, g]: [S::f32s; 5]) -> [S::f32s; 4] {
        let one = simd.splat_f32s(1.0);
        let (inverse_q, inverse_p) = (simd.div_f32s(one, sq), simd.div_f32s(one, sp));
        let shift = simd.mul_f32s(simd.sub_f32s(mq, mp), inverse_p);
        let ratio = simd.mul_f32s(sq, inverse_p);
        let (gp, gq) = (simd.mul_f32s(g, inverse_p), simd.mul_f32s(g, inverse_q));
        let d_mean = simd.mul_f32s(gp, shift);
        let d_sq = simd.sub_f32s(simd.mul_f32s(gp, ratio), gq);
        let squares = simd.mul_add_e_f32s(ratio, ratio, simd.mul_f32s(shift, shift));
        let d_sp = simd.mul_f32s(gp, simd.sub_f32s(one, squares));
        [d_mean, d_sq, simd.neg_f32s(d_mean), d_sp]
    }
}

struct Nll;
impl Pointwise<3, 1> for Nll {
    #[inline(always)]
    fn evaluate<S: Simd>(simd: S, [x, mean, sd]: [S::f32s; 3]) -> [S::f32s; 1] {
        let e = simd.div_f32s(simd.sub_f32s(x, mean), sd);
        let half_e = simd.mul_f32s(simd.splat_f32s(0.5), e);
        [simd.mul_add_e_f32s(half_e, e, ln(simd, sd))]
    }
}

struct NllVjp;
impl Pointwise<4, 3> for NllVjp {
    #[inline(always)]
    fn evaluate<S: Simd>(simd: S, [x, mean, sd, g]: [S::f32s; 4]) -> [S::f32s; 3] {
        let one = simd.splat_f32s(1.0);
        let inverse = simd.div_f32s(one, sd);
        let e = simd.mul_f32s(simd.sub_f32s(x, mean), inverse);
        let g = simd.mul_f32s(g, inverse);
        let d_x = simd.mul_f32s(g, e);
        [d_x, simd.neg_f32s(d_x), simd.mul_f32s(g, simd.negate_mul_add_e_f32s(e, e, one))]
    }
}

/// Computes softplus, `y = ln(1 + exp(x))`, element by element.
pub fn softplus(x: &[f32], y: &mut [f32]) {
    apply(Softplus, [x], [y], [true]);
}

/// Gradient of softplus: `dx += g sigmoid(x)`, or `dx = g sigmoid(x)` if `fresh`.
pub fn softplus_vjp(x: &[f32], g: &[f32], dx: &mut [f32], fresh: bool) {
    apply(SoftplusVjp, [x, g], [dx], [fresh]);
}

/// Computes `y = tanh x`, element by element.
pub fn tanh(x: &[f32], y: &mut [f32]) {
    apply(Tanh, [x], [y], [true]);
}

/// Computes the Kullback-Leibler divergence KL(q
/// p) of Gaussians, from `[mean_q, sd_q, mean_p, sd_p]`.
pub fn gaussian_kl(operands: [&[f32]; 4], y: &mut [f32]) {
    apply(Kl, operands, [y], [true]);
}

/// Adds the gradients of the four operands of [`gaussian_kl`]; overwrites those marked in `fresh`.
pub fn gaussian_kl_vjp([mq, sq, mp, sp]: [&[f32]; 4], g: &[f32], grads: [&mut [f32]; 4], fresh: [bool; 4]) {
    apply(KlVjp, [mq, sq, mp, sp, g], grads, fresh);
}

/// Computes the Gaussian negative log-likelihood `ln sd + (x - mean)^2 / (2 sd^2)`, from `[x, mean, sd]`.
pub fn gaussian_nll(operands: [&[f32]; 3], y: &mut [f32]) {
    apply(Nll, operands, [y], [true]);
}

/// Adds the gradients of the three operands of [`gaussian_nll`]; overwrites those marked in `fresh`.
pub fn gaussian_nll_vjp([x, mean, sd]: [&[f32]; 3], g: &[f32], grads: [&mut [f32]; 3], fresh: [bool; 3]) {
    apply(NllVjp, [x, mean, sd, g], grads, fresh);
}

#[cfg(test)]
mod tests {
    //! Contract: the error bounds in the module's documentation hold over all floats, including denormals,
    //! zero, infinities and NaN, at every level.
    use super::*;

    struct Ln;
    impl Pointwise<1, 1> for Ln {
        #[inline(always)]
        fn evaluate<S: Simd>(simd: S, [x]: [S::f32s; 1]) -> [S::f32s; 1] {
            [ln(simd, x)]
        }
    }

    /// A grid of floats over their whole range, with special values.
    fn floats() -> Vec<f32> {
        let mut x: Vec<f32> = (0..=u32::MAX).step_by(4099).map(f32::from_bits).collect();
        x.extend((0..=100_000).map(|i| 0.5 + i as f32 * 2e-5));
        x.extend([0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, 1e-45, 1e-40]);
        x
    }

    fn at_every_level<F: Pointwise<1, 1>>(_: F, check: impl Fn(Level, f32, f32)) {
        let x = floats();
        let mut y = vec![0.0; x.len()];
        for level in Level::available() {
            let (inputs, outputs, function) = ([&x[..]], [&mut y[..]], PhantomData::<F>);
            let kernel = PointwiseKernel { inputs, outputs, fresh: [true], function };
            level.run(usize::MAX, kernel);
            x.iter().zip(&y).for_each(|(x, y)| check(level, *x, *y));
        }
    }

    #[test]
    fn ln_is_within_two_ulp() {
        at_every_level(Ln, |level, x, y| {
            let want = f64::from(x).ln();
            if want.is_nan() || want.is_infinite() {
                assert!(f64::from(y) == want || (y.is_nan() && want.is_nan()), "{level:?}: ln({x}) = {y}");
            } else {
                let ulp = f64::from(f32::EPSILON) * want.abs();
                assert!((f64::from(y) - want).abs() <= 2.0 * ulp, "{level:?}: ln({x}) = {y}, not {want}");
            }
        });
    }

    #[test]
    fn tanh_is_within_4e_7_relative() {
        at_every_level(Tanh, |level, x, y| {
            let want = f64::from(x).tanh();
            let close = (f64::from(y) - want).abs() <= 4e-7 * want.abs() || (x.is_nan() && y.is_nan());
            // x P / Q of a denormal loses bits, so an absolute error of 1e-42 is accepted.
            assert!(close || (f64::from(y) - want).abs() <= 1e-42, "{level:?}: tanh({x}) = {y}");
        });
    }

    #[test]
    fn softplus_is_within_4e_7_relative_above_one() {
        at_every_level(Softplus, |level, x, y| {
            let wide = f64::from(x);
            let want = wide.max(0.0) + (-wide.abs()).exp().ln_1p();
            let close = (f64::from(y) - want).abs() <= 4e-7 * want.max(1.0);
            assert!(
                close || f64::from(y) == want || (x.is_nan() && y.is_nan()),
                "{level:?}: softplus({x}) = {y}"
            );
            // For very negative x it approaches exp(x), so a standard deviation stays positive.
            assert!(x.is_nan() || y > 0.0);
            assert!(!(-60.0..-1.0).contains(&x) || (f64::from(y) / want - 1.0).abs() < 1e-5);
        });
    }
}
