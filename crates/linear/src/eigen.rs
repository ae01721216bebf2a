//! Eigenvalues and eigenvectors of a symmetric matrix A = U S Uᵀ, and Gram matrices.

use faer::{Mat, Side};

/// Eigenvalues of a symmetric matrix in ascending order, with orthonormal eigenvectors.
#[derive(Debug, Clone)]
pub struct SymmetricEigen {
    /// Eigenvalues in ascending order, `[n]`.
    pub values: Vec<f64>,
    /// Eigenvectors, `[n, n]`; vector `k` is column `k`.
    pub vectors: Mat<f64>,
}

/// Computes eigenvalues and eigenvectors of a symmetric matrix, `[n, n]`.
///
/// Reads the lower triangle. Returns `None` if the iteration does not converge, as for non-finite values.
pub fn symmetric_eigen(matrix: &Mat<f64>) -> Option<SymmetricEigen> {
    let eigen = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    let values = (0..matrix.nrows()).map(|k| eigen.S()[k]).collect();
    Some(SymmetricEigen { values, vectors: eigen.U().to_owned() })
}

/// Computes the scaled Gram matrix `scale` XᵀX, `[n, n]`, of a matrix X, `[m, n]`.
pub fn gram(x: &Mat<f64>, scale: f64) -> Mat<f64> {
    x.transpose() * x * scale
}

#[cfg(test)]
mod tests {
    //! Contract: pairs satisfy A u = s u, vectors are orthonormal, and values are in ascending order.
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn eigenpairs_satisfy_their_definition() {
        let x = Mat::from_fn(12, 6, |i, j| ((i * 7 + j * 3) % 11) as f64 - 4.5);
        let a = gram(&x, 1.0 / 12.0);
        let SymmetricEigen { values, vectors } = symmetric_eigen(&a).expect("finite");
        assert!(values.is_sorted());
        for k in 0..6 {
            for i in 0..6 {
                let product: f64 = (0..6).map(|j| a[(i, j)] * vectors[(j, k)]).sum();
                assert_relative_eq!(product, values[k] * vectors[(i, k)], epsilon = 1e-11);
                let inner: f64 = (0..6).map(|j| vectors[(j, i)] * vectors[(j, k)]).sum();
                assert_relative_eq!(inner, if i == k { 1.0 } else { 0.0 }, epsilon = 1e-12);
            }
        }
    }

    #[test]
    fn gram_entries_are_inner_products_of_columns() {
        let x = Mat::from_fn(3, 2, |i, j| (i + 2 * j) as f64);
        let a = gram(&x, 0.5);
        // Columns [0 1 2] and [2 3 4].
        assert_eq!([a[(0, 0)], a[(1, 0)], a[(1, 1)]], [2.5, 5.5, 14.5]);
    }
}
