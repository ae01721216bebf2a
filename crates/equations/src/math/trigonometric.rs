//! Sine and cosine.

use super::{ROUNDER, polynomial};

/// Second part of pi/2: what remains of pi/2 after its value as a double.
const HALF_PI_MIDDLE: f64 = 6.123_233_995_736_766e-17;
/// Third part of pi/2: what remains after the first two.
const HALF_PI_LOW: f64 = -1.497_384_904_859_183_3e-33;

/// Computes `sin x`, x in radians.
#[inline(always)]
pub(crate) fn sin(x: f64) -> f64 {
    let (sine, cosine, quarter) = reduce(x);
    with_sign_flipped(if quarter & 1 == 0 { sine } else { cosine }, quarter & 2)
}

/// Computes `cos x`, x in radians.
#[inline(always)]
pub(crate) fn cos(x: f64) -> f64 {
    let (sine, cosine, quarter) = reduce(x);
    with_sign_flipped(if quarter & 1 == 0 { cosine } else { sine }, quarter.wrapping_add(1) & 2)
}

/// Changes the sign of `value` if `flip` is 2; keeps it if `flip` is 0.
#[inline(always)]
fn with_sign_flipped(value: f64, flip: u64) -> f64 {
    f64::from_bits(value.to_bits() ^ (flip << 62))
}

/// Reduces an angle: sine and cosine of `x` minus the nearest multiple of pi/2, and the number of that multiple.
///
/// Cody and Waite's reduction with pi/2 in three parts; the fused products are exact, so that it holds for
/// arguments up to 1e9. Beyond about 1e15 the number of quarter turns is lost; the result then has no meaning
/// but stays bounded.
#[inline(always)]
fn reduce(x: f64) -> (f64, f64, u64) {
    let shifted = x.mul_add(std::f64::consts::FRAC_2_PI, ROUNDER);
    let n = shifted - ROUNDER;
    let high = (-n).mul_add(std::f64::consts::FRAC_PI_2, x);
    let r = (-n).mul_add(HALF_PI_LOW, (-n).mul_add(HALF_PI_MIDDLE, high));
    let r = if r.abs() > 1.0 { 0.0 } else { r };
    let z = r * r;
    let s = polynomial(
        z,
        [
            1.589_690_995_211_55e-10,
            -2.505_076_025_340_686_3e-8,
            2.755_731_370_707_006_8e-6,
            -1.984_126_982_985_795e-4,
            8.333_333_333_322_49e-3,
            -1.666_666_666_666_663_2e-1,
        ],
    );
    let c = polynomial(
        z,
        [
            -1.135_964_755_778_819_5e-11,
            2.087_572_321_298_175e-9,
            -2.755_731_435_139_066_3e-7,
            2.480_158_728_947_673e-5,
            -1.388_888_888_887_411e-3,
            4.166_666_666_666_66e-2,
        ],
    );
    let sine = (z * r).mul_add(s, r);
    let half = 0.5 * z;
    let w = 1.0 - half;
    // 1 - half is rounded; the difference is added back.
    let cosine = w + ((1.0 - w - half) + z * z * c);
    (sine, cosine, shifted.to_bits())
}
