//! Contract: a robot that is written in either format and read again moves the same masses in the same way. Mechanism: the
//! centres of mass and tensors of all links of all fixtures at random joint positions, and the values of their joints.

use augsim_robot::description::{Format, Inertia, Joint, JointKind, Placement};
use augsim_robot::{Robot, read, read_mjcf, read_urdf, to_mjcf, to_urdf};

use crate::{FIXTURES, assert_close, fixture};

type Matrix = [[f64; 3]; 3];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn apply(a: &Matrix, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|k| a[i][k] * v[k]).sum())
}

fn compose(outer: &Placement, inner: &Placement) -> Placement {
    let moved = apply(&outer.rotation, inner.translation_m);
    Placement {
        rotation: product(&outer.rotation, &inner.rotation),
        translation_m: std::array::from_fn(|i| outer.translation_m[i] + moved[i]),
    }
}

/// Motion of a joint from its reference, by Rodrigues' formula.
fn motion(joint: &Joint, position: f64) -> Placement {
    let displacement = position - joint.reference;
    let [x, y, z] = joint.axis;
    match joint.kind {
        JointKind::Fixed => Placement::IDENTITY,
        JointKind::Prismatic => {
            Placement { translation_m: joint.axis.map(|part| displacement * part), ..Placement::IDENTITY }
        }
        JointKind::Revolute => {
            let (sin, cos) = displacement.sin_cos();
            let turned = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
            let rotation = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let same = if i == j { cos } else { 0.0 };
                    same + sin * turned[i][j] + (1.0 - cos) * joint.axis[i] * joint.axis[j]
                })
            });
            Placement { rotation, translation_m: [0.0; 3] }
        }
    }
}

/// Placements of all links, where each joint is at a position that follows from its name.
fn placements(robot: &Robot) -> Vec<Placement> {
    let position =
        |joint: &Joint| joint.name.bytes().fold(0.3, |sum, byte| (sum * 7.0 + f64::from(byte)) % 1.9) - 0.9;
    let mut known: Vec<Option<Placement>> = vec![None; robot.links.len()];
    let moved: Vec<usize> = robot.joints.iter().map(|joint| joint.child).collect();
    (0..known.len())
        .filter(|link| !moved.contains(link))
        .for_each(|base| known[base] = Some(Placement::IDENTITY));
    while known.contains(&None) {
        for joint in &robot.joints {
            if let (Some(parent), None) = (known[joint.parent], known[joint.child]) {
                known[joint.child] =
                    Some(compose(&compose(&parent, &joint.placement), &motion(joint, position(joint))));
            }
        }
    }
    known.into_iter().flatten().collect()
}

/// Inertias of all links with mass in the frame of the base, by name.
fn inertias_in_base(robot: &Robot) -> Vec<(String, Inertia)> {
    let mut list: Vec<(String, Inertia)> = Vec::new();
    for (link, placement) in robot.links.iter().zip(placements(robot)) {
        let Some(inertia) = link.inertia else { continue };
        let r = placement.rotation;
        let [xx, yy, zz, xy, xz, yz] = inertia.inertia_kg_m2;
        let tensor = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let transposed = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
        let t = product(&r, &product(&tensor, &transposed));
        let moved = apply(&r, inertia.centre_m);
        list.push((
            link.name.clone(),
            Inertia {
                mass_kg: inertia.mass_kg,
                centre_m: std::array::from_fn(|i| placement.translation_m[i] + moved[i]),
                inertia_kg_m2: [t[0][0], t[1][1], t[2][2], t[0][1], t[0][2], t[1][2]],
            },
        ));
    }
    list.sort_by(|a, b| a.0.cmp(&b.0));
    list
}

/// Asserts that two robots move the same masses, and have the same values that `format` can state.
fn assert_same_robot(converted: &Robot, original: &Robot, format: Format) {
    let (masses, expected) = (inertias_in_base(converted), inertias_in_base(original));
    assert_eq!(masses.len(), expected.len());
    for ((name, inertia), (expected_name, expected)) in masses.iter().zip(&expected) {
        assert_eq!(name, expected_name);
        assert_close(Some(inertia), Some(expected));
    }
    for expected in original.joints.iter().filter(|joint| joint.kind != JointKind::Fixed) {
        let joint = &converted.joints[converted.joint(&expected.name).expect("the joint is converted")];
        assert_eq!(
            (joint.kind, joint.damping, joint.friction_loss),
            (expected.kind, expected.damping, expected.friction_loss)
        );
        if expected.range.is_some() {
            assert_eq!(joint.range, expected.range);
        }
        let coupling = |robot: &Robot, joint: &Joint| {
            let coupling = joint.coupling.clone();
            coupling.map(|c| (robot.joints[c.joint].name.clone(), c.ratio, (c.offset * 1e12).round()))
        };
        assert_eq!(coupling(converted, joint), coupling(original, expected));
        if format == Format::Mjcf {
            let values =
                |joint: &Joint| [joint.armature, joint.stiffness, joint.spring_reference, joint.reference];
            assert_eq!(values(joint), values(expected));
        }
    }
}

#[test]
fn every_fixture_survives_the_conversion_to_mjcf() {
    for name in FIXTURES {
        let original = read(&fixture(name), name).unwrap();
        let converted = read_mjcf(&to_mjcf(&original), name).unwrap();
        assert_same_robot(&converted, &original, Format::Mjcf);
        let drives = |robot: &Robot| {
            robot.actuators.iter().map(|a| (a.drive, a.gear, a.force_range)).collect::<Vec<_>>()
        };
        assert_eq!(drives(&converted), drives(&original), "{name}");
        assert_eq!(converted.gravity_m_s2, original.gravity_m_s2.or(Some([0.0, 0.0, -9.81])), "{name}");
    }
}

#[test]
fn every_fixture_survives_the_conversion_to_urdf() {
    for name in FIXTURES {
        let original = read(&fixture(name), name).unwrap();
        let converted = read_urdf(&to_urdf(&original), name).unwrap();
        assert_same_robot(&converted, &original, Format::Urdf);
    }
}

#[test]
fn what_a_format_cannot_state_is_a_comment() {
    let robot = read(&fixture("slide-arm.xml"), "slide-arm.xml").unwrap();
    let urdf = to_urdf(&robot);
    for comment in [
        "<!-- Converted from slide-arm.xml. -->",
        "<!-- Gravity: 0 0 -9.81 m/s2, which URDF cannot state. -->",
        "<!-- joint rail: armature 0.01, which URDF cannot state -->",
        "<!-- joint rail: stiffness 40, which URDF cannot state -->",
        "<!-- joint rail: position loop with kp 900, kv 80, gear 1, which URDF cannot state -->",
    ] {
        assert!(urdf.contains(comment), "{comment}\n{urdf}");
    }
}

#[test]
fn names_with_special_characters_are_escaped() {
    let text = r#"<robot name="a&lt;&quot;&amp;--"><link name="l&#9;&gt;'"/></robot>"#;
    let robot = read_urdf(text, "arm -- 2.urdf").unwrap();
    assert_eq!((robot.name.as_str(), robot.links[0].name.as_str()), ("a<\"&--", "l\t>'"));
    let urdf = read_urdf(&to_urdf(&robot), "x").unwrap();
    assert_eq!((&urdf.name, &urdf.links[0].name), (&robot.name, &robot.links[0].name));
    let mjcf = read_mjcf(&to_mjcf(&robot), "x").unwrap();
    assert_eq!((&mjcf.name, &mjcf.links[1].name), (&robot.name, &robot.links[0].name));
}
