//! Compares the step function and the FMU of a model with the engine, at the same integration steps.

use super::STRICT;
use crate::programs::printed;
use augsim_equations::engine::Signal;
use augsim_equations::listing::Listing;
use augsim_equations::model::{Hold, Integrator};
use augsim_equations::{Model, model};
use augsim_session::Subject;
use augsim_session::export::{Exported, Language, export_files};
use augsim_session::simulate::{Plan, simulate};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Output};

/// Integration steps in each sample interval, enough for the fastest of the tested models to be stable.
const SUBSTEPS: usize = 32;

const STEP_DRIVER: &str = include_str!("step_driver.c");
const FMU_DRIVER: &str = include_str!("fmu_driver.c");
const EVENTS_CHECK: &str = include_str!("events_check.py");
const NUMPY_CHECK: &str = include_str!("numpy_check.py");
const FMPY_CHECK: &str = include_str!("fmpy_check.py");

/// Writes the files of an export.
pub fn write(exported: &Exported) {
    for (path, bytes) in &exported.files {
        std::fs::write(path, bytes).expect("written");
    }
}

/// The model with a declared number of steps, method and widths, which step functions do not choose themselves.
///
/// Negative delays become positive: they would need inputs that are still to come.
fn with_fixed_steps(model: &Model, integrator: Integrator) -> Model {
    let mut fixed = model.clone();
    fixed.numerics.substeps = Some(SUBSTEPS);
    fixed.numerics.integrator = integrator;
    for discontinuity in Listing::new(model).expect("a listing").discontinuities {
        fixed.numerics.widths.insert(discontinuity.argument, discontinuity.width);
    }
    for delay in model.inputs.iter().filter_map(|input| input.delay) {
        let delay = &mut fixed.parameters[delay];
        delay.nominal = delay.nominal.abs().min(delay.max);
    }
    fixed
}

/// The plan as the drivers read it: times, and the cubics of the inputs from each time to the next.
fn cubics(model: &Model, plan: &Plan) -> String {
    let times = &plan.times;
    let signals: Vec<(Signal, &Vec<f64>)> = (model.inputs.iter())
        .map(|input| {
            let (_, values) = plan.inputs.iter().find(|(name, _)| *name == input.name).expect("an input");
            (Signal::new(times, values, input.hold.unwrap_or(Hold::Linear)), values)
        })
        .collect();
    let mut text = times.len().to_string();
    for (k, t) in times.iter().enumerate() {
        text += &format!("\n{t}");
        for (signal, values) in &signals {
            let [mut slope, mut square, mut cube] = [0.0; 3];
            if let (Some(next), true) = (times.get(k + 1), signal.hold() != Hold::Zero) {
                let (h, bend) = (next - t, signal.curvature_at(*t));
                // The natural spline has no curvature at its ends.
                let next_bend = if k + 2 < times.len() { signal.curvature_at(*next) } else { 0.0 };
                slope = (values[k + 1] - values[k]) / h - h * (2.0 * bend + next_bend) / 6.0;
                (square, cube) = (0.5 * bend, (next_bend - bend) / (6.0 * h));
            }
            text += &format!(" {} {slope} {square} {cube}", values[k]);
        }
    }
    text
}

/// Largest error of numbers that a program printed, relative to 1 and the value of the engine.
fn largest_error(printed: &str, engine: &[f64], what: &str) -> f64 {
    let found: Vec<f64> = printed.lines().map(|line| line.parse().expect("a number")).collect();
    assert_eq!(found.len(), engine.len(), "{what}");
    let errors = found.iter().zip(engine).map(|(a, b)| (a - b).abs() / (1.0 + b.abs()));
    errors.fold(0.0, |most: f64, error| if error.is_nan() { f64::INFINITY } else { most.max(error) })
}

/// Checks that the step function and the FMU of a model give the trajectory of the engine.
///
/// Their caller gives all initial states. Those of effects begin at 0 here, in the engine as well.
pub fn follow_the_engine(model: &Model, plan: &Plan, what: &str, dir: &Path) {
    let of_effects = model.states[model.declared_states()..].iter().map(|s| (s.name.clone(), vec![0.0]));
    let plan = &Plan { start: plan.start.iter().cloned().chain(of_effects).collect(), ..plan.clone() };
    let declared = model.numerics.integrator;
    let methods = match declared {
        Integrator::Automatic => &[Integrator::Explicit, Integrator::Implicit][..],
        _ => &[declared],
    };
    let simulated = methods.iter().find_map(|method| {
        let fixed = with_fixed_steps(model, *method);
        let engine = simulate(&Subject::Equations(Box::new(fixed.clone())), plan).ok()?;
        engine.values.iter().all(|v| v.abs() < 1e6).then_some((fixed, engine.values))
    });
    let (fixed, engine) = simulated.expect("the engine simulates with fixed steps");
    let x: Vec<String> = fixed.states.iter().map(|state| start_of(state, plan).to_string()).collect();
    step_function(&fixed, plan, &x, what, dir);
    unit(&fixed, plan, &x, &engine, what, dir);
    fmpy_follows_the_engine(&fixed, plan, what, dir);
}

/// Initial value of a state, as planned.
fn start_of(state: &model::State, plan: &Plan) -> f64 {
    let planned = plan.start.iter().find(|(name, _)| *name == state.name);
    planned.expect("a planned start").1[0]
}

/// Compares the step function with the engine; inputs are linear at most, because a spline needs the samples to come.
fn step_function(fixed: &Model, plan: &Plan, x: &[String], what: &str, dir: &Path) {
    let mut fixed = fixed.clone();
    for input in &mut fixed.inputs {
        input.hold = Some(if input.hold == Some(Hold::Zero) { Hold::Zero } else { Hold::Linear });
    }
    let subject = Subject::Equations(Box::new(fixed.clone()));
    let engine = simulate(&subject, plan).expect("a simulation").values;
    write(&export_files(&subject, Language::C, &dir.join("law.c")).expect("a step function"));
    std::fs::write(dir.join("plan.txt"), cubics(&fixed, plan)).expect("written");
    std::fs::write(dir.join("step_driver.c"), STEP_DRIVER).expect("written");
    let build = [STRICT, &["-O1", "step_driver.c", "law.c", "-o", "steps", "-lm"]].concat();
    let args: Vec<&str> = std::iter::once("plan.txt").chain(x.iter().map(String::as_str)).collect();
    let Some(found) = printed("cc", &build, dir).and_then(|_| printed("./steps", &args, dir)) else { return };
    let error = largest_error(&found, &engine, what);
    assert!(error <= 1e-9, "step function, {what}: error {error}");
}

/// Compares both kinds of the FMU with the engine, and checks its files.
fn unit(fixed: &Model, plan: &Plan, x: &[String], engine: &[f64], what: &str, dir: &Path) {
    let subject = Subject::Equations(Box::new(fixed.clone()));
    let exported = export_files(&subject, Language::Fmu, &dir.join("law.fmu")).expect("a unit");
    write(&exported);
    let description = unpack(&dir.join("law.fmu"), dir);
    let (guid, indicators) = check_description(&description, fixed);
    if !exported.notes.is_empty() || !cfg!(target_os = "linux") {
        return;
    }
    std::fs::write(dir.join("plan.txt"), cubics(fixed, plan)).expect("written");
    std::fs::write(dir.join("fmu_driver.c"), FMU_DRIVER).expect("written");
    let build = ["-Wall", "-Werror", "-O1", "fmu_driver.c", "-o", "unit", "-lm", "-ldl"];
    printed("cc", &build, dir);
    let unit = [STRICT, &["-O2", "-c", "fmi2.c", "-o", "fmi2.o"]].concat();
    printed("cc", &unit, dir);
    let sizes = [fixed.states.len(), fixed.inputs.len(), fixed.outputs.len(), indicators, SUBSTEPS];
    for kind in ["cs", "me"] {
        // The importer of the test integrates by explicit steps.
        if kind == "me" && fixed.numerics.integrator == Integrator::Implicit {
            continue;
        }
        let mut args = vec!["./law.so".to_owned(), guid.clone(), kind.to_owned(), "plan.txt".to_owned()];
        args.extend(sizes.iter().map(usize::to_string).chain(x.iter().cloned()));
        let Some(found) = printed("./unit", &args, dir) else { return };
        let error = largest_error(&found, engine, what);
        // In model exchange the past of an input is known at the importer's steps only, with lines between them.
        let is_sampled = |i: &model::Input| i.delay.is_some() && i.hold != Some(Hold::Zero);
        let allowed = if kind == "me" && fixed.inputs.iter().any(is_sampled) { 1e-6 } else { 1e-9 };
        assert!(error <= allowed, "FMU ({kind}), {what}: error {error}");
    }
}

/// Unpacks an FMU into `dir`, without folders, and returns its description.
fn unpack(file: &Path, dir: &Path) -> String {
    let bytes = std::fs::File::open(file).expect("an archive");
    let mut archive = zip::ZipArchive::new(bytes).expect("an archive");
    let mut names = Vec::new();
    for index in 0..archive.len() {
        let mut file = archive.by_index(index).expect("a file");
        let name = file.name().expect("a name").into_owned();
        let mut content = Vec::new();
        file.read_to_end(&mut content).expect("its content");
        std::fs::write(dir.join(name.rsplit('/').next().unwrap_or_default()), content).expect("written");
        names.push(name);
    }
    for name in ["modelDescription.xml", "sources/fmi2.c", "sources/fmi2.h", "sources/law.c", "sources/law.h"]
    {
        assert!(names.iter().any(|found| found == name), "{name} is not in {names:?}");
    }
    std::fs::read_to_string(dir.join("modelDescription.xml")).expect("a description")
}

/// Checks the structure of a description; returns the GUID and the number of event indicators.
fn check_description(text: &str, model: &Model) -> (String, usize) {
    let document = roxmltree::Document::parse(text).expect("XML");
    let root = document.root_element();
    let attribute = |name: &str| root.attribute(name).unwrap_or_default().to_owned();
    assert_eq!((root.tag_name().name(), &*attribute("fmiVersion")), ("fmiModelDescription", "2.0"));
    let child = |name: &str| root.children().find(|c| c.has_tag_name(name));
    for kind in ["ModelExchange", "CoSimulation"] {
        assert_eq!(child(kind).and_then(|c| c.attribute("modelIdentifier")), Some("law"));
    }
    let variables: Vec<_> =
        child("ModelVariables").into_iter().flat_map(|v| v.children()).filter(|v| v.is_element()).collect();
    let (n, u) = (model.states.len(), model.inputs.len());
    let declared = (model.states.iter().map(|s| &s.name).enumerate())
        .chain(model.inputs.iter().map(|i| &i.name).enumerate().map(|(i, name)| (2 * n + i, name)))
        .chain(model.outputs.iter().map(|o| &o.name).enumerate().map(|(i, name)| (2 * n + u + i, name)));
    for (reference, name) in declared {
        let variable = variables[reference];
        let number = reference.to_string();
        assert_eq!(
            (variable.attribute("name"), variable.attribute("valueReference")),
            (Some(&**name), Some(&*number))
        );
    }
    let mut names: Vec<_> = variables.iter().filter_map(|v| v.attribute("name")).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), variables.len(), "names are unique");
    let listed = |name: &str| {
        let lists = child("ModelStructure").into_iter().flat_map(|s| s.children());
        lists
            .filter(|list| list.has_tag_name(name))
            .flat_map(|list| list.children())
            .filter(|u| u.is_element())
            .count()
    };
    assert_eq!((listed("Derivatives"), listed("Outputs")), (n, model.outputs.len()));
    let indicators = attribute("numberOfEventIndicators").parse().expect("a number");
    (attribute("guid"), indicators)
}

/// The plan for fmpy: samples at equal intervals, and inputs that jump at every second one.
fn fmpy_plan(model: &Model, plan: &Plan) -> Plan {
    let times: Vec<f64> = (0..=200).map(|k| 0.01 * f64::from(k)).collect();
    let wave = |input: usize| -> Vec<f64> {
        let value = |k: u32| 1.5 + 2.0 * (0.4 + 0.03 * f64::from(k.div_ceil(2)) * (2.0 + input as f64)).sin();
        (0..=200).map(value).collect()
    };
    let inputs = model.inputs.iter().enumerate().map(|(i, input)| (input.name.clone(), wave(i))).collect();
    Plan { times, inputs, start: plan.start.clone(), ..Plan::default() }
}

/// Checks that fmpy simulates the FMU of a model as the engine does, with inputs that are held.
///
/// Where fmpy is missing this is printed and nothing is checked.
fn fmpy_follows_the_engine(fixed: &Model, plan: &Plan, what: &str, dir: &Path) {
    let mut fixed = fixed.clone();
    fixed.inputs.iter_mut().for_each(|input| input.hold = Some(Hold::Zero));
    let plan = fmpy_plan(&fixed, plan);
    let subject = Subject::Equations(Box::new(fixed.clone()));
    // Not every combination of effects stays finite with these inputs.
    let Ok(engine) = simulate(&subject, &plan) else { return };
    let row = fixed.outputs.len();
    let engine: Vec<f64> = engine.values.chunks(row).step_by(2).flatten().copied().collect();
    super::write_inputs(&plan, dir);
    write(&export_files(&subject, Language::Fmu, &dir.join("law.fmu")).expect("a unit"));
    std::fs::write(dir.join("fmpy_check.py"), FMPY_CHECK).expect("written");
    for (kind, allowed) in [("cs", 1e-9), ("me", 1e-5)] {
        let mut args = ["fmpy_check.py", "law.fmu", kind, "in.csv"].map(str::to_owned).to_vec();
        let start = |state: &model::State| format!("{}={}", state.name, start_of(state, &plan));
        args.extend(fixed.states.iter().map(start));
        let Some(found) = scientific_python(&args, what, dir) else { return };
        let error = largest_error(&found, &engine, what);
        assert!(error <= allowed, "fmpy ({kind}), {what}: error {error}");
    }
}

/// Checks the exported Python module on arrays and in a solver of scipy.
pub fn python_takes_arrays(what: &str, dir: &Path) {
    std::fs::write(dir.join("numpy_check.py"), NUMPY_CHECK).expect("written");
    scientific_python(&["numpy_check.py".to_owned()], what, dir);
}

/// What a script prints that needs packages of Python; `None`, with a message, where they are missing.
///
/// `AUGSIM_TEST_PYTHON` names a Python that has numpy, scipy and fmpy.
fn scientific_python(args: &[String], what: &str, dir: &Path) -> Option<String> {
    let python = std::env::var_os("AUGSIM_TEST_PYTHON").unwrap_or_else(|| "python3".into());
    let out = Command::new(&python).args(args).current_dir(dir).output();
    let reason = match out {
        Ok(out) if out.status.success() => return Some(String::from_utf8(out.stdout).expect("text")),
        Ok(out) if out.status.code() == Some(77) => String::from_utf8_lossy(&out.stderr).into_owned(),
        Ok(out) => panic!("{args:?}, {what}: {}", String::from_utf8_lossy(&out.stderr)),
        Err(e) => e.to_string(),
    };
    // Nothing can be done when standard error is closed.
    let _ = writeln!(
        std::io::stderr(),
        "NOT TESTED: {} ({}); set AUGSIM_TEST_PYTHON to a Python with numpy, scipy and fmpy",
        args[0],
        reason.trim()
    );
    None
}

/// Compiles the step function of a model with an option, and runs it over a plan of inputs.
fn run_steps(text: &str, plan: &Plan, option: &str, dir: &Path) -> Option<Output> {
    let model = model::parse(text, "model.toml").expect("a model");
    let subject = Subject::Equations(Box::new(model.clone()));
    write(&export_files(&subject, Language::C, &dir.join("law.c")).expect("a step function"));
    std::fs::write(dir.join("plan.txt"), cubics(&model, plan)).expect("written");
    std::fs::write(dir.join("step_driver.c"), STEP_DRIVER).expect("written");
    let build = [STRICT, &[option, "-O1", "step_driver.c", "law.c", "-o", "steps", "-lm"]].concat();
    printed("cc", &build, dir)?;
    let out = Command::new("./steps").args(["plan.txt", "0.5", "0.1"]).current_dir(dir).output();
    Some(out.expect("the program runs"))
}

#[test]
fn a_delay_that_is_longer_than_the_history_is_an_error() {
    let dir = super::folder("history");
    let text = super::FLOW.replace("hold = \"zero\"", "hold = \"zero\", delay_s = 0.5");
    let times: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(k)).collect();
    let inputs = vec![("heater_W".to_owned(), times.clone())];
    let plan = Plan { times, inputs, ..Plan::default() };
    let Some(enough) = run_steps(&text, &plan, "-DLAW_HISTORY=60", &dir) else { return };
    assert!(enough.status.success(), "{}", String::from_utf8_lossy(&enough.stderr));
    let Some(short) = run_steps(&text, &plan, "-DLAW_HISTORY=40", &dir) else { return };
    let message = String::from_utf8_lossy(&short.stderr).into_owned();
    assert!(!short.status.success() && message.contains("a delay is longer"), "{message}");
}

#[test]
fn a_step_function_runs_without_end_although_one_simulation_has_at_most_1000_events() {
    let dir = super::folder("long");
    let text = "scenario = \"system\"\nname = \"swing\"\n[states]\nx_m = { start = \"y_m\" }\nv_m_s = { start = \"0\" }\n\
        [parameters]\nrate = { nominal = 39.0, min = 0.0, unit = \"1/s^2\" }\n[rates]\nx_m = \"v_m_s\"\n\
        v_m_s = \"-rate * x_m\"\n[outputs]\ny_m = { value = \"x_m\", sd = 0.001 }\n[[events]]\nname = \"middle\"\n\
        when = \"x_m\"\ndirection = \"both\"\nset = { v_m_s = \"v_m_s\" }\n[numerics]\nsubsteps = 20\n";
    let times: Vec<f64> = (0..3000).map(|k| 0.25 * f64::from(k)).collect();
    let plan = Plan { times, ..Plan::default() };
    let Some(out) = run_steps(text, &plan, "-O1", &dir) else { return };
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert_eq!(String::from_utf8_lossy(&out.stdout).lines().count(), 3000);
}

#[test]
fn a_solver_of_scipy_goes_on_after_events() {
    let dir = super::folder("events");
    let text = augsim_equations::example("mass-spring-stop").expect("the example");
    let subject = Subject::parse(text, "model.toml").expect("a model");
    let times: Vec<f64> = (0..=100).map(|k| 0.01 * f64::from(k)).collect();
    let start = [("x_m", 0.0), ("v_m_s", 0.5)].map(|(name, value)| (name.to_owned(), vec![value]));
    // The force keeps the mass away from a rest at the stop, which is at 5 cm.
    let inputs = vec![("force_N".to_owned(), vec![1.0; times.len()])];
    let plan = Plan { start: start.to_vec(), times, inputs, ..Plan::default() };
    let engine = simulate(&subject, &plan).expect("a simulation").values;
    assert!(engine.windows(3).any(|x| x[1] > 0.045 && x[2] < x[1]), "the mass reaches the stop");
    write(&export_files(&subject, Language::Python, &dir.join("law.py")).expect("a module"));
    std::fs::write(dir.join("events_check.py"), EVENTS_CHECK).expect("written");
    let args = ["events_check.py", "1.0", "0.0", "0.5"].map(str::to_owned);
    let Some(found) = scientific_python(&args, "mass-spring-stop", &dir) else { return };
    let error = largest_error(&found, &engine, "mass-spring-stop");
    assert!(error <= 1e-6, "error {error}");
}
