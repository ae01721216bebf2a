//! Dense matrix product by faer, on one thread: callers run batches in parallel.

use faer::linalg::matmul::matmul as faer_matmul;
use faer::{Accum, MatMut, MatRef, Par};

/// Extents and layouts of a matrix product `out (m x n) = a (m x k) b (k x n)`. `out` is row-major.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MatmulDims {
    /// Number of rows of the product.
    pub m: usize,
    /// Inner extent: number of columns of `a` and rows of `b`.
    pub k: usize,
    /// Number of columns of the product.
    pub n: usize,
    /// Whether `a` is stored as its transpose (k x m, row-major).
    pub a_transposed: bool,
    /// Whether `b` is stored as its transpose (n x k, row-major).
    pub b_transposed: bool,
}

/// Computes the matrix product `out = a b`, or `out += a b` if `accumulate`.
pub fn matmul<T: faer::traits::ComplexField>(
    d: MatmulDims,
    a: &[T],
    b: &[T],
    out: &mut [T],
    accumulate: bool,
) {
    let lhs = if d.a_transposed {
        MatRef::from_row_major_slice(a, d.k, d.m).transpose()
    } else {
        MatRef::from_row_major_slice(a, d.m, d.k)
    };
    let rhs = if d.b_transposed {
        MatRef::from_row_major_slice(b, d.n, d.k).transpose()
    } else {
        MatRef::from_row_major_slice(b, d.k, d.n)
    };
    let dst = MatMut::from_row_major_slice_mut(out, d.m, d.n);
    let mode = if accumulate { Accum::Add } else { Accum::Replace };
    faer_matmul(dst, mode, lhs, rhs, T::one_impl(), Par::Seq);
}
