//! Contract: the dynamics of a model with `[robot]` are those of `augsim_robot`, in both formulations, with exact derivatives.
//!
//! The models are written for descriptions of `fixtures/robots`, whose dynamics the tests of `augsim_robot` compare with
//! Pinocchio and MuJoCo. Simulations are compared with the same integrator in a few lines, and derivatives with central
//! differences of the same engine.

use augsim_equations::System;
use augsim_equations::engine::{Method, Options, Point, Record, Seed, Signal, Window};
use augsim_equations::model::{self, Hold, Model};
use augsim_robot::{Numbers, Robot, Tree, forward_dynamics, inverse_dynamics};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Folder of the descriptions.
pub fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/robots")
}

/// Reads a model file `arm.toml` beside the descriptions; the error is its message without the folder.
pub fn read(text: &str) -> Result<Model, String> {
    let folder = fixtures().display().to_string();
    let file = format!("{folder}/arm.toml");
    model::parse(text, &file).map_err(|e| e.to_string().replace(&format!("{folder}/"), ""))
}

pub fn parsed(text: &str) -> Model {
    read(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Compiles a model with derivatives with respect to all parameters.
pub fn compiled(model: &Model) -> System {
    let all: Vec<usize> = (0..model.parameters.len()).collect();
    System::compile(model, &all).unwrap_or_else(|e| panic!("{e}"))
}

/// A description of `fixtures/robots` with the joints that move.
pub struct Arm {
    file: &'static str,
    joints: Vec<&'static str>,
    pub robot: Robot,
    pub tree: Tree,
}

/// Position, speed and acceleration (or torque) of every joint.
pub type Motion = [Vec<f64>; 3];

impl Arm {
    pub fn new(file: &'static str, joints: &[&'static str]) -> Arm {
        let text = std::fs::read_to_string(fixtures().join(file)).expect("a fixture");
        let robot = augsim_robot::read(&text, file).unwrap_or_else(|e| panic!("{e}"));
        let names: Vec<String> = joints.iter().map(|name| (*name).to_owned()).collect();
        let tree = Tree::new(&robot, &names, &BTreeMap::new()).unwrap_or_else(|e| panic!("{e}"));
        Arm { file, joints: joints.to_vec(), robot, tree }
    }

    /// Two links that move in a vertical plane.
    pub fn two_links() -> Arm {
        Arm::new("two-link-planar.urdf", &["shoulder", "elbow"])
    }

    pub fn gravity(&self) -> [f64; 3] {
        self.robot.gravity_m_s2.unwrap_or([0.0, 0.0, -9.81])
    }

    /// Inertial parameters of the moving bodies.
    pub fn bodies(&self) -> Vec<[f64; 10]> {
        self.tree.body_parameters(&mut Numbers, &self.tree.link_parameters(&self.robot))
    }

    /// Torques by `augsim_robot`, with those that accelerate the rotors.
    pub fn torques(&self, [position, speed, acceleration]: &Motion) -> Vec<f64> {
        let (tree, bodies) = (&self.tree, self.bodies());
        let rigid =
            inverse_dynamics(&mut Numbers, tree, &bodies, self.gravity(), position, speed, acceleration);
        let rotors = tree.armature(&self.robot).into_iter().zip(acceleration).map(|(inertia, a)| inertia * a);
        rigid.into_iter().zip(rotors).map(|(torque, rotor)| torque + rotor).collect()
    }

    /// Accelerations by `augsim_robot`.
    pub fn accelerations(&self, [position, speed, torque]: &Motion) -> Vec<f64> {
        let (tree, bodies, armature) = (&self.tree, self.bodies(), self.tree.armature(&self.robot));
        forward_dynamics(&mut Numbers, tree, &bodies, self.gravity(), &armature, position, speed, torque)
    }

    /// A motion number `k` without symmetries.
    pub fn motion(&self, k: usize) -> Motion {
        let value = |part: usize, joint: usize| {
            [0.9, 1.4, 3.0][part] * ((1.7 * k as f64) + 2.3 * joint as f64 + 0.8 * part as f64).sin()
        };
        std::array::from_fn(|part| (0..self.joints.len()).map(|joint| value(part, joint)).collect())
    }

    /// The section `[robot]`, with a list of `last` for each joint.
    fn section(&self, last: &str, values: &[String]) -> String {
        let list = |of: &dyn Fn(usize) -> String| {
            let quoted = (0..self.joints.len()).map(|i| format!("{:?}", of(i)));
            quoted.collect::<Vec<_>>().join(", ")
        };
        let [joints, q, w, values] = [
            list(&|i| self.joints[i].to_owned()),
            list(&|i| format!("q{i}")),
            list(&|i| format!("w{i}")),
            list(&|i| values[i].clone()),
        ];
        format!(
            "scenario = \"system\"\n[robot]\nfile = \"{}\"\njoints = [{joints}]\nposition = [{q}]\nspeed = [{w}]\n{last} = [{values}]\n",
            self.file
        )
    }

    /// A model whose outputs are the torques, with `passive` added to them, and further sections.
    pub fn inverse(&self, passive: &[&str], more: &str) -> Model {
        let accelerations: Vec<String> = (0..self.joints.len()).map(|i| format!("a{i}")).collect();
        let mut text = self.section("acceleration", &accelerations);
        text.push_str("[inputs]\n");
        for letter in ["q", "w", "a"] {
            let lines = (0..self.joints.len()).map(|i| format!("{letter}{i} = {{}}\n"));
            text.push_str(&lines.collect::<String>());
        }
        text.push_str("[outputs]\n");
        for (i, joint) in self.joints.iter().enumerate() {
            let added = passive.get(i).copied().unwrap_or_default();
            let _ = writeln!(text, "tau{i} = \"inverse_dynamics({joint}){added}\"");
        }
        parsed(&(text + more))
    }

    /// A model whose states are the motion under torques that are inputs, with `passive` added to them, and further sections.
    pub fn forward(&self, passive: &[&str], more: &str) -> Model {
        let torque = |i: usize| format!("tau{i}{}", passive.get(i).copied().unwrap_or_default());
        let torques: Vec<String> = (0..self.joints.len()).map(torque).collect();
        let mut text = self.section("torque", &torques);
        let mut table = |name: &str, line: &dyn Fn(usize, &str) -> String| {
            let lines = self.joints.iter().enumerate().map(|(i, joint)| line(i, joint));
            let _ = write!(text, "[{name}]\n{}", lines.collect::<String>());
        };
        table("inputs", &|i, _| format!("tau{i} = {{ hold = \"zero\" }}\n"));
        table("states", &|i, _| format!("q{i} = {{}}\nw{i} = {{}}\n"));
        table("rates", &|i, joint| format!("q{i} = \"w{i}\"\nw{i} = \"forward_dynamics({joint})\"\n"));
        table("outputs", &|i, _| format!("y{i} = \"q{i}\"\n"));
        parsed(&(text + more))
    }
}

/// Robots of both formats: chains and branches, prismatic, coupled and continuous joints, joints without a body of their own.
fn arms() -> Vec<Arm> {
    vec![
        Arm::two_links(),
        Arm::new("six-axis-arm.urdf", &["axis1", "axis2", "axis3", "axis4", "axis5", "axis6"]),
        Arm::new("gripper.urdf", &["wrist", "left_slide"]),
        Arm::new("slide-arm.xml", &["rail", "elbow", "wrist"]),
        Arm::new("two-hinges.xml", &["roll", "pitch", "extend", "spin"]),
    ]
}

/// Outputs of a model in a motion.
pub fn outputs(model: &Model, motion: &Motion) -> Vec<f64> {
    let parameters = model.nominals();
    let point = Point { state: &[], inputs: &motion.concat(), parameters: &parameters, time: 0.0 };
    compiled(model).outputs_at([point])
}

/// Rates of the speeds of a model whose inputs are the torques.
pub fn rates(model: &Model, [position, speed, torque]: &Motion) -> Vec<f64> {
    let state: Vec<f64> = position.iter().zip(speed).flat_map(|(q, w)| [*q, *w]).collect();
    let parameters = model.nominals();
    let point = Point { state: &state, inputs: torque, parameters: &parameters, time: 0.0 };
    let rates = compiled(model).linearise(&point).rates;
    (0..position.len()).map(|i| rates[2 * i + 1]).collect()
}

/// Asserts that values agree within `tolerance` times the largest of them.
pub fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    let size = expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    assert_eq!(found.len(), expected.len(), "{what}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance * size, "{what}: {found:?} instead of {expected:?}");
    }
}

#[test]
fn the_torques_of_a_model_are_those_of_the_inverse_dynamics() {
    for arm in arms() {
        let model = arm.inverse(&[], "");
        for motion in (0..4).map(|k| arm.motion(k)) {
            assert_close(&outputs(&model, &motion), &arm.torques(&motion), 1e-12, arm.file);
        }
    }
}

#[test]
fn the_rates_of_a_model_are_those_of_the_forward_dynamics() {
    for arm in arms() {
        let model = arm.forward(&[], "");
        for motion in (0..4).map(|k| arm.motion(k)) {
            assert_close(&rates(&model, &motion), &arm.accelerations(&motion), 1e-10, arm.file);
        }
    }
}

const OPTIONS: Options = Options { method: Method::UncheckedRungeKutta, substeps: 2 };
const INTERVAL_S: f64 = 0.01;
const SAMPLES: usize = 60;

/// A record with a sine for each input of a model.
fn record(model: &Model) -> Record {
    let times: Vec<f64> = (0..SAMPLES).map(|k| INTERVAL_S * k as f64).collect();
    let signal = |(k, input): (usize, &model::Input)| {
        let values: Vec<f64> =
            times.iter().map(|t| 1.5 * ((4.0 + k as f64) * t + 0.7 * k as f64).sin()).collect();
        Signal::new(&times, &values, input.hold.unwrap_or(Hold::Linear))
    };
    let inputs = model.inputs.iter().enumerate().map(signal).collect();
    Record::new("sines", times.clone(), inputs).expect("rising times")
}

/// Simulates all samples; returns the outputs and their derivatives with respect to the seeds.
fn simulate(
    system: &System,
    record: &Record,
    start: &[f64],
    parameters: &[f64],
    seeds: &[Seed],
) -> (Vec<f64>, Vec<f64>) {
    let window = Window { record, first: 0, last: SAMPLES - 1, start, parameters };
    let simulated = system.simulate(&[window], seeds, &OPTIONS).remove(0).unwrap_or_else(|e| panic!("{e}"));
    (simulated.values, simulated.slopes)
}

#[test]
fn a_simulated_model_without_states_gives_the_torques_at_every_sample() {
    let arm = Arm::two_links();
    let model = arm.inverse(&[], "");
    let record = record(&model);
    let (values, _) = simulate(&compiled(&model), &record, &[], &[], &[]);
    for k in [0, 1, 17, SAMPLES - 1] {
        let inputs: Vec<f64> =
            record.inputs().iter().map(|signal| signal.at(INTERVAL_S * k as f64)).collect();
        let motion: Motion = std::array::from_fn(|part| inputs[2 * part..2 * part + 2].to_vec());
        assert_close(&values[2 * k..2 * k + 2], &arm.torques(&motion), 1e-12, "torques");
    }
}

/// One step of the classical Runge-Kutta method; the state is position and speed of every joint.
fn runge_kutta(arm: &Arm, state: &[Vec<f64>; 2], torque: &[f64], step: f64) -> [Vec<f64>; 2] {
    let rate = |state: &[Vec<f64>; 2]| {
        let motion = [state[0].clone(), state[1].clone(), torque.to_vec()];
        [state[1].clone(), arm.accelerations(&motion)]
    };
    let moved = |rate: &[Vec<f64>; 2], step: f64| -> [Vec<f64>; 2] {
        std::array::from_fn(|part| state[part].iter().zip(&rate[part]).map(|(x, r)| x + step * r).collect())
    };
    let first = rate(state);
    let second = rate(&moved(&first, 0.5 * step));
    let third = rate(&moved(&second, 0.5 * step));
    let fourth = rate(&moved(&third, step));
    let mean = std::array::from_fn(|part| {
        let at =
            |i: usize| (first[part][i] + 2.0 * (second[part][i] + third[part][i]) + fourth[part][i]) / 6.0;
        (0..torque.len()).map(at).collect()
    });
    moved(&mean, step)
}

#[test]
fn a_simulated_motion_is_that_of_the_forward_dynamics() {
    let arm = Arm::new("slide-arm.xml", &["rail", "elbow", "wrist"]);
    let model = arm.forward(&[], "");
    let record = record(&model);
    let start = [0.1, 0.2, 0.3, -0.4, -0.2, 0.5];
    let (values, _) = simulate(&compiled(&model), &record, &start, &[], &[]);
    let mut state = [vec![0.1, 0.3, -0.2], vec![0.2, -0.4, 0.5]];
    for k in 0..SAMPLES - 1 {
        let torque: Vec<f64> = record.inputs().iter().map(|s| s.at(INTERVAL_S * k as f64)).collect();
        for _ in 0..OPTIONS.substeps {
            state = runge_kutta(&arm, &state, &torque, INTERVAL_S / OPTIONS.substeps as f64);
        }
    }
    assert_close(&values[3 * (SAMPLES - 1)..], &state[0], 1e-10, "positions at the end");
}

/// Asserts that the derivatives with respect to all parameters and initial states agree with central differences.
fn check_derivatives(model: &Model, start: &[f64]) {
    let (system, record, parameters) = (compiled(model), record(model), model.nominals());
    let of_parameters = (0..parameters.len()).map(Seed::Parameter);
    let seeds: Vec<Seed> = of_parameters.chain((0..start.len()).map(Seed::Start)).collect();
    let (_, slopes) = simulate(&system, &record, start, &parameters, &seeds);
    for (lane, seed) in seeds.iter().enumerate() {
        let moved = |by: f64| {
            let (mut parameters, mut start) = (parameters.clone(), start.to_vec());
            match seed {
                Seed::Parameter(index) => parameters[*index] += by,
                Seed::Start(state) => start[*state] += by,
            }
            simulate(&system, &record, &start, &parameters, &[]).0
        };
        // Two central differences combined have an error of order h^4. The step is small, so that it seldom passes a bend of
        // abs(load) or abs(speed).
        let h = 2e-5;
        let [up, down, near_up, near_down] = [h, -h, 0.5 * h, -0.5 * h].map(moved);
        let difference = |i: usize| {
            let (wide, near) = ((up[i] - down[i]) / (2.0 * h), (near_up[i] - near_down[i]) / h);
            (4.0 * near - wide) / 3.0
        };
        let slope = |i: usize| slopes[i * seeds.len() + lane];
        let name = match seed {
            Seed::Parameter(index) => model.parameters[*index].name.clone(),
            Seed::Start(state) => format!("start of {}", model.states[*state].name),
        };
        let size = (0..up.len()).map(|i| slope(i).abs()).fold(0.0, f64::max);
        assert!(size > 1e-6, "{name} has no effect");
        for i in 0..up.len() {
            let error = (slope(i) - difference(i)).abs();
            assert!(error < 1e-6 * size, "{name}, value {i}: {} instead of {}", slope(i), difference(i));
        }
    }
}

/// Three joints of an arm whose motion is not plane, so that every parameter of the last link matters.
fn wrist() -> Arm {
    Arm::new("six-axis-arm.urdf", &["axis2", "axis3", "axis4"])
}

/// Parameters of every kind that a robot has, each on a link or joint where it moves the torques, and effects of every kind of
/// place.
const FREE: &str = r#"
[parameters]
upper_arm_moment_x_kg_m = { nominal = 0.5 }
upper_arm_origin_inertia_zz_kg_m2 = { nominal = 0.4, unit = "kg m^2" }
elbow_com_x_m = { nominal = 0.05 }
forearm_mass_kg = { nominal = 2.9, min = 0.0 }
forearm_com_y_m = { nominal = 0.01 }
forearm_com_z_m = { nominal = 0.12 }
forearm_inertia_zz_kg_m2 = { nominal = 0.014 }
forearm_inertia_xy_kg_m2 = { nominal = 0.002 }
wrist_mass_kg = { nominal = 0.8 }
gravity_x_m_s2 = { nominal = 0.3 }
axis2_armature_kg_m2 = { nominal = 0.3 }
axis4_armature_kg_m2 = { nominal = 0.2 }
axis2_viscous = { nominal = 0.35 }
axis3_viscous = { nominal = 0.12 }
[[effect]]
kind = "coulomb"
on = "all joints"
f_axis2 = 0.4
f_axis3 = 0.3
f_axis4 = 0.2
w_axis2 = 0.4
w_axis3 = 0.5
w_axis4 = 0.6
[[effect]]
kind = "load-friction"
on = "axis3"
c = 0.1
w = 0.5
[[effect]]
kind = "coupled-coulomb"
on = "axis3"
with = "axis4"
f = 0.4
r = 1.5
w = 0.6
[[effect]]
kind = "payload"
on = "forearm"
m = 0.3
p_x = 0.06
p_y = 0.015
p_z = 0.03
[[effect]]
kind = "rotor-inertia"
on = "axis3"
J = 0.05
[[effect]]
kind = "tilt"
on = "gravity"
a = 0.2
b = 0.3
c = 0.1
[[effect]]
kind = "presliding"
on = "axis4"
k = 2.0
d = 0.2
"#;

#[test]
fn derivatives_of_the_torques_agree_with_differences() {
    let passive = [" + axis2_viscous * w0", " + axis3_viscous * w1"];
    check_derivatives(&wrist().inverse(&passive, FREE), &[0.05]);
}

#[test]
fn derivatives_of_the_motion_agree_with_differences() {
    let passive = [" - axis2_viscous * w0", " - axis3_viscous * w1"];
    check_derivatives(&wrist().forward(&passive, FREE), &[0.4, -0.3, 0.2, 0.5, 0.1, -0.2, 0.05]);
}

#[test]
fn a_description_is_found_beside_the_model_file_that_names_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("models")).expect("a folder");
    std::fs::copy(fixtures().join("two-link-planar.urdf"), folder.path().join("arm.urdf")).expect("a copy");
    let model = Arm::two_links().inverse(&[], "");
    let text = model.text.replace("two-link-planar.urdf", "../arm.urdf");
    let file = folder.path().join("models/arm.toml");
    std::fs::write(&file, text).expect("written");
    let beside = model::read(&file).unwrap_or_else(|e| panic!("{e}"));
    let motion = Arm::two_links().motion(0);
    assert_eq!(outputs(&beside, &motion), outputs(&model, &motion));
}

#[test]
fn a_model_that_is_written_back_reads_the_same() {
    let passive = [" + axis2_viscous * w0", " + axis3_viscous * w1"];
    let model = wrist().inverse(&passive, FREE);
    let text = model.to_toml().expect("a text");
    let again = parsed(&text);
    assert_eq!(again.nominals(), model.nominals());
    assert_eq!(again.to_toml().expect("a text"), text, "written twice");
    let system = |model: &Model| simulate(&compiled(model), &record(model), &[0.0], &model.nominals(), &[]).0;
    assert_eq!(system(&again), system(&model));
}
