//! Robots for the tests, described in code.

use augsim_robot::description::{Coupling, Format, Inertia, Joint, JointKind, Link, Placement, Robot};

/// A link with an inertia that no symmetry simplifies; `size` scales it.
pub fn link(name: &str, size: f64) -> Link {
    let inertia = Inertia {
        mass_kg: 1.0 + size,
        centre_m: [0.1 * size, -0.05, 0.2 + 0.1 * size],
        inertia_kg_m2: [0.05 + 0.01 * size, 0.06, 0.04 * size + 0.03, 0.004, -0.006, 0.002 * size],
    };
    Link { name: name.to_owned(), line: 1, inertia: Some(inertia), shift_m: [0.0; 3] }
}

/// A link without inertia, such as the base.
pub fn empty_link(name: &str) -> Link {
    Link { inertia: None, ..link(name, 0.0) }
}

/// A joint that leads from link `parent` to link `child`.
pub fn joint(name: &str, kind: JointKind, [parent, child]: [usize; 2], axis: [f64; 3]) -> Joint {
    Joint {
        name: name.to_owned(),
        line: 10 + child,
        kind,
        parent,
        child,
        placement: Placement { translation_m: [0.3, 0.1 * child as f64, -0.2], ..placement() },
        axis,
        reference: 0.0,
        range: None,
        effort: None,
        damping: 0.0,
        friction_loss: 0.0,
        armature: 0.0,
        stiffness: 0.0,
        spring_reference: 0.0,
        coupling: None,
    }
}

/// A placement whose rotation is none about a coordinate axis.
fn placement() -> Placement {
    let (sin, cos) = 0.4_f64.sin_cos();
    // About z by 0.4 rad, then about the new x by 90 degrees.
    Placement { rotation: [[cos, 0.0, sin], [sin, 0.0, -cos], [0.0, 1.0, 0.0]], translation_m: [0.0; 3] }
}

/// A robot of these links and joints.
pub fn robot(links: Vec<Link>, joints: Vec<Joint>) -> Robot {
    Robot {
        name: "arm".to_owned(),
        file: "arm.urdf".to_owned(),
        format: Format::Urdf,
        links,
        joints,
        actuators: Vec::new(),
        gravity_m_s2: None,
        unsupported: Vec::new(),
    }
}

/// A chain of three joints with axes in general directions; the second one is prismatic.
pub fn general_arm() -> Robot {
    let links = vec![empty_link("base"), link("upper", 0.5), link("slide", 0.2), link("hand", 0.1)];
    let joints = vec![
        joint("shoulder", JointKind::Revolute, [0, 1], [0.0, 0.0, 1.0]),
        joint("slider", JointKind::Prismatic, [1, 2], [0.6, 0.0, 0.8]),
        joint("wrist", JointKind::Revolute, [2, 3], [0.48, 0.64, 0.6]),
    ];
    robot(links, joints)
}

/// A chain of three revolute joints.
pub fn elbow_arm() -> Robot {
    let mut arm = general_arm();
    arm.joints[1].kind = JointKind::Revolute;
    arm.joints[1].axis = [0.0, -1.0, 0.0];
    arm
}

/// A hand with a palm on a revolute joint and two prismatic fingers, of which the second follows the first.
pub fn gripper() -> Robot {
    let links =
        vec![empty_link("base"), link("palm", 0.6), link("left", 0.1), link("right", 0.2), link("tip", 0.05)];
    let mut joints = vec![
        joint("turn", JointKind::Revolute, [0, 1], [1.0, 0.0, 0.0]),
        joint("left_finger", JointKind::Prismatic, [1, 2], [0.0, 1.0, 0.0]),
        joint("right_finger", JointKind::Prismatic, [1, 3], [0.0, 1.0, 0.0]),
        joint("tip_joint", JointKind::Revolute, [3, 4], [0.0, 0.0, 1.0]),
    ];
    joints[2].coupling = Some(Coupling { joint: 1, ratio: -2.0, offset: 0.05 });
    joints[3].coupling = Some(Coupling { joint: 2, ratio: 3.0, offset: 0.1 });
    joints[1].reference = 0.02;
    joints[3].reference = -0.3;
    robot(links, joints)
}

/// Names of joints as the tree takes them.
pub fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}
