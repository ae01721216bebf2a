//! Exponential decay, computed where it is used: sums over patches spend most of their time in it.

/// Ratio above which the decay is 0. There it is less than the rounding error of a factor `1 + decay`.
const NEGLIGIBLE_RATIO: f64 = 40.0;
/// Two parts of ln 2. The first has 32 bits, so that its product with a small integer is exact.
const LN2_PARTS: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
/// `1 / k!` for k from 0 to 13.
const RECIPROCAL_FACTORIALS: [f64; 14] = {
    let mut c = [1.0; 14];
    let mut k = 1;
    while k < 14 {
        c[k] = c[k - 1] / k as f64;
        k += 1;
    }
    c
};
/// Added to a number and subtracted again, it rounds the number to an integer, which stays in the lowest bits of the sum.
const ROUNDER: f64 = 1.5 * (1u64 << 52) as f64;

/// `exp(-ratio)` for a ratio of at least 0; 0 for ratios above 40.
///
/// The relative error is at most 4e-16. The argument is reduced to at most ln 2 / 2 (Cody and Waite, Software Manual for
/// the Elementary Functions, 1980), where a Taylor polynomial of degree 13 has an error of 4e-18.
#[inline(always)]
pub(super) fn decay(ratio: f64) -> f64 {
    let x = -ratio.min(NEGLIGIBLE_RATIO);
    let shifted = x * std::f64::consts::LOG2_E + ROUNDER;
    let n = shifted - ROUNDER;
    let r = (x - n * LN2_PARTS[0]) - n * LN2_PARTS[1];
    let sum = RECIPROCAL_FACTORIALS.iter().rev().fold(0.0, |sum, c| sum * r + c);
    // 2^n: the integer n, with the offset of the exponent, moved to the bits of the exponent.
    let power = f64::from_bits((shifted.to_bits().wrapping_add(1023)) << 52);
    if ratio < NEGLIGIBLE_RATIO { sum * power } else { 0.0 }
}

#[cfg(test)]
mod tests {
    //! Contract: the values are those of the library, and vanish where a factor `1 + decay` would not show them.

    use super::*;

    #[test]
    fn agrees_with_the_exponential_function() {
        for n in 0..=40_000 {
            let ratio = f64::from(n) * 0.999_9e-3;
            let (value, expected) = (decay(ratio), (-ratio).exp());
            assert!((value - expected).abs() <= 4e-16 * expected, "{ratio}: {value:e}, {expected:e}");
        }
        assert_eq!(decay(0.0), 1.0);
        assert!(decay(1e-300) == 1.0 && (1.0 - decay(1e-9) - 1e-9).abs() < 1e-16);
    }

    #[test]
    fn vanishes_where_it_is_below_rounding() {
        for ratio in [40.0, 700.0, 1e300, f64::INFINITY] {
            assert_eq!(decay(ratio), 0.0);
        }
        assert_eq!(1.0 + decay(39.999), 1.0);
    }
}
