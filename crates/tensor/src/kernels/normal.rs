//! Standard normal random numbers in SIMD lanes, with an independent generator per lane.
//!
//! The generator is xoshiro128++ (Blackman and Vigna 2021). Normal numbers come from the transform of Box and
//! Muller (Annals of Mathematical Statistics 29, 1958), two from two words; the uniform number of the radius
//! has 24 bits, so no number exceeds 5.77. The numbers of a lane depend only on its seed, not on the other
//! lanes.

use super::lanes::MAX_LANES;
use super::pointwise::ln;
use super::vector::Vector;
use crate::simd::{Kernel, Level};
use pulp::Simd;

/// Generators of standard normal random numbers, one for each of up to 16 SIMD lanes.
#[derive(Debug, Clone)]
pub struct NormalLanes {
    state: [[u32; MAX_LANES]; 4],
    lanes: usize,
}

impl NormalLanes {
    /// Maximum number of lanes, each with its own generator.
    pub const MAX: usize = MAX_LANES;

    /// Creates one generator for each of the first [`NormalLanes::MAX`] seeds.
    ///
    /// Seeds should come from a good generator, because they are the state; a seed of zeros is replaced.
    pub fn new(seeds: impl IntoIterator<Item = [u64; 2]>) -> Self {
        let mut state = [[1; MAX_LANES]; 4];
        let mut lanes = 0;
        for (lane, [a, b]) in seeds.into_iter().take(MAX_LANES).enumerate() {
            let b = if a == 0 && b == 0 { 1 } else { b };
            let words = [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32];
            for (state, word) in state.iter_mut().zip(words) {
                state[lane] = word;
            }
            lanes = lane + 1;
        }
        NormalLanes { state, lanes }
    }

    /// Number of lanes in use: independent generators.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Fills `out [rows, lanes]` with the next standard normal numbers of every lane.
    ///
    /// Rows are generated in pairs; for an odd number of rows the second row of the last pair is discarded.
    pub fn fill(&mut self, out: &mut [f32]) {
        self.fill_at(Level::current(), out);
    }

    /// Runs [`NormalLanes::fill`] with a given instruction set.
    pub fn fill_at(&mut self, level: Level, out: &mut [f32]) {
        if self.lanes > 0 {
            level.run(self.lanes, Fill(self, out));
        }
    }
}

struct Fill<'a>(&'a mut NormalLanes, &'a mut [f32]);

impl Kernel for Fill<'_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        let Fill(NormalLanes { state, lanes }, out) = self;
        let lanes = *lanes;
        for first in (0..lanes).step_by(S::F32_LANES) {
            let count = S::F32_LANES.min(lanes - first);
            let mut s = [simd.splat_u32s(0); 4];
            for (s, from) in s.iter_mut().zip(state.iter()) {
                *s = simd.partial_load_u32s(&from[first..first + S::F32_LANES]);
            }
            let whole = if lanes == S::F32_LANES { out.len() / (2 * lanes) * 2 * lanes } else { 0 };
            let (head, remaining) = out.split_at_mut(whole);
            for rows in S::as_mut_simd_f32s(head).0.as_chunks_mut::<2>().0 {
                let (a, b) = box_muller(simd, next(simd, &mut s), next(simd, &mut s));
                *rows = [a, b];
            }
            for rows in remaining.chunks_mut(2 * lanes) {
                let (a, b) = box_muller(simd, next(simd, &mut s), next(simd, &mut s));
                let mut rows = rows.chunks_exact_mut(lanes);
                for v in [a, b] {
                    if let Some(row) = rows.next() {
                        simd.partial_store_f32s(&mut row[first..first + count], v);
                    }
                }
            }
            for (s, to) in s.into_iter().zip(state.iter_mut()) {
                simd.partial_store_u32s(&mut to[first..first + S::F32_LANES], s);
            }
        }
    }
}

/// Rotates the bits of every lane of `x` to the left.
#[inline(always)]
fn rotate<S: Simd>(simd: S, x: S::u32s, by: u32) -> S::u32s {
    let left = simd.wrapping_dyn_shl_u32s(x, simd.splat_u32s(by));
    simd.or_u32s(left, simd.wrapping_dyn_shr_u32s(x, simd.splat_u32s(32 - by)))
}

/// Advances the xoshiro128++ generator of every lane; returns its next 32-bit words.
#[inline(always)]
fn next<S: Simd>(simd: S, s: &mut [S::u32s; 4]) -> S::u32s {
    let result = simd.add_u32s(rotate(simd, simd.add_u32s(s[0], s[3]), 7), s[0]);
    let t = simd.wrapping_dyn_shl_u32s(s[1], simd.splat_u32s(9));
    s[2] = simd.xor_u32s(s[2], s[0]);
    s[3] = simd.xor_u32s(s[3], s[1]);
    s[1] = simd.xor_u32s(s[1], s[2]);
    s[0] = simd.xor_u32s(s[0], s[3]);
    s[2] = simd.xor_u32s(s[2], t);
    s[3] = rotate(simd, s[3], 11);
    result
}

/// Polynomial in t^2 for sin(pi t) / t on |t| <= 1/2, highest power first; minimax error 1.4e-8.
const SIN: [f32; 5] = [7.765_940_6e-2, -5.982_922e-1, 2.550_077_7, -5.167_710_3, std::f32::consts::PI];
/// Polynomial in t^2 for cos(pi t) on |t| <= 1/2, highest power first; minimax error 2e-10.
const COS: [f32; 6] = [-2.439_671_8e-2, 2.349_375_6e-1, -1.335_212_1, 4.058_709, -4.934_802, 1.0];

/// Evaluates a polynomial at `x`; coefficients of the highest power first.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, x: S::f32s, coefficients: [f32; N]) -> S::f32s {
    let mut p = simd.splat_f32s(coefficients[0]);
    for &c in &coefficients[1..] {
        p = simd.mul_add_e_f32s(p, x, simd.splat_f32s(c));
    }
    p
}

/// Converts the upper 24 bits of `x` to a float, in two halves of 12 bits that fit into a mantissa.
#[inline(always)]
fn upper_bits<S: Simd>(simd: S, x: S::u32s) -> S::f32s {
    let bits = |c: u32| simd.splat_u32s(c);
    let x = simd.wrapping_dyn_shr_u32s(x, bits(8));
    let high = simd.or_u32s(simd.wrapping_dyn_shr_u32s(x, bits(12)), bits(0x4b00_0000));
    let low = simd.or_u32s(simd.and_u32s(x, bits(0xfff)), bits(0x4b00_0000));
    let shift = simd.splat_f32s(8_388_608.0);
    let high = simd.sub_f32s(simd.transmute_f32s_u32s(high), shift);
    let low = simd.sub_f32s(simd.transmute_f32s_u32s(low), shift);
    simd.mul_add_e_f32s(high, simd.splat_f32s(4096.0), low)
}

/// Computes two normal numbers from two words: sqrt(-2 ln u) times cosine and sine of a uniform angle.
#[inline(always)]
fn box_muller<S: Simd>(simd: S, a: S::u32s, b: S::u32s) -> (S::f32s, S::f32s) {
    let k = |c: f32| simd.splat_f32s(c);
    // u is in (0, 1], so that its logarithm is finite; t is in [-1/2, 1/2).
    let u = simd.mul_f32s(simd.add_f32s(upper_bits(simd, a), k(1.0)), k(1.0 / 16_777_216.0));
    let t = simd.mul_add_e_f32s(upper_bits(simd, b), k(1.0 / 16_777_216.0), k(-0.5));
    let radius = simd.sqrt_f32s(simd.mul_f32s(k(-2.0), ln(simd, u)));
    let square = simd.mul_f32s(t, t);
    let sin = simd.mul_f32s(t, polynomial(simd, square, SIN));
    let cos = polynomial(simd, square, COS);
    // Double-angle formulas: pi t covers half a circle, 2 pi t the whole one.
    let cos_double = simd.negate_mul_add_e_f32s(simd.add_f32s(sin, sin), sin, k(1.0));
    let sin_double = simd.mul_f32s(simd.add_f32s(sin, sin), cos);
    (simd.mul_f32s(radius, cos_double), simd.mul_f32s(radius, sin_double))
}

#[cfg(test)]
mod tests {
    //! Contract: the numbers are standard normal (moments to 5 standard errors, Kolmogorov-Smirnov at 1e-4),
    //! a lane does not depend on the others, lanes and rows are uncorrelated, and levels agree except for
    //! rounding.
    use super::*;

    /// Seed of a lane, with well-mixed bits.
    fn seed(lane: u64) -> [u64; 2] {
        let mix = |z: u64| {
            let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        [mix(2 * lane + 1), mix(2 * lane + 2)]
    }

    fn draws(level: Level, lanes: std::ops::Range<u64>, rows: usize) -> Vec<f32> {
        let mut out = vec![0.0; rows * (lanes.end - lanes.start) as usize];
        NormalLanes::new(lanes.map(seed)).fill_at(level, &mut out);
        out
    }

    /// Standard normal distribution function (Abramowitz and Stegun 26.2.17, error 7.5e-8).
    fn cdf(x: f64) -> f64 {
        let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
        let poly = t
            * (0.319_381_530
                + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
        let tail = (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt() * poly;
        if x > 0.0 { 1.0 - tail } else { tail }
    }

    #[test]
    fn draws_are_standard_normal() {
        let mut x: Vec<f64> = draws(Level::current(), 0..16, 20_000).into_iter().map(f64::from).collect();
        let n = x.len() as f64;
        let moment = |k: i32| x.iter().map(|v| v.powi(k)).sum::<f64>() / n;
        for (k, want, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
            let error: f64 = moment(k) - want;
            assert!(error.abs() < 5.0 * (variance / n).sqrt(), "moment {k} is off by {error}");
        }
        x.sort_by(f64::total_cmp);
        let distance = x.iter().enumerate().map(|(i, v)| (cdf(*v) - (i as f64 + 0.5) / n).abs());
        let distance = distance.fold(0.0, f64::max);
        assert!(distance * n.sqrt() < 2.23, "Kolmogorov-Smirnov distance {distance}");
    }

    #[test]
    fn a_lane_depends_neither_on_other_lanes_nor_on_the_batch_size() {
        let sixteen = draws(Level::current(), 0..16, 10);
        for lanes in [1, 3, 8, 9] {
            let fewer = draws(Level::current(), 0..lanes as u64, 10);
            for (i, v) in fewer.iter().enumerate() {
                assert_eq!(*v, sixteen[i / lanes * 16 + i % lanes], "{lanes} lanes, draw {i}");
            }
        }
        let mut parts = vec![0.0; 160];
        let mut normals = NormalLanes::new((0..16).map(seed));
        normals.fill(&mut parts[..64]);
        normals.fill(&mut parts[64..]);
        assert_eq!(parts, sixteen);
    }

    #[test]
    fn lanes_and_rows_are_uncorrelated() {
        let (rows, lanes) = (20_000, 16);
        let x = draws(Level::current(), 0..16, rows);
        for (step, what) in [(1, "lanes"), (lanes, "rows"), (2 * lanes, "pairs of rows")] {
            let n = x.len() - step;
            let r: f64 = (0..n).map(|i| f64::from(x[i]) * f64::from(x[i + step])).sum::<f64>() / n as f64;
            assert!(r.abs() < 5.0 / (n as f64).sqrt(), "{what}: correlation {r}");
        }
    }

    #[test]
    fn levels_agree() {
        let want = draws(Level::Scalar, 0..16, 500);
        for level in Level::available() {
            for (got, want) in draws(level, 0..16, 500).iter().zip(&want) {
                assert!((got - want).abs() <= 3e-6, "{level:?}: {got}, scalar {want}");
            }
        }
    }
}
