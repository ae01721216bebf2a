//! Wrenches with their slopes in closed form: what integrated surfaces give to derivatives, cheaper than dual numbers.

use crate::Scalar;
use crate::dual::chained;
use crate::push::planar::{Vector, Wrench, dot};

/// Force x, force y and moment of a surface, with their slopes in `K` numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sloped<const K: usize> {
    pub values: [f64; 3],
    /// `[output][input]`
    pub slopes: [[f64; K]; 3],
}

impl<const K: usize> Sloped<K> {
    pub fn zero() -> Self {
        Self { values: [0.0; 3], slopes: [[0.0; K]; 3] }
    }

    /// The wrench at `inputs`, whose values are those that the slopes belong to, by the chain rule.
    #[inline]
    pub fn through<S: Scalar>(&self, inputs: [S; K]) -> Wrench<S> {
        let [x, y, moment] = chained(inputs, self.values, self.slopes);
        Wrench { force: [x, y], moment }
    }

    /// Adds `k (v, arm·v + c² ω)`, the friction of a small patch with its centre at `arm` turned back by 90 degrees and the
    /// velocity `v` there, where `k` is a function of `s = |v|² + c² ω²` with the slope `k_slope`. The first three inputs are
    /// the velocity of the footprint and its rotation.
    #[inline(always)]
    pub fn add_patch(&mut self, patch: &Moving, [k, k_slope]: [f64; 2]) {
        let &Moving { arm, v, c_squared, rotation } = patch;
        // Halves of the slopes of s.
        let half = [v[0], v[1], dot(arm, v) + rotation * c_squared];
        let plain = [[1.0, 0.0, arm[0]], [0.0, 1.0, arm[1]], [arm[0], arm[1], dot(arm, arm) + c_squared]];
        for (row, (value, slopes)) in self.values.iter_mut().zip(&mut self.slopes).enumerate() {
            *value += k * half[row];
            for column in 0..3 {
                slopes[column] += k * plain[row][column] + 2.0 * k_slope * half[row] * half[column];
            }
        }
    }
}

/// A small patch of a footprint that moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moving {
    /// Its place, turned by 90 degrees, m.
    pub arm: Vector<f64>,
    /// Its velocity, m/s.
    pub v: Vector<f64>,
    /// Square of its own `c`, m².
    pub c_squared: f64,
    /// Rotation of the footprint, rad/s.
    pub rotation: f64,
}

impl Moving {
    /// The patch at `arm` of a footprint that moves with `twist` (velocity, rotation).
    #[inline(always)]
    pub fn new(arm: Vector<f64>, c_squared: f64, twist: [f64; 3]) -> Self {
        let [x, y, rotation] = twist;
        Self { arm, v: [x + arm[0] * rotation, y + arm[1] * rotation], c_squared, rotation }
    }

    /// `|v|² + c² ω²`, m²/s².
    #[inline(always)]
    pub fn square(&self) -> f64 {
        dot(self.v, self.v) + self.rotation * self.rotation * self.c_squared
    }
}

#[cfg(test)]
mod tests {
    //! Contract: values and slopes in closed form are those of dual numbers through the plain sums, to rounding: 1e-9 of the
    //! largest for patches, 1e-7 for a polygon, because the sums over its edges cancel where the centre of rotation is far.
    use super::*;
    use crate::Dual;
    use crate::push::outline::Polygon;
    use crate::push::surface::patches::{self, Patch, SpeedLaw};
    use crate::push::surface::uniform::UniformPolygon;

    fn agrees<const K: usize>(found: &Sloped<K>, wanted: &Wrench<Dual<K>>, tolerance: f64) {
        let wanted = [wanted.force[0], wanted.force[1], wanted.moment];
        for row in 0..3 {
            assert!(
                (found.values[row] - wanted[row].value).abs() < 1e-3 * tolerance,
                "{row}: {found:?} {wanted:?}"
            );
            let largest = wanted[row].d.iter().fold(1e-3, |a: f64, b| a.max(b.abs()));
            for k in 0..K {
                let off = (found.slopes[row][k] - wanted[row].d[k]).abs();
                assert!(off < tolerance * largest, "{row} {k}: {found:?} {wanted:?}");
            }
        }
    }

    /// Velocities and rotations: centres inside, on a vertex, on an edge, outside, and far away.
    const TWISTS: [[f64; 3]; 8] = [
        [0.01, -0.02, 1.0],
        [0.0, 0.0, -2.0],
        [-0.03, -0.04, -1.0],
        [0.0, 0.02, 1.0],
        [0.05, 0.01, 0.3],
        [0.05, 0.01, -0.009],
        [0.05, 0.01, 0.0],
        [1e-4, 2e-5, 4e-3],
    ];

    #[test]
    fn a_uniform_polygon_has_the_slopes_of_its_closed_form() {
        let corners = [[-0.04, -0.03], [0.05, -0.03], [0.04, 0.03], [0.0, 0.005], [-0.04, 0.03]];
        let polygon = UniformPolygon::new(&Polygon::new(&corners).expect("a polygon"));
        for twist in TWISTS {
            let [x, y, r] = std::array::from_fn(|i| Dual::<3>::variable(twist[i], i));
            agrees(&polygon.sloped(twist), &polygon.wrench([x, y], r, None), 1e-7);
        }
    }

    #[test]
    fn patches_have_the_slopes_of_their_sum() {
        let patch = |i: i32| Patch {
            position: [0.01 * f64::from(i - 3), 0.007 * f64::from(i * i % 5) - 0.01],
            c_squared: 1e-5,
            share: 0.2,
        };
        let patches: Vec<Patch> = (0..6).map(patch).collect();
        let weights: Vec<f64> = (0..6).map(|i| 0.1 + 0.03 * f64::from(i)).collect();
        for twist in TWISTS {
            let [x, y, r] = std::array::from_fn(|i| Dual::<3>::variable(twist[i], i));
            let plain = patches::wrench(&patches, &weights, [x, y], r, None, None);
            agrees(&patches::sloped(&patches, &weights, twist), &plain, 1e-9);
            let inputs = [twist[0], twist[1], twist[2], 0.4, 0.03];
            let [x, y, r, rise, speed_m_s] = std::array::from_fn(|i| Dual::<5>::variable(inputs[i], i));
            let law = SpeedLaw { rise, speed_m_s };
            let slower = patches::wrench(&patches, &weights, [x, y], r, None, Some(&law));
            agrees(&patches::sloped_by_speed(&patches, &weights, inputs), &slower, 1e-9);
        }
    }
}
