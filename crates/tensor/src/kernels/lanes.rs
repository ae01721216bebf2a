//! Batches of sequences as SIMD vectors, one sequence per lane.
//!
//! All functions are generic over the instruction set and are inlined into the function that is compiled for
//! it.

use pulp::Simd;

/// Maximum number of f32 lanes (values per vector) of a supported instruction set.
pub(crate) const MAX_LANES: usize = 16;

/// Number of time steps that kernels process at once.
///
/// It is large enough to make the work per block negligible, and small enough for a block to stay in the L2
/// cache.
pub(crate) const BLOCK: usize = 32;

/// Loads a row of at most one vector of values; unused lanes are 0.
#[inline(always)]
fn load<S: Simd>(simd: S, row: &[f32]) -> S::f32s {
    match S::as_simd_f32s(row) {
        ([v], _) => *v,
        (_, tail) => simd.partial_load_f32s(tail),
    }
}

/// Stores the first lanes of a vector to a row of at most one vector of values.
#[inline(always)]
fn store<S: Simd>(simd: S, row: &mut [f32], v: S::f32s) {
    match S::as_mut_simd_f32s(row) {
        ([slot], _) => *slot = v,
        (_, tail) => simd.partial_store_f32s(tail, v),
    }
}

/// Lane by lane, the larger of `x` and `bound`; NaN stays NaN.
#[inline(always)]
pub(crate) fn at_least<S: Simd>(simd: S, x: S::f32s, bound: f32) -> S::f32s {
    let bound = simd.splat_f32s(bound);
    if S::F32_LANES == 1 {
        return simd.select_f32s(simd.less_than_f32s(x, bound), bound, x);
    }
    // x is the second operand: the maximum of x86 returns its second operand if either is NaN.
    simd.max_f32s(bound, x)
}

/// Lane by lane, the smaller of `x` and `bound`; NaN stays NaN.
#[inline(always)]
pub(crate) fn at_most<S: Simd>(simd: S, x: S::f32s, bound: f32) -> S::f32s {
    let bound = simd.splat_f32s(bound);
    if S::F32_LANES == 1 {
        return simd.select_f32s(simd.greater_than_f32s(x, bound), bound, x);
    }
    simd.min_f32s(bound, x)
}

/// Splits `n` SIMD vectors off a scratch buffer; returns them and the remainder.
#[inline(always)]
pub(crate) fn vectors<S: Simd>(scratch: &mut [f32], n: usize) -> (&mut [S::f32s], &mut [f32]) {
    let (head, remainder) = scratch.split_at_mut(n * S::F32_LANES);
    (S::as_mut_simd_f32s(head).0, remainder)
}

/// A chunk of a batch: the sequences `first..first + count`, at most one per lane of a vector.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chunk {
    batch: usize,
    first: usize,
    count: usize,
}

impl Chunk {
    /// Divides a batch of sequences into chunks of at most one vector.
    #[inline(always)]
    pub fn all<S: Simd>(batch: usize) -> impl Iterator<Item = Chunk> {
        let chunk = move |first| Chunk { batch, first, count: S::F32_LANES.min(batch - first) };
        (0..batch).step_by(S::F32_LANES).map(chunk)
    }

    /// Whether the batch fills exactly one vector, so that its memory can be used as a slice of vectors.
    #[inline(always)]
    pub fn is_whole<S: Simd>(self) -> bool {
        self.batch == S::F32_LANES
    }

    /// Reads `rows` rows from row `start` of an array `[row, batch]` as vectors; unused lanes are 0.
    ///
    /// They are copied to `buffer` unless the batch fills exactly one vector.
    #[inline(always)]
    pub fn read<'a, S: Simd>(
        self,
        simd: S,
        array: &'a [f32],
        (start, rows): (usize, usize),
        buffer: &'a mut [S::f32s],
    ) -> &'a [S::f32s] {
        if self.is_whole::<S>() {
            return &S::as_simd_f32s(array).0[start..start + rows];
        }
        for (i, v) in buffer[..rows].iter_mut().enumerate() {
            *v = load(simd, &array[(start + i) * self.batch + self.first..][..self.count]);
        }
        &buffer[..rows]
    }

    /// Writes vectors to the rows of an array `[row, batch]` from row `start`.
    #[inline(always)]
    pub fn write<S: Simd>(self, simd: S, array: &mut [f32], start: usize, from: &[S::f32s]) {
        for (i, v) in from.iter().enumerate() {
            let row = &mut array[(start + i) * self.batch + self.first..][..self.count];
            store(simd, row, *v);
        }
    }

    /// Adds vectors to the rows of an array `[row, batch]` from row `start`.
    #[inline(always)]
    pub fn add<S: Simd>(self, simd: S, array: &mut [f32], start: usize, from: &[S::f32s]) {
        for (i, v) in from.iter().enumerate() {
            let row = &mut array[(start + i) * self.batch + self.first..][..self.count];
            let sum = simd.add_f32s(load(simd, row), *v);
            store(simd, row, sum);
        }
    }
}

/// Views `rows` rows from row `start` of an array whose rows are whole vectors.
#[inline(always)]
pub(crate) fn rows_mut<S: Simd>(array: &mut [f32], start: usize, rows: usize) -> &mut [S::f32s] {
    &mut S::as_mut_simd_f32s(array).0[start..start + rows]
}

/// Adds the sum over the lanes of each accumulator vector to the element of `out` with its index.
#[inline(always)]
pub(crate) fn reduce_into<S: Simd>(simd: S, out: &mut [f32], acc: &[S::f32s]) {
    for (o, a) in out.iter_mut().zip(acc) {
        *o += simd.reduce_sum_f32s(*a);
    }
}
