//! Contract: `model from-robot` and `discover` find the friction that a robot's description lacks, on the right joint; the same
//! log gives the same bytes; each mistake ends with its exit code and one sentence that says what to do.
//!
//! The log is made here with the dynamics of `augsim_robot`: two links that follow a sum of sines.

use crate::command::{augsim, fail, succeed, succeed_json};
use crate::same_bytes::writes_the_same;
use augsim_robot::{Numbers, Robot, Tree, inverse_dynamics};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

/// Coulomb friction of the elbow, N m, and width of its change of sign, rad/s; the description lacks both.
const FRICTION_N_M: f64 = 0.35;
const WIDTH_RAD_S: f64 = 0.02;

const SAMPLE_RATE_HZ: f64 = 200.0;
const DURATION_S: f64 = 20.0;

/// Random numbers for the noise of the log: SplitMix64 (Steele, Lea and Flood, 2014).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A normal number with the standard deviation 1, by the method of Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}

/// Position, speed and acceleration of a joint at a time: a sum of sines, which differs between the joints.
fn motion(joint: usize, t: f64) -> [f64; 3] {
    let mut motion = [[-0.4, 0.5][joint], 0.0, 0.0];
    for harmonic in 1..=4 {
        let rate = 0.1 * TAU * harmonic as f64 * [1.0, 1.3][joint];
        let amplitude = 0.5 / harmonic as f64;
        let (sin, cos) = (rate * t + 1.1 * (harmonic * (joint + 1)) as f64).sin_cos();
        motion[0] += amplitude * sin;
        motion[1] += amplitude * rate * cos;
        motion[2] -= amplitude * rate * rate * sin;
    }
    motion
}

/// Text of the description: two links in a vertical plane.
fn description() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/robots/two-link-planar.urdf");
    let text = std::fs::read_to_string(path).expect("a fixture");
    // The friction of the shoulder is left out, so that only that of the elbow is to be found.
    text.replace(" friction=\"0.5\"", "")
}

/// Torques of the shoulder and the elbow: rigid bodies, the damping of the description, and the friction that it lacks.
fn torques(robot: &Robot, tree: &Tree, motion: [[f64; 3]; 2]) -> [f64; 2] {
    let part = |k: usize| motion.map(|of_joint| of_joint[k]);
    let parameters = tree.body_parameters(&mut Numbers, &tree.link_parameters(robot));
    let gravity = [0.0, 0.0, -9.81];
    let (position, speed, acceleration) = (part(0), part(1), part(2));
    let rigid = inverse_dynamics(&mut Numbers, tree, &parameters, gravity, &position, &speed, &acceleration);
    std::array::from_fn(|joint| {
        let friction = [0.0, FRICTION_N_M][joint] * (speed[joint] / WIDTH_RAD_S).tanh();
        rigid[joint] + robot.joints[joint].damping * speed[joint] + friction
    })
}

/// Writes `arm.urdf` and `log.csv`, whose torques have the unit and the names that `torque` gives.
fn write_log(folder: &Path, torque: &str) {
    let text = description();
    let robot = augsim_robot::read(&text, "arm.urdf").expect("a description");
    let joints = ["shoulder".to_owned(), "elbow".to_owned()];
    let tree = Tree::new(&robot, &joints, &BTreeMap::new()).expect("a tree");
    let mut random = Random(7);
    let [first, second] = ["1", "2"].map(|number| torque.replace('#', number));
    let mut log = format!("t_s,q1_rad,q2_rad,{first},{second}\n");
    for k in 0..(DURATION_S * SAMPLE_RATE_HZ) as usize {
        let t = k as f64 / SAMPLE_RATE_HZ;
        let motion = [motion(0, t), motion(1, t)];
        let torque = torques(&robot, &tree, motion);
        let [q1, q2] = motion.map(|of_joint| of_joint[0] + 2e-5 * random.normal());
        let [tau1, tau2] = [torque[0] + 0.05 * random.normal(), torque[1] + 0.02 * random.normal()];
        let _ = writeln!(log, "{t},{q1:.7},{q2:.7},{tau1:.5},{tau2:.5}");
    }
    std::fs::write(folder.join("arm.urdf"), text).expect("written");
    std::fs::write(folder.join("log.csv"), log).expect("written");
}

/// A folder with `arm.urdf` and `log.csv`.
fn scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_log(folder.path(), "tau#_N_m");
    folder
}

#[test]
fn friction_that_the_description_lacks_is_named_on_its_joint_with_its_value() {
    let folder = scene();
    let d = folder.path();
    let made = succeed(&["model", "from-robot", "arm.urdf", "log.csv", "--out", "arm"], d);
    for part in ["2 joints (shoulder, elbow), 1 trajectories", "inverse dynamics: motion in, torque out"] {
        assert!(made.contains(part), "`{part}` is not in:\n{made}");
    }
    assert!(made.ends_with("next: augsim discover arm/model.toml arm/data.csv\n"), "{made}");
    let found = succeed_json(&["discover", "arm/model.toml", "arm/data.csv", "--out", "found"], d);
    let effects = found["effects"].as_array().expect("effects");
    let kinds: Vec<&str> = effects.iter().filter_map(|effect| effect["kind"].as_str()).collect();
    assert_eq!(kinds, ["coulomb on elbow"], "{}", found["sentence"]);
    let friction = &effects[0]["parameters"]["f"];
    let [low, high] = [0, 1].map(|end| friction["ci95"][end].as_f64().expect("an interval"));
    assert!(low < FRICTION_N_M && FRICTION_N_M < high && high - low < 0.05, "{friction}");
    // The declared viscous friction keeps its value.
    let viscous = found["parameters"]["elbow_viscous"]["value"].as_f64().expect("a value");
    assert!((viscous - 0.12).abs() < 0.02, "{viscous}");
    // What was found is a model of the same robot, whose description it needs beside it.
    std::fs::copy(d.join("arm/arm.urdf"), d.join("found/arm.urdf")).expect("copied");
    let error = |model: &str| {
        let scores = succeed_json(&["evaluate", model, "--data", "arm/data.csv"], d);
        let row = scores["rows"]
            .as_array()
            .and_then(|rows| rows.iter().find(|row| row["output"] == "tau_elbow_N_m"));
        row.and_then(|row| row["rmse"].as_f64()).unwrap_or_else(|| panic!("{scores}"))
    };
    let (before, after) = (error("arm/model.toml"), error("found/model.toml"));
    assert!(after < 0.5 * before, "{before} {after}");
}

#[test]
fn the_same_log_gives_the_same_bytes_with_any_number_of_threads() {
    let folder = scene();
    let args = ["model", "from-robot", "arm.urdf", "log.csv", "--free", "inertias,viscous,armature"];
    let out = writes_the_same(&args, folder.path());
    let copy = std::fs::read_to_string(out.join("arm.urdf")).expect("a copy of the description");
    assert_eq!(copy, description());
}

#[test]
fn the_result_is_printed_as_json() {
    let folder = scene();
    let args = ["model", "from-robot", "arm.urdf", "log.csv", "--free", "viscous,armature", "--out", "arm"];
    let made = succeed_json(&args, folder.path());
    assert_eq!(made["formulation"], "inverse");
    assert_eq!(made["joints"], serde_json::json!(["shoulder", "elbow"]));
    assert_eq!(made["free"], serde_json::json!(["shoulder_armature_kg_m2", "elbow_armature_kg_m2"]));
    assert_eq!(made["next"], "augsim discover arm/model.toml arm/data.csv");
    assert_eq!(made["notes"], serde_json::json!([]));
    let [cutoff, rate] = ["cutoff_hz", "rate_hz"].map(|key| made[key].as_f64().expect("a number"));
    assert!(1.0 < cutoff && 2.0 * cutoff < rate && rate < SAMPLE_RATE_HZ, "{cutoff} Hz, {rate} Hz");
    let data = std::fs::read_to_string(folder.path().join("arm/data.csv")).expect("data");
    assert_eq!(made["samples"], data.lines().count() - 1);
}

#[test]
fn currents_become_torques_by_an_expression_of_the_columns() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let d = folder.path();
    write_log(d, "drive#_A");
    let args = ["model", "from-robot", "arm.urdf", "log.csv", "--torque", "shoulder=2 * drive1_A"];
    succeed(&[&args[..], &["--torque", "elbow=drive2_A - 0.5 * drive1_A", "--out", "arm"]].concat(), d);
    let model = std::fs::read_to_string(d.join("arm/model.toml")).expect("a model");
    assert!(model.contains("tau_elbow_N_m = { value = \"inverse_dynamics(elbow) + elbow_viscous"), "{model}");
    let exported = augsim(&["export", "arm/model.toml", "--as", "c", "--out", "torque.c"], d);
    let exported = String::from_utf8_lossy(&exported.stderr);
    let note = "tau_shoulder_N_m, tau_elbow_N_m: written as computed from the inputs, without the filter of low_pass_hz";
    assert!(exported.contains(note), "{exported}");
    let rms = |file: &str, column: &str, value: &dyn Fn(&[f64]) -> f64| {
        let text = std::fs::read_to_string(d.join(file)).expect("a table");
        let names: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
        let first = names.iter().position(|name| *name == column).expect("a column");
        let squares: Vec<f64> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').collect::<Vec<&str>>())
            // Torques have fewer samples than the motion.
            .filter(|cells| !cells[first].is_empty())
            .map(|cells| {
                let numbers: Vec<f64> = cells.iter().map(|n| n.parse().unwrap_or(0.0)).collect();
                value(&numbers[first..]).powi(2)
            })
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let logged = rms("log.csv", "drive1_A", &|row| row[1] - 0.5 * row[0]);
    let filtered = rms("arm/data.csv", "tau_elbow_N_m", &|row| row[0]);
    assert!((logged / filtered - 1.0).abs() < 0.05, "{logged} {filtered}");
}

/// Asserts that a command line ends with code 3 and exactly this sentence, and writes nothing.
fn refused(folder: &Path, args: &[&str], sentence: &str) {
    refused_with(3, folder, args, sentence);
}

/// Asserts that a command line ends with this code and exactly this sentence, and writes nothing.
fn refused_with(code: i32, folder: &Path, args: &[&str], sentence: &str) {
    let error = fail(code, &[&["model", "from-robot"], args, &["--out", "arm"]].concat(), folder, &[]);
    assert_eq!(error, format!("augsim: error: {sentence}\n"), "{args:?}");
    assert!(!folder.join("arm").exists(), "{args:?} wrote a folder");
}

/// Writes a copy of a file in which `old` is replaced by `new`.
fn changed(folder: &Path, from: &str, to: &str, changes: &[(&str, &str)]) {
    let text = std::fs::read_to_string(folder.join(from)).expect("a file");
    let text = changes.iter().fold(text, |text, (old, new)| {
        assert!(text.contains(old), "{from} no longer has `{old}`");
        text.replacen(old, new, 1)
    });
    std::fs::write(folder.join(to), text).expect("written");
}

#[test]
fn each_mistake_in_a_log_or_an_option_is_answered_with_a_remedy() {
    let folder = scene();
    let d = folder.path();
    changed(d, "log.csv", "volts.csv", &[("q1_rad", "x1_V"), ("q2_rad", "x2_V")]);
    refused(
        d,
        &["arm.urdf", "volts.csv"],
        "the log has no position of shoulder, elbow; its columns are x1_V, x2_V, tau1_N_m, tau2_N_m; name one with \
         --position, such as --position 'shoulder=q1_rad'",
    );
    changed(d, "log.csv", "currents.csv", &[("tau1_N_m", "i1_A"), ("tau2_N_m", "i2_A")]);
    refused(
        d,
        &["arm.urdf", "currents.csv"],
        "the log has no torque of every joint, only currents, whose gains are not known; its columns are q1_rad, q2_rad, i1_A, \
         i2_A; give each with --torque, such as --torque 'joint_1=12.5 * current1_A'",
    );
    let closest = "`arm.urdf` has no joint `elbwo`; did you mean `elbow`?";
    refused_with(2, d, &["arm.urdf", "log.csv", "--joints", "shoulder,elbwo"], closest);
    let has = "arm.urdf has no joint `elbwo` that can move; it has shoulder, elbow";
    refused_with(2, d, &["arm.urdf", "log.csv", "--position", "elbwo=q2_rad"], has);
    refused_with(2, d, &["arm.urdf", "log.csv", "--torque", "elbwo=tau2_N_m"], has);
    refused_with(
        2,
        d,
        &["arm.urdf", "log.csv", "--joints", "shoulder,flange"],
        "joint `flange` (arm.urdf, line 54) is fixed and cannot move; remove its name",
    );
    refused_with(
        2,
        d,
        &["arm.urdf", "log.csv", "--torque", "elbow=2 * tau3_N_m"],
        "--torque elbow: unknown name `tau3_N_m`; did you mean `tau1_N_m`?\n    2 * tau3_N_m\n        ^^^^^^^^",
    );
    refused(d, &["none.urdf", "log.csv"], "none.urdf: there is no such file or folder; check the path");
    for option in ["elbow", "=q1_rad"] {
        let wrong = ["model", "from-robot", "arm.urdf", "log.csv", "--position", option];
        fail(2, &wrong, d, &["write JOINT=EXPRESSION, such as joint_5=45 * current5_A"]);
    }
}

#[test]
fn each_mistake_in_a_description_is_answered_with_its_line_and_a_remedy() {
    let folder = scene();
    let d = folder.path();
    let wrong = |changes: &[(&str, &str)], sentence: &str| {
        changed(d, "arm.urdf", "wrong.urdf", changes);
        refused(d, &["wrong.urdf", "log.csv"], sentence);
    };
    wrong(
        &[("<mass value=\"1.35\"/>", "<mass value=\"0\"/>")],
        "wrong.urdf, line 21: link `forearm` moves and has a moment of inertia, but no mass; correct its <inertial>",
    );
    wrong(
        &[("<parent link=\"base\"/>", "<parent link=\"forearm\"/>")],
        "wrong.urdf, line 36: joints `shoulder`, `elbow` form a loop; remove one of them: a robot is a tree",
    );
    wrong(
        &[("joint name=\"elbow\" type=\"revolute\"", "joint name=\"elbow\" type=\"hinge\"")],
        "wrong.urdf, line 45: joint `elbow` has the unknown type `hinge`; use revolute, continuous, prismatic or fixed",
    );
    // Each entity is ten of the one before it: a million million letters.
    let entities: String =
        (1..13).map(|i| format!("<!ENTITY e{i} \"{}\">", format!("&e{};", i - 1).repeat(10))).collect();
    let bomb = format!(
        "<?xml version=\"1.0\"?>\n<!DOCTYPE robot [<!ENTITY e0 \"ha\">{entities}]>\n<robot name=\"&e12;\"/>\n"
    );
    std::fs::write(d.join("bomb.urdf"), bomb).expect("written");
    refused(
        d,
        &["bomb.urdf", "log.csv"],
        "bomb.urdf: the file has a document type definition (<!DOCTYPE>), which could expand to any size; remove it and write \
         entities out",
    );
    // Without inertia a joint has no acceleration; its torque is 0 and needs none.
    let text = description();
    let upper_arm = text.find("<link name=\"forearm\">").expect("a link");
    let joints = text.find("<joint name=\"shoulder\"").expect("a joint");
    let light =
        format!("{}<link name=\"forearm\"/><link name=\"payload\"/>{}", &text[..upper_arm], &text[joints..]);
    std::fs::write(d.join("light.urdf"), light).expect("written");
    refused(
        d,
        &["light.urdf", "log.csv", "--formulation", "forward"],
        "joint `elbow` (light.urdf, line 30) moves no positive inertia; give a link that it moves a mass and an inertia, or give the \
         joint an armature",
    );
}
