//! Linear map over the feature axis in SIMD lanes. Twin: [`super::linear_reference`].

use super::lanes::{BLOCK, Chunk, MAX_LANES, reduce_into, rows_mut, vectors};
use super::outer::{Rows, outer, sums};
use super::panels::{Panels, Start, packed_len};
use super::pointwise::tanh_at;
use super::vector::Vector;
use super::{LinearBackward, LinearDims, LinearForward};
use crate::simd::{Kernel, Level};

/// Scratch elements for extents `(input, output)`.
pub fn scratch(input: usize, output: usize) -> usize {
    let packed = packed_len(output, input).max(packed_len(input, output));
    packed + MAX_LANES * (BLOCK * (2 * input + 3 * output) + output * input + output)
}

/// Forward pass.
pub fn forward(args: LinearForward<'_, f32>, scratch: &mut [f32]) {
    forward_at(Level::current(), args, scratch);
}

/// Forward pass at a given level.
pub fn forward_at(level: Level, args: LinearForward<'_, f32>, scratch: &mut [f32]) {
    level.run(args.dims.batch, Forward(args, scratch));
}

/// Vector-Jacobian product; accumulates into every output but a fresh `dx`.
pub fn backward(args: LinearBackward<'_, f32>, scratch: &mut [f32]) {
    backward_at(Level::current(), args, scratch);
}

/// Vector-Jacobian product at a given level.
pub fn backward_at(level: Level, args: LinearBackward<'_, f32>, scratch: &mut [f32]) {
    level.run(args.dims.batch, Backward(args, scratch));
}

struct Forward<'a, 'b>(LinearForward<'a, f32>, &'b mut [f32]);
struct Backward<'a, 'b>(LinearBackward<'a, f32>, &'b mut [f32]);

impl Kernel for Forward<'_, '_> {
    #[inline(always)]
    fn run<S: Vector, const ROOMY: bool>(self, simd: S) {
        let Forward(g, scratch) = self;
        let LinearDims { time, input, output, batch } = g.dims;
        let (packed, rest) = scratch.split_at_mut(packed_len(output, input));
        let w = Panels::pack::<ROOMY>(packed, output, input, |o, i| g.w[o * input + i]);
        let (x_buffer, rest) = vectors::<S>(rest, BLOCK * input);
        let (y_buffer, _) = vectors::<S>(rest, BLOCK * output);
        for chunk in Chunk::all::<S>(batch) {
            for start in (0..time).step_by(BLOCK) {
                let steps = BLOCK.min(time - start);
                let x = chunk.read(simd, g.x, (start * input, steps * input), x_buffer);
                let whole = chunk.is_whole::<S>();
                let y = match whole {
                    true => rows_mut::<S>(g.y, start * output, steps * output),
                    false => &mut y_buffer[..steps * output],
                };
                w.apply::<S, ROOMY>(simd, Start::Bias(g.b), (x, input), (y, output), steps);
                if g.tanh {
                    for v in &mut *y {
                        *v = tanh_at(simd, *v);
                    }
                }
                if !whole {
                    chunk.write(simd, g.y, start * output, &y_buffer[..steps * output]);
                }
            }
        }
    }
}

impl Kernel for Backward<'_, '_> {
    #[inline(always)]
    fn run<S: Vector, const ROOMY: bool>(self, simd: S) {
        let Backward(g, scratch) = self;
        let LinearDims { time, input, output, batch } = g.dims;
        let (packed, rest) = scratch.split_at_mut(packed_len(input, output));
        let w = Panels::pack::<ROOMY>(packed, input, output, |i, o| g.w[o * input + i]);
        let (x_buffer, rest) = vectors::<S>(rest, BLOCK * input);
        let (dx_buffer, rest) = vectors::<S>(rest, BLOCK * input);
        let (dy_buffer, rest) = vectors::<S>(rest, BLOCK * output);
        let (y_buffer, rest) = vectors::<S>(rest, BLOCK * output);
        let (slopes, rest) = vectors::<S>(rest, BLOCK * output);
        let (dw, rest) = vectors::<S>(rest, output * input);
        let (db, _) = vectors::<S>(rest, output);
        dw.fill(simd.splat_f32s(0.0));
        db.fill(simd.splat_f32s(0.0));
        for chunk in Chunk::all::<S>(batch) {
            for start in (0..time).step_by(BLOCK) {
                let steps = BLOCK.min(time - start);
                let x = chunk.read(simd, g.x, (start * input, steps * input), x_buffer);
                let dy = chunk.read(simd, g.dy, (start * output, steps * output), dy_buffer);
                let dy = match g.y.is_empty() {
                    true => dy,
                    false => {
                        let y = chunk.read(simd, g.y, (start * output, steps * output), y_buffer);
                        let slopes = &mut slopes[..steps * output];
                        for ((slope, dy), y) in slopes.iter_mut().zip(dy).zip(y) {
                            *slope =
                                simd.mul_f32s(*dy, simd.negate_mul_add_e_f32s(*y, *y, simd.splat_f32s(1.0)));
                        }
                        &*slopes
                    }
                };
                let dy_rows = Rows { all: dy, stride: output, first: 0, count: output };
                let x_rows = Rows { all: x, stride: input, first: 0, count: input };
                outer::<S, ROOMY>(simd, dw, dy_rows, x_rows, steps);
                sums(simd, db, dy_rows, steps);
                if g.dx.is_empty() {
                    continue;
                }
                let (at, n) = (start * input, steps * input);
                if chunk.is_whole::<S>() {
                    let from = if g.dx_fresh { Start::Zero } else { Start::Output };
                    w.apply::<S, ROOMY>(simd, from, (dy, output), (rows_mut::<S>(g.dx, at, n), input), steps);
                    continue;
                }
                w.apply::<S, ROOMY>(simd, Start::Zero, (dy, output), (&mut dx_buffer[..n], input), steps);
                if g.dx_fresh {
                    chunk.write(simd, g.dx, at, &dx_buffer[..n]);
                } else {
                    chunk.add(simd, g.dx, at, &dx_buffer[..n]);
                }
            }
        }
        reduce_into(simd, g.dw, dw);
        reduce_into(simd, g.db, db);
    }
}
