//! Elementary functions without branches, so that a loop over lanes becomes vector code.
//!
//! They give the same bits in every instruction set and for any number of lanes. The standard library's
//! functions are called for one number at a time.
//!
//! Sources: reductions and polynomials of fdlibm (Sun Microsystems, 1993) and Cephes (Moshier, 1992).

mod exponential;
mod logarithm;
mod trigonometric;

pub(crate) use exponential::{exp, tanh};
pub(crate) use logarithm::ln;
pub(crate) use trigonometric::{cos, sin};

/// The number 1.5 * 2^52: adding and then subtracting it rounds a number to a whole one.
///
/// After the addition the whole number is in the low bits of the sum.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Evaluates a polynomial in `x` by Horner's scheme, highest coefficient first.
#[inline(always)]
fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    // A plain loop, because an iterator's closure may remain a separate function, compiled for the lowest
    // instruction set.
    let mut sum = 0.0_f64;
    for c in coefficients {
        sum = sum.mul_add(x, c);
    }
    sum
}

#[cfg(test)]
mod tests {
    //! Contract: each function agrees with the standard library's to a few units in the last place, and
    //! equals it at zeros, infinities and NaN.
    use super::*;

    fn close(name: &str, x: f64, ours: f64, theirs: f64, ulps: f64) {
        if theirs.is_nan() {
            assert!(ours.is_nan(), "{name}({x}) = {ours}, not NaN");
        } else if theirs.is_infinite() {
            assert_eq!(ours, theirs, "{name}({x})");
        } else {
            let unit = (theirs.abs() * f64::EPSILON).max(f64::MIN_POSITIVE);
            assert!((ours - theirs).abs() <= ulps * unit, "{name}({x}) = {ours}, expected {theirs}");
        }
    }

    fn arguments() -> impl Iterator<Item = f64> {
        let steps = (0..40_000).map(|i| f64::from(i - 20_000) * 0.037_1);
        let scales = (-1070..1023).flat_map(|e| [1.0, 1.37, -1.91].map(|m| m * 2.0_f64.powi(e)));
        let special = [0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, f64::MAX, f64::MIN_POSITIVE];
        steps.chain(scales).chain(special)
    }

    #[test]
    fn every_function_agrees_with_the_standard_library() {
        for x in arguments() {
            close("exp", x, exp(x), x.exp(), 2.0);
            close("tanh", x, tanh(x), x.tanh(), 4.0);
            close("ln", x, ln(x), x.ln(), 2.0);
        }
    }

    #[test]
    fn sine_and_cosine_agree_within_the_range_of_their_reduction() {
        for x in arguments() {
            if x.abs() < 1e9 || !x.is_finite() {
                close("sin", x, sin(x), x.sin(), 2.0);
                close("cos", x, cos(x), x.cos(), 2.0);
            } else {
                assert!(sin(x).abs() <= 1.0 && cos(x).abs() <= 1.0, "{x}");
            }
        }
    }
}
