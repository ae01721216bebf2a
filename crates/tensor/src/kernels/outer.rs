//! Weight gradients: sums over time of outer products, lane by lane, in register tiles.

use pulp::Simd;

/// Vectors of a block of steps: one row of `stride` vectors a step, of which `count` from `first` matter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a, V> {
    /// All vectors.
    pub all: &'a [V],
    /// Vectors from one step to the next.
    pub stride: usize,
    /// First vector of a step that matters.
    pub first: usize,
    /// How many matter.
    pub count: usize,
}

/// `acc[row * cols + col] += sum over steps of g[step][row] * x[step][col]`.
#[inline(always)]
pub(crate) fn outer<S: Simd, const ROOMY: bool>(
    simd: S,
    acc: &mut [S::f32s],
    g: Rows<'_, S::f32s>,
    x: Rows<'_, S::f32s>,
    steps: usize,
) {
    let mut r = 0;
    while r < g.count {
        let height = match g.count - r {
            4 | 5 | 8 if ROOMY => 4,
            6.. if ROOMY => 6,
            rest => rest.min(3),
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

/// One group of rows against all columns, in tiles of nearly equal width.
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
        let rest = x.count - c;
        let width = rest.div_ceil(rest.div_ceil(4));
        match width {
            4 => tile::<S, R, 4>(simd, acc, (g, row), (x, c), steps),
            3 => tile::<S, R, 3>(simd, acc, (g, row), (x, c), steps),
            2 => tile::<S, R, 2>(simd, acc, (g, row), (x, c), steps),
            _ => tile::<S, R, 1>(simd, acc, (g, row), (x, c), steps),
        }
        c += width;
    }
}

#[inline(always)]
fn tile<S: Simd, const R: usize, const C: usize>(
    simd: S,
    acc: &mut [S::f32s],
    (g, row): (Rows<'_, S::f32s>, usize),
    (x, col): (Rows<'_, S::f32s>, usize),
    steps: usize,
) {
    let mut sums = [[simd.splat_f32s(0.0); C]; R];
    let (g_rows, x_rows) = (&g.all[g.first + row..], &x.all[x.first + col..]);
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

/// `acc[row] += sum over steps of g[step][row]`.
#[inline(always)]
pub(crate) fn sums<S: Simd>(simd: S, acc: &mut [S::f32s], g: Rows<'_, S::f32s>, steps: usize) {
    let mut r = 0;
    while r < g.count {
        r += match g.count - r {
            8.. => sum_of::<S, 8>(simd, acc, g, r, steps),
            4.. => sum_of::<S, 4>(simd, acc, g, r, steps),
            _ => sum_of::<S, 1>(simd, acc, g, r, steps),
        };
    }
}

/// `N` rows from row `row`; returns `N`.
#[inline(always)]
fn sum_of<S: Simd, const N: usize>(
    simd: S,
    acc: &mut [S::f32s],
    g: Rows<'_, S::f32s>,
    row: usize,
    steps: usize,
) -> usize {
    let mut sums = [simd.splat_f32s(0.0); N];
    let rows = &g.all[g.first + row..];
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
