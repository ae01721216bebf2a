//! Samples from the Gaussian that an output layer predicts, in one pass over memory.

use super::pointwise::softplus_at;
use super::vector::Vector;
use crate::simd::{Kernel, Level};

/// Arguments of [`draw`], for T steps, L values per step and B sequences.
#[derive(Debug)]
pub struct Draw<'a> {
    /// Outputs of the layer `[T, 2 L, B]`: means, then the standard deviations before softplus.
    pub heads: &'a [f32],
    /// Standard normal random numbers `[T, L, B]`, one per sample.
    pub eps: &'a [f32],
    /// Value that is added to the standard deviations after softplus.
    pub floor: f32,
    /// Number of samples per time step, L B.
    pub row: usize,
    /// Output of the kernel: the samples `[T, L, B]`.
    pub z: &'a mut [f32],
}

/// Draws samples `z = mean + eps (softplus(raw) + floor)` of all steps.
pub fn draw(args: Draw<'_>) {
    draw_at(Level::current(), args);
}

/// Runs [`draw`] with a given instruction set.
pub fn draw_at(level: Level, args: Draw<'_>) {
    if args.row > 0 {
        level.run(args.row, args);
    }
}

impl Kernel for Draw<'_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        let floor = simd.splat_f32s(self.floor);
        let steps = self.z.chunks_exact_mut(self.row).zip(self.eps.chunks_exact(self.row));
        for ((z, eps), heads) in steps.zip(self.heads.chunks_exact(2 * self.row)) {
            let (mean, raw) = heads.split_at(self.row);
            let (mean, raw, eps) = (S::as_simd_f32s(mean), S::as_simd_f32s(raw), S::as_simd_f32s(eps));
            let z = S::as_mut_simd_f32s(z);
            for (((z, mean), raw), eps) in z.0.iter_mut().zip(mean.0).zip(raw.0).zip(eps.0) {
                *z = sample(simd, floor, [*mean, *raw, *eps]);
            }
            if !z.1.is_empty() {
                let mut x = [floor; 3];
                for (x, from) in x.iter_mut().zip([mean, raw, eps]) {
                    *x = simd.partial_load_f32s(from.1);
                }
                simd.partial_store_f32s(z.1, sample(simd, floor, x));
            }
        }
    }
}

/// Computes one vector of samples.
#[inline(always)]
fn sample<S: Vector>(simd: S, floor: S::f32s, [mean, raw, eps]: [S::f32s; 3]) -> S::f32s {
    simd.mul_add_e_f32s(eps, simd.add_f32s(softplus_at(simd, raw), floor), mean)
}

#[cfg(test)]
mod tests {
    //! Contract: every level agrees with double precision, for rows with and without an incomplete vector.
    use super::*;

    #[test]
    fn every_level_agrees_with_double_precision() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 2_097_152.0 - 4.0
        };
        for (row, steps) in [(1, 3), (4, 2), (16, 5), (33, 2), (64, 3)] {
            let heads: Vec<f32> = (0..2 * row * steps).map(|_| next()).collect();
            let eps: Vec<f32> = (0..row * steps).map(|_| next()).collect();
            for level in Level::available() {
                let mut z = vec![0.0; row * steps];
                draw_at(level, Draw { heads: &heads, eps: &eps, floor: 0.25, row, z: &mut z });
                for (i, z) in z.iter().enumerate() {
                    let head = i / row * 2 * row + i % row;
                    let [mean, raw, eps] = [heads[head], heads[head + row], eps[i]].map(f64::from);
                    let want = mean + eps * (raw.exp().ln_1p() + 0.25);
                    assert!((f64::from(*z) - want).abs() < 1e-5, "{level:?}, row {row}: {z}, not {want}");
                }
            }
        }
    }
}
