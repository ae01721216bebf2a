//! Contract: the engine of a system of equations agrees with its simulator, inputs and events included.
//!
//! Nets correct the rates of its force and flow equations only, so that a position stays the integral of its
//! velocity. State bounds and events hold for any correction of a net. Configurations (TOML) and checkpoints
//! restore the same engine.

use augsim_equations::engine::{Method, Options, Record, Signal, Window};
use augsim_equations::model::{Hold, parse};
use augsim_equations::{EquationSystem, System};
use augsim_nn::checkpoint;
use augsim_trainer::{
    Correction, Engine, EquationEngine, Forecaster, NetModel, Recipe, Sequence, Sequences, Settings, Task,
    Training,
};

const STEP_S: f64 = 0.01;

/// Model file of a mass on a spring that an input force drives against a stop.
const STOPPED: &str = "scenario = \"system\"\nname = \"mass with stop\"\n[inputs]\nforce_N = { hold = \"linear\" }\n[states]\n\
    x_m = { start = \"position_m\" }\nv_m_s = { start = 0.0 }\n[parameters]\nmass_kg = { nominal = 1.2, frozen = true }\n\
    stiffness_N_per_m = 80.0\nstop_m = { nominal = 0.05, frozen = true }\nrestitution = 0.5\n[rates]\nx_m = \"v_m_s\"\n\
    v_m_s = \"(force_N - stiffness_N_per_m * x_m) / mass_kg\"\n[outputs]\nposition_m = \"x_m\"\n[[events]]\nname = \"stop\"\n\
    when = \"x_m - stop_m\"\ndirection = \"rising\"\nset = { v_m_s = \"-restitution * v_m_s\" }\n";

/// Model file of a draining tank.
const TANK: &str = "scenario = \"system\"\nname = \"tank\"\n[states]\nlevel_m = { start = \"height_m\", min = 0.0, max = 0.5 }\n\
    [parameters]\nk = { nominal = 0.3, unit = \"m^0.5/s\" }\n[rates]\nlevel_m = \"-k * sqrt(level_m)\"\n[outputs]\n\
    height_m = \"level_m\"\n";

fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

fn engine(text: &str) -> Engine {
    let model = ok(parse(text, "model.toml"));
    let system = ok(EquationSystem::declared_only(&model));
    Engine::Equations(ok(EquationEngine::new(&system, STEP_S, vec![1e-3])))
}

/// Generates action rows: force and time.
fn actions(samples: usize) -> Vec<f64> {
    (0..samples).flat_map(|k| [6.0 * (0.13 * k as f64).sin(), STEP_S * k as f64]).collect()
}

/// Generates records whose states jump by more than the equations allow, so that a net learns large corrections.
fn erratic_records(engine: &Engine, states: usize, actions: &[f64]) -> Sequences {
    let time = 60;
    let record = |r: usize| {
        let values = (0..time * states).map(|i| 0.02 + 0.02 * ((i * (r + 3)) as f64).sin());
        Sequence { id: r.to_string(), time, states: values.collect(), actions: actions.to_vec() }
    };
    let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect();
    let (columns, action_columns) = (owned(engine.columns()), owned(engine.action_columns()));
    Sequences { columns, action_columns, items: (0..4).map(record).collect() }
}

fn trained(engine: Engine, records: &Sequences, recipe: Recipe) -> NetModel {
    let mut training = ok(Training::new(Settings::new(recipe, 30, 1, engine), records));
    (0..30).for_each(|_| {
        ok(training.step());
    });
    ok(NetModel::new(ok(training.finish()).clone()))
}

#[test]
fn a_roll_out_through_the_stop_agrees_with_the_simulator() {
    let engine = engine(STOPPED);
    assert_eq!((engine.columns(), engine.action_columns()), (vec!["x_m", "v_m_s"], vec!["force_N", "t_s"]));
    let (time, model) = (200, ok(parse(STOPPED, "model.toml")));
    let actions = actions(time);
    let path = engine.rollout(&[0.03, 0.2], &actions, time);
    let (times, force): (Vec<f64>, Vec<f64>) = actions.chunks_exact(2).map(|a| (a[1], a[0])).unzip();
    let signal = Signal::new(&times, &force, Hold::Linear);
    let record = ok(Record::new("whole", times, vec![signal]));
    let window = Window {
        record: &record,
        first: 0,
        last: time - 1,
        start: &[0.03, 0.2],
        parameters: &model.nominals(),
    };
    let options = Options { method: Method::RungeKutta, substeps: 4 };
    let whole = ok(ok(System::compile(&model, &[])).states_along(&window, &options));
    assert!(path.iter().step_by(2).any(|x| *x > 0.045), "the mass reaches the stop");
    for (a, b) in path.iter().zip(&whole) {
        assert!((a - b).abs() < 1e-9, "{a} and {b}");
    }
}

#[test]
fn an_input_with_spline_interpolation_agrees_with_the_simulator() {
    let text = STOPPED.replace("\"linear\"", "\"spline\"");
    let (engine, model, time) = (engine(&text), ok(parse(&text, "model.toml")), 40);
    assert_eq!(engine.action_columns(), ["force_N", "curvature of force_N", "t_s"]);
    let times: Vec<f64> = (0..time).map(|k| STEP_S * k as f64).collect();
    let force: Vec<f64> = (0..time).map(|k| 3.0 * (1.3 * k as f64).sin()).collect();
    let signal = Signal::new(&times, &force, Hold::Spline);
    let rows = times.iter().zip(&force);
    let actions: Vec<f64> = rows.flat_map(|(t, u)| [*u, signal.curvature_at(*t), *t]).collect();
    let path = engine.rollout(&[0.0, 0.1], &actions, time);
    let record = ok(Record::new("whole", times, vec![signal]));
    let window = Window {
        record: &record,
        first: 0,
        last: time - 1,
        start: &[0.0, 0.1],
        parameters: &model.nominals(),
    };
    let options = Options { method: Method::RungeKutta, substeps: 4 };
    let whole = ok(ok(System::compile(&model, &[])).states_along(&window, &options));
    for (a, b) in path.iter().zip(&whole) {
        assert!((a - b).abs() < 1e-12, "{a} and {b}");
    }
}

#[test]
fn outputs_are_computed_from_states() {
    let engine = engine(STOPPED);
    let system = engine.equation_engine().expect("equations");
    assert_eq!(system.outputs(&[0.01, 3.0, -0.02, 1.0], &[1.0, 0.0, 2.0, 0.01]), [0.01, -0.02]);
}

#[test]
fn forecasts_never_pass_a_stop_or_the_bounds_of_a_state() {
    let time = 60;
    for recipe in [Recipe::HybridPlus, Recipe::EnsembleResidual] {
        let (stopped, forces) = (engine(STOPPED), actions(time));
        let net = trained(stopped.clone(), &erratic_records(&stopped, 2, &forces), recipe);
        let task = Task { start: &[0.04, 0.5], actions: &forces, time, index: 0 };
        let drawn = ok(net.forecast(task, 24));
        let (tank, clock) = (engine(TANK), actions(time).chunks_exact(2).map(|a| a[1]).collect::<Vec<f64>>());
        let net = trained(tank.clone(), &erratic_records(&tank, 1, &clock), recipe);
        let levels = ok(net.forecast(Task { start: &[0.02], actions: &clock, time, index: 0 }, 24));
        let [mut highest, mut lowest] = [f32::MIN, f32::MAX];
        for positions in drawn.values.chunks_exact(48).map(|row| &row[..24]) {
            highest = positions.iter().fold(highest, |a, b| a.max(*b));
        }
        levels.values.iter().for_each(|v| lowest = lowest.min(*v));
        // Samples are single-precision numbers.
        assert!(highest <= 0.05 * (1.0 + f32::EPSILON), "{recipe:?}: {highest} m");
        assert!((0.0..0.02).contains(&lowest), "{recipe:?}: {lowest} m");
        assert!(levels.values.iter().all(|v| *v <= 0.5), "{recipe:?}");
    }
}

#[test]
fn each_sample_can_have_its_own_initial_state() {
    let (stopped, forces) = (engine(STOPPED), actions(60));
    let records = erratic_records(&stopped, 2, &forces);
    for recipe in [Recipe::HybridPlus, Recipe::FeedForwardResidual] {
        let net = trained(stopped.clone(), &records, recipe);
        let starts: Vec<f64> = (0..6).map(|i| 0.01 * f64::from(i)).collect();
        let drawn = ok(net.forecast(Task { start: &starts, actions: &forces, time: 60, index: 0 }, 3));
        let first: Vec<f64> = drawn.values[..6].iter().map(|v| f64::from(*v)).collect();
        for (k, expected) in [0.0, 0.02, 0.04, 0.01, 0.03, 0.05].into_iter().enumerate() {
            assert!((first[k] - expected).abs() < 1e-7, "{first:?}");
        }
    }
}

#[test]
fn configurations_and_checkpoints_restore_the_engine() {
    let engine = engine(STOPPED);
    let settings = Settings::new(Recipe::HybridPlus, 10, 1, engine);
    assert_eq!(settings.correction, Correction::Rates);
    let text = ok(toml::to_string_pretty(&settings));
    assert_eq!(ok(toml::from_str::<Settings>(&text)), settings);
    let file = ok(tempfile::NamedTempFile::new());
    ok(std::fs::write(file.path(), ok(checkpoint::encode(&settings))));
    assert_eq!(ok(checkpoint::load::<Settings>(file.path())), settings);
}

#[test]
fn recipes_and_corrections_that_do_not_suit_equations_are_rejected() {
    let named = |recipe| Settings::new(recipe, 10, 1, engine(TANK));
    for recipe in Recipe::all() {
        let is_rejected = named(recipe).check().is_err();
        let suitable = [
            "hybrid-plus",
            "feed-forward-residual",
            "recurrent-residual",
            "mixture-residual",
            "ensemble-residual",
        ];
        assert_eq!(is_rejected, !suitable.contains(&recipe.name()), "{}", recipe.name());
    }
    let other = Settings { correction: Correction::Step, ..named(Recipe::HybridPlus) };
    let error = other.check().expect_err("it is refused").to_string();
    assert!(error.starts_with("setting `correction` = step: "), "{error}");
}
