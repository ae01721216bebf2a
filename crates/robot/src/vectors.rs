//! Vectors and symmetric tensors in three dimensions over an [`Algebra`].
//!
//! Factors that the description file fixes, such as placements and axes, are `f64`: products with 0 and 1 are skipped, so
//! that the equations of an arm whose axes are parallel or perpendicular stay short.

use crate::algebra::Algebra;
use crate::description::Placement;
use crate::rotation::compose;

/// Elements (row, column) of a symmetric tensor in the order in which its six values are stored.
pub(crate) const SYMMETRIC: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

/// Index of the stored value of element (row, column) of a symmetric tensor; the inverse of [`SYMMETRIC`].
pub(crate) const STORED: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// Operations on vectors and symmetric tensors; every [`Algebra`] has them.
///
/// Elements are written out: the closures of `map` on arrays stay calls in long functions, at several times the cost.
pub(crate) trait Vectors: Algebra {
    /// The sum of the products `factor * value`; see [`Algebra::SKIPS_CONSTANTS`].
    #[inline(always)]
    fn combine<const K: usize>(&mut self, terms: [(f64, Self::Value); K]) -> Self::Value {
        if !Self::SKIPS_CONSTANTS {
            let mut sum = self.scale(terms[0].0, terms[0].1);
            for &(factor, value) in &terms[1..] {
                let product = self.scale(factor, value);
                sum = self.add(sum, product);
            }
            return sum;
        }
        let mut sum = None;
        for &(factor, value) in &terms {
            if factor == 0.0 {
                continue;
            }
            sum = Some(match sum {
                None if factor == 1.0 => value,
                None if factor == -1.0 => self.negate(value),
                None => self.scale(factor, value),
                Some(sum) if factor == 1.0 => self.add(sum, value),
                Some(sum) if factor == -1.0 => self.subtract(sum, value),
                Some(sum) => {
                    let product = self.scale(factor, value);
                    self.add(sum, product)
                }
            });
        }
        match sum {
            Some(sum) => sum,
            None => self.constant(0.0),
        }
    }

    /// The product of a constant and a value.
    #[inline(always)]
    fn scale(&mut self, factor: f64, value: Self::Value) -> Self::Value {
        let factor = self.constant(factor);
        self.multiply(factor, value)
    }

    /// The sum `x1 * y1 + x2 * y2`.
    #[inline(always)]
    fn sum_of_products(&mut self, [x1, y1]: [Self::Value; 2], [x2, y2]: [Self::Value; 2]) -> Self::Value {
        let (first, second) = (self.multiply(x1, y1), self.multiply(x2, y2));
        self.add(first, second)
    }

    /// The difference `x1 * y1 - x2 * y2`.
    #[inline(always)]
    fn difference_of_products(
        &mut self,
        [x1, y1]: [Self::Value; 2],
        [x2, y2]: [Self::Value; 2],
    ) -> Self::Value {
        let (first, second) = (self.multiply(x1, y1), self.multiply(x2, y2));
        self.subtract(first, second)
    }

    /// The vector 0.
    #[inline(always)]
    fn zero3(&mut self) -> [Self::Value; 3] {
        [self.constant(0.0); 3]
    }

    /// The sum `x + y`.
    #[inline(always)]
    fn add3(&mut self, x: [Self::Value; 3], y: [Self::Value; 3]) -> [Self::Value; 3] {
        [self.add(x[0], y[0]), self.add(x[1], y[1]), self.add(x[2], y[2])]
    }

    /// The difference `x - y`.
    #[inline(always)]
    fn subtract3(&mut self, x: [Self::Value; 3], y: [Self::Value; 3]) -> [Self::Value; 3] {
        [self.subtract(x[0], y[0]), self.subtract(x[1], y[1]), self.subtract(x[2], y[2])]
    }

    /// The negative vector `-x`.
    #[inline(always)]
    fn negate3(&mut self, x: [Self::Value; 3]) -> [Self::Value; 3] {
        [self.negate(x[0]), self.negate(x[1]), self.negate(x[2])]
    }

    /// The vector `factor * x`.
    #[inline(always)]
    fn scale3(&mut self, factor: Self::Value, x: [Self::Value; 3]) -> [Self::Value; 3] {
        [self.multiply(factor, x[0]), self.multiply(factor, x[1]), self.multiply(factor, x[2])]
    }

    /// The sum `x + factor * direction`.
    #[inline(always)]
    fn add_along(
        &mut self,
        x: [Self::Value; 3],
        direction: [f64; 3],
        factor: Self::Value,
    ) -> [Self::Value; 3] {
        [
            self.combine([(1.0, x[0]), (direction[0], factor)]),
            self.combine([(1.0, x[1]), (direction[1], factor)]),
            self.combine([(1.0, x[2]), (direction[2], factor)]),
        ]
    }

    /// The scalar product of `x` and `y`.
    #[inline(always)]
    fn dot(&mut self, x: [Self::Value; 3], y: [Self::Value; 3]) -> Self::Value {
        let sum = self.sum_of_products([x[0], y[0]], [x[1], y[1]]);
        let last = self.multiply(x[2], y[2]);
        self.add(sum, last)
    }

    /// The scalar product of a constant vector and `x`.
    #[inline(always)]
    fn dot_constant(&mut self, constant: [f64; 3], x: [Self::Value; 3]) -> Self::Value {
        self.combine([(constant[0], x[0]), (constant[1], x[1]), (constant[2], x[2])])
    }

    /// The vector product `x × y`.
    #[inline(always)]
    fn cross(&mut self, x: [Self::Value; 3], y: [Self::Value; 3]) -> [Self::Value; 3] {
        [
            self.difference_of_products([x[1], y[2]], [x[2], y[1]]),
            self.difference_of_products([x[2], y[0]], [x[0], y[2]]),
            self.difference_of_products([x[0], y[1]], [x[1], y[0]]),
        ]
    }

    /// The vector product `constant × x`.
    #[inline(always)]
    fn cross_constant(&mut self, constant: [f64; 3], x: [Self::Value; 3]) -> [Self::Value; 3] {
        [
            self.combine([(constant[1], x[2]), (-constant[2], x[1])]),
            self.combine([(constant[2], x[0]), (-constant[0], x[2])]),
            self.combine([(constant[0], x[1]), (-constant[1], x[0])]),
        ]
    }

    /// The product of a constant matrix and `x`.
    #[inline(always)]
    fn apply_constant(&mut self, matrix: &[[f64; 3]; 3], x: [Self::Value; 3]) -> [Self::Value; 3] {
        [self.dot_constant(matrix[0], x), self.dot_constant(matrix[1], x), self.dot_constant(matrix[2], x)]
    }

    /// The product of a matrix of values and a constant vector.
    #[inline(always)]
    fn apply_to_constant(&mut self, matrix: &[[Self::Value; 3]; 3], constant: [f64; 3]) -> [Self::Value; 3] {
        [
            self.dot_constant(constant, matrix[0]),
            self.dot_constant(constant, matrix[1]),
            self.dot_constant(constant, matrix[2]),
        ]
    }

    /// The product of a matrix of values and `x`.
    #[inline(always)]
    fn apply(&mut self, matrix: &[[Self::Value; 3]; 3], x: [Self::Value; 3]) -> [Self::Value; 3] {
        [self.dot(matrix[0], x), self.dot(matrix[1], x), self.dot(matrix[2], x)]
    }

    /// The product of a symmetric tensor and `x`.
    #[inline(always)]
    fn apply_symmetric(&mut self, tensor: &[Self::Value; 6], x: [Self::Value; 3]) -> [Self::Value; 3] {
        let [row0, row1, row2] = symmetric_rows(tensor);
        [self.dot(row0, x), self.dot(row1, x), self.dot(row2, x)]
    }
}

impl<A: Algebra> Vectors for A {}

/// Transposed matrix.
#[inline(always)]
pub(crate) fn transposed<T: Copy>([x, y, z]: &[[T; 3]; 3]) -> [[T; 3]; 3] {
    [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
}

/// Rows of a symmetric tensor.
#[inline(always)]
pub(crate) fn symmetric_rows<T: Copy>(&[xx, xy, xz, yy, yz, zz]: &[T; 6]) -> [[T; 3]; 3] {
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// Symmetric tensor `rotation * tensor * rotation^T`, where `turn` multiplies a vector by the rotation.
#[inline(always)]
pub(crate) fn turned_tensor<A: Algebra>(
    a: &mut A,
    tensor: &[A::Value; 6],
    mut turn: impl FnMut(&mut A, [A::Value; 3]) -> [A::Value; 3],
) -> [A::Value; 6] {
    // The tensor is symmetric: its rows are its columns.
    let [x, y, z] = symmetric_rows(tensor);
    let columns = [turn(a, x), turn(a, y), turn(a, z)];
    let [x, y, z] = transposed(&columns);
    let rows = [turn(a, x), turn(a, y), turn(a, z)];
    [rows[0][0], rows[0][1], rows[0][2], rows[1][1], rows[1][2], rows[2][2]]
}

/// Elements that differ from 0, 1 or -1 by less than this are rounding errors of an angle such as pi/2.
const ROUNDING: f64 = 1e-15;

/// Placement of a frame that is at `second` in a frame that is at `first`.
///
/// Rotation elements within rounding of 0, 1 or -1 get these values, so that products with them are skipped.
pub(crate) fn composed(first: &Placement, second: &Placement) -> Placement {
    let Placement { rotation, translation_m } = compose(first, second);
    Placement { rotation: rotation.map(|row| row.map(rounded)), translation_m }
}

/// The three matrices of Rodrigues' formula: rotation = first + cos(angle) * second + sin(angle) * third.
pub(crate) fn rotation_terms(axis: [f64; 3]) -> [[[f64; 3]; 3]; 3] {
    let [x, y, z] = axis;
    let along = axis.map(|row| axis.map(|column| row * column));
    let across = [0, 1, 2].map(|i| [0, 1, 2].map(|j| f64::from(u8::from(i == j)) - along[i][j]));
    [along, across, [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]]
}

/// The value, or 0, 1 or -1 where the value differs from it by rounding only.
pub(crate) fn rounded(value: f64) -> f64 {
    [0.0, 1.0, -1.0].into_iter().find(|exact| (value - exact).abs() < ROUNDING).unwrap_or(value)
}
