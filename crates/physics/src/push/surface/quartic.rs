//! The convex force-motion model of Zhou, Paolini, Bagnell and Mason (ICRA 2016): friction wrenches of a sliding object lie on a level
//! set of a convex homogeneous polynomial of the fourth degree, and twists along its gradient.
//!
//! With `F = (f_x, f_y, m/c)` the polynomial is `H(F) = Σ_k (Fᵀ A_k F)²` with positive definite `A_k`: a sum of squares, and convex, by
//! construction instead of by a constraint of the fit. The friction against a twist `V = (v_x, v_y, c ω)` is where `H = 1` has the
//! normal `V`, found as the minimum of the convex `H(G)/4 − G·V`, scaled back to the level set.

use super::sloped::Sloped;
use crate::scalar::{cross, dot};

/// Squares in the sum.
pub const TERMS: usize = 2;
/// Newton steps for a wrench, which converge quadratically, and halvings of one.
const STEPS: usize = 40;
const HALVINGS: usize = 30;
/// Relative size of the gradient that counts as zero.
const CONVERGED: f64 = 1e-12;

type Vec3 = [f64; 3];
type Mat3 = [Vec3; 3];

/// The polynomial of a footprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Quartic {
    /// Unit of the lengths in moments, m.
    c_m: f64,
    forms: [Mat3; TERMS],
}

impl Quartic {
    /// With symmetric, positive definite forms `A_k` for wrenches `(f_x, f_y, m/c)`, in units of the sliding force.
    pub fn new(c_m: f64, forms: [Mat3; TERMS]) -> Self {
        Self { c_m, forms }
    }

    /// The ellipsoid of ratio `c`, m, as a polynomial: all forms alike.
    ///
    /// ```
    /// use augsim_physics::push::surface::{Surface, quartic::Quartic};
    /// let quartic = Quartic::ellipsoid(0.03);
    /// let w = Surface::Quartic { quartic: &quartic }.wrench([0.0, 0.0], 2.0, None);
    /// // Pure rotation is resisted by a moment of c, in units of the sliding force.
    /// assert!((w.moment - 0.03).abs() < 1e-12);
    /// ```
    pub fn ellipsoid(c_m: f64) -> Self {
        let share = (1.0 / TERMS as f64).sqrt();
        let form = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { share } else { 0.0 }));
        Self { c_m, forms: [form; TERMS] }
    }

    /// Ratio of the largest moment to the largest force along the first axis, m.
    pub fn nominal_c(&self) -> f64 {
        let along = |k: usize| self.forms.iter().map(|a| a[k][k].powi(2)).sum::<f64>();
        self.c_m * (along(0) / along(2)).powf(0.25)
    }

    /// The wrench against a twist (m/s, m/s, rad/s), with its slopes.
    pub(super) fn sloped(&self, twist: Vec3) -> Sloped<3> {
        let unit = [1.0, 1.0, self.c_m];
        let v = [0, 1, 2].map(|i| twist[i] * unit[i]);
        let size = dot(&v, &v).sqrt();
        if size <= 0.0 {
            return Sloped::zero();
        }
        let v = v.map(|x| x / size);
        let g = self.conjugate(&v);
        let (h, m) = (4.0 * self.quarter(&g), self.curvature(&g));
        let root = h.powf(-0.25);
        // dF = h^(-1/4) (1 − G Vᵀ/h) M⁻¹ dV, since the gradient of H/4 is V and H is homogeneous.
        let columns = [0, 1, 2].map(|k| {
            let mut e = [0.0; 3];
            e[k] = 1.0;
            let dg = solve(&m, e);
            let along = dot(&v, &dg) / h;
            [0, 1, 2].map(|i| root * (dg[i] - along * g[i]) / size)
        });
        Sloped {
            values: [0, 1, 2].map(|i| unit[i] * root * g[i]),
            slopes: [0, 1, 2].map(|i| [0, 1, 2].map(|k| unit[i] * columns[k][i] * unit[k])),
        }
    }

    /// Where `H(G)/4 − G·V` is least, for a unit `v`.
    fn conjugate(&self, v: &Vec3) -> Vec3 {
        let merit = |g: &Vec3| self.quarter(g) - dot(g, v);
        // Along V itself.
        let reach = (4.0 * self.quarter(v)).powf(-1.0 / 3.0);
        let mut g = v.map(|x| reach * x);
        for _ in 0..STEPS {
            let gradient: Vec3 = {
                let slope = self.gradient(&g);
                [0, 1, 2].map(|i| slope[i] - v[i])
            };
            if dot(&gradient, &gradient).sqrt() <= CONVERGED {
                break;
            }
            let step = solve(&self.curvature(&g), gradient);
            let (before, fall) = (merit(&g), dot(&gradient, &step));
            let mut share = 1.0;
            for _ in 0..HALVINGS {
                let trial = [0, 1, 2].map(|i| g[i] - share * step[i]);
                if merit(&trial) <= before - 1e-4 * share * fall {
                    break;
                }
                share *= 0.5;
            }
            g = [0, 1, 2].map(|i| g[i] - share * step[i]);
        }
        g
    }

    /// `H/4`.
    fn quarter(&self, g: &Vec3) -> f64 {
        0.25 * self.forms.iter().map(|a| dot(g, &apply(a, g)).powi(2)).sum::<f64>()
    }

    /// Gradient of `H/4`.
    fn gradient(&self, g: &Vec3) -> Vec3 {
        let mut out = [0.0; 3];
        for a in &self.forms {
            let ag = apply(a, g);
            let q = dot(g, &ag);
            (0..3).for_each(|i| out[i] += q * ag[i]);
        }
        out
    }

    /// Second derivatives of `H/4`.
    fn curvature(&self, g: &Vec3) -> Mat3 {
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

fn apply(a: &Mat3, g: &Vec3) -> Vec3 {
    [dot(&a[0], g), dot(&a[1], g), dot(&a[2], g)]
}

/// The solution of a symmetric system by Cramer's rule.
fn solve(m: &Mat3, b: Vec3) -> Vec3 {
    let adjugate = [cross(&m[1], &m[2]), cross(&m[2], &m[0]), cross(&m[0], &m[1])];
    let determinant = dot(&m[0], &adjugate[0]);
    [0, 1, 2].map(|i| (0..3).map(|k| adjugate[k][i] * b[k]).sum::<f64>() / determinant)
}

#[cfg(test)]
mod tests {
    //! Contract: equal forms are the ellipsoid; wrenches lie on the level set with the twist as normal; slopes are those of difference
    //! quotients; and dissipation is never less than at any other wrench of the level set.
    use super::*;
    use crate::push::surface::ellipsoid;

    const TWISTS: [Vec3; 5] =
        [[0.01, -0.02, 1.0], [0.0, 0.0, -2.0], [0.05, 0.01, 0.0], [-0.03, -0.04, -1.0], [1e-4, 2e-5, 4e-3]];

    fn uneven() -> Quartic {
        let first = [[1.1, 0.1, -0.05], [0.1, 0.8, 0.2], [-0.05, 0.2, 0.9]];
        let second = [[0.5, -0.2, 0.1], [-0.2, 0.7, 0.0], [0.1, 0.0, 0.2]];
        Quartic::new(0.03, [first, second])
    }

    #[test]
    fn equal_forms_are_the_ellipsoid() {
        let quartic = Quartic::ellipsoid(0.03);
        assert!((quartic.nominal_c() - 0.03).abs() < 1e-15);
        for twist in TWISTS {
            let found = quartic.sloped(twist).values;
            let wanted = ellipsoid::wrench(0.03, [twist[0], twist[1]], twist[2]);
            let wanted = [wanted.force[0], wanted.force[1], wanted.moment];
            for k in 0..3 {
                assert!((found[k] - wanted[k]).abs() < 1e-12, "{twist:?}: {found:?} {wanted:?}");
            }
        }
    }

    #[test]
    fn the_twist_is_the_normal_of_the_level_set_and_dissipation_is_largest() {
        let quartic = uneven();
        for twist in TWISTS {
            let [x, y, moment] = quartic.sloped(twist).values;
            let (f, v) = ([x, y, moment / 0.03], [twist[0], twist[1], 0.03 * twist[2]]);
            assert!((4.0 * quartic.quarter(&f) - 1.0).abs() < 1e-10, "{twist:?}");
            let normal = quartic.gradient(&f);
            let off = cross(&normal, &v);
            let size = (dot(&normal, &normal) * dot(&v, &v)).sqrt();
            assert!(dot(&off, &off).sqrt() < 1e-9 * size && dot(&normal, &v) > 0.0, "{twist:?}");
            for other in TWISTS {
                let [x, y, moment] = quartic.sloped(other).values;
                assert!(dot(&[x, y, moment / 0.03], &v) <= dot(&f, &v) * (1.0 + 1e-12));
            }
        }
    }

    #[test]
    fn slopes_are_those_of_difference_quotients() {
        let quartic = uneven();
        for twist in TWISTS {
            let slopes = quartic.sloped(twist).slopes;
            let size = (twist[0].powi(2) + twist[1].powi(2) + (0.03 * twist[2]).powi(2)).sqrt();
            for k in 0..3 {
                let nudge = 1e-6 * size / [1.0, 1.0, 0.03][k];
                let at = |sign: f64| {
                    let mut moved = twist;
                    moved[k] += sign * nudge;
                    quartic.sloped(moved).values
                };
                let (up, down) = (at(1.0), at(-1.0));
                for i in 0..3 {
                    let unit = [1.0, 1.0, 0.03];
                    let wanted = (up[i] - down[i]) / (2.0 * nudge);
                    let scale = unit[i] * unit[k] / size;
                    assert!(
                        (slopes[i][k] - wanted).abs() < 1e-7 * scale,
                        "{twist:?} {i} {k}: {} {wanted}",
                        slopes[i][k]
                    );
                }
            }
        }
    }
}
