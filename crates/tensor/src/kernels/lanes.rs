//! Register tiles shared by the SIMD kernels: batch in lanes, weights broadcast from memory.
//!
//! The runtime picks the instruction set (AVX-512, AVX2, NEON or scalar) once per kernel call; all
//! functions here are generic over it and inlined into the dispatched body. They contain no `unsafe`.

use pulp::Simd;

/// Outputs per register tile of a matrix-vector product.
pub(crate) const TILE: usize = 8;
/// Largest number of f32 lanes of any supported instruction set.
pub(crate) const MAX_LANES: usize = 16;

/// Loads a row of at most one vector; missing lanes are zero.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, row: &[f32]) -> S::f32s {
    let (whole, tail) = S::as_simd_f32s(row);
    match whole {
        [v] => *v,
        _ => simd.partial_load_f32s(tail),
    }
}

/// Stores a row of at most one vector.
#[inline(always)]
pub(crate) fn store<S: Simd>(simd: S, row: &mut [f32], v: S::f32s) {
    let (whole, tail) = S::as_mut_simd_f32s(row);
    match whole {
        [slot] => *slot = v,
        _ => simd.partial_store_f32s(tail, v),
    }
}

/// Splits `n * lanes` scratch values off as `n` vectors.
#[inline(always)]
pub(crate) fn vectors<S: Simd>(scratch: &mut [f32], n: usize) -> (&mut [S::f32s], &mut [f32]) {
    let (head, rest) = scratch.split_at_mut(n * lanes::<S>());
    (S::as_mut_simd_f32s(head).0, rest)
}

/// Lanes of one vector.
#[inline(always)]
pub(crate) fn lanes<S: Simd>() -> usize {
    size_of::<S::f32s>() / size_of::<f32>()
}

/// Groups of [`TILE`] outputs that cover `n`.
pub(crate) fn tiles(n: usize) -> usize {
    n.div_ceil(TILE)
}

/// Packs `w[row, col]` so that one tile of [`TILE`] outputs reads its weights contiguously:
/// `packed[tile][input][output in tile]`, zero where an output does not exist.
pub(crate) fn pack(packed: &mut [f32], outputs: usize, inputs: usize, weight: impl Fn(usize, usize) -> f32) {
    let (rows, _) = packed.as_chunks_mut::<TILE>();
    for (at, row) in rows.iter_mut().enumerate() {
        let (tile, input) = (at / inputs.max(1), at % inputs.max(1));
        for (j, slot) in row.iter_mut().enumerate() {
            let output = tile * TILE + j;
            *slot = if output < outputs { weight(output, input) } else { 0.0 };
        }
    }
}

/// `acc[j] += sum_k w[k][j] x[k]`.
#[inline(always)]
pub(crate) fn matvec<S: Simd, const N: usize>(
    simd: S,
    acc: &mut [S::f32s; N],
    w: &[[f32; N]],
    x: &[S::f32s],
) {
    for (w, &x) in w.iter().zip(x) {
        for j in 0..N {
            acc[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[j]), x, acc[j]);
        }
    }
}

/// Sum over time of the outer product of `g[t][rows]` and `x[t][cols]`, lane by lane:
/// `acc[row * cols + col] += sum_t g[t * g_stride + row] * x[t * x_stride + col]`.
#[inline(always)]
pub(crate) fn outer<S: Simd>(
    simd: S,
    acc: &mut [S::f32s],
    (g, g_stride, rows): (&[S::f32s], usize, usize),
    (x, x_stride, cols): (&[S::f32s], usize, usize),
    time: usize,
) {
    let mut r = 0;
    while r + 6 <= rows {
        outer_rows::<S, 6>(simd, acc, (g, g_stride, r), (x, x_stride, cols), time);
        r += 6;
    }
    while r < rows {
        outer_rows::<S, 1>(simd, acc, (g, g_stride, r), (x, x_stride, cols), time);
        r += 1;
    }
}

#[inline(always)]
fn outer_rows<S: Simd, const R: usize>(
    simd: S,
    acc: &mut [S::f32s],
    g: (&[S::f32s], usize, usize),
    (x, x_stride, cols): (&[S::f32s], usize, usize),
    time: usize,
) {
    let mut c = 0;
    while c + 4 <= cols {
        outer_tile::<S, R, 4>(simd, acc, g, (x, x_stride, c), cols, time);
        c += 4;
    }
    while c < cols {
        outer_tile::<S, R, 1>(simd, acc, g, (x, x_stride, c), cols, time);
        c += 1;
    }
}

#[inline(always)]
fn outer_tile<S: Simd, const R: usize, const C: usize>(
    simd: S,
    acc: &mut [S::f32s],
    (g, g_stride, row): (&[S::f32s], usize, usize),
    (x, x_stride, col): (&[S::f32s], usize, usize),
    cols: usize,
    time: usize,
) {
    let mut tile = [[simd.splat_f32s(0.0); C]; R];
    for t in 0..time {
        let g = &g[t * g_stride + row..][..R];
        let x = &x[t * x_stride + col..][..C];
        for i in 0..R {
            for j in 0..C {
                tile[i][j] = simd.mul_add_e_f32s(g[i], x[j], tile[i][j]);
            }
        }
    }
    for (i, tile) in tile.iter().enumerate() {
        let acc = &mut acc[(row + i) * cols + col..][..C];
        for (a, t) in acc.iter_mut().zip(tile) {
            *a = simd.add_f32s(*a, *t);
        }
    }
}

/// Adds the sum over lanes of each accumulator to `out`.
#[inline(always)]
pub(crate) fn reduce_into<S: Simd>(simd: S, out: &mut [f32], acc: &[S::f32s]) {
    for (o, a) in out.iter_mut().zip(acc) {
        *o += simd.reduce_sum_f32s(*a);
    }
}
