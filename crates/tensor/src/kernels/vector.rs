//! Vector operation that [`pulp::Simd`] lacks: n / (1 + 2^t), the basis of all gates.

use super::exp2;
use pulp::Simd;

/// A SIMD vector of a supported instruction set, with the operation on which the gates are based.
pub(crate) trait Vector: Simd {
    /// Returns numerator / (1 + 2^a) and numerator / (1 + 2^b), from which all gates of a GRU are computed.
    #[inline(always)]
    fn over_one_plus_exp2(self, numerator: f32, a: Self::f32s, b: Self::f32s) -> (Self::f32s, Self::f32s) {
        exp2::by_one_division(self, numerator, a, b)
    }
}

impl Vector for pulp::Scalar {}

#[cfg(target_arch = "aarch64")]
impl Vector for pulp::aarch64::Neon {}

#[cfg(target_arch = "x86_64")]
impl Vector for pulp::x86::V3 {}

#[cfg(target_arch = "x86_64")]
impl Vector for pulp::x86::V4 {
    /// Uses a table of 2^(i/32) in two registers, so that a quadratic suffices for the remainder of t.
    ///
    /// The scaling by 2^n underflows to 0 and overflows to infinity correctly, so nothing is clamped. The
    /// table lookup and the scaling run in parallel with the multiply-adds. Two divisions cost less here than
    /// one division and the products of [`exp2::by_one_division`].
    #[inline(always)]
    fn over_one_plus_exp2(self, numerator: f32, a: Self::f32s, b: Self::f32s) -> (Self::f32s, Self::f32s) {
        let k = |c: f32| self.splat_f32s(c);
        let over = |t| self.div_f32s(k(numerator), wide::one_plus_exp2(self, t));
        (over(a), over(b))
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    //! 1 + 2^t in AVX-512.

    use pulp::{Simd, cast, f32x16, x86::V4};

    /// Table of 2^(i/32) for i from 0 to 31.
    static TABLE: [f32x16; 2] = [
        f32x16(
            1.0,
            1.021_897_2,
            1.044_273_7,
            1.067_140_5,
            1.090_507_7,
            1.114_386_8,
            1.138_788_6,
            1.163_724_9,
            1.189_207_1,
            1.215_247_4,
            1.241_857_8,
            1.269_051,
            1.296_839_6,
            1.325_236_7,
            1.354_255_6,
            1.383_91,
        ),
        f32x16(
            std::f32::consts::SQRT_2,
            1.445_180_8,
            1.476_826_2,
            1.509_164_5,
            1.542_210_8,
            1.575_980_9,
            1.610_490_3,
            1.645_755_5,
            1.681_792_9,
            1.718_619_3,
            1.756_252_2,
            1.794_709_1,
            1.834_008_1,
            1.874_167_7,
            1.915_206_6,
            1.957_144_1,
        ),
    ];
    /// Rounding constant 1.5 * 2^18: adding it to t and rounding down leaves floor(32 t) in the low bits.
    const FLOOR_32T: f32 = 393_216.0;
    /// AVX-512 rounding mode: down, without floating-point exceptions.
    const ROUND_DOWN: i32 = 0x09;
    /// AVX-512 reduction mode that keeps the remainder of t after 5 binary places, between 0 and 1/32.
    const REMAINDER: i32 = (5 << 4) | ROUND_DOWN;
    /// Polynomial for (2^f - 1) / f on [0, 1/32], highest power first; minimax, relative error of 2^f 6.6e-8.
    const EXP2: [f32; 2] = [2.426_527e-1, 6.931_237_6e-1];

    /// Computes 1 + 2^t in every SIMD lane.
    #[inline(always)]
    pub fn one_plus_exp2(simd: V4, t: f32x16) -> f32x16 {
        let k = |c: f32| simd.splat_f32s(c);
        let f = cast(simd.avx512dq._mm512_reduce_ps::<REMAINDER>(cast(t)));
        let index = cast(simd.avx512f._mm512_add_round_ps::<ROUND_DOWN>(cast(t), cast(k(FLOOR_32T))));
        let root = simd.avx512f._mm512_permutex2var_ps(cast(TABLE[0]), index, cast(TABLE[1]));
        let scale = cast(simd.avx512f._mm512_scalef_ps(root, cast(t)));
        let p = simd.mul_add_e_f32s(k(EXP2[0]), f, k(EXP2[1]));
        simd.mul_add_e_f32s(simd.mul_add_e_f32s(p, f, k(1.0)), scale, k(1.0))
    }
}
