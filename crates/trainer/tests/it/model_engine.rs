//! Contract: the engine of a model file agrees with the simulator of that model.
//!
//! Its roll-out is one run of the exact engine over the whole drop, contacts of finite duration included. Its
//! single steps follow the same curve, because the effects depend on the state alone. Sensor effects and
//! random effects are left out; effects that depend on anything but height and velocity are rejected. A model
//! of pushing keeps its effects. Configurations (TOML) and checkpoints restore the same engine.

use augsim_nn::checkpoint;
use augsim_physics::ball::{Axes, Covariates, Offsets, Run, State, Throw, simulate};
use augsim_physics::model::{Model, ModelFile, PushModel};
use augsim_physics::push::{Pose, Push, Run as PushRun, Steps, StraightPush, World};
use augsim_trainer::{
    Correction, Engine, EngineError, Recipe, Settings, SystemEngine, ThrowAxes, ThrowEngine,
};

/// Sample interval of the data, s.
const STEP_S: f64 = 1.0 / 60.0;
/// Number of samples of a drop; the ball comes to rest after about 5 s.
const TIME: usize = 400;
const START: [f64; 2] = [4.3, 0.4];

const DECLARED: &str = "\
scenario = \"ball\"
[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
restitution = 0.6
[release]
kind = \"free\"
";
const DRAG: &str = "[[effect]]\nkind = \"quadratic-drag\"\nk_per_m = 0.03\n";
const SPEED: &str = "[[effect]]\nkind = \"restitution-speed-linear\"\nb_s_per_m = 0.01\n";
const CONTACT: &str = "[[effect]]\nkind = \"contact-duration\"\ntau_s = 0.01\n";
const LEFT_OUT: &str = "[[effect]]\nkind = \"height-offset\"\nb_m = 0.05\n\
    [[effect]]\nkind = \"restitution-scatter\"\nper = \"impact\"\nsd = 0.1\n";
/// Height offset in the model file `LEFT_OUT`, m.
const OFFSET_M: f64 = 0.05;

fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

fn model(effects: &[&str]) -> Model {
    ok(Model::parse(&(DECLARED.to_owned() + &effects.concat()), "model.toml"))
}

fn engine(effects: &[&str]) -> Engine {
    Engine::Model(system(effects))
}

fn system(effects: &[&str]) -> SystemEngine {
    ok(SystemEngine::new(&ModelFile::Ball(model(effects)), Some(STEP_S)))
}

/// Simulates heights and velocities of a drop in one run of the exact engine.
fn simulated(effects: &[&str]) -> Vec<f64> {
    let (world, parameters) = model(effects).world(Axes::Vertical);
    let throw = Throw {
        world: &world,
        parameters: &parameters,
        start: State { velocity: [0.0, 0.0, START[1]], ..State::at_rest(START[0]) },
        covariates: &Covariates::default(),
        offsets: Offsets::None,
        velocities: true,
    };
    let times: Vec<f64> = (0..TIME).map(|i| i as f64 * STEP_S).collect();
    let mut run = Run::default();
    simulate(&throw, &times, &mut run);
    run.positions.iter().zip(&run.velocities).flat_map(|(p, v)| [p[2], v[2]]).collect()
}

/// Simulates a drop by single steps of the engine.
fn stepped(engine: &Engine) -> Vec<f64> {
    let mut out = START.to_vec();
    for t in 1..TIME {
        let mut next = [0.0; 2];
        engine.step(&out[2 * (t - 1)..], &[], &[], &mut next);
        out.extend(next);
    }
    out
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_rollout_equals_the_simulation_of_the_whole_drop() {
    for effects in [&[][..], &[DRAG], &[SPEED], &[DRAG, SPEED, CONTACT]] {
        let got = engine(effects).rollout(&START, &[], TIME);
        assert!(largest_difference(&got, &simulated(effects)) <= 1e-9, "{effects:?}");
    }
}

#[test]
fn single_steps_agree_with_the_simulation() {
    // Without drag every flight has a closed form. With drag it is integrated in steps of h = 0.05 s and
    // sampled by cubic interpolation. At s = h / 3 the velocity of the cubic has an error of 2 s (h - s) (h -
    // 2 s) / 24 times the fourth derivative of the height, which is at most 6 m/s^4 with this drag: 5e-6 m/s
    // per step, 2e-3 m/s in 400 steps. A wrong bounce would give an error of metres per second.
    for (effects, bound) in [(&[][..], 1e-9), (&[SPEED], 1e-9), (&[DRAG, SPEED], 2e-3)] {
        let (got, want) = (stepped(&engine(effects)), simulated(effects));
        let worst = largest_difference(&got, &want);
        assert!(worst <= bound, "{effects:?}: {worst:e}");
    }
}

#[test]
fn effects_of_the_motion_change_the_curve_and_sensor_effects_do_not() {
    let path = |effects: &[&str]| engine(effects).rollout(&START, &[], TIME);
    assert!(largest_difference(&path(&[DRAG]), &path(&[])) > 0.1);
    assert!(largest_difference(&stepped(&engine(&[SPEED])), &stepped(&engine(&[]))) > 0.1);
    // A constant height offset is equivalent to a ground at that height.
    let raised: Vec<f64> = path(&[DRAG]).chunks(2).flat_map(|s| [s[0] + OFFSET_M, s[1]]).collect();
    let there = engine(&[DRAG, LEFT_OUT]).rollout(&[START[0] + OFFSET_M, START[1]], &[], TIME);
    assert!(largest_difference(&there, &raised) < 1e-12, "{:e}", largest_difference(&there, &raised));
    assert_eq!(engine(&[DRAG, LEFT_OUT]).ignored_effects(), ["restitution-scatter"]);
}

#[test]
fn a_throw_agrees_with_the_exact_engine_along_its_axes() {
    let file = model(&[DRAG, SPEED]);
    let start = [0.1, 0.9, 1.2, 0.5];
    let (world, parameters) = file.world(Axes::Plane);
    let throw = Throw {
        world: &world,
        parameters: &parameters,
        start: State { position: [0.1, 0.0, 0.9], velocity: [1.2, 0.0, 0.5], ..State::at_rest(0.0) },
        covariates: &Covariates::default(),
        offsets: Offsets::None,
        velocities: true,
    };
    let times: Vec<f64> = (0..TIME).map(|i| i as f64 * STEP_S).collect();
    let mut run = Run::default();
    simulate(&throw, &times, &mut run);
    let rows = run.positions.iter().zip(&run.velocities);
    let want: Vec<f64> = rows.flat_map(|(p, v)| [p[0], p[2], v[0], v[2]]).collect();
    let engine = Engine::Throw(ok(ThrowEngine::new(&file, ThrowAxes::Plane, STEP_S)));
    assert_eq!(engine.columns(), ["x_m", "z_m", "velocity_x_m_s", "velocity_z_m_s"]);
    assert!(largest_difference(&engine.rollout(&start, &[], TIME), &want) <= 1e-12);
    let text = toml::to_string(&engine).expect("TOML");
    assert_eq!(toml::from_str::<Engine>(&text).expect("the same engine"), engine);
    // A horizontal effect needs a throw's states instead of a height alone; an effect of the spin is in
    // neither.
    let friction = model(&["[[effect]]\nkind = \"horizontal-acceleration\"\na_m_s2 = 0.1\n"]);
    assert!(SystemEngine::new(&ModelFile::Ball(friction.clone()), Some(STEP_S)).is_err());
    assert!(ThrowEngine::new(&friction, ThrowAxes::Plane, STEP_S).is_ok());
    let magnus = model(&["[[effect]]\nkind = \"magnus\"\ns = 0.01\n"]);
    assert!(ThrowEngine::new(&magnus, ThrowAxes::Space, STEP_S).is_err());
}

#[test]
fn noisy_states_below_the_ground_stay_finite_and_do_not_sink() {
    let engine = engine(&[CONTACT, DRAG]);
    for state in [[-0.004, 0.0], [-0.01, -3.0], [-0.01, 3.0], [0.0, -1e-9]] {
        let mut next = [f64::NAN; 2];
        engine.step(&state, &[], &[], &mut next);
        assert!(next[0] >= 0.0 && next[0] < 0.06 && next[1].abs() < 3.0, "{state:?}: {next:?}");
    }
}

#[test]
fn effects_that_need_more_than_height_and_velocity_are_rejected() {
    let drift = "[[effect]]\nkind = \"restitution-drift\"\nd_per_s = 0.001\n";
    let bounce = "[[effect]]\nkind = \"table\"\ntarget = \"restitution\"\nagainst = \"bounce\"\nfirst = 0.0\n\
        last = 3.0\nvalues = [0.0, 0.1]\n";
    let magnus = "[[effect]]\nkind = \"magnus\"\ns = 0.01\n";
    for (effect, kind) in [(drift, "restitution-drift"), (bounce, "table"), (magnus, "magnus")] {
        let error =
            Engine::from_model_file(&ModelFile::Ball(model(&[effect])), Some(STEP_S)).expect_err("refused");
        assert!(matches!(error, EngineError::Hidden { .. }), "{error}");
        assert!(error.to_string().contains(kind), "{error}");
    }
    for step_s in [None, Some(0.0), Some(-1.0), Some(f64::NAN)] {
        let engine = Engine::from_model_file(&ModelFile::Ball(model(&[])), step_s);
        assert!(matches!(engine, Err(EngineError::Step { .. })));
    }
}

fn augmented_push() -> PushModel {
    let text = "scenario = \"push\"\nobject = \"rect1\"\n[parameters]\ncontact_friction = 0.2\n\
        [[effect]]\nkind = \"table-anisotropy\"\nratio = 1.3\nangle_rad = 0.5\n\
        [[effect]]\nkind = \"exact-surface\"\n[[effect]]\nkind = \"friction-scatter\"\nsd_m = 0.001\n";
    ok(PushModel::parse(text, "push.toml"))
}

/// Simulates a straight push: rod positions `[time, (x, y, t)]` and poses.
fn pushed(world: &World, parameters: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let path = StraightPush {
        start_m: [-0.018, 0.04975],
        direction: [0.0, -1.0],
        speed_m_s: 0.02,
        acceleration_m_s2: 0.0,
        travel_m: 0.06,
    };
    let times: Vec<f64> = (0..31).map(|i| 0.1 * f64::from(i)).collect();
    let push = Push {
        world,
        parameters,
        start: Pose::new(0.0, 0.0, 0.0),
        path: &path,
        field: None,
        steps: Steps { travel_m: 1e-3, ..Steps::default() },
    };
    let mut run = PushRun::default();
    ok(augsim_physics::push::simulate(&push, &times, &mut run));
    let actions = times.iter().flat_map(|t| [-0.018, 0.04975 - 0.02 * t.min(3.0), *t]).collect();
    (actions, run.poses.iter().flat_map(|p| [p.position[0], p.position[1], p.angle]).collect())
}

fn engine_of(model: &PushModel) -> Engine {
    ok(Engine::from_model_file(&ModelFile::Push(model.clone()), None))
}

#[test]
fn a_model_of_pushing_keeps_its_effects() {
    let model = augmented_push();
    let engine = engine_of(&model);
    assert_eq!(engine.ignored_effects(), ["friction-scatter"]);
    let (world, parameters) = model.world();
    let (actions, want) = pushed(&world, &parameters);
    let got = engine.rollout(&[0.0; 3], &actions, actions.len() / 3);
    // The effects are the same; the engine's rod path is piecewise linear instead of one straight line.
    assert!(largest_difference(&got, &want) <= 1e-9, "{:e}", largest_difference(&got, &want));
    let declared = engine_of(&PushModel { effects: Vec::new(), ..model });
    let without = declared.rollout(&[0.0; 3], &actions, actions.len() / 3);
    assert!(largest_difference(&without, &want) > 1e-3);
}

/// A polygon in the model file moves like the built-in object with the same outline.
#[test]
fn an_outline_from_the_model_file_is_pushed_like_a_built_in_one() {
    let engine_with = |object: &str| {
        let text = format!("scenario = \"push\"\n{object}\n[parameters]\nc_m = 0.035\n");
        engine_of(&ok(PushModel::parse(&text, "push.toml")))
    };
    let (actions, _) = pushed(&augmented_push().world().0, &augmented_push().world().1);
    let path = |engine: &Engine| engine.rollout(&[0.0; 3], &actions, actions.len() / 3);
    let built_in = path(&engine_with("object = \"rect1\""));
    let square = "polygon_m = [[0.045, 0.045], [-0.045, 0.045], [-0.045, -0.045], [0.045, -0.045]]";
    assert!(largest_difference(&path(&engine_with(square)), &built_in) <= 1e-12);
    let flatter = "polygon_m = [[0.045, 0.03], [-0.045, 0.03], [-0.045, -0.03], [0.045, -0.03]]";
    assert!(
        largest_difference(&path(&engine_with(flatter)), &built_in) > 1e-3,
        "the rod touches the flatter object later"
    );
}

#[test]
fn configurations_and_checkpoints_restore_the_same_engine() {
    let dir = ok(tempfile::tempdir());
    for engine in [engine(&[DRAG, SPEED, LEFT_OUT]), engine_of(&augmented_push())] {
        let settings = Settings::new(Recipe::Hybrid, 10, 1, engine);
        let text = ok(toml::to_string_pretty(&settings));
        assert_eq!(ok(toml::from_str::<Settings>(&text)), settings, "{text}");
        let path = dir.path().join("checkpoint.bin");
        ok(std::fs::write(&path, ok(checkpoint::encode(&settings))));
        assert_eq!(ok(checkpoint::load::<Settings>(&path)), settings);
    }
}

#[test]
fn a_wrong_model_in_a_configuration_is_rejected_like_a_wrong_model_file() {
    let text = ok(toml::to_string(&engine_of(&augmented_push())));
    for (right, wrong, word) in [
        ("table-anisotropy", "table-anisotropi", "did you mean `table-anisotropy`"),
        ("ratio = ", "ration = ", "did you mean `ratio`"),
    ] {
        assert!(text.contains(right), "{text}");
        let error = toml::from_str::<Engine>(&text.replace(right, wrong)).expect_err("refused").to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn the_correction_follows_from_the_engine_and_rejects_unsuitable_recipes() {
    let settings = |recipe, engine| Settings::new(recipe, 10, 1, engine);
    let push = settings(Recipe::HybridStandardised, engine_of(&augmented_push()));
    assert_eq!(push.correction, Correction::Rollout);
    let error = push.check().expect_err("refused").to_string();
    assert!(error.contains("Hybrid-std") && error.contains("ball"), "{error}");
    let ball = settings(Recipe::HybridStandardised, engine(&[]));
    assert_eq!(ball.correction, Correction::Step);
    assert!(ball.check().is_ok());
}
