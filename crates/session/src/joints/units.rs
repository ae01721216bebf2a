//! Units of the parameters of joint effects as an engineer of robots writes them: N m and N m s/rad, never J.

use augsim_data::Unit;

/// Kinds of effects whose coefficient `k` is a torque per angle.
const STIFFNESS_EXPONENTS: [(&str, &str); 8] = [
    ("linear-stiffness", "rad"),
    ("asymmetric-stiffness", "rad2"),
    ("cubic-stiffness", "rad3"),
    ("stop-high", "rad"),
    ("stop-low", "rad"),
    ("backlash", "rad"),
    ("presliding", "rad"),
    ("hysteresis", "rad"),
];

/// Unit of the parameter `name` of an effect of this kind at a joint, where the dimensions give `unit`.
///
/// Angles have no dimension, so that the dimensions of a torque, of a stiffness and of an energy are the same; the
/// kind of the effect tells them apart.
pub(super) fn joint_unit(kind: &str, name: &str, unit: &str, is_prismatic: bool) -> String {
    let is = |text: &str| {
        let dimensions = |text: &str| Unit::parse(text).map(Unit::dimensions);
        dimensions(unit).is_some() && dimensions(unit) == dimensions(text)
    };
    if is_prismatic {
        return if is("N s/m") { "N s/m".to_owned() } else { unit.to_owned() };
    }
    let stiffness = STIFFNESS_EXPONENTS.iter().find(|(other, _)| *other == kind && name == "k");
    let text = match stiffness {
        Some((_, angle)) if is("N m") => return format!("N m/{angle}"),
        _ if is("N m") => "N m",
        _ if is("N m s") => "N m s/rad",
        _ if is("kg m^2") && kind.ends_with("inertia") => "kg m2",
        _ if is("kg m^2") => "N m s2/rad2",
        _ if is("N m s^3") => "N m s3/rad3",
        _ => unit,
    };
    text.to_owned()
}

#[cfg(test)]
mod tests {
    //! Contract: torques are in N m, dampings in N m s/rad, inertias in kg m2; no parameter of a joint is in J.
    use super::*;

    #[test]
    fn torques_dampings_and_inertias_have_the_units_of_joints() {
        for (kind, name, unit, expected) in [
            ("coulomb", "f", "J", "N m"),
            ("linear-damping", "c", "J s", "N m s/rad"),
            ("coupled-damping", "c", "J s", "N m s/rad"),
            ("rotor-inertia", "J", "kg m^2", "kg m2"),
            ("quadratic-damping", "c", "kg m^2", "N m s2/rad2"),
            ("linear-stiffness", "k", "J", "N m/rad"),
            ("presliding", "k", "N m", "N m/rad"),
            ("coulomb", "w", "rad/s", "rad/s"),
            ("coupled-coulomb", "r", "", ""),
        ] {
            assert_eq!(joint_unit(kind, name, unit, false), expected, "{kind} {name}");
        }
    }

    #[test]
    fn prismatic_joints_keep_forces() {
        assert_eq!(joint_unit("coulomb", "f", "N", true), "N");
        assert_eq!(joint_unit("linear-damping", "c", "kg/s", true), "N s/m");
    }
}
