//! Weight gradients: sums over time of outer products, separately for each lane, in register tiles.

use pulp::Simd;

/// Vectors of consecutive steps: `stride` vectors per step, of which `count` from `first` are used.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a, V> {
    /// The vectors of all steps, one step after the other.
    pub vectors: &'a [V],
    /// Number of vectors from one step to the next.
    pub stride: usize,
    /// Index of the first used vector within a step.
    pub first: usize,
    /// Number of used vectors within a step.
    pub count: usize,
}

/// Adds outer products: `acc[row * cols + col] += sum over steps of g[step][row] * x[step][col]`.
#[inline(always)]
pub(crate) fn outer<S: Simd, const MANY_REGISTERS: bool>(
    simd: S,
    acc: &mut [S::f32s],
    g: Rows<'_, S::f32s>,
    x: Rows<'_, S::f32s>,
    steps: usize,
) {
    let mut r = 0;
    while r < g.count {
        let height = match g.count - r {
            4 | 5 | 8 if MANY_REGISTERS => 4,
            6.. if MANY_REGISTERS => 6,
            remaining => remaining.min(3),
        };
        match height {
            6 => columns::<S, 6>(simd, acc, g, r, x, steps),
            4 => columns::<S, 4>(simd, acc, g, r, x, steps),
            3 => columns::<S, 3>(simd, acc, g, r, x, steps),
            2 => columns::<S, 2>(simd, acc, g, r, x, steps),
            _ => columns::<S, 1>(simd, acc, g, r, x, steps),
        }
        r += height;
    }
}

/// Adds the products of `R` rows with all columns to `acc`, in tiles of nearly equal width.
#[inline(always)]
fn columns<S: Simd, const R: usize>(
    simd: S,
    acc: &mut [S::f32s],
    g: Rows<'_, S::f32s>,
    row: usize,
    x: Rows<'_, S::f32s>,
    steps: usize,
) {
    let mut c = 0;
    while c < x.count {
        let remaining = x.count - c;
        let width = remaining.div_ceil(remaining.div_ceil(4));
        match width {
            4 => tile::<S, R, 4>(simd, acc, (g, row), (x, c), steps),
            3 => tile::<S, R, 3>(simd, acc, (g, row), (x, c), steps),
            2 => tile::<S, R, 2>(simd, acc, (g, row), (x, c), steps),
            _ => tile::<S, R, 1>(simd, acc, (g, row), (x, c), steps),
        }
        c += width;
    }
}

/// Adds the products of `R` rows from `row` with `C` columns from `col` to `acc`, with all sums in registers.
#[inline(always)]
fn tile<S: Simd, const R: usize, const C: usize>(
    simd: S,
    acc: &mut [S::f32s],
    (g, row): (Rows<'_, S::f32s>, usize),
    (x, col): (Rows<'_, S::f32s>, usize),
    steps: usize,
) {
    let mut sums = [[simd.splat_f32s(0.0); C]; R];
    let (g_rows, x_rows) = (&g.vectors[g.first + row..], &x.vectors[x.first + col..]);
    for s in 0..steps {
        let g = &g_rows[s * g.stride..][..R];
        let x = &x_rows[s * x.stride..][..C];
        for i in 0..R {
            for j in 0..C {
                sums[i][j] = simd.mul_add_e_f32s(g[i], x[j], sums[i][j]);
            }
        }
    }
    for (i, sums) in sums.iter().enumerate() {
        let acc = &mut acc[(row + i) * x.count + col..][..C];
        for (a, s) in acc.iter_mut().zip(sums) {
            *a = simd.add_f32s(*a, *s);
        }
    }
}

/// Adds sums over time: `acc[row] += sum over steps of g[step][row]`.
#[inline(always)]
pub(crate) fn sums<S: Simd>(simd: S, acc: &mut [S::f32s], g: Rows<'_, S::f32s>, steps: usize) {
    let mut r = 0;
    while r < g.count {
        r += match g.count - r {
            8.. => sum_rows::<S, 8>(simd, acc, g, r, steps),
            4.. => sum_rows::<S, 4>(simd, acc, g, r, steps),
            _ => sum_rows::<S, 1>(simd, acc, g, r, steps),
        };
    }
}

/// Adds the sums over time of `N` rows from `row` to `acc`; returns `N`.
#[inline(always)]
fn sum_rows<S: Simd, const N: usize>(
    simd: S,
    acc: &mut [S::f32s],
    g: Rows<'_, S::f32s>,
    row: usize,
    steps: usize,
) -> usize {
    let mut sums = [simd.splat_f32s(0.0); N];
    let rows = &g.vectors[g.first + row..];
    for s in 0..steps {
        let g = &rows[s * g.stride..][..N];
        for j in 0..N {
            sums[j] = simd.add_f32s(sums[j], g[j]);
        }
    }
    for (a, s) in acc[row..row + N].iter_mut().zip(sums) {
        *a = simd.add_f32s(*a, s);
    }
    N
}
