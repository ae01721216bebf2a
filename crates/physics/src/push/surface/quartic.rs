//! The convex polynomial force-motion model of Zhou, Paolini, Bagnell and Mason (ICRA 2016).
//!
//! Friction wrenches of a sliding object lie on a level set of a convex homogeneous polynomial of degree
//! four; the twist is along its gradient. With `F = (f_x, f_y, m/c)` the polynomial is
//!
//! ```text
//! H(F) = Σ_k (Fᵀ A_k F)²        (1)
//! ```
//!
//! with positive definite `A_k`. This form is a sum of squares and convex for any such `A_k`, so the fit
//! needs no constraint. The friction against a twist `V = (v_x, v_y, c ω)` is the point of `H = 1` with
//! normal `V`. It is found as the minimum over `G` of the convex function
//!
//! ```text
//! H(G)/4 − G·V        (2)
//! ```
//!
//! scaled back to the level set.

use super::wrench_jacobian::WrenchWithJacobian;
use crate::scalar::{cross, dot};

/// Number of quadratic forms `A_k` in the polynomial of formula (1).
pub const QUADRATIC_FORMS: usize = 2;
/// Maximum number of Newton steps for one friction wrench; convergence is quadratic.
const MAX_NEWTON_STEPS: usize = 40;
/// Maximum number of halvings of one Newton step in the line search.
const MAX_HALVINGS: usize = 30;
/// Norm of the gradient, for a unit twist, below which the minimum counts as found.
const GRADIENT_TOLERANCE: f64 = 1e-12;

type Vec3 = [f64; 3];
type Mat3 = [Vec3; 3];

/// The convex polynomial `H` of formula (1), whose level set is the limit surface of one footprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Quartic {
    /// Length `c` by which moments are divided, m.
    c_m: f64,
    /// Matrices `A_k` of the polynomial.
    forms: [Mat3; QUADRATIC_FORMS],
}

impl Quartic {
    /// The polynomial of formula (1) with the symmetric, positive definite forms `A_k`.
    ///
    /// They act on wrenches `(f_x, f_y, m/c)` in units of the sliding force; `c_m` is `c`, m.
    pub fn new(c_m: f64, forms: [Mat3; QUADRATIC_FORMS]) -> Self {
        Self { c_m, forms }
    }

    /// The polynomial whose level set is the ellipsoid with ratio `c`, m: all forms are equal.
    ///
    /// ```
    /// use augsim_physics::push::surface::{Surface, quartic::Quartic};
    /// let quartic = Quartic::ellipsoid(0.03);
    /// let w = Surface::Quartic { quartic: &quartic }.wrench([0.0, 0.0], 2.0, None);
    /// // Pure rotation is resisted by a moment of c, in units of the sliding force.
    /// assert!((w.moment - 0.03).abs() < 1e-12);
    /// ```
    pub fn ellipsoid(c_m: f64) -> Self {
        let diagonal = (1.0 / QUADRATIC_FORMS as f64).sqrt();
        let form = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { diagonal } else { 0.0 }));
        Self { c_m, forms: [form; QUADRATIC_FORMS] }
    }

    /// Ratio of the moment in pure rotation to the force along the x axis, m.
    pub fn nominal_c(&self) -> f64 {
        let along = |k: usize| self.forms.iter().map(|a| a[k][k].powi(2)).sum::<f64>();
        self.c_m * (along(0) / along(2)).powf(0.25)
    }

    /// Friction wrench against a twist (m/s, m/s, rad/s), and its Jacobian.
    pub(super) fn wrench_with_jacobian(&self, twist: Vec3) -> WrenchWithJacobian<3> {
        let unit = [1.0, 1.0, self.c_m];
        let v = [0, 1, 2].map(|i| twist[i] * unit[i]);
        let size = dot(&v, &v).sqrt();
        if size <= 0.0 {
            return WrenchWithJacobian::zero();
        }
        let v = v.map(|x| x / size);
        let g = self.conjugate(&v);
        let (h, m) = (4.0 * self.quarter_value(&g), self.hessian(&g));
        let root = h.powf(-0.25);
        // dF = h^(-1/4) (1 − G Vᵀ/h) M⁻¹ dV, since the gradient of H/4 is V and H is homogeneous.
        let columns = [0, 1, 2].map(|k| {
            let mut e = [0.0; 3];
            e[k] = 1.0;
            let dg = solve(&m, e);
            let along = dot(&v, &dg) / h;
            [0, 1, 2].map(|i| root * (dg[i] - along * g[i]) / size)
        });
        WrenchWithJacobian {
            values: [0, 1, 2].map(|i| unit[i] * root * g[i]),
            jacobian: [0, 1, 2].map(|i| [0, 1, 2].map(|k| unit[i] * columns[k][i] * unit[k])),
        }
    }

    /// Scaled wrench at which the function (2) is smallest for a unit twist `v`, by damped Newton steps.
    fn conjugate(&self, v: &Vec3) -> Vec3 {
        let merit = |g: &Vec3| self.quarter_value(g) - dot(g, v);
        // Start at the minimum along the direction of V itself.
        let length = (4.0 * self.quarter_value(v)).powf(-1.0 / 3.0);
        let mut g = v.map(|x| length * x);
        for _ in 0..MAX_NEWTON_STEPS {
            let gradient: Vec3 = {
                let h_gradient = self.gradient(&g);
                [0, 1, 2].map(|i| h_gradient[i] - v[i])
            };
            if dot(&gradient, &gradient).sqrt() <= GRADIENT_TOLERANCE {
                break;
            }
            let step = solve(&self.hessian(&g), gradient);
            let (before, decrease) = (merit(&g), dot(&gradient, &step));
            let mut factor = 1.0;
            for _ in 0..MAX_HALVINGS {
                let trial = [0, 1, 2].map(|i| g[i] - factor * step[i]);
                if merit(&trial) <= before - 1e-4 * factor * decrease {
                    break;
                }
                factor *= 0.5;
            }
            g = [0, 1, 2].map(|i| g[i] - factor * step[i]);
        }
        g
    }

    /// Value of `H/4` at the scaled wrench `g`.
    fn quarter_value(&self, g: &Vec3) -> f64 {
        0.25 * self.forms.iter().map(|a| dot(g, &apply(a, g)).powi(2)).sum::<f64>()
    }

    /// Gradient of `H/4` at the scaled wrench `g`.
    fn gradient(&self, g: &Vec3) -> Vec3 {
        let mut out = [0.0; 3];
        for a in &self.forms {
            let ag = apply(a, g);
            let q = dot(g, &ag);
            (0..3).for_each(|i| out[i] += q * ag[i]);
        }
        out
    }

    /// Hessian of `H/4` at the scaled wrench `g`.
    fn hessian(&self, g: &Vec3) -> Mat3 {
        let mut out = [[0.0; 3]; 3];
        for a in &self.forms {
            let ag = apply(a, g);
            let q = dot(g, &ag);
            for i in 0..3 {
                for j in 0..3 {
                    out[i][j] += q * a[i][j] + 2.0 * ag[i] * ag[j];
                }
            }
        }
        out
    }
}

/// Product of a 3 x 3 matrix and a vector.
fn apply(a: &Mat3, g: &Vec3) -> Vec3 {
    [dot(&a[0], g), dot(&a[1], g), dot(&a[2], g)]
}

/// Solution of a symmetric 3 x 3 system `m x = b` by Cramer's rule.
fn solve(m: &Mat3, b: Vec3) -> Vec3 {
    let adjugate = [cross(&m[1], &m[2]), cross(&m[2], &m[0]), cross(&m[0], &m[1])];
    let determinant = dot(&m[0], &adjugate[0]);
    [0, 1, 2].map(|i| (0..3).map(|k| adjugate[k][i] * b[k]).sum::<f64>() / determinant)
}

#[cfg(test)]
mod tests {
    //! Contract: equal forms give the ellipsoid; wrenches lie on the level set with the twist as normal; the
    //! Jacobian agrees with difference quotients; no other wrench of the level set dissipates more.
    use super::*;
    use crate::push::surface::ellipsoid;

    const TWISTS: [Vec3; 5] =
        [[0.01, -0.02, 1.0], [0.0, 0.0, -2.0], [0.05, 0.01, 0.0], [-0.03, -0.04, -1.0], [1e-4, 2e-5, 4e-3]];

    fn anisotropic_quartic() -> Quartic {
        let first = [[1.1, 0.1, -0.05], [0.1, 0.8, 0.2], [-0.05, 0.2, 0.9]];
        let second = [[0.5, -0.2, 0.1], [-0.2, 0.7, 0.0], [0.1, 0.0, 0.2]];
        Quartic::new(0.03, [first, second])
    }

    #[test]
    fn equal_forms_give_the_ellipsoid() {
        let quartic = Quartic::ellipsoid(0.03);
        assert!((quartic.nominal_c() - 0.03).abs() < 1e-15);
        for twist in TWISTS {
            let found = quartic.wrench_with_jacobian(twist).values;
            let expected = ellipsoid::wrench(0.03, [twist[0], twist[1]], twist[2]);
            let expected = [expected.force[0], expected.force[1], expected.moment];
            for k in 0..3 {
                assert!((found[k] - expected[k]).abs() < 1e-12, "{twist:?}: {found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn the_twist_is_the_normal_of_the_level_set_and_dissipation_is_largest() {
        let quartic = anisotropic_quartic();
        for twist in TWISTS {
            let [x, y, moment] = quartic.wrench_with_jacobian(twist).values;
            let (f, v) = ([x, y, moment / 0.03], [twist[0], twist[1], 0.03 * twist[2]]);
            assert!((4.0 * quartic.quarter_value(&f) - 1.0).abs() < 1e-10, "{twist:?}");
            let normal = quartic.gradient(&f);
            let off = cross(&normal, &v);
            let size = (dot(&normal, &normal) * dot(&v, &v)).sqrt();
            assert!(dot(&off, &off).sqrt() < 1e-9 * size && dot(&normal, &v) > 0.0, "{twist:?}");
            for other in TWISTS {
                let [x, y, moment] = quartic.wrench_with_jacobian(other).values;
                assert!(dot(&[x, y, moment / 0.03], &v) <= dot(&f, &v) * (1.0 + 1e-12));
            }
        }
    }

    #[test]
    fn jacobian_agrees_with_difference_quotients() {
        let quartic = anisotropic_quartic();
        for twist in TWISTS {
            let jacobian = quartic.wrench_with_jacobian(twist).jacobian;
            let size = (twist[0].powi(2) + twist[1].powi(2) + (0.03 * twist[2]).powi(2)).sqrt();
            for k in 0..3 {
                let nudge = 1e-6 * size / [1.0, 1.0, 0.03][k];
                let wrench_at = |sign: f64| {
                    let mut moved = twist;
                    moved[k] += sign * nudge;
                    quartic.wrench_with_jacobian(moved).values
                };
                let (up, down) = (wrench_at(1.0), wrench_at(-1.0));
                for i in 0..3 {
                    let unit = [1.0, 1.0, 0.03];
                    let expected = (up[i] - down[i]) / (2.0 * nudge);
                    let scale = unit[i] * unit[k] / size;
                    assert!(
                        (jacobian[i][k] - expected).abs() < 1e-7 * scale,
                        "{twist:?} {i} {k}: {} {expected}",
                        jacobian[i][k]
                    );
                }
            }
        }
    }
}
