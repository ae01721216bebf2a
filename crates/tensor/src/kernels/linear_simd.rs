//! Linear map over the feature axis in SIMD lanes. Twin: [`super::linear_reference`].

use super::lanes::{self, MAX_LANES, TILE, load, matvec, store, tiles};
use super::{LinearBackward, LinearDims, LinearForward};
use pulp::{Arch, Simd, WithSimd};

/// Time steps whose weight gradient is accumulated in registers at a time.
const BLOCK: usize = 16;

/// Scratch elements for extents `(input, output)`.
pub fn scratch(input: usize, output: usize) -> usize {
    let packed = TILE * (tiles(output) * input).max(tiles(input) * output);
    let rows = BLOCK * (input + output) + output * input + output;
    packed + MAX_LANES * rows
}

/// Forward pass.
pub fn forward(args: LinearForward<'_, f32>, scratch: &mut [f32]) {
    Arch::new().dispatch(Forward(args, scratch));
}

/// Vector-Jacobian product; accumulates into every output.
pub fn backward(args: LinearBackward<'_, f32>, scratch: &mut [f32]) {
    Arch::new().dispatch(Backward(args, scratch));
}

struct Forward<'a, 'b>(LinearForward<'a, f32>, &'b mut [f32]);
struct Backward<'a, 'b>(LinearBackward<'a, f32>, &'b mut [f32]);

impl WithSimd for Forward<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Forward(g, scratch) = self;
        let LinearDims { time, input, output, batch } = g.dims;
        let (packed, rest) = scratch.split_at_mut(TILE * tiles(output) * input);
        lanes::pack(packed, output, input, |o, i| g.w[o * input + i]);
        let packed = packed.as_chunks::<TILE>().0;
        let (x, _) = lanes::vectors::<S>(rest, input);
        for c in (0..batch).step_by(lanes::lanes::<S>()) {
            let n = lanes::lanes::<S>().min(batch - c);
            for t in 0..time {
                for (i, x) in x.iter_mut().enumerate() {
                    *x = load(simd, &g.x[(t * input + i) * batch + c..][..n]);
                }
                for tile in 0..tiles(output) {
                    let first = tile * TILE;
                    let mut acc = [simd.splat_f32s(0.0); TILE];
                    for (a, b) in acc.iter_mut().zip(&g.b[first..]) {
                        *a = simd.splat_f32s(*b);
                    }
                    matvec(simd, &mut acc, &packed[tile * input..][..input], x);
                    for (j, a) in acc.into_iter().enumerate().take(output - first) {
                        store(simd, &mut g.y[(t * output + first + j) * batch + c..][..n], a);
                    }
                }
            }
        }
    }
}

impl WithSimd for Backward<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Backward(g, scratch) = self;
        let LinearDims { time, input, output, batch } = g.dims;
        let (packed, rest) = scratch.split_at_mut(TILE * tiles(input) * output);
        lanes::pack(packed, input, output, |i, o| g.w[o * input + i]);
        let packed = packed.as_chunks::<TILE>().0;
        let (x, rest) = lanes::vectors::<S>(rest, BLOCK * input);
        let (dy, rest) = lanes::vectors::<S>(rest, BLOCK * output);
        let (dw, rest) = lanes::vectors::<S>(rest, output * input);
        let (db, _) = lanes::vectors::<S>(rest, output);
        dw.fill(simd.splat_f32s(0.0));
        db.fill(simd.splat_f32s(0.0));
        for c in (0..batch).step_by(lanes::lanes::<S>()) {
            let n = lanes::lanes::<S>().min(batch - c);
            for start in (0..time).step_by(BLOCK) {
                let steps = BLOCK.min(time - start);
                for (at, x) in x.iter_mut().take(steps * input).enumerate() {
                    *x = load(simd, &g.x[(start * input + at) * batch + c..][..n]);
                }
                for (at, dy) in dy.iter_mut().take(steps * output).enumerate() {
                    *dy = load(simd, &g.dy[(start * output + at) * batch + c..][..n]);
                }
                for dy in dy.chunks_exact(output.max(1)).take(steps) {
                    for (db, dy) in db.iter_mut().zip(dy) {
                        *db = simd.add_f32s(*db, *dy);
                    }
                }
                lanes::outer(simd, dw, (dy, output, output), (x, input, input), steps);
                if g.dx.is_empty() {
                    continue;
                }
                for s in 0..steps {
                    for tile in 0..tiles(input) {
                        let first = tile * TILE;
                        let mut acc = [simd.splat_f32s(0.0); TILE];
                        matvec(simd, &mut acc, &packed[tile * output..][..output], &dy[s * output..]);
                        for (j, a) in acc.into_iter().enumerate().take(input - first) {
                            let row = &mut g.dx[((start + s) * input + first + j) * batch + c..][..n];
                            let sum = simd.add_f32s(load(simd, row), a);
                            store(simd, row, sum);
                        }
                    }
                }
            }
        }
        lanes::reduce_into(simd, g.dw, dw);
        lanes::reduce_into(simd, g.db, db);
    }
}
