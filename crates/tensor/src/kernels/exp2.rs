//! 2^t in SIMD lanes, the basis of the gates of a GRU.

use super::lanes::{at_least, at_most};
use pulp::Simd;

/// Bound to which |t| is clamped in 1 + 2^t: the product of two factors of at most 1 + 2^43 is finite.
const MAX_EXPONENT: f32 = 43.0;
/// Rounding constant 1.5 * 2^23 + 127: adding it rounds to the nearest integer n, left as n + 127 in the low bits.
///
/// n + 127 is the biased exponent of 2^n.
const ROUND: f32 = 12_582_912.0 + 127.0;
/// Polynomial for (2^f - 1) / f on |f| <= 1/2, highest power first; minimax, relative error of 2^f 9.2e-8.
#[expect(clippy::approx_constant, reason = "a fitted coefficient near ln 2, not ln 2")]
const EXP2: [f32; 5] = [1.326_472_7e-3, 9.671_513e-3, 5.550_733_6e-2, 2.402_224_2e-1, 6.931_47e-1];

/// Splits 2^t into factors: returns 2^n and 2^f, where t = n + f with an integer n and |f| <= 1/2.
///
/// t must be between -126 and 126.
#[inline(always)]
fn powers<S: Simd>(simd: S, t: S::f32s) -> (S::f32s, S::f32s) {
    let k = |c: f32| simd.splat_f32s(c);
    let rounded = simd.add_f32s(t, k(ROUND));
    let f = simd.sub_f32s(t, simd.sub_f32s(rounded, k(ROUND)));
    let bits = simd.transmute_u32s_f32s(rounded);
    let power = simd.transmute_f32s_u32s(simd.wrapping_dyn_shl_u32s(bits, simd.splat_u32s(23)));
    let mut p = k(EXP2[0]);
    for &c in &EXP2[1..] {
        p = simd.mul_add_e_f32s(p, f, k(c));
    }
    (power, simd.mul_add_e_f32s(p, f, k(1.0)))
}

/// Computes 1 + 2^t, with t clamped to +-43.
#[inline(always)]
pub(crate) fn one_plus_exp2<S: Simd>(simd: S, t: S::f32s) -> S::f32s {
    let k = |c: f32| simd.splat_f32s(c);
    let t = at_most(simd, at_least(simd, t, -MAX_EXPONENT), MAX_EXPONENT);
    let (n, f) = powers(simd, t);
    simd.mul_add_e_f32s(f, n, k(1.0))
}

/// Computes 2^t for t <= 0; 2^-126 if t < -126.
#[inline(always)]
pub(crate) fn exp2<S: Simd>(simd: S, t: S::f32s) -> S::f32s {
    let (n, f) = powers(simd, at_least(simd, t, -126.0));
    simd.mul_f32s(f, n)
}

/// Returns numerator / (1 + 2^a) and numerator / (1 + 2^b), with one division for both.
#[inline(always)]
pub(crate) fn by_one_division<S: Simd>(
    simd: S,
    numerator: f32,
    a: S::f32s,
    b: S::f32s,
) -> (S::f32s, S::f32s) {
    let (a, b) = (one_plus_exp2(simd, a), one_plus_exp2(simd, b));
    let both = simd.div_f32s(simd.splat_f32s(numerator), simd.mul_f32s(a, b));
    (simd.mul_f32s(b, both), simd.mul_f32s(a, both))
}
