//! Branch-free `exp`, `tanh`, `sigmoid` and `softplus` in single precision.
//!
//! The compiler can vectorise them in a loop; the SIMD kernels have their own versions. Error bounds, tested
//! against f64: `exp` 2 ulp on [-87, 88] (clamped outside), `tanh` 4e-7 relative, `sigmoid` 3e-7 absolute,
//! `softplus` 4e-7 relative to max(1, |y|).

const LOG2_E: f32 = std::f32::consts::LOG2_E;
/// First part of ln 2, split (Cody and Waite) so that n * LN2_HI is exact for every n that occurs.
const LN2_HI: f32 = 0.693_359_4;
const LN2_LO: f32 = -2.121_944_4e-4;
/// Rounding constant 1.5 * 2^23: adding it rounds to the nearest integer, which is left in the low bits.
const ROUND: f32 = 12_582_912.0;
const EXP_MIN: f32 = -87.0;
const EXP_MAX: f32 = 88.0;
/// Coefficients of a polynomial for exp(r) on |r| <= ln 2 / 2, minimax (Cephes expf).
const EXP_POLY: [f32; 6] =
    [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5];

/// Largest |x| of the rational approximation tanh(x) = x P(x^2) / Q(x^2), minimax.
pub(crate) const TANH_CLAMP: f32 = 7.905_311;
/// Coefficients of P in the approximation tanh(x) = x P(x^2) / Q(x^2), highest power first.
pub(crate) const TANH_P: [f32; 7] = [
    -2.760_768_5e-16,
    2.000_188e-13,
    -8.604_672e-11,
    5.122_297e-8,
    1.485_722_4e-5,
    6.372_619_3e-4,
    4.893_524_6e-3,
];
/// Coefficients of Q in the approximation tanh(x) = x P(x^2) / Q(x^2), highest power first.
pub(crate) const TANH_Q: [f32; 4] = [1.198_258_4e-6, 1.185_347_1e-4, 2.268_434_6e-3, 4.893_525e-3];
/// Polynomial for ln(1 + u) / u on [0, 1], highest power first; near-minimax, relative error 6e-8.
pub(crate) const LN1P_POLY: [f32; 9] = [
    5.253_458e-3,
    -2.958_850_7e-2,
    7.836_167e-2,
    -1.367_477e-1,
    1.911_143e-1,
    -2.484_437e-1,
    3.331_927e-1,
    -4.999_95e-1,
    1.0,
];

/// Exponential function of x; x is clamped to [-87, 88].
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let x = x.clamp(EXP_MIN, EXP_MAX);
    let t = x * LOG2_E + ROUND;
    let n = t - ROUND;
    let r = x - n * LN2_HI - n * LN2_LO;
    let mut p = EXP_POLY[0];
    for c in &EXP_POLY[1..] {
        p = p * r + c;
    }
    let y = p * (r * r) + r + 1.0;
    f32::from_bits(y.to_bits().wrapping_add(t.to_bits() << 23))
}

/// Hyperbolic tangent of x.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let x = x.clamp(-TANH_CLAMP, TANH_CLAMP);
    let s = x * x;
    let mut p = TANH_P[0];
    for c in &TANH_P[1..] {
        p = p * s + c;
    }
    let mut q = TANH_Q[0];
    for c in &TANH_Q[1..] {
        q = q * s + c;
    }
    x * p / q
}

/// Logistic function of x, computed as (1 + tanh(x / 2)) / 2.
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    tanh(x * 0.5) * 0.5 + 0.5
}

/// Softplus function ln(1 + exp(x)), computed as max(x, 0) + ln(1 + exp(-|x|)).
#[inline(always)]
pub fn softplus(x: f32) -> f32 {
    let u = exp(-x.abs());
    let mut p = LN1P_POLY[0];
    for c in &LN1P_POLY[1..] {
        p = p * u + c;
    }
    x.max(0.0) + u * p
}

#[cfg(test)]
mod tests {
    //! Contract: the error bounds in the module's documentation hold over the range that the networks use.
    use super::*;

    fn grid(lo: f32, hi: f32) -> impl Iterator<Item = f32> {
        (0..=200_000).map(move |i| lo + (hi - lo) * (i as f32 / 200_000.0))
    }

    #[test]
    fn exp_is_within_two_ulp() {
        for x in grid(-87.0, 88.0) {
            let want = f64::from(x).exp();
            let ulp = f64::from(f32::EPSILON) * want;
            assert!((f64::from(exp(x)) - want).abs() <= 2.0 * ulp, "exp({x}) = {} want {want}", exp(x));
        }
    }

    #[test]
    fn tanh_is_within_4e_7_relative_and_odd() {
        for x in grid(-12.0, 12.0).chain([1e-30, 1e-10, 1e-4, -1e-6, f32::MAX, f32::INFINITY]) {
            let want = f64::from(x).tanh();
            assert!((f64::from(tanh(x)) - want).abs() <= 4e-7 * want.abs(), "tanh({x}) = {}", tanh(x));
            assert_eq!(tanh(-x), -tanh(x));
        }
    }

    #[test]
    fn sigmoid_is_within_3e_7_absolute() {
        for x in grid(-40.0, 40.0) {
            let want = 1.0 / (1.0 + (-f64::from(x)).exp());
            assert!((f64::from(sigmoid(x)) - want).abs() <= 3e-7, "sigmoid({x}) = {}", sigmoid(x));
        }
    }

    #[test]
    fn softplus_is_within_4e_7_relative_above_one() {
        for x in grid(-80.0, 80.0) {
            let want = f64::from(x).exp().ln_1p();
            let tolerance = 4e-7 * want.max(1.0);
            assert!((f64::from(softplus(x)) - want).abs() <= tolerance, "softplus({x}) = {}", softplus(x));
        }
        // For very negative x it approaches exp(x) with a small relative error, so a standard deviation stays
        // positive.
        let x = -20.0_f32;
        assert!((softplus(x) / (-20.0_f64).exp() as f32 - 1.0).abs() < 1e-5);
    }

    #[test]
    fn nan_stays_nan() {
        assert!(exp(f32::NAN).is_nan() && tanh(f32::NAN).is_nan() && softplus(f32::NAN).is_nan());
    }
}
