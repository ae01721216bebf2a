//! Contract: every error in `[robot]` names file, line and key, and says what to do.
//!
//! Each case is a valid file with one thing changed. The texts are compared exactly.

use crate::robot::{fixtures, read};
use augsim_equations::model;

/// Model of two links, whose torques are the outputs.
const INVERSE: &str = r#"scenario = "system"
[robot]
file = "two-link-planar.urdf"
joints = ["shoulder", "elbow"]
position = ["q0", "q1"]
speed = ["w0", "w1"]
acceleration = ["a0", "a1"]
[inputs]
q0 = {}
q1 = {}
w0 = {}
w1 = {}
a0 = {}
a1 = {}
[outputs]
tau0 = "inverse_dynamics(shoulder)"
tau1 = "inverse_dynamics(elbow)"
"#;

/// Message of the model with `old` replaced by `new`.
fn with(old: &str, new: &str) -> String {
    message(&replaced(INVERSE, &[(old, new)]))
}

fn replaced(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "the model no longer has `{old}`");
        text.replacen(old, new, 1)
    })
}

fn message(text: &str) -> String {
    read(text).map_or_else(|message| message, |model| format!("read {} outputs", model.outputs.len()))
}

#[test]
fn the_model_without_a_mistake_is_read() {
    assert_eq!(message(INVERSE), "read 2 outputs");
}

#[test]
fn a_description_that_cannot_be_read_is_named_with_its_path() {
    assert_eq!(
        with("two-link-planar.urdf", "missing.urdf"),
        "arm.toml:3: robot.file: missing.urdf: No such file or directory (os error 2); check the path"
    );
    assert_eq!(
        with("two-link-planar.urdf", "../robots"),
        "arm.toml:3: robot.file: ../robots: not a file; give the path of a URDF or MJCF file"
    );
    assert_eq!(
        with("two-link-planar.urdf", "no\\tsuch\\u001b.urdf"),
        "arm.toml:3: robot.file: no\\tsuch\\u{1b}.urdf: No such file or directory (os error 2); check the path"
    );
    assert_eq!(
        with("two-link-planar.urdf", "golden.json"),
        "arm.toml:3: robot.file: golden.json, line 1: this is not well-formed XML: unknown token at 1:1; correct it, or save the \
         file again"
    );
    assert_eq!(
        with("file = \"two-link-planar.urdf\"\n", ""),
        "arm.toml:2: robot: the key `file` is missing; add file = \"arm.urdf\""
    );
}

#[test]
fn a_joint_that_cannot_move_is_named_with_the_nearest_one_or_all() {
    let joints = |last: &str| with("\"elbow\"]", &format!("{last:?}]"));
    assert_eq!(
        joints("elbows"),
        "arm.toml:4: robot.joints: `two-link-planar.urdf` has no joint `elbows`; did you mean `elbow`?"
    );
    assert_eq!(
        joints("hand"),
        "arm.toml:4: robot.joints: `two-link-planar.urdf` has no joint `hand`; it has `shoulder`, `elbow`"
    );
    assert_eq!(
        joints("shoulder"),
        "arm.toml:4: robot.joints: joint `shoulder` is named twice; name each moving joint once"
    );
    assert_eq!(
        joints("flange"),
        "arm.toml:4: robot.joints: joint `flange` (two-link-planar.urdf, line 54) is fixed and cannot move; remove its name"
    );
    assert_eq!(
        with("joints = [\"shoulder\", \"elbow\"]\n", ""),
        "arm.toml:2: robot: the key `joints` is missing; add joints = [\"joint1\", \"joint2\"]"
    );
    let locked = |table: &str| with("joints =", &format!("locked = {{ {table} }}\njoints ="));
    assert_eq!(
        locked("elbow = 0.2"),
        "arm.toml:5: robot.joints: joint `elbow` is both moving and locked; remove it from one of the two"
    );
    assert_eq!(
        locked("elbw = 0.2"),
        "arm.toml:5: robot.joints: `two-link-planar.urdf` has no joint `elbw`; did you mean `elbow`?"
    );
}

#[test]
fn each_list_needs_one_expression_for_each_joint() {
    assert_eq!(
        with("[\"q0\", \"q1\"]", "[\"q0\"]"),
        "arm.toml:5: robot.position: the list has 1 expressions, but `joints` has 2; give one expression for each joint"
    );
    assert_eq!(
        with("[\"a0\", \"a1\"]", "[\"a0\", \"a1\", \"a1\"]"),
        "arm.toml:7: robot.acceleration: the list has 3 expressions, but `joints` has 2; give one expression for each joint"
    );
    assert_eq!(
        with("[\"q0\", \"q1\"]", "\"q0\""),
        "arm.toml:5: robot.position: the value must be a list with one expression in quotes for each joint"
    );
    assert_eq!(
        with("[\"q0\", \"q1\"]", "[\"q0\", \"2 * q2\"]"),
        "arm.toml:5: robot.position: unknown name `q2`; did you mean `q0`?\n    2 * q2\n        ^^"
    );
    assert_eq!(
        with("position = [\"q0\", \"q1\"]\n", ""),
        "arm.toml:2: robot: the key `position` is missing; add position = [\"q1_rad\"], with one expression for each joint"
    );
    assert_eq!(
        with("speed = [\"w0\", \"w1\"]\n", ""),
        "arm.toml:2: robot: the key `speed` is missing; add speed = [\"w1_rad_s\"], with one expression for each joint"
    );
}

#[test]
fn dynamics_are_those_of_a_joint_with_what_they_are_computed_from() {
    let torque = |text: &str| with("inverse_dynamics(elbow)", text);
    assert_eq!(
        torque("inverse_dynamics(elbw)"),
        "arm.toml:17: outputs.tau1: unknown joint `elbw`; did you mean `elbow`? (joints are listed under `joints` of [robot])\n    \
         inverse_dynamics(elbw)\n                     ^^^^"
    );
    assert_eq!(
        torque("inverse_dynamics(2 * q1)"),
        "arm.toml:17: outputs.tau1: the first argument of `inverse_dynamics` must be the name of a joint\n    \
         inverse_dynamics(2 * q1)\n                     ^"
    );
    assert_eq!(
        torque("forward_dynamics(elbow)"),
        "arm.toml:17: outputs.tau1: forward_dynamics needs the torque of every drive; add torque = [\"tau1_N_m\"] to [robot], with \
         one expression for each joint"
    );
    assert_eq!(
        with("acceleration = [\"a0\", \"a1\"]\n", ""),
        "arm.toml:15: outputs.tau0: inverse_dynamics needs the acceleration of every joint; add acceleration = [\"a1_rad_s2\"] to \
         [robot], with one expression for each joint"
    );
}

#[test]
fn settings_of_the_robot_are_checked() {
    let setting = |line: &str| with("joints =", &format!("{line}\njoints ="));
    assert_eq!(
        setting("base = \"floating\""),
        "arm.toml:4: robot.base: the value must be \"fixed\"; robots with a moving base are not supported"
    );
    assert_eq!(
        setting("gravity_m_s2 = [0.0, 1.0]"),
        "arm.toml:4: robot.gravity_m_s2: the value must be a list of three numbers, such as [0.0, 0.0, -9.81]"
    );
    assert_eq!(
        setting("frame = 1"),
        "arm.toml:4: robot: unknown key `frame` (allowed here: file, joints, locked, gravity_m_s2, base, position, speed, \
         acceleration, torque)"
    );
    assert_eq!(
        with("[outputs]", "[parameters]\nforearm_mas_kg = 1.0\n[outputs]"),
        "arm.toml:16: parameters.forearm_mas_kg: the parameter is not used anywhere; remove it or set frozen = true"
    );
}

#[test]
fn a_drive_cannot_move_a_joint_without_inertia() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = std::fs::read_to_string(fixtures().join("two-link-planar.urdf")).expect("a fixture");
    let [forearm, joints] =
        ["<link name=\"forearm\">", "<joint name=\"shoulder\""].map(|t| text.find(t).expect("it"));
    let light =
        format!("{}<link name=\"forearm\"/><link name=\"payload\"/>{}", &text[..forearm], &text[joints..]);
    std::fs::write(folder.path().join("light.urdf"), light).expect("written");
    let file = folder.path().join("arm.toml").display().to_string();
    let inverse = replaced(INVERSE, &[("two-link-planar.urdf", "light.urdf")]);
    model::parse(&inverse, &file).unwrap_or_else(|e| panic!("a torque needs no inertia: {e}"));
    let changes = [
        ("acceleration", "torque"),
        ("inverse_dynamics", "forward_dynamics"),
        ("inverse_dynamics", "forward_dynamics"),
    ];
    let error =
        model::parse(&replaced(&inverse, &changes), &file).expect_err("a joint without inertia").to_string();
    assert_eq!(
        error.replace(&file, "arm.toml"),
        "arm.toml:4: robot.joints: joint `elbow` (light.urdf, line 30) moves no positive inertia; give a link that it moves a mass \
         and an inertia, or give the joint an armature"
    );
}
