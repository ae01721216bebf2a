//! Triangular factor of a tall matrix that arrives in blocks of rows.

/// Upper triangular factor R of a matrix A = Q R, `[rows, width]`, with Q orthogonal.
///
/// R has the inner products of the columns of A without their rounding: rank decisions need R, because the Gram matrix squares
/// the condition number. Rows are added by Householder reflections (Golub and Van Loan, *Matrix Computations*, 5.2 and 6.5.4),
/// so that a regressor of a long log need not be stored.
#[derive(Debug, Clone, PartialEq)]
pub struct TriangularFactor {
    width: usize,
    /// Rows of the current factor, then rows that are not yet factored, `[rows][width]`.
    rows: Vec<f64>,
    /// Number of rows of A.
    count: usize,
}

impl TriangularFactor {
    /// Factor of a matrix without rows.
    pub fn new(width: usize) -> TriangularFactor {
        TriangularFactor { width, rows: Vec::new(), count: 0 }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows that were added.
    pub fn row_count(&self) -> usize {
        self.count
    }

    /// Adds rows, `[k][width]`, stored row by row; values that do not fill a row are ignored.
    pub fn add_rows(&mut self, rows: &[f64]) {
        if self.width == 0 {
            return;
        }
        for row in rows.chunks_exact(self.width) {
            self.rows.extend_from_slice(row);
            self.count += 1;
            // Four times as many new rows as rows of the factor: the factor's share of the work is a fifth.
            if self.rows.len() >= 5 * self.width * self.width.max(8) {
                self.factor();
            }
        }
    }

    /// The factor R, `[width, width]`, row by row; 0 below the diagonal.
    pub fn upper(mut self) -> Vec<f64> {
        self.factor();
        self.rows.resize(self.width * self.width, 0.0);
        self.rows
    }

    /// Replaces all rows by those of their triangular factor.
    fn factor(&mut self) {
        let p = self.width;
        let n = self.rows.len() / p.max(1);
        let a = &mut self.rows;
        let mut projection = vec![0.0; p];
        for k in 0..p.min(n) {
            let norm = (k..n).map(|i| a[i * p + k].powi(2)).sum::<f64>().sqrt();
            if norm == 0.0 {
                continue;
            }
            // The reflection v = x + sign(x_k) |x| e_k maps column k to -sign(x_k) |x| e_k.
            let pivot = if a[k * p + k] < 0.0 { -norm } else { norm };
            a[k * p + k] += pivot;
            let scale = 1.0 / (pivot * a[k * p + k]);
            projection[k + 1..].fill(0.0);
            for row in a[k * p..].chunks_exact(p) {
                for j in k + 1..p {
                    projection[j] += row[k] * row[j];
                }
            }
            for row in a[k * p..].chunks_exact_mut(p) {
                let factor = scale * row[k];
                for j in k + 1..p {
                    row[j] -= factor * projection[j];
                }
                row[k] = 0.0;
            }
            a[k * p + k] = -pivot;
        }
        a.truncate(p.min(n) * p);
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the inner products of the factor's columns are those of the matrix, however the rows arrive.
    use super::*;
    use approx::assert_relative_eq;

    fn matrix(rows: usize, width: usize) -> Vec<f64> {
        (0..rows * width).map(|i| ((i * i * 7 + i * 3) % 101) as f64 / 50.0 - 1.0).collect()
    }

    fn inner(a: &[f64], width: usize, i: usize, j: usize) -> f64 {
        a.chunks_exact(width).map(|row| row[i] * row[j]).sum()
    }

    #[test]
    fn inner_products_of_columns_are_kept() {
        for rows in [3, 5, 200, 1000] {
            let a = matrix(rows, 5);
            let mut factor = TriangularFactor::new(5);
            for block in a.chunks(15) {
                factor.add_rows(block);
            }
            assert_eq!(factor.row_count(), rows);
            let r = factor.upper();
            assert_eq!(r.len(), 25);
            for (i, j) in (0..5).flat_map(|i| (0..5).map(move |j| (i, j))) {
                assert_relative_eq!(inner(&r, 5, i, j), inner(&a, 5, i, j), epsilon = 1e-11 * rows as f64);
                assert!(j >= i || r[i * 5 + j] == 0.0);
            }
        }
    }

    #[test]
    fn a_column_that_is_a_multiple_of_another_leaves_a_diagonal_of_rounding() {
        let mut a = matrix(500, 3);
        a.chunks_exact_mut(3).for_each(|row| row[2] = 0.3 * row[0] - 7.0 * row[1]);
        let mut factor = TriangularFactor::new(3);
        factor.add_rows(&a);
        let r = factor.upper();
        assert!(r[8].abs() < 1e-13 * r[5].abs(), "{}", r[8]);
    }
}
