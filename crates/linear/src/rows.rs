//! Gram matrix of a matrix that is stored row by row.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// Computes the Gram matrix XᵀX, `[width, width]`, of a matrix X, `[m, width]`; both are stored row by row.
///
/// It runs on one thread, so that the result does not depend on the number of threads.
///
/// # Panics
/// If the length of `rows` is not a multiple of `width`.
pub fn gram_of_rows(rows: &[f64], width: usize) -> Vec<f64> {
    if width == 0 {
        return Vec::new();
    }
    let x = MatRef::from_row_major_slice(rows, rows.len() / width, width);
    let mut out = Mat::<f64>::zeros(width, width);
    matmul(out.as_mut(), Accum::Replace, x.transpose(), x, 1.0, Par::Seq);
    (0..width * width).map(|k| out[(k / width, k % width)]).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: entry (i, j) is the inner product of columns i and j; without rows all entries are 0.
    use super::*;

    #[test]
    fn entries_are_inner_products_of_columns() {
        // Columns [0 2 4] and [1 3 5].
        assert_eq!(gram_of_rows(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 2), [20.0, 26.0, 26.0, 35.0]);
        assert_eq!(gram_of_rows(&[], 2), [0.0; 4]);
        assert!(gram_of_rows(&[], 0).is_empty());
    }
}
