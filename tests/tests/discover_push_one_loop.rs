//! Contract: pushes go through the loop of all systems with the findings of sealed sets: nothing where there is nothing, an
//! effect by name and size, a value for each group, a centre of pressure that is drawn anew for each push; the augmented
//! model says it. The command line still takes the loop of pushes alone, until measured sets and speed are as good here.

use augsim_data::{Dataset, Trajectory};
use augsim_discovery::{Discovery, Options, Verdict, discover};
use augsim_physics::model::PushModel;
use augsim_tests::sealed_push::{PushKind, PushTruth, SealedPushes, seal_pushes};

fn set(effect: Option<PushKind>, c_m: f64, pushes: usize, seed: u64) -> SealedPushes {
    let truth = PushTruth { effect, patches: false, c_m, contact_friction: 0.28, pushes };
    seal_pushes(truth, seed).expect("well formed")
}

fn answer(model: &str, data: &Dataset) -> Discovery {
    let model = PushModel::parse(model, "sealed.toml").expect("a model");
    discover(&model, data, &Options::default(), &mut |_| {}).expect("an answer")
}

fn kinds(d: &Discovery) -> Vec<&str> {
    d.effects.iter().map(|e| e.kind.as_str()).collect()
}

#[test]
fn nothing_is_found_where_there_is_nothing() {
    let set = set(None, 0.0355, 12, 11);
    let d = answer(&set.model, &set.data);
    assert_eq!(d.verdict, Verdict::NothingToAdd, "{} {:?}", d.sentence, d.tests);
    assert!(d.tests.pass, "{:?}", d.tests);
    let [low, high] = d.parameters["c_m"].ci95;
    assert!(low < 0.0355 && 0.0355 < high && high - low < 2e-3, "{:?}", d.parameters);
    // Position decides, in m; rotation is a measure of its own; both after half a second to two.
    assert!(d.errors["rotation"].unit == "degrees" && d.horizons.len() == 3, "{:?}", d.errors);
}

#[test]
fn a_law_that_is_singular_at_its_null_is_named_with_its_direction() {
    let set = set(Some(PushKind::TableAnisotropy(1.25, 1.5)), 0.0355, 12, 11);
    let d = answer(&set.model, &set.data);
    assert_eq!(kinds(&d), ["table-anisotropy"], "{}", d.sentence);
    let p = &d.effects[0].parameters;
    assert!((p["ratio"].value - 1.25).abs() < 0.03 && (p["angle_rad"].value - 1.5).abs() < 0.06, "{p:?}");
    assert!(d.error.augmented.rmse < 0.5 * d.error.calibrated.rmse, "{:?}", d.error);
}

#[test]
fn what_differs_from_group_to_group_is_named_and_written_into_the_model() {
    let session = |name: &str, c_m: f64, seed: u64| {
        let set = set(None, c_m, 6, seed);
        let renamed = set.data.trajectories().iter().map(|t| {
            let t = Trajectory::new(format!("{name} {}", t.id()), t.time_s().to_vec(), t.values().to_vec())?;
            t.with_group(name)
        });
        (renamed.collect::<Result<Vec<_>, _>>().expect("well formed"), set.model)
    };
    let ((morning, model), (evening, _)) = (session("morning", 0.031, 21), session("evening", 0.038, 22));
    let names = ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"];
    let data = Dataset::from_names(&names, [morning, evening].concat()).expect("well formed");
    let d = answer(&model, &data);
    assert_eq!(kinds(&d), ["c_m per group"], "{}", d.sentence);
    let groups = &d.effects[0].parameters["c_m"].groups;
    assert!(
        (groups["morning"].value - 0.031).abs() < 1e-3 && (groups["evening"].value - 0.038).abs() < 1e-3,
        "{groups:?}"
    );
    let augmented = PushModel::parse(&d.model_toml, "augmented.toml").expect("a model");
    assert_eq!(augmented.parameters[0].groups.len(), 2, "{}", d.model_toml);
}

#[test]
fn a_centre_of_its_own_in_each_push_is_named_with_its_spread() {
    let set = set(Some(PushKind::FrictionScatter(2e-3, [0.0; 2])), 0.0355, 24, 11);
    let d = answer(&set.model, &set.data);
    assert_eq!(kinds(&d), ["friction-scatter"], "{}", d.sentence);
    let [low, high] = d.effects[0].parameters["sd_m"].ci95;
    assert!(low < 2e-3 && 2e-3 < high, "{}", d.sentence);
    assert_eq!(d.effects[0].per.as_deref(), Some("push"));
    let augmented = PushModel::parse(&d.model_toml, "augmented.toml").expect("a model");
    assert_eq!(augmented.effects[0].kind, "friction-scatter");
}
