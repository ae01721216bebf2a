//! Solutions of linear systems and inverses, by the Cholesky factorisation A = L Lᵀ.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::solvers::Solve;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, Par, Side};

/// Solves `matrix` x = `right`, `[n, k]`, for a positive definite `matrix`, `[n, n]`.
///
/// Reads the lower triangle. Returns `None` if the matrix is not positive definite in floating point.
pub fn solve_positive_definite(matrix: &Mat<f64>, right: &Mat<f64>) -> Option<Mat<f64>> {
    Some(matrix.llt(Side::Lower).ok()?.solve(right))
}

/// Inverse of a positive definite matrix A, with half the logarithm of the determinant of A.
#[derive(Debug, Clone)]
pub struct PositiveInverse {
    /// Inverse A⁻¹ of the matrix A, `[n, n]`.
    pub inverse: Mat<f64>,
    /// Half the log determinant, ln √(det A): the sum of the logarithms of the diagonal of the Cholesky factor L.
    pub half_log_determinant: f64,
}

/// Inverts a positive definite matrix, `[n, n]`, as L⁻ᵀ L⁻¹, on one thread.
///
/// Reads the lower triangle; the upper one must be 0. Returns `None` if the matrix is not positive definite
/// in floating point.
pub fn invert_positive_definite(mut matrix: Mat<f64>) -> Option<PositiveInverse> {
    let n = matrix.nrows();
    // One thread, so that the result does not depend on the number of threads.
    let params = Default::default();
    let mut memory = MemBuffer::new(llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, params));
    let stack = MemStack::new(&mut memory);
    llt::factor::cholesky_in_place(matrix.as_mut(), Default::default(), Par::Seq, stack, params).ok()?;
    let lower = matrix;
    let mut lower_inverse = Mat::<f64>::identity(n, n);
    solve_lower_triangular_in_place(lower.as_ref(), lower_inverse.as_mut(), Par::Seq);
    let mut inverse = Mat::<f64>::zeros(n, n);
    matmul(
        inverse.as_mut(),
        BlockStructure::Rectangular,
        Accum::Replace,
        lower_inverse.transpose(),
        BlockStructure::TriangularUpper,
        lower_inverse.as_ref(),
        BlockStructure::TriangularLower,
        1.0,
        Par::Seq,
    );
    Some(PositiveInverse { inverse, half_log_determinant: (0..n).map(|i| lower[(i, i)].ln()).sum() })
}

#[cfg(test)]
mod tests {
    //! Contract: solutions and inverses satisfy their definitions; a matrix that is not positive definite
    //! gives `None`.
    use super::*;
    use approx::assert_relative_eq;

    /// Hilbert matrix plus the identity: positive definite, without entries of 0.
    fn matrix(n: usize) -> Mat<f64> {
        Mat::from_fn(n, n, |i, j| 1.0 / (i + j + 1) as f64 + if i == j { 1.0 } else { 0.0 })
    }

    #[test]
    fn a_solution_satisfies_its_equations() {
        let (a, b) = (matrix(7), Mat::from_fn(7, 2, |i, j| (i * i) as f64 - 3.0 * j as f64));
        let x = solve_positive_definite(&a, &b).expect("positive definite");
        for (i, j) in (0..7).flat_map(|i| [(i, 0), (i, 1)]) {
            let row: f64 = (0..7).map(|k| a[(i, k)] * x[(k, j)]).sum();
            assert_relative_eq!(row, b[(i, j)], epsilon = 1e-12);
        }
    }

    #[test]
    fn inverse_and_determinant_satisfy_their_definitions() {
        let a = matrix(9);
        let lower = Mat::from_fn(9, 9, |i, j| if i >= j { a[(i, j)] } else { 0.0 });
        let inverse = invert_positive_definite(lower).expect("positive definite").inverse;
        for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
            let product: f64 = (0..9).map(|k| a[(i, k)] * inverse[(k, j)]).sum();
            assert_relative_eq!(product, if i == j { 1.0 } else { 0.0 }, epsilon = 1e-12);
        }
        // det [2 0.5; 0.5 4/3] = 29/12.
        let small = Mat::from_fn(2, 2, |i, j| if i >= j { matrix(2)[(i, j)] } else { 0.0 });
        let found = invert_positive_definite(small).expect("positive definite");
        assert_relative_eq!(found.half_log_determinant, 0.5 * (29.0_f64 / 12.0).ln(), epsilon = 1e-14);
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_gives_none() {
        let indefinite = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 });
        let nan = Mat::from_fn(2, 2, |_, _| f64::NAN);
        let right = Mat::<f64>::zeros(2, 1);
        for bad in [indefinite, nan] {
            assert!(solve_positive_definite(&bad, &right).is_none());
            assert!(invert_positive_definite(bad).is_none());
        }
    }
}
