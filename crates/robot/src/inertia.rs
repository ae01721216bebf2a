//! Inertial parameters that enter the equations of motion linearly.
//!
//! The ten parameters of a link or body are `[m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`: its mass (kg), the mass
//! times the centre of mass (kg m), and the elements of the inertia tensor about the ORIGIN of its frame (kg m2).
//! `Ixy` is an element of the tensor: minus the integral of x y dm. Reference: Khalil and Dombre, *Modeling,
//! Identification and Control of Robots*, 2002, section 9.3.

use crate::algebra::Algebra;
use crate::description::{Inertia, Placement, Robot};
use crate::tree::Tree;
use crate::vectors::{SYMMETRIC, Vectors, turned_tensor};

/// The ten linear parameters of a link; see the module for their order and units.
pub fn dynamic_parameters(inertia: &Inertia) -> [f64; 10] {
    let mass = inertia.mass_kg;
    let [x, y, z] = inertia.centre_m;
    let [xx, yy, zz, xy, xz, yz] = inertia.inertia_kg_m2;
    // Parallel axes: I(origin) = I(centre) + m (c.c 1 - c c^T).
    [
        mass,
        mass * x,
        mass * y,
        mass * z,
        xx + mass * (y * y + z * z),
        xy - mass * x * y,
        xz - mass * x * z,
        yy + mass * (x * x + z * z),
        yz - mass * y * z,
        zz + mass * (x * x + y * y),
    ]
}

/// Mass, centre of mass and inertia about it from the ten linear parameters; `None` if the mass is not positive.
pub fn inertia_of(parameters: &[f64; 10]) -> Option<Inertia> {
    let [mass_kg, hx, hy, hz, xx, xy, xz, yy, yz, zz] = *parameters;
    // A mass that is not a number is refused as well.
    if mass_kg.is_nan() || mass_kg <= 0.0 {
        return None;
    }
    let [x, y, z] = [hx / mass_kg, hy / mass_kg, hz / mass_kg];
    let inertia_kg_m2 = [
        xx - (hy * y + hz * z),
        yy - (hx * x + hz * z),
        zz - (hx * x + hy * y),
        xy + hx * y,
        xz + hx * z,
        yz + hy * z,
    ];
    Some(Inertia { mass_kg, centre_m: [x, y, z], inertia_kg_m2 })
}

/// The ten parameters of a link in the frame of its body, from those in its own frame; linear in the parameters.
///
/// `placement` is the placement of the link frame in the body frame.
pub fn moved<A: Algebra>(a: &mut A, parameters: &[A::Value; 10], placement: &Placement) -> [A::Value; 10] {
    let (mass, moment, tensor) = split(parameters);
    let rotation = &placement.rotation;
    let moment = a.apply_constant(rotation, moment);
    let tensor = turned_tensor(a, &tensor, |a, x| a.apply_constant(rotation, x));
    shifted(a, (mass, moment, tensor), placement.translation_m)
}

/// Mass, mass times centre, and tensor about the origin.
pub(crate) type Parts<V> = (V, [V; 3], [V; 6]);

/// Mass, mass times centre and inertia tensor of the ten parameters.
#[inline(always)]
pub(crate) fn split<V: Copy>(parameters: &[V; 10]) -> Parts<V> {
    let [m, x, y, z, xx, xy, xz, yy, yz, zz] = *parameters;
    (m, [x, y, z], [xx, xy, xz, yy, yz, zz])
}

/// The ten parameters from mass, mass times centre and inertia tensor.
#[inline(always)]
pub(crate) fn joined<V: Copy>((m, [x, y, z], [xx, xy, xz, yy, yz, zz]): Parts<V>) -> [V; 10] {
    [m, x, y, z, xx, xy, xz, yy, yz, zz]
}

/// The ten parameters about another origin, which is at `-p` in the frame of `parts`; the axes stay.
///
/// With moment h = m c: h' = h + m p and I' = I + 2 (h.p) 1 - h p^T - p h^T + m (p.p 1 - p p^T).
pub(crate) fn shifted<A: Algebra>(
    a: &mut A,
    (mass, moment, tensor): Parts<A::Value>,
    p: [f64; 3],
) -> [A::Value; 10] {
    let square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    let mut shifted = tensor;
    for (value, [i, j]) in shifted.iter_mut().zip(SYMMETRIC) {
        // Factors of mass and moment in this element of the tensor.
        let mut factors = [0.0; 3];
        factors[j] -= p[i];
        factors[i] -= p[j];
        let mut mass_factor = -p[i] * p[j];
        if i == j {
            mass_factor += square;
            for k in 0..3 {
                factors[k] += 2.0 * p[k];
            }
        }
        let [x, y, z] = moment;
        *value = a.combine([
            (1.0, *value),
            (mass_factor, mass),
            (factors[0], x),
            (factors[1], y),
            (factors[2], z),
        ]);
    }
    let moment = a.add_along(moment, p, mass);
    joined((mass, moment, shifted))
}

/// The sum of the ten parameters of two links in the same frame.
#[inline(always)]
pub(crate) fn added<A: Algebra>(a: &mut A, x: &[A::Value; 10], y: &[A::Value; 10]) -> [A::Value; 10] {
    let mut sum = *x;
    for (sum, y) in sum.iter_mut().zip(y) {
        *sum = a.add(*sum, *y);
    }
    sum
}

impl Tree {
    /// The ten parameters of each link of [`Tree::links`] in the frame of the link; zeros for a link without inertia.
    pub fn link_parameters(&self, robot: &Robot) -> Vec<[f64; 10]> {
        let parameters =
            |link: usize| robot.links[link].inertia.as_ref().map_or([0.0; 10], dynamic_parameters);
        self.links.iter().map(|attached| parameters(attached.link)).collect()
    }

    /// The ten parameters of each body in its frame: the sum over its links, given as in [`Tree::links`].
    pub fn body_parameters<A: Algebra>(&self, a: &mut A, links: &[[A::Value; 10]]) -> Vec<[A::Value; 10]> {
        let mut bodies = vec![None; self.bodies.len()];
        for (attached, parameters) in self.links.iter().zip(links) {
            let link = moved(a, parameters, &attached.placement);
            let body = &mut bodies[attached.body];
            *body = Some(body.map_or(link, |sum| added(a, &sum, &link)));
        }
        bodies.into_iter().map(|body| body.unwrap_or_else(|| [a.constant(0.0); 10])).collect()
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the ten parameters describe the same mass distribution in every frame.

    use super::*;
    use crate::algebra::Numbers;
    use crate::rotation::about_axis;

    fn example() -> Inertia {
        Inertia {
            mass_kg: 2.5,
            centre_m: [0.1, -0.2, 0.3],
            inertia_kg_m2: [0.04, 0.05, 0.06, 0.003, -0.004, 0.005],
        }
    }

    /// Parameters of point masses `(kg, position)`.
    fn of_points(points: &[(f64, [f64; 3])]) -> [f64; 10] {
        let mut sum = [0.0; 10];
        for &(mass_kg, centre_m) in points {
            let point = dynamic_parameters(&Inertia { mass_kg, centre_m, inertia_kg_m2: [0.0; 6] });
            sum = added(&mut Numbers, &sum, &point);
        }
        sum
    }

    #[test]
    fn parameters_give_back_the_inertia_they_were_computed_from() {
        let inertia = example();
        let back = inertia_of(&dynamic_parameters(&inertia)).expect("the mass is positive");
        for (x, y) in back.centre_m.iter().zip(&inertia.centre_m) {
            approx::assert_abs_diff_eq!(x, y, epsilon = 1e-15);
        }
        for (x, y) in back.inertia_kg_m2.iter().zip(&inertia.inertia_kg_m2) {
            approx::assert_abs_diff_eq!(x, y, epsilon = 1e-15);
        }
    }

    #[test]
    fn parameters_without_positive_mass_have_no_centre() {
        assert_eq!(inertia_of(&[0.0; 10]), None);
        assert_eq!(inertia_of(&[f64::NAN; 10]), None);
    }

    #[test]
    fn moved_parameters_are_those_of_the_moved_points() {
        let points = [(1.0, [0.3, 0.1, -0.2]), (0.7, [-0.4, 0.5, 0.6]), (2.0, [0.0, -0.3, 0.1])];
        let rotation = about_axis([0.6, 0.0, 0.8], 0.7);
        let placement = Placement { rotation, translation_m: [0.2, -0.5, 1.1] };
        let place = |point: [f64; 3]| {
            let turned = Numbers.apply_constant(&placement.rotation, point);
            Numbers.add3(turned, placement.translation_m)
        };
        let expected = of_points(&points.map(|(mass, point)| (mass, place(point))));
        let result = moved(&mut Numbers, &of_points(&points), &placement);
        for (x, y) in result.iter().zip(&expected) {
            approx::assert_abs_diff_eq!(x, y, epsilon = 1e-14);
        }
    }
}
