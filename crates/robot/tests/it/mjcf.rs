//! Contract: an MJCF file gives the links, joints and actuators that MuJoCo 3.3.2 compiles from it, or an error that names
//! file, line, element and remedy. Mechanism: values that MuJoCo printed for the fixtures, and short files with one feature or
//! fault each.

use approx::assert_abs_diff_eq;
use augsim_robot::description::{Coupling, Drive, Inertia, JointKind};
use augsim_robot::{Robot, read_mjcf};

use crate::fixture;

/// A file with a world and further sections.
fn model(world: &str, more: &str) -> String {
    format!("<mujoco>\n<worldbody>\n{world}\n</worldbody>\n{more}\n</mujoco>")
}

/// A body `b` with a hinge `j` that has further attributes, and a ball.
fn hinge(attributes: &str) -> String {
    format!(r#"<body name="b"><joint name="j" {attributes}/><geom size="0.1"/></body>"#)
}

fn robot(text: &str) -> Robot {
    read_mjcf(text, "arm.xml").unwrap_or_else(|error| panic!("{error}"))
}

/// The message of a file that cannot be read.
fn message(text: &str) -> String {
    match read_mjcf(text, "arm.xml") {
        Ok(robot) => format!("read {} links", robot.links.len()),
        Err(error) => error.to_string(),
    }
}

/// Elements that are not supported, with their joints.
fn unsupported(robot: &Robot) -> Vec<(&str, &[usize])> {
    robot.unsupported.iter().map(|item| (item.element.as_str(), item.joints.as_slice())).collect()
}

/// Compares with MuJoCo's values, whose principal axes have errors of 1e-8 rad.
fn assert_inertia(inertia: &Inertia, mass: f64, centre: [f64; 3], tensor: [f64; 6]) {
    assert_abs_diff_eq!(inertia.mass_kg, mass, epsilon = 1e-15 * mass);
    for (value, expected) in inertia.centre_m.iter().zip(centre) {
        assert_abs_diff_eq!(*value, expected, epsilon = 1e-15);
    }
    for (value, expected) in inertia.inertia_kg_m2.iter().zip(tensor) {
        assert_abs_diff_eq!(*value, expected, epsilon = 2e-8 * tensor[0]);
    }
}

#[test]
fn inertias_of_geoms_of_every_shape_are_those_of_mujoco() {
    let robot = robot(&fixture("pendulum.xml"));
    let inertia = |name: &str| robot.links[robot.link(name).unwrap()].inertia.unwrap();
    assert_inertia(
        &inertia("upper"),
        0.5986893990577558,
        [0.006681260777784573, 0.0, -0.19170315194446144],
        [
            0.0024536134050261436,
            0.0024668883619150053,
            0.00017145551701571238,
            0.0,
            3.318739222216412e-05,
            0.0,
        ],
    );
    assert_inertia(
        &inertia("lower"),
        0.2438877936302537,
        [0.006869226551313101, 0.0009098778186737742, -0.16573108494948915],
        [
            0.002019602486527987,
            0.0019805069089649666,
            0.0001311299658062988,
            -2.0821108037048965e-05,
            0.00013833193789490906,
            0.00019239981068961862,
        ],
    );
    assert_inertia(
        &inertia("body3"),
        0.4,
        [0.0, 0.0, 0.0],
        [0.00014399999999999998, 0.00014399999999999998, 0.00014399999999999998, 0.0, 0.0, 0.0],
    );
    assert_eq!(robot.gravity_m_s2, Some([0.0, 0.0, -9.80665]));
}

#[test]
fn values_of_nested_classes_are_inherited_and_overridden() {
    let robot = robot(&fixture("pendulum.xml"));
    let knee = &robot.joints[robot.joint("knee").unwrap()];
    assert_eq!((knee.damping, knee.friction_loss, knee.armature), (0.005, 0.01, 0.0004));
    assert_eq!(knee.axis, [0.0, 1.0, 0.0]);
    let limit = 150.0_f64.to_radians();
    assert_eq!(knee.range, Some([-limit, limit]));
    let pivot = &robot.joints[robot.joint("pivot").unwrap()];
    assert_eq!((pivot.damping, pivot.friction_loss, pivot.armature, pivot.range), (0.02, 0.01, 0.0, None));
    let motor = &robot.actuators[0];
    assert_eq!((motor.drive, motor.gear, motor.command_range), (Drive::Motor, 3.0, Some([-2.0, 2.0])));
}

#[test]
fn a_body_without_a_name_and_without_joints_is_a_fixed_link() {
    let robot = robot(&fixture("pendulum.xml"));
    let names: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["world", "upper", "lower", "body3"]);
    let fixed = &robot.joints[2];
    assert_eq!((fixed.name.as_str(), fixed.kind, fixed.parent), ("body3_fixed", JointKind::Fixed, 2));
    assert_eq!(fixed.placement.translation_m, [0.0, 0.0, -0.34]);
}

#[test]
fn references_springs_and_inertias_along_turned_axes_are_those_of_mujoco() {
    let robot = robot(&fixture("slide-arm.xml"));
    let rail = &robot.joints[0];
    assert_eq!(
        (rail.kind, rail.reference, rail.spring_reference, rail.stiffness),
        (JointKind::Prismatic, 0.15, 0.05, 40.0)
    );
    assert_eq!((rail.armature, rail.damping, rail.friction_loss), (0.01, 12.0, 4.0));
    let carriage = robot.links[1].inertia.unwrap();
    assert_inertia(
        &carriage,
        3.2,
        [0.01, -0.02, 0.03],
        [
            0.01739301939058172,
            0.01760110803324099,
            0.015005872576177286,
            0.0005385041551246513,
            -0.0033799445983379505,
            0.0018814404432132977,
        ],
    );
    let elbow = &robot.links[2];
    assert_eq!(elbow.shift_m, [0.02, 0.01, 0.0]);
    assert_eq!(elbow.inertia.unwrap().centre_m, [0.14 - 0.02, -0.01, 0.01]);
}

#[test]
fn a_damping_ratio_becomes_the_damping_that_mujoco_computes() {
    let robot = robot(&fixture("slide-arm.xml"));
    let drives: Vec<_> = robot.actuators.iter().map(|actuator| (actuator.drive, actuator.gear)).collect();
    assert_eq!(drives[0], (Drive::Position { kp: 900.0, kv: 80.0 }, 1.0));
    let Drive::Position { kp, kv } = drives[1].0 else { panic!("a position loop") };
    assert_eq!(kp, 60.0);
    assert_abs_diff_eq!(kv, 2.5211383622032693, epsilon = 1e-8);
    assert_eq!(drives[2], (Drive::Velocity { kv: 0.8 }, -2.0));
    assert_eq!(robot.actuators[0].force_range, Some([-200.0, 200.0]));
}

#[test]
fn several_joints_of_a_body_become_a_chain_with_massless_links() {
    let robot = robot(&fixture("two-hinges.xml"));
    let names: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["world", "base", "cardan_roll", "cardan_pitch", "cardan", "wheel", "idler"]);
    let masses: Vec<bool> = robot.links.iter().map(|link| link.inertia.is_some()).collect();
    assert_eq!(masses, [false, true, false, false, true, true, true]);
    let pitch = &robot.joints[robot.joint("pitch").unwrap()];
    assert_eq!((pitch.parent, pitch.child), (2, 3));
    assert_eq!(pitch.placement.translation_m, [0.01, 0.0, 0.01]);
    assert_eq!(robot.joints[robot.joint("roll").unwrap()].reference, 5.0_f64.to_radians());
}

#[test]
fn a_coupling_counts_from_the_references_of_both_joints() {
    let robot = robot(&fixture("two-hinges.xml"));
    let follow = &robot.joints[robot.joint("follow").unwrap()];
    let offset = 0.1 + 2.0 * 10.0_f64.to_radians();
    let expected = Coupling { joint: robot.joint("spin").unwrap(), ratio: -2.0, offset };
    assert_eq!(follow.coupling, Some(expected));
}

#[test]
fn general_actuators_are_recognised_by_their_gains() {
    let general = |attributes: &str| {
        let text = model(&hinge(""), &format!(r#"<actuator><general joint="j" {attributes}/></actuator>"#));
        let robot = robot(&text);
        robot.actuators.first().map(|actuator| (actuator.drive, actuator.gear))
    };
    let affine = r#"biastype="affine""#;
    assert_eq!(general(r#"gainprm="4" gear="2""#), Some((Drive::Motor, 8.0)));
    assert_eq!(
        general(&format!(r#"{affine} gainprm="4" biasprm="0 -4 -1""#)),
        Some((Drive::Position { kp: 4.0, kv: 1.0 }, 1.0))
    );
    assert_eq!(
        general(&format!(r#"{affine} gainprm="4" biasprm="0 0 -4""#)),
        Some((Drive::Velocity { kv: 4.0 }, 1.0))
    );
    assert_eq!(general(&format!(r#"{affine} gainprm="4" biasprm="0 -3 0""#)), None);
    assert_eq!(general(&format!(r#"{affine} gainprm="4" biasprm="1 -4 0""#)), None);
    assert_eq!(general(r#"biastype="muscle""#), None);
    assert_eq!(general(r#"dyntype="integrator""#), None);
}

#[test]
fn frames_move_bodies_and_joints_and_pass_on_their_class() {
    let world = r#"<frame pos="1 0 0" euler="0 0 90" childclass="c"><body pos="0 1 0"><frame euler="90 0 0" pos="0 0 2"><joint pos="0 0 1" axis="0 1 0"/></frame><geom size="0.1"/></body></frame>"#;
    let text = model(world, r#"<default><default class="c"><joint damping="3"/></default></default>"#);
    let robot = robot(&text);
    let joint = &robot.joints[0];
    assert_eq!(joint.damping, 3.0);
    for (value, expected) in joint.axis.iter().zip([0.0, 0.0, 1.0]) {
        assert_abs_diff_eq!(*value, expected, epsilon = 1e-15);
    }
    // In the body the joint is at (0, -1, 2), and the body at (0, 0, 0) of the world, turned about z by a quarter.
    for (value, expected) in joint.placement.translation_m.iter().zip([1.0, 0.0, 2.0]) {
        assert_abs_diff_eq!(*value, expected, epsilon = 1e-15);
    }
}

#[test]
fn compiler_settings_bound_balance_and_scale_inertias() {
    let body = |compiler: &str, inertial: &str| {
        let text = model(&format!(r#"<body><joint/><inertial pos="0 0 0" {inertial}/></body>"#), compiler);
        robot(&text).links[1].inertia.unwrap()
    };
    let bounded =
        body(r#"<compiler boundmass="4" boundinertia="0.25"/>"#, r#"mass="3" diaginertia="0.1 0.2 0.3""#);
    assert_inertia(&bounded, 4.0, [0.0; 3], [0.25, 0.25, 0.3, 0.0, 0.0, 0.0]);
    let balanced = body(r#"<compiler balanceinertia="true"/>"#, r#"mass="3" diaginertia="0.1 0.2 0.6""#);
    assert_inertia(&balanced, 3.0, [0.0; 3], [0.3, 0.3, 0.3, 0.0, 0.0, 0.0]);
    let scaled = body(r#"<compiler settotalmass="6"/>"#, r#"mass="3" diaginertia="0.1 0.2 0.3""#);
    assert_inertia(&scaled, 6.0, [0.0; 3], [0.2, 0.4, 0.6, 0.0, 0.0, 0.0]);
}

#[test]
fn what_is_not_supported_is_listed_with_the_joints_it_changes() {
    let chain = r#"<body name="b"><joint name="j"/><geom name="g" size="0.1"/>
<body name="c"><joint name="k"/><geom size="0.1"/><site name="s"/></body></body>
<body name="d"><joint name="l"/><geom name="h" size="0.1"/></body>"#;
    let listed = |world: &str, more: &str| {
        let robot = robot(&model(world, more));
        unsupported(&robot)
            .into_iter()
            .map(|(name, joints)| (name.to_owned(), joints.to_vec()))
            .collect::<Vec<_>>()
    };
    let one = |name: &str, joints: &[usize]| vec![(name.to_owned(), joints.to_vec())];
    assert_eq!(listed(chain, ""), []);
    let tendon = r#"<tendon><fixed name="t"><joint joint="k" coef="1"/></fixed></tendon>"#;
    assert_eq!(listed(chain, tendon), one("tendon fixed `t`", &[1]));
    let spatial = r#"<tendon><spatial name="t"><site site="s"/><geom geom="h"/></spatial></tendon>"#;
    assert_eq!(listed(chain, spatial), one("tendon spatial `t`", &[0, 1, 2]));
    let pair = r#"<contact><pair name="p" geom1="g" geom2="h"/><exclude body1="b" body2="c"/></contact>"#;
    assert_eq!(listed(chain, pair), one("contact pair `p`", &[0, 2]));
    let weld = r#"<equality><weld name="w" body1="c"/><weld body1="b" active="false"/></equality>"#;
    assert_eq!(listed(chain, weld), one("equality weld `w`", &[0, 1]));
    let cubic = r#"<equality><joint joint1="j" joint2="l" polycoef="0 1 0 1"/></equality>"#;
    assert_eq!(listed(chain, cubic), one("equality <joint>", &[0, 2]));
    let composite = chain.replace("<site", r#"<composite type="cable"/><site"#);
    assert_eq!(listed(&composite, ""), one("<composite>", &[0, 1]));
    let ball = chain.replace(r#"<joint name="k"/>"#, r#"<joint name="k" type="ball"/>"#);
    assert_eq!(listed(&ball, ""), one("ball joint `k`", &[0, 1]));
    let free = chain.replace(r#"<joint name="j"/>"#, r#"<freejoint name="j"/>"#);
    assert_eq!(listed(&free, ""), one("free freejoint `j`", &[0, 1]));
    let mesh = chain.replace(r#"<geom size="0.1"/>"#, r#"<geom type="mesh" mesh="m" mass="1"/>"#);
    let name = "inertia of body `c` from geom of mesh `m` (add <inertial> to the body)";
    assert_eq!(listed(&mesh, ""), one(name, &[0, 1]));
    let muscle = r#"<actuator><muscle name="m" joint="j"/></actuator>"#;
    assert_eq!(listed(chain, muscle), one("actuator muscle `m` of joint `j`", &[]));
    let filter = r#"<actuator><position name="a" joint="j" timeconst="0.1"/></actuator>"#;
    assert_eq!(
        listed(chain, filter),
        one("filter of the command of actuator position `a` (time constant 0.1 s)", &[])
    );
}

#[test]
fn a_mesh_beside_an_explicit_inertia_is_no_obstacle() {
    let world = r#"<body><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="mesh" mesh="m"/></body>"#;
    let robot = robot(&model(world, ""));
    assert_eq!((robot.unsupported.len(), robot.links[1].inertia.unwrap().mass_kg), (0, 1.0));
}

#[test]
fn bodies_and_frames_are_read_as_deep_as_elements_may_be_nested() {
    let inner = "<frame euler=\"0 0 1\"><body><joint/><geom size=\"0.1\"/>";
    let robot = robot(&model(&format!("{}{}", inner.repeat(120), "</body></frame>".repeat(120)), ""));
    assert_eq!((robot.links.len(), robot.joints[119].parent), (121, 119));
    let text = model(&format!("{}{}", inner.repeat(130), "</body></frame>".repeat(130)), "");
    assert_eq!(
        message(&text),
        "arm.xml, line 3: elements are nested deeper than 250 levels; split the robot into parts"
    );
}

/// Asserts the message of each file, which is behind its name.
fn assert_messages(cases: &[(String, &str)]) {
    for (text, expected) in cases {
        assert_eq!(message(text), format!("arm.xml, {expected}"));
    }
}

#[test]
fn each_fault_of_a_body_is_named_with_its_remedy() {
    let one = hinge("");
    let world = |attributes: &str| model(&hinge(attributes), "");
    let inertial =
        |content: &str| model(&format!(r#"<body name="b"><joint/><inertial {content}/></body>"#), "");
    let cases = [
        (world(r#"axis="0 0 0""#), "line 3: joint `j`: its axis has the length 0; give a direction"),
        (
            world(r#"class="zz""#),
            "line 3: joint `j` has the class `zz`, which does not exist; declare <default class=\"zz\"> or correct the name",
        ),
        (world(r#"type="screw""#), "line 3: joint `j` has the unknown type `screw`; use hinge or slide"),
        (
            world(r#"range="1 -1" limited="true""#),
            "line 3: joint `j`: range=\"1 -1\" is empty; give the smaller bound first",
        ),
        (
            world(r#"damping="1e999""#),
            "line 3: joint `j`: damping=\"1e999\" is not a finite number; write a decimal number such as 0.25",
        ),
        (
            world(r#"limited="maybe""#),
            "line 3: joint `j`: limited=\"maybe\" is neither true nor false; write true or false",
        ),
        (
            model(r#"<body childclass="zz"/>"#, ""),
            "line 3: <body> has the class `zz`, which does not exist; declare <default class=\"zz\"> or correct the name",
        ),
        (
            model(r#"<body quat="1 0 0 0" euler="1 2 3"/>"#, ""),
            "line 3: <body> has several orientations; keep one of quat, axisangle, xyaxes, zaxis and euler",
        ),
        (
            model(r#"<body quat="0 0 0 0"/>"#, ""),
            "line 3: <body>: its orientation has an axis or a quaternion of length 0; give a direction",
        ),
        (
            model(r#"<body><geom type="box" size="1 1"/></body>"#, ""),
            "line 3: <geom> has a size of 0 or less, or one that is missing; give the sizes of its type",
        ),
        (
            model(r#"<body><geom type="capsule" size="1" fromto="0 0 0 0 0 0"/></body>"#, ""),
            "line 3: <geom>: fromto does not span a capsule, cylinder, ellipsoid or box; give two different points",
        ),
        (model("<joint/>", ""), "line 3: the world has a <joint>; put it inside a <body>"),
        (
            model(&format!("{one}{one}"), ""),
            "line 3: link `b` is declared a second time (first in line 3); give it another name",
        ),
        (
            inertial(r#"mass="1" diaginertia="1 1 1""#),
            "line 3: <inertial> has no attribute `pos`; add pos=\"...\"",
        ),
        (
            inertial(r#"pos="0 0 0" mass="-1""#),
            "line 3: link `b` has the negative mass -1 kg; correct its <inertial>",
        ),
        (
            inertial(r#"pos="0 0 0" mass="0" diaginertia="1 1 1""#),
            "line 3: link `b` moves and has a moment of inertia, but no mass; correct its <inertial>",
        ),
        (
            inertial(r#"pos="0 0 0" mass="1" quat="1 0 0 0" fullinertia="1 1 1 0 0 0""#),
            "line 3: <inertial> has fullinertia and an orientation; remove the orientation: fullinertia is along the axes of the body",
        ),
    ];
    assert_messages(&cases);
}

#[test]
fn each_fault_of_another_section_is_named_with_its_remedy() {
    let more = |section: &str| model(&hinge(""), section);
    let cases = [
        (
            more(r#"<default><default class="c"><default class="c"/></default></default>"#),
            "line 5: the default class `c` is declared a second time; give it another name",
        ),
        (
            more(r#"<default class="c"/>"#),
            "line 5: the outermost default class is called `c`; call it main, or put it inside another <default>",
        ),
        (
            more("<default><default/></default>"),
            "line 5: a default class inside `main` has no name; add class=\"...\"",
        ),
        (
            more(r#"<actuator><motor joint="zz"/></actuator>"#),
            "line 5: <motor>: its joint `zz` does not exist; correct the name",
        ),
        (
            more(r#"<actuator><position joint="j" kv="1" dampratio="1"/></actuator>"#),
            "line 5: <position> has both kv and dampratio; keep one of them",
        ),
        (
            more(r#"<actuator><position joint="j" inheritrange="1"/></actuator>"#),
            "line 5: <position> inherits the range of joint `j`, which has none; give the joint a range, or remove inheritrange",
        ),
        (
            more(r#"<equality><joint name="e" joint1="j" joint2="zz"/></equality>"#),
            "line 5: equality joint `e`: joint `zz` does not exist; correct the name",
        ),
        (
            more(r#"<compiler coordinate="global"/>"#),
            "line 5: compiler: global coordinates are no longer part of MJCF; load and save the file in MuJoCo 2.3.3 or older",
        ),
        (
            more(r#"<compiler eulerseq="xyw"/>"#),
            "line 5: compiler: eulerseq is not three letters of xyzXYZ; write a sequence such as xyz",
        ),
        (
            more(r#"<include file="x.xml"/>"#),
            "line 5: <include> adds `x.xml`, which is another file and is not read; save the whole model in one file: in Python, mujoco.mj_saveLastXML('whole.xml', mujoco.MjModel.from_xml_path('robot.xml'))",
        ),
        (
            model(r#"<body name="b"><geom size="1e200"/></body>"#, ""),
            "line 3: link `b` has numbers that are too large; check their units",
        ),
        ("<robot/>".into(), "line 1: the first element is <robot> instead of <mujoco>; give an MJCF file"),
    ];
    assert_messages(&cases);
}

#[test]
fn couplings_that_form_a_loop_are_listed_and_not_followed() {
    let world = format!("{}{}", hinge(""), hinge("").replace("\"b\"", "\"c\"").replace("\"j\"", "\"k\""));
    let more =
        r#"<equality><joint joint1="j" joint2="k"/><joint name="e" joint1="k" joint2="j"/></equality>"#;
    let robot = robot(&model(&world, more));
    assert_eq!(robot.joints[0].coupling.as_ref().map(|coupling| coupling.joint), Some(1));
    assert_eq!(robot.joints[1].coupling, None);
    assert_eq!(unsupported(&robot), [("equality joint `e`", [0, 1].as_slice())]);
}
