//! Contract: the code in `docs/recipes` compiles and does what the recipe says. The files are included by
//! path, and this crate has the modules of the crate into which a user copies them: `ball::effects`,
//! `library` and `convert`, and the names of `augsim-physics` and `augsim-data` at the root. Recipes without
//! Rust code are tested by `crates/cli/tests/it/readme.rs`. This is a binary of its own, because the recipes
//! name modules at the root of a crate.

use augsim_data::convert::Converted;
use augsim_data::{DataError, Dataset, Trajectory, random_stream, read_text};
use augsim_discovery::Verdict;
use augsim_nn::{Bound, Params};
use augsim_physics::ball::Covariates;
use augsim_physics::ball::effects::{Effect, Flight, Law};
use augsim_physics::{Dual, Scalar};
use augsim_tensor::Tape;
use augsim_tests::characterisation::{Answer, Answers};
use augsim_tests::random::normals;
use height_spring::HeightSpring;
use own_net::{TinyNet, oscillations, train};
use std::collections::BTreeMap;

/// Stand-in for the module `ball` of `augsim-physics`, which the copied effects import.
mod ball {
    pub mod effects {
        pub use augsim_physics::ball::effects::*;
    }
}
mod library {
    pub use augsim_physics::library::*;
}

#[path = "../../docs/recipes/code/height_spring.rs"]
mod height_spring;
#[path = "../../crates/nn/examples/own_net.rs"]
mod own_net;
#[path = "../../docs/recipes/code/two_column_log.rs"]
mod two_column_log;

fn flight<S: Scalar>(height: S, covariates: &Covariates) -> Flight<'_, S> {
    let still = [S::zero(); 3];
    let position = [S::zero(), S::zero(), height];
    Flight { time: S::zero(), position, velocity: still, airspeed: still, spin: still, covariates }
}

#[test]
fn effect_pulls_to_its_height_vanishes_at_its_null_and_has_exact_derivatives() {
    let covariates = Covariates::default();
    // A spring of 0.5 1/s² towards 1 m: f = k z0. The ball is 0.4 m above it.
    let mut a = [0.0; 3];
    HeightSpring.acceleration(&[0.5, 0.5], &flight(1.4, &covariates), &mut a);
    assert!((a[2] + 0.2).abs() < 1e-15 && a[0] == 0.0 && a[1] == 0.0);
    let spec = Effect::<f64>::spec(&HeightSpring);
    let nulls: Vec<f64> = spec.parameters.iter().map(|p| p.null).collect();
    let mut a = [0.0; 3];
    HeightSpring.acceleration(&nulls, &flight(3.0, &covariates), &mut a);
    assert_eq!(a, [0.0; 3], "the effect vanishes at its null");
    let p = [Dual::<2>::variable(0.5, 0), Dual::variable(0.5, 1)];
    let mut a = [Dual::constant(0.0); 3];
    HeightSpring.acceleration(&p, &flight(Dual::constant(1.4), &covariates), &mut a);
    assert_eq!(a[2].derivatives(), [-1.4, 1.0]);
}

#[test]
fn effect_is_not_in_the_library_yet() {
    let kinds = augsim_physics::ball::effects::all::<f64>().map(|e| e.spec().kind);
    let spec = Effect::<f64>::spec(&HeightSpring);
    assert!(!kinds.contains(&spec.kind), "the recipe adds an effect that is there: choose another for it");
}

#[test]
fn reader_gives_trajectories_in_si_units_and_names_a_mistake() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("b.log", "# the second drop\n0 1500\n10 1499.5\n");
    write("a.log", "0 1000\n20 998\n\n40 992.2\n");
    write("notes.txt", "not a drop");
    let converted = two_column_log::convert(folder.path()).expect("a set");
    let ids: Vec<&str> = converted.data.trajectories().iter().map(Trajectory::id).collect();
    assert_eq!(ids, ["a", "b"]);
    let first = &converted.data.trajectories()[0];
    // A thousandth of a decimal number is a rounding off the decimal number that is meant.
    let near = |a: &[f64], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
    assert!(near(first.time_s(), [0.0, 0.02, 0.04]) && near(first.column(0), [1.0, 0.998, 0.9922]));
    let model = converted.model_toml.expect("a model file");
    augsim_physics::model::Model::parse(&model, "model.toml").expect("a model");
    write("c.log", "0 1000\n10 99O\n");
    let error = two_column_log::convert(folder.path()).expect_err("a letter for a digit").to_string();
    assert!(error.contains("c.log") && error.contains("line 2") && error.contains("99O"), "{error}");
}

fn loss_of(
    net: &TinyNet,
    params: &Params<f64>,
    extents: (usize, usize),
    data: (&[f64], &[f64]),
) -> (f64, Vec<f64>) {
    let ((time, lanes), (mut tape, mut bound)) = (extents, (Tape::new(), Bound::default()));
    params.bind(&mut tape, &mut bound).expect("parameters");
    let [x, y] = [data.0, data.1].map(|v| tape.constant(&[time, 1, lanes], v).expect("a sequence"));
    let loss = net.loss(&mut tape, &bound, x, y).expect("a loss");
    tape.backward(loss).expect("a scalar");
    let mut grads = vec![0.0; params.values().len()];
    params.gather_grads(&tape, &bound, &mut grads);
    (tape.value(loss)[0], grads)
}

#[test]
fn net_has_the_gradient_of_central_differences() {
    let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    let net = TinyNet::new(&mut params);
    let (extents, (seen, next)) = ((6, 3), oscillations(5, 6, 3));
    let (_, grads) = loss_of(&net, &params, extents, (&seen, &next));
    let direction = normals(9, grads.len());
    let along: f64 = grads.iter().zip(&direction).map(|(g, d)| g * d).sum();
    let [up, down] = [1e-6, -1e-6].map(|h| {
        let mut moved = params.clone();
        moved.values_mut().iter_mut().zip(&direction).for_each(|(v, d)| *v += h * d);
        loss_of(&net, &moved, extents, (&seen, &next)).0
    });
    // Truncation of order h² and rounding of order eps / h, times a loss of order 10: see `augsim_tests::gradient`.
    assert!(((up - down) / 2e-6 - along).abs() < 1e-6 * along.abs().max(1.0));
}

#[test]
fn net_example_runs() {
    own_net::main().expect("extents that fit");
}

#[test]
fn net_beats_the_best_constant_on_sequences_that_it_has_not_seen() {
    let extents = (30, 16);
    let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    let net = TinyNet::new(&mut params);
    let (seen, next) = oscillations(1, 30, 16);
    train(&net, &mut params, extents, (&seen, &next), 300).expect("a run");
    let (seen, next) = oscillations(2, 30, 16);
    let (trained, _) = loss_of(&net, &params, extents, (&seen, &next));
    let n = next.len() as f64;
    let mean = next.iter().sum::<f64>() / n;
    let variance = next.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / n;
    // The same figure of the constant Gaussian that fits the held-out values best: n (1/2 + ln sd).
    let constant = n * (0.5 + variance.sqrt().ln());
    assert!(trained < constant - 0.5 * n, "{trained} against {constant}");
}

fn answer(hash: &str) -> Answer {
    Answer { verdict: Verdict::NothingToAdd, effects: vec![], hash: hash.into(), work: Default::default() }
}

#[test]
fn golden_that_changed_is_refused_until_it_is_minted_with_a_reason() {
    let sets = |hash: &str| BTreeMap::from([("drops".to_owned(), answer(hash))]);
    let kept = Answers::keep("the first answers of this recipe".to_owned(), sets("00"));
    assert!(kept.differences(&sets("00")).is_empty());
    let changed = kept.differences(&sets("01"));
    assert!(changed.len() == 1 && changed[0].contains("drops"), "{changed:?}");
    assert_eq!(kept.differences(&BTreeMap::new()), ["drops: kept, and not found"]);
    let minted =
        Answers::keep("sums run in another order, by a digit in the last place".to_owned(), sets("01"));
    let text = serde_json::to_string(&minted).expect("JSON");
    let read: Answers = serde_json::from_str(&text).expect("answers");
    assert!(read.differences(&sets("01")).is_empty());
}

#[test]
#[should_panic(expected = "says why the answers change")]
fn golden_without_a_reason_is_refused() {
    Answers::keep("new".to_owned(), BTreeMap::new());
}
