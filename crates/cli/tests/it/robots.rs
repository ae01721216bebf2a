//! Contract: the output folder of `fit` and of `discover` on a robot contains the robot's description, so that the other
//! commands work on it after the folder of the declared model is gone, also the export of the description with the values found.

use crate::command::{fail, succeed, succeed_json};
use std::fmt::Write;
use std::path::Path;

const URDF: &str = r#"<robot name="pendulum">
  <!-- built in the workshop -->
  <link name="base"/>
  <link name="rod">
    <inertial>
      <origin xyz="0.3 0 0" rpy="0 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>
  </link>
  <joint name="pivot" type="continuous">
    <parent link="base"/>
    <child link="rod"/>
    <axis xyz="0 1 0"/>
    <dynamics damping="0.1" friction="0"/>
  </joint>
</robot>
"#;

const MODEL: &str = r#"scenario = "system"
[robot]
file = "../robots/pendulum.urdf" # from the workshop
joints = ["pivot"]
gravity_m_s2 = [0.0, 0.0, -9.81]
position = ["q_rad"]
speed = ["w_rad_s"]
acceleration = ["a_rad_s2"]
[inputs]
q_rad = { hold = "linear" }
w_rad_s = { hold = "linear" }
a_rad_s2 = { hold = "linear" }
[parameters]
pivot_viscous = { nominal = 0.1, min = 0.0, unit = "N m s" }
[outputs]
tau_N_m = { value = "inverse_dynamics(pivot) + pivot_viscous * w_rad_s", sd = "estimate" }
"#;

/// Viscous friction of the simulated pendulum, N m s/rad.
const VISCOUS: f64 = 0.4;
/// Coulomb friction of the simulated pendulum, N m.
const COULOMB: f64 = 0.8;

/// Writes motions of the pendulum with the torque of its drive, by the equation of a pendulum: the inertia about the pivot
/// is 0.02 + 2 * 0.3^2 = 0.2 kg m2, and gravity pulls with 2 * 9.81 * 0.3 * cos(q) N m towards a larger angle.
fn motions(path: &Path) {
    let mut text = "trajectory,t_s,q_rad,w_rad_s,a_rad_s2,tau_N_m\n".to_owned();
    for i in 0..4 {
        let phase = 0.7 * f64::from(i);
        for k in 0..300 {
            let t = 0.02 * f64::from(k);
            let (a, b) = (1.3 * t + phase, 3.1 * t - phase);
            let q = a.sin() + 0.3 * b.sin();
            let w = 1.3 * a.cos() + 0.93 * b.cos();
            let acceleration = -1.69 * a.sin() - 2.883 * b.sin();
            let noise = 0.01 * (1000.0 * t * t + 17.0 * phase).sin();
            let friction = VISCOUS * w + COULOMB * (w / 0.02).tanh();
            let torque = 0.2 * acceleration - 2.0 * 9.81 * 0.3 * q.cos() + friction + noise;
            writeln!(text, "{i},{t:.2},{q:.9},{w:.9},{acceleration:.9},{torque:.9}").expect("a string");
        }
    }
    std::fs::write(path, text).expect("it can be written");
}

/// Writes the model of the pendulum and its description into a folder, and motions beside it.
fn write_pendulum(dir: &Path) {
    for folder in ["declared/models", "declared/robots"] {
        std::fs::create_dir_all(dir.join(folder)).expect("a folder");
    }
    std::fs::write(dir.join("declared/robots/pendulum.urdf"), URDF).expect("it can be written");
    std::fs::write(dir.join("declared/models/model.toml"), MODEL).expect("it can be written");
    motions(&dir.join("motions.csv"));
}

/// Checks that the folder has the description and a model that names it, and scores the model after the declared one is gone.
fn check_folder(dir: &Path, folder: &str) -> serde_json::Value {
    std::fs::remove_dir_all(dir.join("declared")).expect("it can be removed");
    let copied = std::fs::read_to_string(dir.join(folder).join("pendulum.urdf")).expect("the description");
    assert_eq!(copied, URDF);
    let model = std::fs::read_to_string(dir.join(folder).join("model.toml")).expect("a model");
    assert!(model.contains("file = \"pendulum.urdf\" # from the workshop"), "{model}");
    succeed(&["predict", folder, "--data", "motions.csv", "--out", "predicted.csv"], dir);
    succeed_json(&["evaluate", folder, "--data", "motions.csv"], dir)
}

#[test]
fn the_folder_of_a_fit_is_complete_without_the_declared_model() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    write_pendulum(d);
    succeed(&["fit", "declared/models/model.toml", "motions.csv", "--out", "fit"], d);
    let score = check_folder(d, "fit");
    assert!(score["rows"][0]["rmse"].as_f64().expect("a number") < 1.0, "{score}");
}

#[test]
fn the_folder_of_a_discovery_is_complete_without_the_declared_model() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    write_pendulum(d);
    let discover =
        ["discover", "declared/models/model.toml", "motions.csv", "--null-runs", "0", "--only", "coulomb"];
    succeed(&[&discover[..], &["--out", "found"]].concat(), d);
    let score = check_folder(d, "found");
    let rmse = |model: &str| {
        let rows = score["rows"].as_array().expect("rows").iter();
        let row = rows.clone().find(|row| row["model"] == model).expect("a row");
        row["rmse"].as_f64().expect("a number")
    };
    assert!(rmse("augmented") < 0.05 && rmse("calibrated") > 0.1, "{score}");
    // The pendulum's own file, with the friction that was found.
    let exported = succeed(&["export", "found", "--as", "urdf"], d);
    assert!(exported.contains("<!-- built in the workshop -->"), "{exported}");
    let robot = augsim_robot::read(&exported, "exported").expect("a description");
    let joint = &robot.joints[0];
    assert!((joint.damping - VISCOUS).abs() < 0.02, "{exported}");
    assert!((joint.friction_loss - COULOMB).abs() < 0.02, "{exported}");
    fail(2, &["export", "found", "--as", "urdf", "--out", "found/pendulum.urdf"], d, &["pendulum.urdf"]);
    succeed(&["export", "found", "--as", "mjcf", "--out", "pendulum.xml"], d);
    let converted = std::fs::read_to_string(d.join("pendulum.xml")).expect("a file");
    let converted = augsim_robot::read(&converted, "pendulum.xml").expect("a description");
    let converted = &converted.joints[converted.joint("pivot").expect("a joint")];
    assert_eq!((converted.damping, converted.friction_loss), (joint.damping, joint.friction_loss));
    let listed = succeed_json(&["report", "found"], d);
    assert!(!listed["figures"].as_array().expect("a list").is_empty(), "{listed}");
}

#[test]
fn a_description_in_the_output_folder_is_not_overwritten() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    write_pendulum(d);
    // Another robot's description has the same name.
    std::fs::create_dir(d.join("fit")).expect("a folder");
    std::fs::write(d.join("fit/pendulum.urdf"), "other").expect("it can be written");
    let fit = ["fit", "declared/models/model.toml", "motions.csv", "--out", "fit"];
    fail(2, &fit, d, &["pendulum.urdf", "--force"]);
    assert_eq!(std::fs::read_to_string(d.join("fit/pendulum.urdf")).expect("a file"), "other");
    // Beside the description itself only the model is written.
    let beside = [&fit[..4], &["declared/robots"]].concat();
    succeed(&beside, d);
    let model = std::fs::read_to_string(d.join("declared/robots/model.toml")).expect("a model");
    assert!(model.contains("file = \"pendulum.urdf\""), "{model}");
    assert_eq!(std::fs::read_to_string(d.join("declared/robots/pendulum.urdf")).expect("a file"), URDF);
}

#[test]
fn a_model_without_a_robot_has_no_description_to_export() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["model", "new", "pendulum"], d);
    fail(2, &["export", "pendulum.toml", "--as", "urdf"], d, &["pendulum.toml", "model from-robot"]);
}
