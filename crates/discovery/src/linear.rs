//! Dense symmetric matrices of at most a few dozen rows: factorisation, solution, eigenvalues.
//!
//! Implemented here because at this size the calls into a general library cost more than the arithmetic.

/// A square matrix, stored by rows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Square {
    pub n: usize,
    pub a: Vec<f64>,
}

impl Square {
    pub fn zero(n: usize) -> Self {
        Self { n, a: vec![0.0; n * n] }
    }

    #[inline]
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.a[i * self.n + j]
    }

    #[inline]
    pub fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.a[i * self.n + j]
    }

    /// Adds `weight` times a matrix of equal size.
    pub fn add(&mut self, weight: f64, other: &Self) {
        self.a.iter_mut().zip(&other.a).for_each(|(sum, x)| *sum += weight * x);
    }

    /// Sum of matrices of size `n`.
    pub fn sum<'a>(n: usize, all: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut sum = Self::zero(n);
        all.into_iter().for_each(|other| sum.add(1.0, other));
        sum
    }

    /// Difference to another matrix of equal size.
    pub fn minus(&self, other: &Self) -> Self {
        Self { n: self.n, a: self.a.iter().zip(&other.a).map(|(x, y)| x - y).collect() }
    }

    /// Submatrix of the rows and columns with the indices `keep`.
    pub fn sub(&self, keep: &[usize]) -> Self {
        let mut s = Self::zero(keep.len());
        for (i, &r) in keep.iter().enumerate() {
            for (j, &c) in keep.iter().enumerate() {
                *s.at_mut(i, j) = self.at(r, c);
            }
        }
        s
    }

    /// Returns the matrix with its diagonal multiplied by `1 + damping`.
    pub fn damped(&self, damping: f64) -> Self {
        let mut d = self.clone();
        if damping > 0.0 {
            (0..d.n).for_each(|i| *d.at_mut(i, i) *= 1.0 + damping);
        }
        d
    }

    /// Decrease of a quadratic cost along `step`, with this matrix as curvature: `step' (2 gradient - self
    /// step)`.
    pub fn cost_decrease(&self, gradient: &[f64], step: &[f64]) -> f64 {
        let curved = |i: usize| step.iter().enumerate().map(|(k, x)| self.at(i, k) * x).sum::<f64>();
        step.iter().enumerate().map(|(i, x)| x * (2.0 * gradient[i] - curved(i))).sum()
    }

    /// Cholesky factor of the matrix. A pivot below 1e-13 of its diagonal entry marks a direction without
    /// information: it is set to infinity, so that solutions do not move along it.
    pub fn cholesky(&self) -> Cholesky {
        let n = self.n;
        let mut l = self.a.clone();
        let mut log_det = 0.0;
        for j in 0..n {
            let diagonal = self.at(j, j);
            let mut d = diagonal;
            for k in 0..j {
                d -= l[j * n + k] * l[j * n + k];
            }
            if !(d > 1e-13 * diagonal && d > 0.0) {
                d = f64::INFINITY;
            } else {
                log_det += d.ln();
            }
            let root = d.sqrt();
            l[j * n + j] = root;
            for i in j + 1..n {
                let mut s = l[i * n + j];
                for k in 0..j {
                    s -= l[i * n + k] * l[j * n + k];
                }
                l[i * n + j] = s / root;
            }
        }
        Cholesky { n, l, log_det }
    }

    /// Lower triangle `R` with `R R'` equal to the matrix. Columns of directions without variance are 0.
    pub fn lower_factor(&self) -> Square {
        let factor = self.cholesky();
        let mut root = Square::zero(self.n);
        for i in 0..self.n {
            for j in 0..=i {
                let entry = factor.l[i * self.n + j];
                *root.at_mut(i, j) = if entry.is_finite() { entry } else { 0.0 };
            }
        }
        root
    }

    /// Eigenvalues and eigenvectors (as columns) of the symmetric matrix, by Jacobi rotations.
    pub fn eigen(&self) -> (Vec<f64>, Square) {
        let n = self.n;
        let (mut a, mut v) = (self.clone(), Square::zero(n));
        (0..n).for_each(|i| *v.at_mut(i, i) = 1.0);
        for _ in 0..60 {
            let off: f64 =
                (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a.at(i, j).powi(2)).sum();
            if off < 1e-24 * (0..n).map(|i| a.at(i, i).powi(2)).sum::<f64>() {
                break;
            }
            for p in 0..n {
                for q in p + 1..n {
                    let apq = a.at(p, q);
                    if apq == 0.0 {
                        continue;
                    }
                    let theta = (a.at(q, q) - a.at(p, p)) / (2.0 * apq);
                    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                    let c = 1.0 / (t * t + 1.0).sqrt();
                    let s = t * c;
                    for k in 0..n {
                        let (x, y) = (a.at(k, p), a.at(k, q));
                        *a.at_mut(k, p) = c * x - s * y;
                        *a.at_mut(k, q) = s * x + c * y;
                    }
                    for k in 0..n {
                        let (x, y) = (a.at(p, k), a.at(q, k));
                        *a.at_mut(p, k) = c * x - s * y;
                        *a.at_mut(q, k) = s * x + c * y;
                        let (x, y) = (v.at(k, p), v.at(k, q));
                        *v.at_mut(k, p) = c * x - s * y;
                        *v.at_mut(k, q) = s * x + c * y;
                    }
                }
            }
        }
        ((0..n).map(|i| a.at(i, i)).collect(), v)
    }
}

/// Cholesky factorisation `L L'` of a symmetric matrix.
#[derive(Clone, Debug)]
pub(crate) struct Cholesky {
    n: usize,
    l: Vec<f64>,
    /// Logarithm of the determinant, without the directions that carry no information.
    pub log_det: f64,
}

impl Cholesky {
    /// Whether every pivot was positive, so that the matrix carries information along every direction.
    pub fn is_definite(&self) -> bool {
        (0..self.n).all(|i| self.l[i * self.n + i].is_finite())
    }

    /// Solves `L y = x` in place: `x <- L^-1 x`.
    pub fn forward(&self, x: &mut [f64]) {
        for i in 0..self.n {
            let mut s = x[i];
            for (l, y) in self.l[i * self.n..].iter().zip(&x[..i]) {
                s -= l * y;
            }
            x[i] = s / self.l[i * self.n + i];
        }
    }

    /// Solves `L L' y = x` in place: `x <- (L L')^-1 x`.
    pub fn solve(&self, x: &mut [f64]) {
        self.forward(x);
        for i in (0..self.n).rev() {
            let mut s = x[i];
            for (k, y) in x.iter().enumerate().skip(i + 1) {
                s -= self.l[k * self.n + i] * y;
            }
            x[i] = s / self.l[i * self.n + i];
        }
    }

    /// Inverse of the factorised matrix.
    pub fn inverse(&self) -> Square {
        let mut inverse = Square::zero(self.n);
        let mut x = vec![0.0; self.n];
        for j in 0..self.n {
            x.fill(0.0);
            x[j] = 1.0;
            self.solve(&mut x);
            for (i, v) in x.iter().enumerate() {
                *inverse.at_mut(i, j) = *v;
            }
        }
        inverse
    }
}

/// Eliminates the variables from index `keep` on from the equations `h x = g`. Returns the Schur complement
/// `H_aa - H_an H_nn^-1 H_na`, the reduced right-hand side, and the Cholesky factor of `H_nn`.
pub(crate) fn eliminate(h: &Square, g: &[f64], keep: usize) -> (Square, Vec<f64>, Cholesky) {
    let n = h.n;
    let tail: Vec<usize> = (keep..n).collect();
    let factor = h.sub(&tail).cholesky();
    // W = L^-1 H_na, w = L^-1 g_n: the complement is H_aa - W'W, g_a - W'w.
    let mut w: Vec<Vec<f64>> = (0..keep).map(|i| (keep..n).map(|k| h.at(k, i)).collect()).collect();
    w.iter_mut().for_each(|column| factor.forward(column));
    let mut last: Vec<f64> = g[keep..].to_vec();
    factor.forward(&mut last);
    let mut s = Square::zero(keep);
    for i in 0..keep {
        for j in 0..=i {
            let v = h.at(i, j) - dot(&w[i], &w[j]);
            *s.at_mut(i, j) = v;
            *s.at_mut(j, i) = v;
        }
    }
    let u = (0..keep).map(|i| g[i] - dot(&w[i], &last)).collect();
    (s, u, factor)
}

/// Scalar product of two vectors.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    //! Contract: solutions satisfy their equations and eigenvectors their definition, to rounding of 1e-10
    //! at the sizes of this crate.
    use super::*;

    fn sample(n: usize) -> Square {
        let mut m = Square::zero(n);
        for i in 0..n {
            for j in 0..n {
                *m.at_mut(i, j) =
                    1.0 / (1.0 + (i as f64 - j as f64).powi(2)) + f64::from(u8::from(i == j)) * (i as f64);
            }
        }
        m
    }

    #[test]
    fn solving_the_whole_system_equals_solving_after_elimination() {
        let (h, g) = (sample(7), [1.0, -2.0, 0.5, 3.0, 1.0, 0.1, -1.0]);
        let mut x = g;
        h.cholesky().solve(&mut x);
        let (s, u, _) = eliminate(&h, &g, 3);
        let mut y = u;
        s.cholesky().solve(&mut y);
        for i in 0..3 {
            assert!((x[i] - y[i]).abs() < 1e-10);
        }
    }

    #[test]
    fn eigenvectors_reproduce_the_matrix() {
        let h = sample(6);
        let (values, v) = h.eigen();
        for i in 0..6 {
            for j in 0..6 {
                let back: f64 = (0..6).map(|k| v.at(i, k) * values[k] * v.at(j, k)).sum();
                assert!((back - h.at(i, j)).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn a_direction_without_information_does_not_move() {
        let mut h = sample(3);
        for k in 0..3 {
            *h.at_mut(2, k) = 0.0;
            *h.at_mut(k, 2) = 0.0;
        }
        let mut x = [1.0, 1.0, 1.0];
        h.cholesky().solve(&mut x);
        assert_eq!(x[2], 0.0);
    }
}
