//! Contract: the system interface of calibration and discovery returns the values and derivatives of the
//! equations.
//!
//! A window's result is bit-identical whatever is simulated with it, and whether or not its record was
//! prepared. Effects of the library and tables are added with exact derivatives. A model with found effects
//! is written so that it reads back the same.
//!
//! The pendulum is compared with the same equations in Rust under the adaptive integrator of `ode`; the
//! cart-pole has two pairs of position and speed and an input, and the mass with its stop an event.

use augsim_equations::engine::{Method, Options};
use augsim_equations::library::Scales;
use augsim_equations::model::{self, Model};
use augsim_equations::{CalibratedModel, EquationSystem, example};
use augsim_physics::Scalar;
use augsim_physics::ode::{At, Equations, Ode};
use augsim_system::{
    Addition, Augment, Augmentation, Declaration, Fitted, FittedValues, ModelTerm, Offsets, Parameter,
    Prepare, Record, Schema, Seed, Simulate, Simulated, Stream, System, Table, Task,
};

fn model(name: &str) -> Model {
    model::parse(example(name).expect("an example"), "test.toml").unwrap_or_else(|e| panic!("{e}"))
}

fn system(name: &str, substeps: usize) -> EquationSystem {
    let options = Options { method: Method::RungeKutta, substeps };
    EquationSystem::new(&model(name), &Scales::default()).expect("a system").with_options(options)
}

/// Builds a record whose sinusoidal inputs have their own, finer clock than the outputs.
fn record(system: &dyn System) -> Record {
    let clock: Vec<f64> = (0..400).map(|k| 0.005 * f64::from(k)).collect();
    let sine = |k: usize| -> Vec<f64> { clock.iter().map(|t| ((2 + k) as f64 * 3.0 * t).sin()).collect() };
    let inputs = (0..system.schema().inputs.len())
        .map(|k| Stream { times: clock.clone(), values: vec![sine(k)] })
        .collect();
    let times: Vec<f64> = (0..190).map(|k| 0.01 * f64::from(k)).collect();
    let values = system.schema().channels.iter().map(|_| times.iter().map(|t| 0.3 * t.cos()).collect());
    Record { id: "7".into(), values: values.collect(), times, inputs, ..Record::default() }
}

#[test]
fn conditions_are_the_inputs_and_the_starts() {
    let conditions = |name| system(name, 8).schema().conditions.clone();
    assert_eq!(conditions("pendulum"), ["starts"]);
    assert_eq!(conditions("cart-pole").last().map(String::as_str), Some("starts"));
    assert!(conditions("cart-pole").len() > 1);
}

fn run(system: &dyn System, task: &Task<'_>) -> Simulated {
    let mut out = Simulated::default();
    system.simulate(task, &mut out).unwrap_or_else(|e| panic!("{e}"));
    out
}

fn bytes(out: &Simulated) -> Vec<u64> {
    let at = (0..out.samples()).flat_map(|k| (0..out.channels()).map(move |c| (k, c)));
    at.flat_map(|(k, c)| std::iter::once(out.value(k, c)).chain(out.slopes(k, c).to_vec()))
        .map(f64::to_bits)
        .collect()
}

/// The equations of the example model `pendulum`, written in Rust for comparison.
#[derive(Debug)]
struct Pendulum(Schema, Vec<Parameter>);

impl Equations for Pendulum {
    fn schema(&self) -> &Schema {
        &self.0
    }
    fn parameters(&self) -> &[Parameter] {
        &self.1
    }
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
        let [gravity, length, damping] = [at.parameters[0], at.parameters[1], at.parameters[2]];
        rates[0] = at.states[1];
        rates[1] = -(gravity / length) * at.states[0].sin() - damping * at.states[1];
    }
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
}

#[test]
fn values_and_derivatives_equal_those_of_the_equations_in_rust() {
    let written = system("pendulum", 8);
    let record = record(&written);
    let reference = Ode::new(Pendulum(written.schema().clone(), written.parameters().to_vec()));
    // Gravity is frozen, but its derivative is available on request.
    let seeds = [Seed::Parameter(0), Seed::Parameter(1), Seed::Parameter(2), Seed::Start(0), Seed::Start(1)];
    let task = Task {
        parameters: &[9.81, 0.2, 0.1],
        record: &record,
        window: 10..150,
        start: &[0.9, -0.5],
        offsets: Offsets::None,
        seeds: &seeds,
    };
    let (found, expected) = (run(&written, &task), run(&reference, &task));
    for k in 0..found.samples() {
        assert!((found.value(k, 0) - expected.value(k, 0)).abs() < 1e-7, "{k}");
        for (a, b) in found.slopes(k, 0).iter().zip(expected.slopes(k, 0)) {
            assert!((a - b).abs() < 1e-6 * b.abs().max(1.0), "{k}: {a} {b}");
        }
    }
}

#[test]
fn a_window_is_bit_identical_whatever_is_simulated_with_it() {
    for name in ["cart-pole", "mass-spring-stop"] {
        let system = system(name, 2);
        let plain = record(&system);
        let mut prepared = plain.clone();
        system.prepare(&mut prepared, &[]).expect("a record");
        let states = system.schema().states.len();
        let values: Vec<Vec<f64>> = (0..37)
            .map(|i| system.parameters().iter().map(|p| p.nominal * (1.0 + 0.003 * f64::from(i))).collect())
            .collect();
        let starts: Vec<Vec<f64>> = (0..37).map(|i| vec![0.01 * f64::from(i); states]).collect();
        let seeds: [&[Seed]; 3] = [&[Seed::Start(0), Seed::Parameter(0)], &[], &[Seed::Start(1)]];
        let task = |i: usize, record| Task {
            parameters: &values[i],
            record,
            window: i..90 + 2 * i,
            start: &starts[i],
            offsets: Offsets::None,
            seeds: seeds[i % 3],
        };
        let tasks: Vec<Task<'_>> = (0..37).map(|i| task(i, &prepared)).collect();
        let mut out = vec![Simulated::default(); 37];
        let done = system.simulate_batch(&tasks, &mut out);
        let mut reversed: Vec<Task<'_>> = tasks.clone();
        reversed.reverse();
        let mut back = vec![Simulated::default(); 37];
        system.simulate_batch(&reversed, &mut back);
        for i in 0..37 {
            assert!(done[i].is_ok(), "{name} {i}");
            let alone = bytes(&run(&system, &tasks[i]));
            assert_eq!(alone, bytes(&out[i]), "{name} {i}: in a list");
            assert_eq!(alone, bytes(&back[36 - i]), "{name} {i}: in a reversed list");
            assert_eq!(alone, bytes(&run(&system, &task(i, &plain))), "{name} {i}: of an unprepared record");
        }
    }
}

#[test]
fn a_failed_task_does_not_affect_the_others() {
    let system = system("pendulum", 2);
    let record = record(&system);
    let task = |start, window| Task {
        parameters: &[9.81, 0.2, 0.1],
        record: &record,
        window,
        start,
        offsets: Offsets::None,
        seeds: &[],
    };
    let tasks = [
        task(&[0.1, 0.0], 0..50),
        task(&[0.1], 0..50),
        task(&[f64::NAN, 0.0], 0..50),
        task(&[0.1, 0.0], 0..500),
        task(&[0.1, 0.0], 20..50),
    ];
    let mut out = vec![Simulated::default(); 4];
    let done = system.simulate_batch(&tasks, &mut out);
    let succeeded: Vec<bool> = done.iter().map(Result::is_ok).collect();
    assert_eq!(succeeded, [true, false, false, false, false], "{done:?}");
    assert_eq!(bytes(&out[0]), bytes(&run(&system, &tasks[0])));
}

#[test]
fn added_effects_have_exact_derivatives() {
    let system = system("cart-pole", 4);
    let record = record(&system);
    let library = system.library();
    let index =
        |kind: &str| library.iter().position(|e| e.kind == kind).unwrap_or_else(|| panic!("no {kind}"));
    let table = Table { target: 3, feature: 2, first: -1.0, last: 1.0, knots: 4 };
    let laws = [
        ModelTerm::Effect(index("coulomb on v_m_s")),
        ModelTerm::Effect(index("presliding on omega_rad_s")),
        ModelTerm::Table(table),
    ];
    let augmented =
        system.augmented(&laws[..2]).expect("two effects").augmented(&laws[2..]).expect("one more");
    assert_eq!((augmented.declared_count(), augmented.terms()), (system.parameters().len(), &laws[..]));
    let first = augmented.declared_count();
    let mut values: Vec<f64> = augmented.parameters().iter().map(|p| p.nominal).collect();
    values[first..].copy_from_slice(&[0.4, 0.3, 2.0, 0.2, 0.1, -0.3, 0.2, 0.4]);
    let seeds: Vec<Seed> = (first..values.len()).map(Seed::Parameter).collect();
    let start = [0.1, 0.3, 0.4, -0.2];
    let simulate = |values: &[f64], seeds: &[Seed]| {
        let (window, offsets) = (0..120, Offsets::None);
        run(&*augmented, &Task { parameters: values, record: &record, window, start: &start, offsets, seeds })
    };
    let exact = simulate(&values, &seeds);
    for lane in 0..seeds.len() {
        let h = 1e-5;
        let moved = |by: f64| {
            let mut values = values.clone();
            values[first + lane] += by;
            simulate(&values, &[])
        };
        let (up, down) = (moved(h), moved(-h));
        let slope = |k: usize, c: usize| exact.slopes(k, c)[lane];
        let scale = (0..120).flat_map(|k| [slope(k, 0), slope(k, 1)]).fold(0.0, |s: f64, x| s.max(x.abs()));
        assert!(scale > 1e-6, "parameter {lane} has no effect");
        for k in 0..120 {
            for c in 0..2 {
                let difference = (up.value(k, c) - down.value(k, c)) / (2.0 * h);
                assert!((slope(k, c) - difference).abs() < 1e-5 * scale, "parameter {lane}, sample {k}");
            }
        }
    }
}

#[test]
fn found_effects_are_written_and_read_back() {
    let declared = model("pendulum");
    let measured = CalibratedModel::new(
        declared.clone(),
        EquationSystem::new(&declared, &Scales::default()).expect("a system"),
    );
    let system = measured.open(&|_| true).expect("all columns are there");
    let quadratic =
        system.library().iter().position(|e| e.kind == "quadratic-damping").expect("in the library");
    let one =
        |value: f64| Fitted { values: FittedValues::One(value), ci95: Some([value - 0.1, value + 0.1]) };
    let table = Table { target: 1, feature: 0, first: -1.0, last: 1.0, knots: 3 };
    let found = Augmentation {
        declared: vec![(1, one(0.2))],
        additions: vec![
            Addition::Term(ModelTerm::Effect(quadratic), vec![one(0.3)]),
            Addition::Term(ModelTerm::Table(table), vec![one(0.1), one(0.2), one(0.3)]),
        ],
        ..Augmentation::default()
    };
    let text = measured.augmented(&found).expect("a text");
    let again = model::parse(&text, "augmented.toml").unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(again.parameters[1].nominal, 0.2);
    let kinds: Vec<&str> = again.additions.iter().map(|a| a.kind.as_str()).collect();
    assert_eq!(kinds, ["quadratic-damping", "table"]);
    let added: Vec<f64> = again.parameters[3..].iter().map(|p| p.nominal).collect();
    assert_eq!(added, [0.3, 0.1, 0.2, 0.3]);
    // A fitted value may exceed the bound of the file by rounding.
    let beyond = Augmentation { declared: vec![(1, one(declared.parameters[1].max.next_up()))], ..found };
    let text = measured.augmented(&beyond).expect("a text");
    let again = model::parse(&text, "augmented.toml").unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(again.parameters[1].nominal, declared.parameters[1].max);
    let refused =
        measured.open(&|column| column != "angle_rad").expect_err("a column is missing").to_string();
    assert_eq!(
        refused,
        "the data have no column `angle_rad`, which is an output of the model; rename the data column, or remove it from the model"
    );
}

#[test]
fn a_frozen_parameter_is_written_as_frozen() {
    let text = "scenario = \"system\"\n[inputs]\npush = { hold = \"zero\", delay_s = 0.1 }\n[states]\nx = { start = \"y\" }\n\
                [parameters]\nrate = 0.3 # of decay\ngain = { nominal = 2.0, min = 0.0, max = 9.0 } # of the push\n\
                [rates]\nx = \"gain * push - rate * x\"\n[outputs]\ny = { value = \"x\" }\n";
    let mut declared = model::parse(text, "decay.toml").unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(declared.to_toml().expect("a text"), text);
    declared.parameters.iter_mut().for_each(|p| p.frozen = true);
    let written = declared.to_toml().expect("a text");
    let expected = text
        .replace("rate = 0.3", "rate = { nominal = 0.3, frozen = true }")
        .replace("max = 9.0 }", "max = 9.0, frozen = true }");
    assert_eq!(written, expected);
    let again = model::parse(&written, "decay.toml").unwrap_or_else(|e| panic!("{e}"));
    assert!(again.parameters.iter().all(|p| p.frozen));
}

#[test]
fn chosen_steps_do_not_depend_on_an_initial_rest() {
    let steps = |at_rest: i32| {
        let declared = system("servo", 1);
        let times: Vec<f64> = (0..at_rest + 300).map(|k| 0.05 * f64::from(k)).collect();
        let driven = |k: i32| if k < 0 { 0.0 } else { (0.3 * f64::from(k)).sin() };
        let command = (0..at_rest + 300).map(|k| driven(k - at_rest)).collect();
        let angle = (0..at_rest + 300).map(|k| 5.0 * driven(k - at_rest)).collect();
        let inputs = vec![Stream { times: times.clone(), values: vec![command] }];
        let mut record =
            Record { id: "1".into(), times, values: vec![angle], inputs: inputs.into(), ..Record::default() };
        declared.prepare(&mut record, &[]).expect("a record");
        declared.tuned(&[record]).expect("steps are found").options().substeps
    };
    assert!(steps(0) > 1, "the motor is faster than the sampling");
    assert_eq!(steps(600), steps(0));
}

#[test]
fn a_measured_model_opens_the_tuned_system() {
    let declared = system("servo", 4);
    let mut record = record(&declared);
    let [clock, driven] = [record.inputs[0].times.clone(), record.inputs[0].values[0].clone()];
    declared.prepare(&mut record, &[]).expect("a record");
    assert_eq!(record.inputs[0].times, clock);
    assert_eq!(record.inputs[0].values[0], driven, "the first column of a prepared input is the input");
    let records = [record];
    let tuned = declared.with_windows(Some(0.5)).tuned(&records).expect("steps are found");
    let measured = tuned.measured(tuned.model().clone(), &records).expect("a measured model");
    let opened = measured.open(&|_| true).expect("a system");
    let parameters: Vec<f64> = tuned.parameters().iter().map(|p| p.nominal).collect();
    let task = Task {
        parameters: &parameters,
        record: &records[0],
        window: 0..190,
        start: &[0.1, 0.5],
        offsets: Offsets::None,
        seeds: &[Seed::Parameter(0), Seed::Start(1)],
    };
    assert_eq!(bytes(&run(&tuned, &task)), bytes(&run(&*opened, &task)));
    let coulomb = opened.library().iter().position(|e| e.kind == "coulomb").expect("in the library");
    let typical = opened.library()[coulomb].parameters[0].typical;
    assert!(typical > 0.0 && typical != 1.0, "sizes are those of the record: {typical}");
    assert_eq!(opened.null_points(coulomb).len(), 3, "widths have a grid");
}

/// Simulates the channels of a whole record from `start` at nominal values, `[sample][channel]`.
fn channels(system: &EquationSystem, record: &Record, start: &[f64]) -> Vec<f64> {
    let parameters: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let window = 0..record.times.len();
    let task = Task { parameters: &parameters, record, window, start, offsets: Offsets::None, seeds: &[] };
    let mut out = Simulated::default();
    system.simulate(&task, &mut out).unwrap_or_else(|e| panic!("{e}"));
    (0..out.samples())
        .flat_map(|k| (0..out.channels()).map(move |c| (k, c)))
        .map(|(k, c)| out.value(k, c))
        .collect()
}

#[test]
fn process_noise_is_read_and_written_back() {
    let text = example("pendulum").expect("an example");
    let (plain, with) = (
        "start = \"slope(angle_rad)\"",
        "start = \"slope(angle_rad)\", shaken = { sd = 0.5, memory_s = 0.02 }",
    );
    let mut shaken = model::parse(&text.replace(plain, with), "test.toml").unwrap_or_else(|e| panic!("{e}"));
    let there = shaken.states[1].process_noise.expect("process noise is declared");
    assert_eq!((there.sd, there.correlation_time_s, shaken.states[0].process_noise), (0.5, 0.02, None));
    assert_eq!(shaken.to_toml().expect("a text"), text.replace(plain, with), "nothing changed");
    shaken.states[1].process_noise = None;
    let read = |model: &Model| {
        model::parse(&model.to_toml().expect("a text"), "test.toml").unwrap_or_else(|e| panic!("{e}"))
    };
    assert_eq!(read(&shaken).states[1].process_noise, None);
    let mut plain = model("pendulum");
    plain.states[1].process_noise = Some(model::RateNoise { sd: 0.25, correlation_time_s: 0.0 });
    assert_eq!(read(&plain).states[1].process_noise, plain.states[1].process_noise);
}

#[test]
fn process_noise_is_added_to_the_rate_of_its_state() {
    let options = Options { method: Method::RungeKutta, substeps: 4 };
    let mut pendulum = model("pendulum");
    pendulum.states[1].process_noise = Some(model::RateNoise { sd: 0.5, correlation_time_s: 0.0 });
    let plain = EquationSystem::declared_only(&pendulum).expect("a system").with_options(options.clone());
    let pushed = plain.with_process_noise_inputs().expect("a system");
    let mut record = record(&plain);
    let half = record.times.len() / 2;
    let push: Vec<f64> = (0..record.times.len()).map(|k| if k < half { 0.7 } else { -1.1 }).collect();
    record.inputs = [Stream { times: record.times.clone(), values: vec![push] }].into();
    let found = channels(&pushed, &record, &[0.4, 0.1]);
    // The same noise as a constant in the equation, valid for the first half of the record.
    let text =
        example("pendulum").expect("an example").replace("omega_rad_s = \"-", "omega_rad_s = \"0.7 - ");
    let constant = model::parse(&text, "test.toml").unwrap_or_else(|e| panic!("{e}"));
    let constant = EquationSystem::declared_only(&constant).expect("a system").with_options(options);
    record.inputs = [].into();
    let expected = channels(&constant, &record, &[0.4, 0.1]);
    let unpushed = channels(&plain, &record, &[0.4, 0.1]);
    for k in 0..=half {
        assert!((found[k] - expected[k]).abs() < 1e-12, "{k}: {} {}", found[k], expected[k]);
    }
    assert!(
        (found[half] - unpushed[half]).abs() > 1e-3 && (found[half + 40] - expected[half + 40]).abs() > 1e-3
    );
}

#[test]
fn states_are_channels_after_the_outputs() {
    let cart = system("cart-pole", 4);
    let record = record(&cart);
    let start = [0.1, 0.2, 0.3, -0.4];
    let (outputs, shown) = (
        channels(&cart, &record, &start),
        channels(&cart.with_states_as_channels().expect("a system"), &record, &start),
    );
    let samples = record.times.len();
    let (c, all) = (outputs.len() / samples, shown.len() / samples);
    assert_eq!(all, c + 4);
    assert_eq!(shown[c..all], start, "the first sample is the start");
    for k in 0..samples {
        assert_eq!(shown[k * all..k * all + c], outputs[k * c..(k + 1) * c]);
    }
    assert_eq!(cart.process_noise_states(), [1, 3], "positions have speeds as their rates");
}

#[test]
fn a_pause_of_any_length_costs_no_time_when_windows_are_cut() {
    let text = "scenario = \"system\"\nname = \"decay\"\n[states]\nx_m = { start = \"pos_m\" }\n[parameters]\n\
        k_per_s = { nominal = 1.0, min = 0.0, max = 10.0 }\n[rates]\nx_m = \"-k_per_s * x_m\"\n[outputs]\npos_m = \"x_m\"\n";
    let model = augsim_equations::model::parse(text, "decay.toml").expect("a model");
    let system = EquationSystem::declared_only(&model).expect("a system").with_windows(Some(1.0));
    let windows = |pause_s: f64| {
        let times: Vec<f64> =
            (0..60).map(|k| 0.1 * f64::from(k) + if k < 30 { 0.0 } else { pause_s }).collect();
        let values = vec![times.iter().map(|t| (-t).exp()).collect()];
        let mut record = Record { id: "1".into(), times, values, ..Record::default() };
        system.prepare(&mut record, &[]).expect("prepared");
        record.windows.into_iter().map(|w| w.samples).collect::<Vec<_>>()
    };
    // A loop over all seconds of the pause would take hours.
    let cut = windows(1e13);
    assert_eq!((cut[0].start, cut[cut.len() - 1].end), (0, 60), "{cut:?}");
    assert!(cut.len() >= 4 && cut.windows(2).all(|w| w[0].end == w[1].start + 1), "{cut:?}");
    assert_eq!(windows(0.0), [0..10, 9..20, 19..30, 29..40, 39..50, 49..60]);
}
