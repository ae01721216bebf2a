//! Contract: exported programs in C and Python, step functions and FMUs give the trajectory that the engine simulates
//! from an input series, for every effect of the library and of the formulas, with delays, events, state bounds,
//! tables and smoothed discontinuities.

/// Step functions and FMUs, which do not choose their steps from a recording.
mod steps;

use crate::programs::printed;
use augsim_equations::library::Scales;
use augsim_equations::{EquationSystem, Model, model};
use augsim_session::Subject;
use augsim_session::export::{Language, export, export_files};
use augsim_session::simulate::{Plan, simulate};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Number of effects that are added to a model at once, so that the test compiles few programs.
const EFFECTS_PER_PROGRAM: usize = 8;

/// Options of the C compiler, with warnings as errors.
const STRICT: &[&str] = &["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"];

/// A driven oscillator with every kind of hold, a delay, a table, dry friction of undeclared width, an event with a
/// reset and a rest, a state bound, and names that Python or C use themselves.
const MODEL: &str = r#"
scenario = "system"
name = "every */ part \"\"\" @RATES@ \\write18{id}"
[inputs]
double = { hold = "zero", delay_s = 0.013 }
lambda = { hold = "linear" }
NULL = { hold = "spline" }
[states]
main = { start = "y0", min = -0.9 }
d_main = { start = "slope(y0)" }
o_y0 = { start = "y1", max = 0.7 }
[parameters]
rate = 1.1
rate_ = 30.0
M_PI = 0.8
errno = 0.3
x_main = 0.6
import = 0.05
[tables.KNOTS_0]
at = [-1.0, 0.0, 0.4, 1.0]
values = [-2.0, 0.0, 0.3, 3.0]
[let]
v1 = "double + 0.5 * lambda * NULL"
range = "table(KNOTS_0, main) + errno * sign(d_main)"
[rates]
main = "d_main"
d_main = "(v1 - rate_ * main - M_PI * d_main - range) / rate + if(main > import, 0.2, -0.1)"
o_y0 = "(main - o_y0) / x_main + hypot(lambda, 0.1) * 0.2"
[outputs]
y0 = { value = "main", sd = 0.001 }
y1 = { value = "o_y0 + 0.1 * clamp(d_main, -1, 1)", sd = 0.001 }
[[events]]
name = "stop */"
when = "main - 0.25"
direction = "rising"
set = { d_main = "-x_main * d_main" }
rest = { below = 0.01, hold = ["main"], until = "v1 < 0" }
"#;

/// A thermal system with one flow state, to which other effects apply than to forces.
const FLOW: &str = r#"
scenario = "system"
name = "flow"
[inputs]
heater_W = { hold = "zero" }
[states]
a_K = { start = "a_K_read" }
b_K = { start = "0.2" }
[parameters]
capacity_J_per_K = 2.0
loss_W_per_K = 0.7
[rates]
a_K = "(heater_W - loss_W_per_K * (a_K - b_K)) / capacity_J_per_K"
b_K = "0.3 * (a_K - b_K)"
[outputs]
a_K_read = { value = "a_K", sd = 0.001 }
"#;

/// A robot with two joints, driven by torques.
const ROBOT: &str = r#"
scenario = "system"
name = "arm"
[robot]
file = "two-link-planar.urdf"
joints = ["shoulder", "elbow"]
position = ["q1_rad", "q2_rad"]
speed = ["w1_rad_s", "w2_rad_s"]
torque = ["tau1_N_m", "tau2_N_m - viscous * w2_rad_s"]
[inputs]
tau1_N_m = { hold = "zero" }
tau2_N_m = { hold = "linear" }
[states]
q1_rad = { start = "angle1_rad" }
w1_rad_s = { start = "0" }
q2_rad = { start = "angle2_rad" }
w2_rad_s = { start = "0" }
[parameters]
viscous = { nominal = 0.3, min = 0.0, unit = "N m s" }
[rates]
q1_rad = "w1_rad_s"
w1_rad_s = "forward_dynamics(shoulder)"
q2_rad = "w2_rad_s"
w2_rad_s = "forward_dynamics(elbow)"
[outputs]
angle1_rad = { value = "q1_rad", sd = 0.001 }
angle2_rad = { value = "q2_rad", sd = 0.001 }
"#;

/// Creates an empty folder for the programs of one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("exported-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Reads the numbers of a CSV text after its header and first column.
fn values(csv: &str) -> Vec<f64> {
    let rows = csv.lines().skip(1).flat_map(|line| line.split(',').skip(1));
    rows.map(|field| field.parse().unwrap_or(f64::NAN)).collect()
}

fn series(model: &Model) -> (Vec<f64>, Vec<(String, Vec<f64>)>) {
    let times: Vec<f64> = (0..120).map(|k| 0.02 * f64::from(k) + 0.003 * f64::from(k % 3)).collect();
    let wave = |index: usize| -> Vec<f64> {
        let rate = 2.0 + 1.3 * index as f64;
        times.iter().map(|t| 4.0 * (rate * t + 0.4).sin() + 0.3 * index as f64).collect()
    };
    let inputs = model.inputs.iter().enumerate().map(|(i, input)| (input.name.clone(), wave(i))).collect();
    (times, inputs)
}

/// Writes the times and inputs of a plan as `in.csv`.
fn write_inputs(plan: &Plan, dir: &Path) {
    let mut csv = "t_s".to_owned();
    plan.inputs.iter().for_each(|(name, _)| csv += &format!(",{name}"));
    for (k, t) in plan.times.iter().enumerate() {
        csv += &format!("\n{t}");
        plan.inputs.iter().for_each(|(_, values)| csv += &format!(",{}", values[k]));
    }
    std::fs::write(dir.join("in.csv"), csv + "\n").expect("written");
}

/// Compares the programs of a model with the engine, over a series of inputs, from an initial state.
///
/// Returns false if the engine cannot simulate the model.
fn follows_the_engine(model: &Model, what: &str, dir: &Path) -> bool {
    let (times, inputs) = series(model);
    let declared = model.declared_states();
    let start: Vec<(String, f64)> = model.states[..declared]
        .iter()
        .enumerate()
        .map(|(i, s)| (s.name.clone(), 0.1 - 0.07 * i as f64))
        .collect();
    let subject = Subject::Equations(Box::new(model.clone()));
    let plan = Plan {
        start: start.iter().map(|(name, value)| (name.clone(), vec![*value])).collect(),
        times: times.clone(),
        inputs: inputs.clone(),
        ..Plan::default()
    };
    let Ok(engine) = simulate(&subject, &plan) else { return false };
    if !engine.values.iter().all(|v| v.abs() < 1e6) {
        return false;
    }
    write_inputs(&plan, dir);
    let given: Vec<String> = start.iter().map(|(name, value)| format!("{name}={value}")).collect();
    let args: Vec<&str> = std::iter::once("in.csv").chain(given.iter().map(String::as_str)).collect();
    for (language, file) in [(Language::Python, "law.py"), (Language::C, "law.c")] {
        steps::write(&export_files(&subject, language, &dir.join(file)).expect("a program"));
    }
    let python = printed("python3", &[&["law.py"], &args[..]].concat(), dir);
    let build = [STRICT, &["-DLAW_MAIN", "-O0", "law.c", "-o", "law", "-lm"]].concat();
    let c = printed("cc", &build, dir).and_then(|_| printed("./law", &args, dir));
    for (language, found) in [("Python", python), ("C", c)] {
        let Some(found) = found.map(|csv| values(&csv)) else { continue };
        assert_eq!(found.len(), engine.values.len(), "{language}: {what}");
        for (k, (a, b)) in found.iter().zip(&engine.values).enumerate() {
            let error = (a - b).abs();
            assert!(
                error <= 1e-9 * (1.0 + b.abs()),
                "{language}, {what}: value {k} is {a}, of the engine {b}"
            );
        }
    }
    steps::python_takes_arrays(what, dir);
    steps::follow_the_engine(model, &plan, what, dir);
    true
}

#[test]
fn every_part_of_a_model_is_exported() {
    let dir = folder("parts");
    for (name, text) in [("parts", MODEL), ("flow", FLOW)].into_iter().chain(augsim_equations::EXAMPLES) {
        let model = model::parse(text, "model.toml").expect("a model");
        assert!(follows_the_engine(&model, name, &dir), "the engine does not simulate {name}");
        // Optimised code gives more warnings.
        for option in ["-DLAW_MAIN", "-ULAW_MAIN"] {
            printed("cc", &[STRICT, &["-O2", option, "-c", "law.c", "-o", "law.o"]].concat(), &dir);
        }
    }
    for (method, steps) in [("implicit", 3), ("explicit", 5)] {
        let text = format!(
            "{MODEL}[numerics]\nintegrator = \"{method}\"\nsubsteps = {steps}\nsign_width = {{ d_main = 0.02 }}\n"
        );
        let model = model::parse(&text, "model.toml").expect("a model");
        assert!(follows_the_engine(&model, method, &dir), "the engine does not simulate {method}");
    }
}

/// Replaces every quantity of the model in an expression by `z`.
fn shape_of(text: &str, model: &Model) -> String {
    let states = model.states.iter().map(|s| &s.name);
    let known: Vec<&String> = states
        .chain(model.inputs.iter().map(|i| &i.name))
        .chain(model.lets.iter().map(|l| &l.name))
        .chain(model.outputs.iter().map(|o| &o.name))
        .collect();
    let mut shape = String::new();
    for word in text.split_inclusive(|c: char| !(c.is_alphanumeric() || c == '_')) {
        let name = word.trim_end_matches(|c: char| !(c.is_alphanumeric() || c == '_'));
        shape += if known.iter().any(|k| *k == name) { "z" } else { name };
        shape += &word[name.len()..];
    }
    shape
}

#[test]
fn every_effect_is_exported() {
    let mut done: BTreeSet<String> = BTreeSet::new();
    let mut wanted: BTreeSet<String> = BTreeSet::new();
    let smooth = MODEL.split("[[events]]").next().expect("a model");
    let mut programs: Vec<(String, Model)> = Vec::new();
    for (text, of) in [(smooth, ""), (FLOW, ""), (MODEL, ""), (ROBOT, " of a robot")] {
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/robots/model.toml");
        let declared = model::parse(text, &place.display().to_string()).expect("a model");
        let system = EquationSystem::new(&declared, &Scales::default()).expect("a system");
        let (mut model, mut names) = (declared.clone(), Vec::new());
        for candidate in (0..).map_while(|index| system.candidate(index)) {
            // A formula is known by its expression, whatever the quantities, any other effect by its kind.
            let name = match &candidate.shape {
                Some(_) => shape_of(candidate.text().unwrap_or_default(), &declared),
                None => candidate.kind.clone() + of,
            };
            wanted.insert(name.clone());
            if done.contains(&name) {
                continue;
            }
            // A coefficient so small that several effects together stay finite, with the sign that mostly damps.
            let near_null = |null: f64, min: f64| if min < null { null - 0.005 } else { null + 0.005 };
            let numbers: Vec<f64> = (candidate.parameters.iter())
                .map(|p| p.grid.first().copied().unwrap_or(near_null(p.null, p.min)).clamp(p.min, p.max))
                .collect();
            let mut next = model.clone();
            if next.add(&candidate.draft(&numbers)).is_err() {
                continue;
            }
            model = next;
            names.push(name.clone());
            done.insert(name);
            if names.len() == EFFECTS_PER_PROGRAM {
                programs.push((names.join(", "), std::mem::replace(&mut model, declared.clone())));
                names.clear();
            }
        }
        programs.push((names.join(", "), model));
    }
    programs.into_par_iter().enumerate().for_each(|(number, (what, model))| {
        let dir = folder(&format!("effects-{number}"));
        assert!(follows_the_engine(&model, &what, &dir), "the engine does not simulate {what}");
    });
    assert!(wanted.is_subset(&done), "not exported: {:?}", wanted.difference(&done).collect::<Vec<_>>());
    assert!(done.len() > 40, "{done:?}");
}

#[test]
fn names_do_not_become_commands_of_a_document() {
    let subject = Subject::parse(MODEL, "model.toml").expect("a model");
    let text = export(&subject, Language::Latex).expect("a document");
    assert!(text.contains("\\textbackslash{}write18\\{id\\}") && !text.contains("\\write18"), "{text}");
}

#[test]
fn values_by_group_are_exported_for_each_group() {
    let dir = folder("groups");
    let model = |restitution: &str| {
        let text =
            format!("scenario = \"ball\"\n[parameters]\ngravity_m_s2 = 9.81\nrestitution = {restitution}\n");
        Subject::parse(&text, "model.toml").expect("a model")
    };
    let grouped =
        "{ nominal = 0.8, min = 0.0, max = 1.0, per = \"group\", groups = { \"a \\\" b\" = 0.7, c = 0.9 } }";
    let motion = ["0", "0", "1", "0", "0", "0", "0", "0", "0", "0.3", "0.8", "1.2"];
    for (language, file, build) in [(Language::Python, "law.py", false), (Language::C, "law.c", true)] {
        let print = |subject: &Subject, group: &[&str]| -> Option<String> {
            std::fs::write(dir.join(file), export(subject, language).expect("a program")).expect("written");
            let words = [group, &motion[..]].concat();
            if !build {
                return printed("python3", &[&["law.py"], &words[..]].concat(), &dir);
            }
            printed("cc", &["-Wall", "-Wextra", "-Werror", "law.c", "-o", "law", "-lm"], &dir)?;
            printed("./law", &words, &dir)
        };
        for (group, value) in [("a \" b", "0.7"), ("c", "0.9")] {
            assert_eq!(
                print(&model(grouped), &["--group", group]),
                print(&model(value), &[]),
                "{file} {group}"
            );
        }
        // Without a group nothing is computed.
        let (program, words) = if build { ("./law", vec![]) } else { ("python3", vec!["law.py"]) };
        print(&model(grouped), &["--group", "c"]);
        if let Ok(out) = Command::new(program).args(words).args(motion).current_dir(&dir).output() {
            assert!(
                !out.status.success() && String::from_utf8_lossy(&out.stderr).contains("--group"),
                "{file}"
            );
        }
    }
}
