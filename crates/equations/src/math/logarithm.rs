//! Natural logarithm.
//!
//! `ln x = k ln 2 + ln(1 + f)` with `1 + f` between sqrt(1/2) and sqrt(2), and the series of fdlibm in `s = f
//! / (2 + f)`.

use super::polynomial;

/// High part of ln 2, whose products with whole numbers are exact.
const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
/// Low part of ln 2: the remainder of ln 2 after its high part.
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Bit pattern of sqrt(1/2): fractions are scaled to lie between sqrt(1/2) and sqrt(2), that is, around 1.
const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;

/// Computes the natural logarithm of `x`.
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    // Subnormal numbers are multiplied by 2^54 first.
    let is_subnormal = x < f64::MIN_POSITIVE;
    let normal = if is_subnormal { x * 18_014_398_509_481_984.0 } else { x };
    let bits = normal.to_bits();
    // The exponent of 2, offset so that it stays positive: the shift then needs no sign.
    let shifted = bits.wrapping_sub(SQRT_HALF).wrapping_add(2048 << 52);
    let exponent = (shifted >> 52) & 0xfff;
    let fraction = f64::from_bits(bits.wrapping_sub(exponent.wrapping_sub(2048) << 52));
    // A double with exponent 52 equals 2^52 plus the whole number in its low bits, which converts without an
    // instruction.
    let k = f64::from_bits(0x4330_0000_0000_0000 | exponent) - 4_503_599_627_370_496.0 - 2048.0;
    let k = if is_subnormal { k - 54.0 } else { k };
    let f = fraction - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let r = z * polynomial(
        z,
        [
            1.479_819_860_511_658_6e-1,
            1.531_383_769_920_937_3e-1,
            1.818_357_216_161_805e-1,
            2.222_219_843_214_978_4e-1,
            2.857_142_874_366_239e-1,
            3.999_999_999_940_942e-1,
            6.666_666_666_666_735e-1,
        ],
    );
    let half = 0.5 * f * f;
    let value = k.mul_add(LN2_HIGH, -((half - s.mul_add(half + r, k * LN2_LOW)) - f));
    let value = if x == 0.0 { f64::NEG_INFINITY } else { value };
    let value = if x < 0.0 { f64::NAN } else { value };
    if x < f64::INFINITY { value } else { x }
}
