//! Affine map over the feature axis in SIMD lanes. Reference: [`super::linear_reference`].

use super::lanes::{BLOCK, Chunk, MAX_LANES, reduce_into, rows_mut, vectors};
use super::outer::{Rows, outer, sums};
use super::panels::{InitialSum, Panels, packed_len};
use super::pointwise::tanh_at;
use super::vector::Vector;
use super::{LinearBackward, LinearDims, LinearForward};
use crate::simd::{Kernel, Level};

/// Number of scratch elements that a layer needs, enough for forward and backward pass.
pub fn scratch(input: usize, output: usize) -> usize {
    let packed = packed_len(output, input).max(packed_len(input, output));
    packed + MAX_LANES * (BLOCK * (2 * input + 3 * output) + output * input + output)
}

/// Runs the forward pass of the affine map with the instruction set of this process.
pub fn forward(args: LinearForward<'_, f32>, scratch: &mut [f32]) {
    forward_at(Level::current(), args, scratch);
}

/// Runs the forward pass of the affine map with a given instruction set.
pub fn forward_at(level: Level, args: LinearForward<'_, f32>, scratch: &mut [f32]) {
    level.run(args.dims.batch, Forward(args, scratch));
}

/// Computes the vector-Jacobian product with the instruction set of this process; see [`LinearBackward`].
pub fn backward(args: LinearBackward<'_, f32>, scratch: &mut [f32]) {
    backward_at(Level::current(), args, scratch);
}

/// Computes the vector-Jacobian product of the affine map with a given instruction set.
pub fn backward_at(level: Level, args: LinearBackward<'_, f32>, scratch: &mut [f32]) {
    level.run(args.dims.batch, Backward(args, scratch));
}

struct Forward<'a, 'b>(LinearForward<'a, f32>, &'b mut [f32]);
struct Backward<'a, 'b>(LinearBackward<'a, f32>, &'b mut [f32]);

impl Kernel for Forward<'_, '_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        let Forward(g, scratch) = self;
        let LinearDims { time, input, output, batch } = g.dims;
        let (packed, remaining) = scratch.split_at_mut(packed_len(output, input));
        let w = Panels::pack::<MANY_REGISTERS>(packed, output, input, |o, i| g.w[o * input + i]);
        let (x_buffer, remaining) = vectors::<S>(remaining, BLOCK * input);
        let (y_buffer, _) = vectors::<S>(remaining, BLOCK * output);
        for chunk in Chunk::all::<S>(batch) {
            for start in (0..time).step_by(BLOCK) {
                let steps = BLOCK.min(time - start);
                let x = chunk.read(simd, g.x, (start * input, steps * input), x_buffer);
                let is_whole = chunk.is_whole::<S>();
                let y = match is_whole {
                    true => rows_mut::<S>(g.y, start * output, steps * output),
                    false => &mut y_buffer[..steps * output],
                };
                w.apply::<S, MANY_REGISTERS>(simd, InitialSum::Bias(g.b), (x, input), (y, output), steps);
                if g.tanh {
                    for v in &mut *y {
                        *v = tanh_at(simd, *v);
                    }
                }
                if !is_whole {
                    chunk.write(simd, g.y, start * output, &y_buffer[..steps * output]);
                }
            }
        }
    }
}

impl Kernel for Backward<'_, '_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        let Backward(g, scratch) = self;
        let LinearDims { time, input, output, batch } = g.dims;
        let (packed, remaining) = scratch.split_at_mut(packed_len(input, output));
        let w = Panels::pack::<MANY_REGISTERS>(packed, input, output, |i, o| g.w[o * input + i]);
        let (x_buffer, remaining) = vectors::<S>(remaining, BLOCK * input);
        let (dx_buffer, remaining) = vectors::<S>(remaining, BLOCK * input);
        let (dy_buffer, remaining) = vectors::<S>(remaining, BLOCK * output);
        let (y_buffer, remaining) = vectors::<S>(remaining, BLOCK * output);
        let (slopes, remaining) = vectors::<S>(remaining, BLOCK * output);
        let (dw, remaining) = vectors::<S>(remaining, output * input);
        let (db, _) = vectors::<S>(remaining, output);
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
                let dy_rows = Rows { vectors: dy, stride: output, first: 0, count: output };
                let x_rows = Rows { vectors: x, stride: input, first: 0, count: input };
                outer::<S, MANY_REGISTERS>(simd, dw, dy_rows, x_rows, steps);
                sums(simd, db, dy_rows, steps);
                if g.dx.is_empty() {
                    continue;
                }
                let (first_row, rows) = (start * input, steps * input);
                if chunk.is_whole::<S>() {
                    let initial = if g.dx_fresh { InitialSum::Zero } else { InitialSum::Output };
                    let dx = rows_mut::<S>(g.dx, first_row, rows);
                    w.apply::<S, MANY_REGISTERS>(simd, initial, (dy, output), (dx, input), steps);
                    continue;
                }
                let dx = &mut dx_buffer[..rows];
                w.apply::<S, MANY_REGISTERS>(simd, InitialSum::Zero, (dy, output), (dx, input), steps);
                if g.dx_fresh {
                    chunk.write(simd, g.dx, first_row, dx);
                } else {
                    chunk.add(simd, g.dx, first_row, dx);
                }
            }
        }
        reduce_into(simd, g.dw, dw);
        reduce_into(simd, g.db, db);
    }
}
