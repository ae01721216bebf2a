//! Contract: the engine of a model file is the simulator of that model. Its roll-out is one run of the exact engine over
//! the whole drop, contacts that last included; its single steps meet the same curve, since a state is all that the laws
//! see; what the sensor adds and what is random takes no part; laws of anything but height and velocity are refused. A
//! model of pushing keeps its effects. Configurations (TOML) and checkpoints give back the same engine.

use augsim_nn::checkpoint;
use augsim_physics::ball::{Axes, Covariates, Offsets, Run, State, Throw, simulate};
use augsim_physics::model::{Model, PushModel};
use augsim_physics::push::{Object, Pose, Push, Run as PushRun, Steps, StraightPush, World};
use augsim_trainer::push::PushEngine;
use augsim_trainer::{BallModelError, Engine, EngineSpec, ModelBall, Recipe, Settings};

/// A step of the data, s.
const STEP_S: f64 = 1.0 / 60.0;
/// Samples of a drop: the ball comes to rest after about 5 s.
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

fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

fn model(effects: &[&str]) -> Model {
    ok(Model::parse(&(DECLARED.to_owned() + &effects.concat()), "model.toml"))
}

fn engine(effects: &[&str]) -> EngineSpec {
    EngineSpec::ModelBall(Box::new(ok(ModelBall::new(&model(effects), STEP_S))))
}

/// Heights and velocities of one run of the exact engine.
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

/// The roll-out by single steps.
fn stepped(engine: &EngineSpec) -> Vec<f64> {
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
fn a_rollout_is_the_simulation_of_the_whole_drop() {
    for effects in [&[][..], &[DRAG], &[SPEED], &[DRAG, SPEED, CONTACT]] {
        let got = engine(effects).rollout(&START, &[], TIME);
        assert!(largest_difference(&got, &simulated(effects)) <= 1e-9, "{effects:?}");
    }
}

#[test]
fn single_steps_meet_the_simulation() {
    // Without drag every flight is a closed form. With it a flight is integrated in steps of h = 0.05 s and sampled by the
    // cubic through their ends. After s = h / 3 the cubic's velocity errs by 2 s (h - s) (h - 2 s) / 24 times the fourth
    // derivative of the height, at most 6 m/s^4 with this drag: 5e-6 m/s in a step, 2e-3 m/s in 400. A wrong bounce would
    // show in metres per second.
    for (effects, bound) in [(&[][..], 1e-9), (&[SPEED], 1e-9), (&[DRAG, SPEED], 2e-3)] {
        let (got, want) = (stepped(&engine(effects)), simulated(effects));
        let worst = largest_difference(&got, &want);
        assert!(worst <= bound, "{effects:?}: {worst:e}");
    }
}

#[test]
fn an_effect_of_the_model_changes_the_curve_and_one_of_the_sensor_does_not() {
    let path = |effects: &[&str]| engine(effects).rollout(&START, &[], TIME);
    assert!(largest_difference(&path(&[DRAG]), &path(&[])) > 0.1);
    assert!(largest_difference(&stepped(&engine(&[SPEED])), &stepped(&engine(&[]))) > 0.1);
    assert_eq!(path(&[DRAG, LEFT_OUT]), path(&[DRAG]));
    let with = model(&[DRAG, LEFT_OUT]);
    assert_eq!(ModelBall::left_out(&with).collect::<Vec<_>>(), ["height-offset", "restitution-scatter"]);
}

#[test]
fn states_that_noise_has_put_below_the_ground_stay_finite_and_do_not_sink() {
    let engine = engine(&[CONTACT, DRAG]);
    for state in [[-0.004, 0.0], [-0.01, -3.0], [-0.01, 3.0], [0.0, -1e-9]] {
        let mut next = [f64::NAN; 2];
        engine.step(&state, &[], &[], &mut next);
        assert!(next[0] >= 0.0 && next[0] < 0.06 && next[1].abs() < 3.0, "{state:?}: {next:?}");
    }
}

#[test]
fn laws_of_what_height_and_velocity_do_not_tell_are_refused() {
    let drift = "[[effect]]\nkind = \"restitution-drift\"\nd_per_s = 0.001\n";
    let bounce = "[[effect]]\nkind = \"table\"\ntarget = \"restitution\"\nagainst = \"bounce\"\nfirst = 0.0\n\
        last = 3.0\nvalues = [0.0, 0.1]\n";
    let magnus = "[[effect]]\nkind = \"magnus\"\ns = 0.01\n";
    for (effect, kind) in [(drift, "restitution-drift"), (bounce, "table"), (magnus, "magnus")] {
        let error = ModelBall::new(&model(&[effect]), STEP_S).expect_err("refused");
        assert!(matches!(error, BallModelError::Hidden { .. }), "{error}");
        assert!(error.to_string().contains(kind), "{error}");
    }
    for step_s in [0.0, -1.0, f64::NAN] {
        assert!(matches!(ModelBall::new(&model(&[]), step_s), Err(BallModelError::Step { .. })));
    }
}

fn augmented_push() -> PushModel {
    let text = "scenario = \"push\"\nobject = \"rect1\"\n[parameters]\ncontact_friction = 0.2\n\
        [[effect]]\nkind = \"table-anisotropy\"\nratio = 1.3\nangle_rad = 0.5\n\
        [[effect]]\nkind = \"exact-surface\"\n[[effect]]\nkind = \"friction-scatter\"\nsd_m = 0.001\n";
    ok(PushModel::parse(text, "push.toml"))
}

/// Rod positions `[time, (x, y, t)]` of a straight push, and the poses that a world gives.
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

#[test]
fn a_model_of_pushing_keeps_its_effects() {
    let model = augmented_push();
    let engine = PushEngine::of(&model).expect("rect1 is built in");
    assert_eq!(
        engine.effects.iter().map(|e| e.kind()).collect::<Vec<_>>(),
        ["table-anisotropy", "exact-surface"]
    );
    let (world, parameters) = model.world();
    let (actions, want) = pushed(&world, &parameters);
    let got = EngineSpec::Push(engine.clone()).rollout(&[0.0; 3], &actions, actions.len() / 3);
    // The same laws; the path is recorded piecewise instead of straight.
    assert!(largest_difference(&got, &want) <= 1e-9, "{:e}", largest_difference(&got, &want));
    let declared = PushEngine { effects: Vec::new(), ..engine };
    let without = EngineSpec::Push(declared).rollout(&[0.0; 3], &actions, actions.len() / 3);
    assert!(largest_difference(&without, &want) > 1e-3);
    let textbook = PushModel::textbook(
        Object::polygon("butter", &[[0.1, 0.0], [0.0, 0.1], [-0.1, -0.1]]).expect("a triangle"),
    );
    assert!(PushEngine::of(&textbook).is_none());
    let disguised = Object::polygon("rect1", &[[0.1, 0.0], [0.0, 0.1], [-0.1, -0.1]]).expect("a triangle");
    assert!(PushEngine::of(&PushModel::textbook(disguised)).is_none(), "another outline under the same name");
}

#[test]
fn configurations_and_checkpoints_give_back_the_same_engine() {
    let push = PushEngine::of(&augmented_push()).expect("rect1 is built in");
    let dir = ok(tempfile::tempdir());
    for settings in [
        Settings::ball(Recipe::HybridPlus, 10, 1, engine(&[DRAG, SPEED, LEFT_OUT])),
        Settings::push(Recipe::Hybrid, 10, 1, push),
    ] {
        let text = ok(toml::to_string_pretty(&settings));
        assert_eq!(ok(toml::from_str::<Settings>(&text)), settings, "{text}");
        let path = dir.path().join("checkpoint.bin");
        ok(std::fs::write(&path, ok(checkpoint::encode(&settings))));
        assert_eq!(ok(checkpoint::load::<Settings>(&path)), settings);
    }
}

#[test]
fn configurations_from_before_effects_are_read_and_wrong_ones_refused() {
    let push = PushEngine::textbook("rect1", 0.14).expect("rect1 is built in");
    let text = ok(toml::to_string(&push));
    let before: String =
        text.lines().filter(|l| !l.contains("effects")).map(|l| l.to_owned() + "\n").collect();
    assert_eq!(ok(toml::from_str::<PushEngine>(&before)), push);
    let effect =
        |kind: &str, values: &str| format!("{before}[[effects]]\nkind = \"{kind}\"\nvalues = {values}\n");
    for (text, word) in [
        (effect("table-anisotropi", "[1.0, 0.0]"), "did you mean `table-anisotropy`"),
        (effect("table-anisotropy", "[1.0]"), "ratio, angle_rad"),
    ] {
        let error = toml::from_str::<PushEngine>(&text).expect_err("refused").to_string();
        assert!(error.contains(word), "{error}");
    }
    let ball = "step_s = 0.01\nmodel = \"scenario = 'push'\"\n";
    assert!(toml::from_str::<ModelBall>(ball).is_err());
}

#[test]
fn a_recipe_of_the_ball_is_refused_for_pushing() {
    let push = PushEngine::textbook("rect1", 0.14).expect("rect1 is built in");
    let error =
        Settings::push(Recipe::HybridStandardised, 10, 1, push).check().expect_err("refused").to_string();
    assert!(error.contains("Hybrid-std") && error.contains("ball"), "{error}");
    assert!(Settings::ball(Recipe::HybridStandardised, 10, 1, engine(&[])).check().is_ok());
}
