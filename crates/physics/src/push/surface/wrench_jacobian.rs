//! Friction wrenches with their Jacobians in closed form.
//!
//! For integrated surfaces this is cheaper than evaluating the sums in dual numbers.

use crate::Scalar;
use crate::dual::chained;
use crate::push::planar::{Vector, Wrench, dot};

/// Force x, force y and moment of a surface, and their derivatives with respect to `K` inputs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WrenchWithJacobian<const K: usize> {
    pub values: [f64; 3],
    /// Derivatives of the wrench with respect to the inputs, `[force x, force y, moment][input]`.
    pub jacobian: [[f64; K]; 3],
}

impl<const K: usize> WrenchWithJacobian<K> {
    /// The zero wrench.
    pub fn zero() -> Self {
        Self { values: [0.0; 3], jacobian: [[0.0; K]; 3] }
    }

    /// The wrench as a function of `inputs`, by the chain rule.
    ///
    /// The values of `inputs` must be those at which the Jacobian was computed.
    #[inline]
    pub fn chain_rule<S: Scalar>(&self, inputs: [S; K]) -> Wrench<S> {
        let [x, y, moment] = chained(inputs, self.values, self.jacobian);
        Wrench { force: [x, y], moment }
    }

    /// Adds the friction `k (v, arm·v + c² ω)` of one small patch, with its derivatives.
    ///
    /// `k` is a function of `s = |v|² + c² ω²` with derivative `k_derivative`. The first three inputs are the
    /// velocity of the footprint, x and y, and its rotation.
    #[inline(always)]
    pub fn add_patch(&mut self, patch: &MovingPatch, [k, k_derivative]: [f64; 2]) {
        let (arm, c_squared, half_gradient) = (patch.arm, patch.c_squared, patch.half_gradient());
        let plain = [[1.0, 0.0, arm[0]], [0.0, 1.0, arm[1]], [arm[0], arm[1], dot(arm, arm) + c_squared]];
        for (row, (value, jacobian)) in self.values.iter_mut().zip(&mut self.jacobian).enumerate() {
            *value += k * half_gradient[row];
            for column in 0..3 {
                jacobian[column] +=
                    k * plain[row][column] + 2.0 * k_derivative * half_gradient[row] * half_gradient[column];
            }
        }
    }
}

/// A small patch of a moving footprint: arm, velocity and size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingPatch {
    /// Position of the patch in the footprint, rotated by 90 degrees, m.
    pub arm: Vector<f64>,
    /// Velocity of the centre of the patch, m/s.
    pub v: Vector<f64>,
    /// Square of the length `c` of the patch as a small ellipsoidal surface, m².
    pub c_squared: f64,
    /// Angular velocity of the footprint, rad/s.
    pub rotation: f64,
}

impl MovingPatch {
    /// The patch at `arm` of a footprint that moves with `twist` (velocity x, velocity y, rotation).
    #[inline(always)]
    pub fn new(arm: Vector<f64>, c_squared: f64, twist: [f64; 3]) -> Self {
        let [x, y, rotation] = twist;
        Self { arm, v: [x + arm[0] * rotation, y + arm[1] * rotation], c_squared, rotation }
    }

    /// Squared generalised speed `|v|² + c² ω²` of the patch, m²/s².
    #[inline(always)]
    pub fn square(&self) -> f64 {
        dot(self.v, self.v) + self.rotation * self.rotation * self.c_squared
    }

    /// Half the derivatives of the [`square`](Self::square) with respect to the twist.
    #[inline(always)]
    pub fn half_gradient(&self) -> [f64; 3] {
        [self.v[0], self.v[1], dot(self.arm, self.v) + self.rotation * self.c_squared]
    }
}

#[cfg(test)]
mod tests {
    //! Contract: wrenches and Jacobians in closed form agree with sums evaluated in dual numbers.
    //!
    //! The tolerance, relative to the largest derivative, is 1e-9 for patches and 1e-7 for a polygon, because
    //! the sums over its edges cancel if the centre of rotation is far away.
    use super::*;
    use crate::Dual;
    use crate::push::outline::Polygon;
    use crate::push::surface::patches::{self, Patch, SpeedLaw};
    use crate::push::surface::uniform::UniformPolygon;

    fn assert_agrees<const K: usize>(
        closed_form: &WrenchWithJacobian<K>,
        expected: &Wrench<Dual<K>>,
        tolerance: f64,
    ) {
        let expected = [expected.force[0], expected.force[1], expected.moment];
        for row in 0..3 {
            assert!(
                (closed_form.values[row] - expected[row].value).abs() < 1e-3 * tolerance,
                "{row}: {closed_form:?} {expected:?}"
            );
            let largest = expected[row].d.iter().fold(1e-3, |a: f64, b| a.max(b.abs()));
            for k in 0..K {
                let off = (closed_form.jacobian[row][k] - expected[row].d[k]).abs();
                assert!(off < tolerance * largest, "{row} {k}: {closed_form:?} {expected:?}");
            }
        }
    }

    /// Twists for the tests, with the centre of rotation inside, on a vertex, on an edge, outside, far away.
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
    fn jacobian_of_a_uniform_polygon_agrees_with_dual_numbers() {
        let corners = [[-0.04, -0.03], [0.05, -0.03], [0.04, 0.03], [0.0, 0.005], [-0.04, 0.03]];
        let polygon = UniformPolygon::new(&Polygon::new(&corners).expect("a polygon"));
        for twist in TWISTS {
            let [x, y, r] = std::array::from_fn(|i| Dual::<3>::variable(twist[i], i));
            assert_agrees(&polygon.wrench_with_jacobian(twist), &polygon.wrench([x, y], r, None), 1e-7);
        }
    }

    #[test]
    fn jacobian_of_patches_agrees_with_dual_numbers() {
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
            assert_agrees(&patches::wrench_with_jacobian(&patches, &weights, twist), &plain, 1e-9);
            let inputs = [twist[0], twist[1], twist[2], 0.4, 0.03];
            let [x, y, r, rise, speed_m_s] = std::array::from_fn(|i| Dual::<5>::variable(inputs[i], i));
            let law = SpeedLaw { rise, speed_m_s };
            let slower = patches::wrench(&patches, &weights, [x, y], r, None, Some(&law));
            assert_agrees(&patches::wrench_with_jacobian_by_speed(&patches, &weights, inputs), &slower, 1e-9);
            let inputs = [twist[0], twist[1], twist[2], 0.4, 0.03, 1.2, 0.1, 0.2, 0.8];
            let [x, y, r, rise, speed_m_s, xx, xy, yx, yy] =
                std::array::from_fn(|i| Dual::<9>::variable(inputs[i], i));
            for law in [None, Some(SpeedLaw { rise, speed_m_s })] {
                let map = [[xx, xy], [yx, yy]];
                let mapped = patches::wrench(&patches, &weights, [x, y], r, Some(&map), law.as_ref());
                let jacobian =
                    patches::wrench_with_jacobian_of_map(&patches, &weights, inputs, law.is_some());
                assert_agrees(&jacobian, &mapped, 1e-9);
            }
        }
    }
}
