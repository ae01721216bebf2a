//! Contract: a URDF file gives the links and joints that it states, or an error that names file, line, element and remedy.
//! Mechanism: the fixtures in `fixtures/robots`, and short files with one fault each, whose message is compared in full.

use approx::assert_abs_diff_eq;
use augsim_robot::description::{Coupling, Drive, Format, JointKind};
use augsim_robot::read_urdf;

use crate::fixture;

/// A robot of a base `a` and a link `b` on a revolute joint `j`, with further elements.
fn two_links(more: &str) -> String {
    format!(
        r#"<robot name="r">
<link name="a"/>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint>
{more}
</robot>"#
    )
}

/// The message of a file that cannot be read.
fn message(text: &str) -> String {
    match read_urdf(text, "arm.urdf") {
        Ok(robot) => format!("read {} links", robot.links.len()),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_planar_arm_has_the_values_of_its_file() {
    let robot = read_urdf(&fixture("two-link-planar.urdf"), "two-link-planar.urdf").unwrap();
    assert_eq!((robot.name.as_str(), robot.format), ("two_link_planar", Format::Urdf));
    let names: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["base", "upper_arm", "forearm", "payload"]);
    let shoulder = &robot.joints[0];
    assert_eq!((shoulder.name.as_str(), shoulder.line, shoulder.kind), ("shoulder", 36, JointKind::Revolute));
    assert_eq!((shoulder.parent, shoulder.child), (0, 1));
    assert_eq!(shoulder.placement.translation_m, [0.0, 0.0, 0.3]);
    assert_eq!(
        (shoulder.axis, shoulder.range, shoulder.effort),
        ([0.0, 1.0, 0.0], Some([-2.8, 2.8]), Some(40.0))
    );
    assert_eq!((shoulder.damping, shoulder.friction_loss), (0.35, 0.5));
    assert_eq!(robot.joints[2].kind, JointKind::Fixed);
    assert_eq!(robot.gravity_m_s2, None);
    assert_eq!((robot.unsupported.len(), robot.warnings().len()), (0, 0));
}

#[test]
fn an_inertia_along_turned_axes_is_turned_into_the_axes_of_the_link() {
    let robot = read_urdf(&fixture("two-link-planar.urdf"), "two-link-planar.urdf").unwrap();
    // R_z(0.3) I R_z(0.3)^T of the forearm, by numpy.
    let inertia = robot.links[2].inertia.unwrap();
    assert_eq!((inertia.mass_kg, inertia.centre_m), (1.35, [0.16, 0.01, 0.0]));
    let expected = [
        0.0024049235698990513,
        0.013195076430100944,
        0.0147,
        -0.0034486447067462902,
        -2.9552020666133953e-5,
        9.553364891256058e-5,
    ];
    for (value, expected) in inertia.inertia_kg_m2.iter().zip(expected) {
        assert_abs_diff_eq!(*value, expected, epsilon = 1e-16);
    }
}

#[test]
fn axes_are_normalised_and_transmissions_become_motors() {
    let robot = read_urdf(&fixture("six-axis-arm.urdf"), "six-axis-arm.urdf").unwrap();
    assert_eq!(robot.joints[2].axis, [0.0, 0.0, 1.0]);
    assert_eq!((robot.joints[5].range, robot.joints[5].effort), (None, Some(11.0)));
    let motors: Vec<_> =
        robot.actuators.iter().map(|motor| (motor.name.as_str(), motor.joint, motor.gear)).collect();
    assert_eq!(motors, [("motor1", 0, 101.0), ("motor2", 1, 120.5)]);
    assert!(robot.actuators.iter().all(|motor| motor.drive == Drive::Motor));
}

#[test]
fn mimic_joints_are_coupled_to_their_leader() {
    let robot = read_urdf(&fixture("gripper.urdf"), "gripper.urdf").unwrap();
    let leader = robot.joint("left_slide").unwrap();
    let coupling = |name: &str| robot.joints[robot.joint(name).unwrap()].coupling.clone();
    assert_eq!(coupling("right_slide"), Some(Coupling { joint: leader, ratio: 1.0, offset: 0.0 }));
    assert_eq!(coupling("lever_pivot"), Some(Coupling { joint: leader, ratio: -18.5, offset: 0.3 }));
    assert_eq!(coupling("left_slide"), None);
}

#[test]
fn elements_for_drawing_and_simulators_are_skipped() {
    let text =
        two_links(r#"<gazebo reference="b"><mu1>nan</mu1></gazebo><ros2_control name="x" type="system"/>"#);
    let robot = read_urdf(&text, "arm.urdf").unwrap();
    assert_eq!((robot.links.len(), robot.joints.len(), robot.unsupported.len()), (2, 1, 0));
    assert_eq!(robot.joints[0].axis, [1.0, 0.0, 0.0]);
}

#[test]
fn floating_and_planar_joints_are_listed_with_the_joints_they_change() {
    let more = r#"<link name="c"/><joint name="f" type="floating"><parent link="b"/><child link="c"/></joint>
<link name="d"/><joint name="k" type="continuous"><parent link="c"/><child link="d"/></joint>
<link name="e"/><joint name="l" type="continuous"><parent link="a"/><child link="e"/></joint>"#;
    let robot = read_urdf(&two_links(more), "arm.urdf").unwrap();
    let listed: Vec<_> =
        robot.unsupported.iter().map(|item| (item.element.as_str(), item.joints.clone())).collect();
    assert_eq!(listed, [("floating joint `f`", vec![0, 1, 2])]);
}

#[test]
fn transmissions_of_several_fixed_or_unknown_joints_are_listed() {
    let more = r#"<link name="c"/><joint name="f" type="fixed"><parent link="b"/><child link="c"/></joint>
<transmission name="t"><joint name="z"/></transmission>
<transmission name="u"><joint name="f"/></transmission>
<transmission name="v"><joint name="j"/><joint name="f"/></transmission>"#;
    let robot = read_urdf(&two_links(more), "arm.urdf").unwrap();
    let listed: Vec<_> =
        robot.unsupported.iter().map(|item| (item.element.as_str(), item.joints.clone())).collect();
    let expected = [
        ("transmission `t` of joint `z`, which does not exist", vec![]),
        ("transmission `u` of joint `f`, which does not move", vec![]),
        ("transmission `v` of several joints", vec![0, 1]),
    ];
    assert_eq!(listed, expected);
}

#[test]
fn each_structural_fault_is_named_with_its_remedy() {
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            r#"<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>"#
        )
    };
    let cases = [
        (
            two_links(r#"<link name="c"/>"#),
            "arm.urdf, line 5: the robot has two base links, `a` (line 2) and `c`: no joint has either as its child; connect them by a joint",
        ),
        (
            two_links(&joint("k", "a", "b")),
            "arm.urdf, line 5: link `b` is the child of two joints, `j` (line 4) and `k`; remove one of the joints",
        ),
        (
            two_links(&joint("k", "b", "c")),
            "arm.urdf, line 5: joint `k`: its child link `c` does not exist; declare <link name=\"c\"/> or correct the name",
        ),
        (
            two_links(&joint("k", "B", "a")),
            "arm.urdf, line 5: joint `k`: its parent link `B` does not exist; declare <link name=\"B\"/> or correct the name",
        ),
        (
            two_links(&joint("k", "b", "a")),
            "arm.urdf, line 5: joints `k`, `j` form a loop; remove one of them: a robot is a tree",
        ),
        (
            two_links(r#"<link name="b"/>"#),
            "arm.urdf, line 5: link `b` is declared a second time (first in line 3); give it another name",
        ),
        (
            two_links(&format!(r#"<link name="c"/>{}"#, joint("j", "b", "c"))),
            "arm.urdf, line 5: joint `j` is declared a second time (first in line 4); give it another name",
        ),
        (r#"<robot name="r"/>"#.into(), "arm.urdf: the robot has no link; declare its links"),
        (
            r#"<sdf/>"#.into(),
            "arm.urdf, line 1: the first element is <sdf> instead of <robot>; give a URDF file",
        ),
        (two_links("<link/>"), "arm.urdf, line 5: <link> has no attribute `name`; add name=\"...\""),
        (
            two_links(r#"<joint name="k"/>"#),
            "arm.urdf, line 5: joint `k` has no attribute `type`; add type=\"...\"",
        ),
        (
            two_links(r#"<joint name="k" type="ball"/>"#),
            "arm.urdf, line 5: joint `k` has the unknown type `ball`; use revolute, continuous, prismatic or fixed",
        ),
        (
            two_links(r#"<joint name="k" type="fixed"><child link="b"/></joint>"#),
            "arm.urdf, line 5: joint `k` has no <parent>; add <parent link=\"...\"/>",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(message(&text), expected);
    }
}

/// A robot whose joint `j` has the given content, beside its links.
fn with_joint(content: &str) -> String {
    two_links("").replace("<child link=\"b\"/>", &format!("<child link=\"b\"/>\n{content}"))
}

#[test]
fn zeros_of_exporters_are_no_limits() {
    let limits = |content: &str| {
        let robot = read_urdf(&with_joint(content), "arm.urdf").unwrap();
        (robot.joints[0].range, robot.joints[0].effort)
    };
    assert_eq!(limits(r#"<limit lower="0" upper="0" effort="0" velocity="0"/>"#), (None, None));
    assert_eq!(limits(r#"<limit upper="2" effort="5"/>"#), (Some([0.0, 2.0]), Some(5.0)));
    assert_eq!(limits(r#"<limit effort="5"/>"#), (None, Some(5.0)));
}

#[test]
fn each_fault_of_a_joint_is_named_with_its_remedy() {
    let cases = [
        (
            r#"<axis xyz="0 0 0"/>"#,
            "arm.urdf, line 5: joint `j`: <axis> has the length 0; give a direction, such as xyz=\"0 0 1\"",
        ),
        (
            r#"<axis xyz="0 0"/>"#,
            "arm.urdf, line 5: <axis>: xyz has 2 numbers instead of 3; write 3 numbers separated by spaces",
        ),
        (
            r#"<origin xyz="0 nan 0"/>"#,
            "arm.urdf, line 5: <origin>: xyz=\"nan\" is not a finite number; write a decimal number such as 0.25",
        ),
        (
            r#"<origin rpy="0 0 1e999"/>"#,
            "arm.urdf, line 5: <origin>: rpy=\"1e999\" is not a finite number; write a decimal number such as 0.25",
        ),
        (
            r#"<dynamics damping="0,5"/>"#,
            "arm.urdf, line 5: <dynamics>: damping=\"0,5\" is not a finite number; write a decimal number such as 0.25",
        ),
        (
            r#"<limit lower="1" upper="-1"/>"#,
            "arm.urdf, line 5: joint `j`: its lower limit 1 exceeds its upper limit -1; swap them",
        ),
        (
            r#"<mimic joint="z"/>"#,
            "arm.urdf, line 5: joint `j` mimics joint `z`, which does not exist; correct the name",
        ),
        (
            r#"<mimic joint="j"/>"#,
            "arm.urdf, line 4: the positions of joint `j` depend on each other; let one of them be independent",
        ),
        (
            r#"<origin xyz="${x} 0 0"/>"#,
            "arm.urdf, line 5: the file has xacro macros, which only ROS expands; expand them first: xacro arm.urdf > out.urdf",
        ),
    ];
    for (content, expected) in cases {
        assert_eq!(message(&with_joint(content)), expected);
    }
}

/// A robot whose link `b` has the given inertial element.
fn with_inertial(content: &str) -> String {
    let original = r#"<mass value="1"/><inertia ixx="1" iyy="1" izz="1"/>"#;
    two_links("").replace(original, content)
}

#[test]
fn each_fault_of_an_inertia_is_named_with_its_remedy() {
    let tensor = r#"<inertia ixx="1" iyy="1" izz="1"/>"#;
    let cases = [
        (
            tensor.to_owned(),
            "arm.urdf, line 3: <inertial> of link `b` has no <mass value=\"...\"/>; add <mass value=\"...\"/>",
        ),
        (
            r#"<mass value="1"/>"#.into(),
            "arm.urdf, line 3: <inertial> of link `b` has no <inertia ixx=\"...\" .../>; add <inertia ixx=\"...\" .../>",
        ),
        (
            format!(r#"<mass value="0"/>{tensor}"#),
            "arm.urdf, line 3: link `b` moves and has a moment of inertia, but no mass; correct its <inertial>",
        ),
        (
            format!(r#"<mass value="-2"/>{tensor}"#),
            "arm.urdf, line 3: link `b` has the negative mass -2 kg; correct its <inertial>",
        ),
    ];
    for (content, expected) in cases {
        assert_eq!(message(&with_inertial(&content)), expected);
    }
}

#[test]
fn an_impossible_tensor_and_a_massless_link_are_warnings() {
    let text = with_inertial(r#"<mass value="1"/><inertia ixx="1" iyy="1" izz="3"/>"#);
    let warnings = read_urdf(&text, "arm.urdf").unwrap().warnings();
    assert_eq!(
        warnings,
        [
            "arm.urdf, line 3: link `b` has an inertia tensor that no body has: its largest principal moment, 3.0000e0 kg m2, exceeds the sum of the others, 2.0000e0"
        ]
    );
    let text = with_inertial(r#"<mass value="1"/><inertia ixx="-1"/>"#);
    let warnings = read_urdf(&text, "arm.urdf").unwrap().warnings();
    assert_eq!(
        warnings,
        [
            "arm.urdf, line 3: link `b` has an inertia tensor that no body has: its smallest principal moment is -1.0000e0 kg m2"
        ]
    );
    let more = r#"<link name="c"/><joint name="k" type="fixed"><parent link="b"/><child link="c"/></joint>
<link name="d"/><joint name="l" type="continuous"><parent link="c"/><child link="d"/></joint>"#;
    let warnings = read_urdf(&two_links(more), "arm.urdf").unwrap().warnings();
    // Link `d` has no mass at all: the equations of motion refuse it, unless the model file states its inertia.
    assert_eq!(warnings, ["arm.urdf, line 5: link `c` moves and has no <inertial>; it counts as massless"]);
}

#[test]
fn faults_of_xml_are_named_with_their_remedy() {
    let bomb = r#"<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>"#;
    let xacro = r#"<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="m"/></robot>"#;
    let cases = [
        (
            bomb,
            "arm.urdf: the file has a document type definition (<!DOCTYPE>), which could expand to any size; remove it and write entities out",
        ),
        (
            xacro,
            "arm.urdf, line 1: the file has xacro macros, which only ROS expands; expand them first: xacro arm.urdf > out.urdf",
        ),
        (
            "<robot><xacro:include/></robot>",
            "arm.urdf, line 1: the file has xacro macros, which only ROS expands; expand them first: xacro arm.urdf > out.urdf",
        ),
        (
            "<robot>\n<a:b/></robot>",
            "arm.urdf, line 2: the prefix `a:` is not declared; add xmlns:a=\"a\" to the first element",
        ),
        ("", "arm.urdf: the file has no XML element; give a URDF file (<robot>) or an MJCF file (<mujoco>)"),
        (
            "<robot>",
            "arm.urdf: the file ends before its last element is closed; check that the file is complete",
        ),
        (
            "<robot>\n</mujoco>",
            "arm.urdf, line 2: this is not well-formed XML: expected 'robot' tag, not 'mujoco' at 2:1; correct it, or save the file again",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(message(text), expected);
    }
}

#[test]
fn files_that_would_exhaust_memory_or_time_are_refused() {
    let deep = format!("{}{}", "<robot>".repeat(100_000), "</robot>".repeat(100_000));
    let attributes: String = (0..100_000).map(|k| format!(" a{k}=''")).collect();
    let cases = [
        (deep, "arm.urdf, line 1: elements are nested deeper than 250 levels; split the robot into parts"),
        (
            format!("<robot{attributes}/>"),
            "arm.urdf: an element has 100000 attributes, and at most 200 are read; check that it is a description of a robot",
        ),
        (
            "<a/>".repeat(600_000),
            "arm.urdf: the file has more than 500000 elements, texts and comments; check that it is a description of a robot",
        ),
        (
            " ".repeat(17 << 20),
            "arm.urdf: the file has 17825792 bytes, and at most 16777216 are read; check that it is a description of a robot",
        ),
        (
            format!(
                "<robot>{}</robot>",
                (0..2001).map(|k| format!("<link name='{k}'/>")).collect::<String>()
            ),
            "arm.urdf: the robot has more than 2000 links; split it into parts",
        ),
    ];
    for (text, expected) in cases {
        let text = text.replacen("<a/>", "<robot>", 1);
        assert_eq!(message(&text), expected);
    }
    let chain: String = (1..1000).map(|k| format!(r#"<link name="l{k}"/><joint name="j{k}" type="fixed"><parent link="l{}"/><child link="l{k}"/></joint>"#, k - 1)).collect();
    let text = format!(r#"<robot><link name="l0"/>{chain}</robot>"#);
    assert_eq!(
        message(&text),
        "arm.urdf, line 1: link `l201` is more than 200 joints away from the base; split the robot into parts"
    );
}
