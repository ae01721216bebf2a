//! Contract: rates of an external function give the simulations, derivatives and effects of the same rates as equations.

use augsim_equations::engine::{Method, Options, Record, Seed, Signal, Simulated, Window};
use augsim_equations::model::{Draft, Hold, How, Target, parse};
use augsim_equations::{ExternalFunction, ExternalRates, Model, System, library, listing};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A driven pendulum: the arguments are time, angle, speed, torque, length and damping, then forces.
#[derive(Default)]
struct Pendulum {
    points: AtomicUsize,
    /// Length of a semi-implicit Euler step, s; 0 for rates.
    step_s: f64,
}

impl Pendulum {
    fn rates_of(&self, x: &[f64]) -> [f64; 2] {
        let force = x.get(6).copied().unwrap_or(0.0);
        let acceleration = -9.81 / x[4] * x[1].sin() - x[5] * x[2] + x[3] + force;
        [x[2] + self.step_s * acceleration, acceleration]
    }
}

impl ExternalRates for Pendulum {
    fn states(&self) -> usize {
        2
    }

    fn rates(&self, points: usize, arguments: &[f64], rates: &mut [f64]) {
        self.points.fetch_add(points, Ordering::Relaxed);
        for point in 0..points {
            let x: Vec<f64> = arguments.iter().skip(point).step_by(points).copied().collect();
            for (state, rate) in self.rates_of(&x).into_iter().enumerate() {
                rates[state * points + point] = rate;
            }
        }
    }

    fn derivatives(&self, _points: usize, _arguments: &[f64], _derivatives: &mut [f64]) -> bool {
        false
    }

    fn is_costly(&self) -> bool {
        false
    }

    fn typical_sizes(&self) -> &[f64] {
        &[1.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
    }
}

const HEAD: &str = r#"
scenario = "system"
[inputs]
torque_per_s2 = { hold = "zero" }
[states]
theta_rad = { start = "angle_rad" }
omega_rad_s = { start = "slope(angle_rad)" }
[parameters]
length_m = { nominal = 0.5, min = 0.1, max = 2.0 }
damping_per_s = { nominal = 0.2, min = 0.0, max = 5.0 }
[outputs]
angle_rad = { value = "theta_rad", sd = "estimate" }
"#;
const EQUATIONS: &str = r#"
[rates]
theta_rad = "omega_rad_s"
omega_rad_s = "-9.81 / length_m * sin(theta_rad) - damping_per_s * omega_rad_s + torque_per_s2"
"#;
const FUNCTION: &str = r#"
[rates]
theta_rad = "omega_rad_s"
omega_rad_s = "external_rate(omega_rad_s)"
[external]
function = "pendulum"
"#;
const STEPS: &str = r#"
[rates]
theta_rad = "external_rate(theta_rad)"
omega_rad_s = "external_rate(omega_rad_s)"
[external]
function = "pendulum"
step_s = 0.01
forces = { push_per_s2 = ["theta_rad", "omega_rad_s"] }
"#;

fn model(rest: &str) -> Model {
    parse(&[HEAD, rest].concat(), "pendulum.toml").expect("a model")
}

fn with_function(mut model: Model, function: &Arc<Pendulum>) -> Model {
    let external = model.external.as_mut().expect("an external function");
    external.rates = Some(ExternalFunction::new(Arc::<Pendulum>::clone(function)));
    model
}

fn simulated(model: &Model, options: &Options) -> Vec<Simulated> {
    let times: Vec<f64> = (0..41).map(|k| 0.05 * f64::from(k)).collect();
    let torque: Vec<f64> = times.iter().map(|t| 3.0 * (2.0 * t).sin()).collect();
    let torque = Signal::new(&times, &torque, Hold::Zero);
    let record = Record::new("swing", times, vec![torque]).expect("a record");
    let parameters = model.nominals();
    let active: Vec<usize> = (0..parameters.len()).collect();
    let system = System::compile(model, &active).expect("a system");
    let mut seeds: Vec<Seed> = active.iter().map(|p| Seed::Parameter(*p)).collect();
    seeds.push(Seed::Start(1));
    let starts = [[0.8, 0.0], [-0.3, 1.0], [2.0, -1.0]];
    let window = |start| Window { record: &record, first: 0, last: 40, start, parameters: &parameters };
    let windows: Vec<Window<'_>> = starts.iter().map(|start| window(&start[..])).collect();
    system.simulate(&windows, &seeds, options).into_iter().map(|run| run.expect("a simulation")).collect()
}

fn assert_equal(found: &[Simulated], expected: &[Simulated], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        for (a, b) in found.values.iter().zip(&expected.values) {
            assert!((a - b).abs() < 1e-9, "value {a} instead of {b}");
        }
        for (a, b) in found.slopes.iter().zip(&expected.slopes) {
            assert!((a - b).abs() < tolerance * (1.0 + b.abs()), "derivative {a} instead of {b}");
        }
    }
}

const FINE: Options = Options { method: Method::RungeKutta, substeps: 4 };

fn draft(target: Target, how: How, expression: &str) -> Draft {
    let row = parse(&[HEAD, EQUATIONS].concat(), "pendulum.toml").expect("a model");
    let parameter =
        augsim_equations::model::Parameter { name: "c".into(), nominal: 0.3, ..row.parameters[0].clone() };
    Draft {
        kind: "effect".into(),
        on: "omega_rad_s".into(),
        parameters: vec![parameter],
        changes: vec![((target, how), expression.into())],
        ..Draft::default()
    }
}

#[test]
fn an_external_function_is_simulated_with_its_derivatives_like_equations() {
    let function = Arc::new(Pendulum::default());
    let external = with_function(model(FUNCTION), &function);
    assert_equal(&simulated(&external, &FINE), &simulated(&model(EQUATIONS), &FINE), 1e-6);
    assert!(function.points.load(Ordering::Relaxed) > 0, "the function is called");
}

#[test]
fn effects_on_rates_inputs_and_parameters_reach_an_external_function() {
    let function = Arc::new(Pendulum::default());
    for (target, how, expression) in [
        (Target::Rate(1), How::Add, "-c * tanh(omega_rad_s / 0.2)"),
        (Target::Input(0), How::Factor, "1 + c * t"),
        (Target::Parameter(1), How::Factor, "1 + c * abs(theta_rad)"),
    ] {
        let mut external = with_function(model(FUNCTION), &function);
        let mut equations = model(EQUATIONS);
        external.add(&draft(target, how, expression)).expect("an effect");
        equations.add(&draft(target, how, expression)).expect("an effect");
        assert_equal(&simulated(&external, &FINE), &simulated(&equations, &FINE), 1e-6);
    }
}

#[test]
fn steps_repeat_the_simulator_and_forces_act_in_it() {
    let function = Arc::new(Pendulum { step_s: 0.01, ..Pendulum::default() });
    let mut external = with_function(model(STEPS), &function);
    let places = library::candidates(&external).expect("candidates");
    assert!(
        places.iter().any(|effect| effect.kind == "coulomb" && effect.on == "push_per_s2"),
        "friction acts on the force"
    );
    external.add(&draft(Target::Force(0), How::Add, "-c * omega_rad_s")).expect("an effect");
    let system = System::compile(&external, &[]).expect("a system");
    let options = Options { method: system.declared_method(), substeps: 1 };
    assert_eq!(options.method, Method::Euler { step_s: 0.01 });
    let found = simulated(&external, &options);
    let (mut x, mut expected) = ([0.8, 0.0], vec![0.8]);
    for sample in 0..40 {
        for _ in 0..5 {
            let arguments =
                [0.0, x[0], x[1], 3.0 * (2.0 * 0.05 * f64::from(sample)).sin(), 0.5, 0.2, -0.3 * x[1]];
            let rates = function.rates_of(&arguments);
            x = [x[0] + 0.01 * rates[0], x[1] + 0.01 * rates[1]];
        }
        expected.push(x[0]);
    }
    for (a, b) in found[0].values.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-10, "{a} instead of {b}");
    }
    let mut moved = external.clone();
    let last = moved.parameters.len() - 1;
    moved.parameters[last].nominal += 1e-5;
    let (shifted, seeds) = (simulated(&moved, &options), external.parameters.len() + 1);
    for (sample, (a, b)) in shifted[1].values.iter().zip(&found[1].values).enumerate() {
        let slope = found[1].slopes[sample * seeds + last];
        assert!(((a - b) / 1e-5 - slope).abs() < 1e-4, "sample {sample}: {slope}");
    }
}

#[test]
fn a_model_without_its_function_says_which_is_missing() {
    let error = System::compile(&model(FUNCTION), &[]).expect_err("no function").to_string();
    assert!(
        error.contains(
            "pendulum.toml:17: external: the rates of this model are the Python function `pendulum`"
        ),
        "{error}"
    );
    let attached = with_function(model(FUNCTION), &Arc::new(Pendulum::default()));
    let error = listing::Listing::new(&attached).expect_err("no equations").to_string();
    assert!(error.contains("cannot be exported"), "{error}");
    let changed = attached.parse_changed(&attached.to_toml().expect("a text")).expect("a model");
    assert_eq!(changed.external, attached.external);
    let error = parse(
        &[HEAD, FUNCTION].concat().replace("[external]", "[numerics]").replace("function", "substeps"),
        "p.toml",
    );
    assert!(error.is_err(), "external_rate needs its section");
}
