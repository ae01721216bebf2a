//! Exponential and hyperbolic tangent.
//!
//! `e^x = 2^n e^r` with `n` the whole number nearest to `x / ln 2`, `r = x - n ln 2` computed with `ln 2` in
//! two parts, and the Taylor series of `e^r`.

use super::{ROUNDER, polynomial};

/// High part of ln 2, whose products with whole numbers are exact.
const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
/// Low part of ln 2: the remainder of ln 2 after its high part.
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Computes `e^x`.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    // The result is 0 or infinite beyond these bounds; NaN passes both comparisons unchanged.
    let x = if x < -760.0 { -760.0 } else { x };
    let x = if x > 720.0 { 720.0 } else { x };
    let shifted = x.mul_add(std::f64::consts::LOG2_E, ROUNDER);
    let n = shifted - ROUNDER;
    let r = (-n).mul_add(LN2_LOW, (-n).mul_add(LN2_HIGH, x));
    // Taylor series to the 13th power: |r| <= 0.347, so that the remainder is below 5e-18.
    let p = polynomial(
        r,
        [
            1.605_904_383_682_161_5e-10,
            2.087_675_698_786_81e-9,
            2.505_210_838_544_172e-8,
            2.755_731_922_398_589e-7,
            2.755_731_922_398_589_4e-6,
            2.480_158_730_158_73e-5,
            1.984_126_984_126_984e-4,
            1.388_888_888_888_889e-3,
            8.333_333_333_333_333e-3,
            4.166_666_666_666_666_4e-2,
            1.666_666_666_666_666_6e-1,
            0.5,
            1.0,
            1.0,
        ],
    );
    // 2^n as a product of two factors, because n can exceed the exponent range of a double: n = first +
    // second.
    let whole = shifted.to_bits().wrapping_sub(ROUNDER.to_bits());
    let first = (whole.wrapping_add(4096) >> 1).wrapping_sub(2048);
    let second = whole.wrapping_sub(first);
    let two_to = |n: u64| f64::from_bits(n.wrapping_add(1023) << 52);
    p * two_to(first) * two_to(second)
}

/// Computes `tanh x`: a quotient of polynomials below 0.625 (Cephes), `(e^2x - 1) / (e^2x + 1)` above.
///
/// One division serves both cases.
#[inline(always)]
pub(crate) fn tanh(x: f64) -> f64 {
    let size = x.abs();
    let z = x * x;
    let denominator =
        polynomial(z, [1.0, 1.128_116_784_916_329_3e2, 2.235_488_390_601_004_5e3, 4.844_063_053_251_255e3]);
    let p = polynomial(z, [-9.643_991_794_250_523e-1, -9.928_772_310_019_185e1, -1.614_687_684_417_084_5e3]);
    // tanh has reached 1 to the last bit at 20.
    let e = exp(2.0 * if size > 20.0 { 20.0 } else { size });
    let small = size < 0.625;
    let numerator = if small { size * z.mul_add(p, denominator) } else { e - 1.0 };
    let quotient = numerator / if small { denominator } else { e + 1.0 };
    quotient.copysign(x)
}
