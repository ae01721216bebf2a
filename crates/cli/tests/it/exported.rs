//! Contract: programs that `export` writes in Python and C run without augsim and follow the simulation
//! of the engine: balls, pushes, and equations with tables, smoothed jumps, events, rest conditions and
//! state bounds. Models that cannot be exported give an error with an alternative.

use crate::command::{fail, run, succeed, succeed_json};
use crate::programs::printed;
use augsim_session::Subject;
use augsim_session::simulate::{Plan, simulate};
use std::path::Path;
use std::process::Command;

const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
    restitution = { nominal = 0.7, min = 0.0, max = 1.0 }\n[sensor]\nposition_sd_m = 0.002\n";

/// Returns the numbers that a program prints, or `None` if its interpreter or compiler is missing.
fn answers(program: &str, args: &[String], dir: &Path) -> Option<Vec<f64>> {
    let text = printed(program, args, dir)?;
    Some(text.split_whitespace().map(|n| n.parse().expect("a number")).collect())
}

/// Returns the outputs of the exported Python and C programs, which must be equal.
fn exported(model: &str, numbers: &[f64], dir: &Path) -> Vec<Vec<f64>> {
    let args: Vec<String> = numbers.iter().map(f64::to_string).collect();
    succeed(&["export", model, "--as", "python", "--out", "law.py"], dir);
    succeed(&["export", model, "--as", "c", "--out", "law.c"], dir);
    let python = answers("python3", &[&["law.py".to_owned()], &args[..]].concat(), dir);
    let built =
        ["-std=c99", "-Wall", "-Werror", "-O1", "-DLAW_MAIN", "law.c", "-o", "law", "-lm"].map(str::to_owned);
    let c = answers("cc", &built, dir).and_then(|_| answers("./law", &args, dir));
    python.into_iter().chain(c).collect()
}

#[test]
fn exported_ball_follows_the_engine() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let effects = "[[effect]]\nkind = \"quadratic-drag\"\nk_per_m = 0.1\n[[effect]]\nkind = \"magnus\"\ns = 0.01\n\
        [[effect]]\nkind = \"restitution-speed-linear\"\nb_s_per_m = 0.02\n\
        [[effect]]\nkind = \"grip-friction\"\nkappa = 0.1\n[[effect]]\nkind = \"height-offset\"\nb_m = 0.2\n";
    let model = MODEL.replace("[sensor]", "radius_m = 0.02\ninertia_ratio = 0.4\n[sensor]") + effects;
    std::fs::write(d.join("model.toml"), &model).expect("written");
    // The engine predicts the same path: data from it without noise, from the same initial state.
    let start = [0.0, 0.0, 1.0, 1.5, 0.0, 0.5, 0.0, 30.0, 0.0];
    let times: Vec<f64> = (0..60).map(|k| 0.02 * f64::from(k)).collect();
    let answers = exported("model.toml", &[&start[..], &times].concat(), d);
    for found in &answers {
        assert_eq!(found.len(), 3 * times.len());
        let far = found.iter().zip(&answers[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far < 1e-7, "Python and C differ by {far} m");
        // The engine estimates its initial state from the output of the program, and then matches the
        // rest.
        let mut text = "trajectory,t_s,x_m,z_m,spin_rad_s\n".to_owned();
        for shift in 0..2 {
            for (t, p) in times.iter().zip(found.chunks(3)) {
                text += &format!("{shift},{t},{},{},30\n", p[0], p[2]);
            }
        }
        std::fs::write(d.join("law.csv"), text).expect("written");
        let scored = succeed_json(&["evaluate", "model.toml", "--data", "law.csv"], d);
        let error = scored["rows"][0]["rmse"].as_f64().expect("an error");
        assert!(error < 2e-4, "the program and the engine differ by {error} m");
    }
    let latex = succeed(&["export", "model.toml", "--as", "latex"], d);
    assert!(
        latex.contains("quadratic-drag") && latex.contains("= 0.1$") && latex.contains("\\end{document}"),
        "{latex}"
    );
    let table = model + "[[effect]]\nkind = \"contact-duration\"\ntau_s = 0.01\n";
    std::fs::write(d.join("contact.toml"), table).expect("written");
    fail(2, &["export", "contact.toml", "--as", "c"], d, &["contact-duration", "--as latex"]);
}

#[test]
fn exported_equations_follow_the_engine() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["model", "new", "pendulum", "--out", "pendulum.toml"], d);
    let model = std::fs::read_to_string(d.join("pendulum.toml")).expect("a model");
    let out = succeed(
        &["simulate", "pendulum.toml", "--duration-s", "1", "--rate-hz", "100", "--out", "run.csv", "-q"],
        d,
    );
    let run = std::fs::read_to_string(d.join("run.csv")).expect("a run");
    let header: Vec<&str> = run.lines().next().unwrap_or_default().split(',').collect();
    let rows: Vec<Vec<f64>> = (run.lines().skip(1))
        .map(|l| l.split(',').skip(1).map(|v| v.parse().unwrap_or(f64::NAN)).collect())
        .collect();
    let inputs = model.contains("[inputs]");
    assert!(!inputs, "this test gives no inputs: {out} {header:?}");
    // A pendulum that starts at 0.5 rad, as `simulate` reports.
    let times: Vec<f64> = rows.iter().map(|r| r[0]).collect();
    for found in exported("pendulum.toml", &[&[0.5, 0.0][..], &times].concat(), d) {
        assert_eq!(found.len(), rows.len());
        let far = found.iter().zip(&rows).map(|(a, r)| (a - r[1]).abs()).fold(0.0, f64::max);
        // The engine steps from sample to sample, 50 times the step of the program.
        assert!(far < 1e-5, "the program and the engine differ by {far}");
    }
    assert!(succeed(&["export", "pendulum.toml", "--as", "latex"], d).contains("\\tfrac{d}{dt}"));
}

/// Returns the largest difference between the exported programs and the engine's simulation over `length_s` seconds.
fn deviation_from_the_engine(
    text: &str,
    start: &[(&str, f64)],
    inputs: &[(&str, f64)],
    length_s: f64,
    dir: &Path,
) -> f64 {
    std::fs::write(dir.join("model.toml"), text).expect("written");
    let times: Vec<f64> = (0..).map(|k| 0.005 * f64::from(k)).take_while(|t| *t <= length_s).collect();
    let plan = Plan {
        start: start.iter().map(|(name, value)| ((*name).to_owned(), vec![*value])).collect(),
        times: times.clone(),
        inputs: inputs.iter().map(|(name, value)| ((*name).to_owned(), vec![*value; times.len()])).collect(),
        samples: 0,
        seed: 0,
    };
    let engine =
        simulate(&Subject::parse(text, "model.toml").expect("a model"), &plan).expect("a simulation");
    let given = start.iter().chain(inputs).map(|(_, value)| *value);
    let numbers: Vec<f64> = given.chain(times).collect();
    let all = exported("model.toml", &numbers, dir);
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let each = all.iter().map(|found| {
        assert_eq!(found.len(), engine.values.len());
        assert!(found.iter().all(|v| v.is_finite()), "{found:?}");
        assert!(distance(found, &all[0]) < 1e-7, "Python and C differ by {}", distance(found, &all[0]));
        distance(found, &engine.values)
    });
    each.fold(0.0, f64::max)
}

/// Model file of a hopping mass in a tube, with all constructs that an export must translate.
///
/// It has tabulated drag, dry friction with a declared width, a floor with a rest condition, a filter with state
/// bounds, a sensor gain, and a discovered effect in a rate.
const HOPPER: &str = r#"
scenario = "system"
name = "hopper"
[inputs]
lift_N = { hold = "zero", delay_s = 0.0 }
[states]
height_m = { start = "z_m" }
speed_m_s = { start = "slope(z_m)" }
filtered_m = { start = "z_m", min = 0.05, max = 0.32 }
[parameters]
mass_kg = 0.5
gravity_m_s2 = 9.81
restitution = 0.6
friction_N = 0.2
ramp_N_per_s = 3.0
lag_s = 0.1
knee_m_s = 0.1
[tables.drag]
at = [0.0, 1.0, 3.0]
values = [0.0, 0.1, 0.6]
unit = "N"
[let]
drag_N = "table(drag, abs(speed_m_s)) * tanh(speed_m_s / knee_m_s) + friction_N * sign(speed_m_s)"
push_N = "lift_N + ramp_N_per_s * t"
[rates]
height_m = "speed_m_s"
speed_m_s = "(push_N - drag_N) / mass_kg - gravity_m_s2"
filtered_m = "(height_m - filtered_m) / lag_s"
[outputs]
z_m = { value = "height_m", sd = 0.001 }
f_m = { value = "filtered_m", sd = 0.001 }
[numerics]
sign_width = { speed_m_s = 0.05 }
[[events]]
name = "floor"
when = "height_m"
direction = "falling"
set = { speed_m_s = "-restitution * speed_m_s" }
rest = { below_m_s = 0.02, hold = ["height_m"], until = "push_N > mass_kg * gravity_m_s2" }
[[effect]]
kind = "formula"
on = "z_m"
factor = "g"
g = 1.02
[[effect]]
kind = "formula"
on = "speed_m_s"
add = "-c * speed_m_s"
c_per_s = 0.1
"#;

#[test]
fn exported_tables_events_and_bounds_follow_the_engine() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let start = [("height_m", 0.4), ("speed_m_s", 0.0), ("filtered_m", 0.4)];
    let far = deviation_from_the_engine(HOPPER, &start, &[("lift_N", 1.0)], 2.0, dir.path());
    assert!(far < 2e-4, "the program and the engine differ by {far} m");
    let latex = succeed(&["export", "model.toml", "--as", "latex"], dir.path());
    for text in
        ["falls through 0", "^+ &=", "It rests until", "\\begin{tabular}", "State bound", "\\end{document}"]
    {
        assert!(latex.contains(text), "`{text}` is not in {latex}");
    }
}

#[test]
fn exported_examples_with_events_or_bounds_follow_the_engine() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let example = |name: &str| augsim_equations::example(name).expect("the example");
    // 4 N push the mass to 5 cm and to the stop, where it bounces and comes to rest.
    let start = [("x_m", 0.0), ("v_m_s", 0.5)];
    let far =
        deviation_from_the_engine(example("mass-spring-stop"), &start, &[("force_N", 4.5)], 2.0, dir.path());
    assert!(far < 1e-5, "the program and the engine differ by {far} m");
    let start = [("upper_V", 5.0), ("lower_V", 1.0)];
    let far = deviation_from_the_engine(example("tanks"), &start, &[("pump_V", 2.0)], 2.0, dir.path());
    assert!(far < 1e-5, "the program and the engine differ by {far} V");
}

#[test]
fn exported_push_follows_the_engine() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let plain = "scenario = \"push\"\nobject = \"tri1\"\n[parameters]\nc_m = 0.04\ncontact_friction = 0.3\nrod_radius_m = 0.005\n";
    let frame = "[[effect]]\nkind = \"frame-registration\"\nscale = 0.01\nangle_rad = 0.02\ndx_m = 0.002\ndy_m = -0.001\n\
        [[effect]]\nkind = \"pose-offset\"\ndx_m = 0.003\ndy_m = -0.002\ndtheta_rad = 0.05\n";
    // The pusher approaches the object, pushes it off centre so that it turns and slides, and follows a
    // curve.
    let places: Vec<[f64; 3]> = (0..60)
        .map(|k| {
            let t = 0.05 * f64::from(k);
            [t, -0.12 + 0.05 * t, -0.012 + if t > 1.5 { 0.03 * (t - 1.5) } else { 0.0 }]
        })
        .collect();
    for effects in ["", frame] {
        let text = format!("{plain}{effects}");
        std::fs::write(d.join("model.toml"), &text).expect("written");
        let column = |i: usize| places.iter().map(|p| p[i]).collect::<Vec<_>>();
        let named = |name: &str, values: Vec<f64>| (name.to_owned(), values);
        let plan = Plan {
            start: vec![named("x_m", vec![0.0]), named("y_m", vec![0.0]), named("theta_rad", vec![0.2])],
            times: column(0),
            inputs: vec![named("pusher_x_m", column(1)), named("pusher_y_m", column(2))],
            samples: 0,
            seed: 0,
        };
        let engine =
            simulate(&Subject::parse(&text, "model.toml").expect("a model"), &plan).expect("a simulation");
        let travel = engine.values[3 * 59].hypot(engine.values[3 * 59 + 1]);
        assert!(
            travel > 0.03 && (engine.values[3 * 59 + 2] - 0.2).abs() > 0.1,
            "nothing was pushed: {travel} m"
        );
        let numbers: Vec<f64> = [0.0, 0.0, 0.2].into_iter().chain(places.iter().flatten().copied()).collect();
        for found in exported("model.toml", &numbers, d) {
            let far = found.iter().zip(&engine.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert_eq!(found.len(), engine.values.len());
            // The engine has four times the step of the program: 2 mm of pusher travel.
            assert!(far < 1e-5, "the program and the engine differ by {far} m or rad");
        }
    }
    let latex = succeed(&["export", "model.toml", "--as", "latex"], d);
    for text in ["c = 0.04", "frame-registration", "\\end{document}"] {
        assert!(latex.contains(text), "`{text}` is not in {latex}");
    }
    std::fs::write(d.join("model.toml"), format!("{plain}[[effect]]\nkind = \"exact-surface\"\n"))
        .expect("written");
    fail(2, &["export", "model.toml", "--as", "python"], d, &["exact-surface", "--as latex"]);
}

#[test]
fn units_without_a_compiler_have_sources_only_and_say_so() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["model", "new", "servo", "--out", "servo.toml"], d);
    let mut command = Command::new(env!("CARGO_BIN_EXE_augsim"));
    command.args(["export", "servo.toml", "--as", "fmu", "--out", "arm 2.fmu"]).current_dir(d);
    let out = run(command.env("CC", "no-such-compiler"));
    let text = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{text}");
    for part in ["sources only", "no-such-compiler", "set CC"] {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
    let file = std::fs::File::open(d.join("arm 2.fmu")).expect("a unit");
    let archive = zip::ZipArchive::new(file).expect("an archive");
    assert!(archive.index_for_name("sources/arm_2.c").is_some());
    assert!(archive.index_for_name("binaries/linux64/arm_2.so").is_none());
    fail(2, &["export", "servo.toml", "--as", "fmu"], d, &["--out MODEL.fmu"]);
    std::fs::write(d.join("ball.toml"), MODEL).expect("written");
    fail(2, &["export", "ball.toml", "--as", "fmu", "--out", "ball.fmu"], d, &["FMU", "--as c"]);
}

#[test]
fn names_in_c_begin_with_the_name_of_the_file_and_no_input_is_replaced() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["model", "new", "servo", "--out", "servo.toml"], d);
    succeed(&["export", "servo.toml", "--as", "c", "--out", "servo.c"], d);
    let read = |name: &str| std::fs::read_to_string(d.join(name)).expect("a file");
    assert!(read("servo.h").contains("int servo_step(servo_state *state"));
    assert!(read("servo.c").contains("#include \"servo.h\"") && !read("servo.c").contains("law_"));
    assert!(read("servo.c").contains("-D SERVO_MAIN") && read("servo.h").contains("rad/(V s^2)"));
    // Printed, the code has its header in it.
    let whole = succeed(&["export", "servo.toml", "--as", "c"], d);
    assert!(whole.contains("int law_step(law_state *state") && !whole.contains("#include \""));
    std::fs::copy(d.join("servo.toml"), d.join("model.h")).expect("a copy");
    fail(2, &["export", "model.h", "--as", "c", "--out", "model.c"], d, &["model.h"]);
}
