//! Contract: training on pushes of unequal lengths gives the same bytes on any number of threads and after a
//! stop and a restart; padding beyond a push's end has no weight. A forecast of a push depends only on its
//! first pose and the rod's path, and is the same anywhere on the table. The data are 40 pushes of the
//! virtual laboratory, some slow (50 samples), some fast (20), in batches of 20.

use augsim_data::random_stream;
use augsim_nn::{Bound, Params, checkpoint};
use augsim_physics::model::{ModelFile, PushModel};
use augsim_physics::push::Object;
use augsim_physics::push::laboratory::{PushDesign, PushRecipe as Layout, SupportSheet};
use augsim_tensor::{Scalar, Tape};
use augsim_tests::random::normals;
use augsim_trainer::models::{Physics, Still};
use augsim_trainer::nets::{Net, Tile};
use augsim_trainer::push::calibrate::calibrate;
use augsim_trainer::push::{ACTIONS, GpOptions, GpPush, STATES, Subsampling, pushes, windows};
use augsim_trainer::{
    Correction, Engine, Forecaster, NetModel, Recipe, Sequences, Settings, Task, Training, TrainingState,
    evaluate_forecast,
};

const RECIPES: [Recipe; 4] = [Recipe::Neural, Recipe::Hybrid, Recipe::HybridPlus, Recipe::NeuralPlus];

fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

fn declared() -> PushModel {
    let textbook = PushModel::textbook(Object::named("rect1").expect("built in"));
    textbook.with_nominal(|name| (name == "support_friction").then_some(0.14))
}

fn engine_of(model: PushModel) -> Engine {
    ok(Engine::from_model_file(&ModelFile::Push(model), None))
}

fn engine() -> Engine {
    engine_of(declared())
}

fn layout(count: usize) -> Layout {
    let object = Object::named("rect1").expect("built in");
    Layout::new(PushDesign::Mit, &object, SupportSheet::named("abs").expect("known"), count)
}

fn data(count: usize, seed: u64) -> Sequences {
    ok(pushes(&ok(layout(count).generate(seed)).data, Subsampling::default()))
}

fn settings(recipe: Recipe) -> Settings {
    Settings { batch: 20, ..Settings::new(recipe, 100, 7, engine()) }
}

fn run(recipe: Recipe, data: &Sequences, steps: usize) -> TrainingState {
    let mut training = ok(Training::new(settings(recipe), data));
    (0..steps).for_each(|_| {
        ok(training.step());
    });
    training.state().clone()
}

/// Training state as bytes, because a comparison of floats would take -0 for 0.
fn bytes(state: &TrainingState) -> Vec<u8> {
    let dir = ok(tempfile::tempdir());
    let path = dir.path().join("run");
    ok(std::fs::write(&path, ok(checkpoint::encode(state))));
    ok(std::fs::read(&path))
}

#[test]
fn threads_do_not_change_a_run_or_a_forecast() {
    let data = data(40, 1);
    assert!(data.items.iter().any(|q| q.time != data.items[0].time), "lengths must differ");
    for recipe in RECIPES {
        let on = |threads: usize| {
            let pool = ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build());
            pool.install(|| {
                let mut training = ok(Training::new(settings(recipe), &data));
                (0..5).for_each(|_| {
                    ok(training.step());
                });
                let state = ok(training.finish()).clone();
                let score = ok(evaluate_forecast(&ok(NetModel::new(state.clone())), &data));
                (bytes(&state), format!("{score:?}"))
            })
        };
        let one = on(1);
        assert!(one == on(2) && one == on(7), "{recipe:?}: threads change the run");
    }
    let gp = |threads: usize| {
        let pool = ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build());
        pool.install(|| {
            let gp = ok(GpPush::fit(&engine(), &data, GpOptions { steps: 120, seed: 3 }));
            format!("{:?}", ok(evaluate_forecast(&gp, &data)))
        })
    };
    assert_eq!(gp(1), gp(3));
}

#[test]
fn stopping_and_going_on_is_as_if_never_stopped() {
    let data = data(40, 1);
    for recipe in RECIPES {
        let whole = run(recipe, &data, 6);
        for k in [0, 3] {
            let mut training = ok(Training::resume(run(recipe, &data, k), &data));
            (k..6).for_each(|_| {
                ok(training.step());
            });
            assert!(
                bytes(training.state()) == bytes(&whole),
                "{recipe:?}: stopping after {k} changes the run"
            );
        }
    }
    let mut touched = data.clone();
    touched.items[3].actions[0] += 1e-12;
    let refused = Training::resume(run(Recipe::HybridPlus, &data, 1), &touched);
    assert!(
        refused.is_err_and(|e| e.to_string().contains("trained on other data")),
        "other rods are other data"
    );
}

#[test]
fn padding_has_no_weight() {
    const LENGTHS: [usize; 3] = [9, 4, 7];
    for recipe in RECIPES {
        let mut params = Params::<f64>::new(random_stream(3, "init", 0));
        let net = Net::new(&settings(recipe), 3, &mut params);
        let (_, condition) = net.extents();
        let loss = |lanes: &[usize], padding: f64| -> (f64, Vec<f64>) {
            let time = lanes.iter().map(|&l| LENGTHS[l]).max().unwrap_or(0);
            let (rows, latent) = net.noise_rows(time);
            let lay = |purpose: u64, rows: usize, width: usize, padded: bool| -> Vec<f64> {
                let mut out = vec![0.0; rows * width * lanes.len()];
                for (lane, &l) in lanes.iter().enumerate() {
                    let values = normals(10 * purpose + l as u64, 9 * width);
                    for at in 0..rows * width {
                        let beyond = padded && at / width >= LENGTHS[l];
                        out[at * lanes.len() + lane] = if beyond { padding } else { values[at] };
                    }
                }
                out
            };
            let (x, u) = (lay(1, time, 3, true), lay(2, time, condition, true));
            let eps = lay(3, rows, latent, false);
            let seen = |t: usize, l: usize| f64::from(u8::from(t < LENGTHS[l]));
            let mask: Vec<f64> = (0..time).flat_map(|t| lanes.iter().map(move |&l| seen(t, l))).collect();
            let mask = if mask.iter().all(|m| *m == 1.0) { &[][..] } else { &mask };
            let (mut tape, mut bound) = (Tape::new(), Bound::default());
            let mut grads = vec![0.0; params.values().len()];
            ok(params.bind(&mut tape, &mut bound));
            let tile = Tile { time, lanes: lanes.len(), x: &x, u: &u, eps: &eps, mask };
            let loss = ok(net.loss(&mut tape, &bound, tile));
            ok(tape.backward(loss.total));
            params.gather_grads(&tape, &bound, &mut grads);
            (tape.value(loss.total)[0].to_f64(), grads)
        };
        let (together, grads) = loss(&[0, 1, 2], 0.0);
        let alone: Vec<_> = (0..3).map(|l| loss(&[l], 0.0)).collect();
        // Sums of a few hundred terms in another order.
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-11 * together.abs().max(1.0);
        assert!(close(together, alone.iter().map(|a| a.0).sum()), "{recipe:?}: loss");
        for (i, g) in grads.iter().enumerate() {
            assert!(close(*g, alone.iter().map(|a| a.1[i]).sum()), "{recipe:?}: gradient {i}");
        }
        let (padded, padded_grads) = loss(&[0, 1, 2], 3.5);
        assert_eq!(padded, together, "{recipe:?}: what stands beyond the end is read");
        assert!(padded_grads.iter().zip(&grads).all(|(a, b)| close(*a, *b)), "{recipe:?}");
    }
}

fn trained(recipe: Recipe, data: &Sequences, steps: usize) -> NetModel {
    let mut training = ok(Training::new(settings(recipe), data));
    (0..steps).for_each(|_| {
        ok(training.step());
    });
    ok(NetModel::new(ok(training.finish()).clone()))
}

/// Moves all pushes by `by` (m) and turns them by `turn` (rad).
fn moved(data: &Sequences, by: [f64; 2], turn: f64) -> Sequences {
    let (sin, cos) = turn.sin_cos();
    let mut out = data.clone();
    for q in &mut out.items {
        for (rows, angle) in [(&mut q.states, true), (&mut q.actions, false)] {
            for row in rows.chunks_exact_mut(3) {
                let (x, y) = (row[0], row[1]);
                (row[0], row[1]) = (by[0] + cos * x - sin * y, by[1] + sin * x + cos * y);
                if angle {
                    row[2] += turn;
                }
            }
        }
    }
    out
}

#[test]
fn a_forecast_is_the_same_wherever_the_push_happens() {
    let here = data(40, 1);
    let turn = 2.1;
    let there = moved(&here, [-0.4, 0.7], turn);
    let (sin, cos) = f64::sin_cos(turn);
    let gp = ok(GpPush::fit(&engine(), &here, GpOptions { steps: 120, seed: 3 }));
    let nets: Vec<NetModel> = RECIPES.iter().map(|r| trained(*r, &here, 30)).collect();
    let physics = Physics(engine());
    let mut models: Vec<&dyn Forecaster> = vec![&physics, &gp];
    models.extend(nets.iter().map(|n| n as &dyn Forecaster));
    for model in models {
        for (i, (a, b)) in here.items.iter().zip(&there.items).enumerate().take(12) {
            let run = |q: &augsim_trainer::Sequence| {
                let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: i as u64 };
                ok(model.forecast(task, 3))
            };
            let (a, b) = (run(a), run(b));
            for (a, b) in a.values.chunks_exact(3 * a.count).zip(b.values.chunks_exact(3 * b.count)) {
                let n = a.len() / 3;
                for s in 0..n {
                    let (x, y) = (f64::from(a[s]), f64::from(a[n + s]));
                    let (x, y) = (-0.4 + cos * x - sin * y, 0.7 + sin * x + cos * y);
                    // Poses are single precision (3e-8 m at 0.5 m); a standardised input may round the other way, which
                    // a net of unit gain turns into 1e-7 of some centimetres. A step of the rod at the edge of contact
                    // may fall on the other side: less than the engine's own step allows.
                    assert!((x - f64::from(b[s])).abs() < 2e-5, "{}, push {i}: {x} {}", model.name(), b[s]);
                    assert!((y - f64::from(b[n + s])).abs() < 2e-5, "{}, push {i}", model.name());
                    assert!((f64::from(a[2 * n + s]) + turn - f64::from(b[2 * n + s])).abs() < 5e-4);
                }
            }
        }
    }
}

#[test]
fn a_forecast_does_not_see_what_comes_later() {
    let data = data(40, 1);
    for recipe in RECIPES {
        let model = trained(recipe, &data, 10);
        let slow = data.items.iter().max_by_key(|q| q.time).expect("there are some");
        let known = 30;
        let run = |actions: &[f64]| {
            ok(model.forecast(Task { start: slow.state(0), actions, time: slow.time, index: 0 }, 4))
        };
        // The rod turns aside after sample 30: nothing before may change, whatever net or physics.
        let mut aside = slow.actions.clone();
        for (t, row) in aside.chunks_exact_mut(3).enumerate().skip(known) {
            row[0] += 1e-3 * (t - known) as f64;
        }
        let (a, b) = (run(&slow.actions), run(&aside));
        let width = 3 * a.count;
        assert_eq!(a.values[..known * width], b.values[..known * width], "{recipe:?} sees the rod's future");
        assert_ne!(
            a.values[(known + 5) * width..],
            b.values[(known + 5) * width..],
            "{recipe:?} ignores the rod"
        );
    }
}

/// Corrections can also be learned for single steps under actions, for systems whose states are all measured.
#[test]
fn single_steps_are_corrected_under_actions_too() {
    let data = data(12, 1);
    for recipe in [Recipe::Neural, Recipe::Hybrid, Recipe::HybridPlus] {
        let settings = Settings { correction: Correction::Step, ..settings(recipe) };
        let mut training = ok(Training::new(settings, &data));
        (0..3).for_each(|_| {
            ok(training.step());
        });
        let net = ok(NetModel::new(ok(training.finish()).clone()));
        let q = &data.items[0];
        let run = |actions: &[f64]| {
            ok(net.forecast(Task { start: q.state(0), actions, time: q.time, index: 0 }, 2))
        };
        let mut aside = q.actions.clone();
        aside.chunks_exact_mut(3).for_each(|row| row[0] += 0.02);
        assert_eq!(run(&q.actions) == run(&aside), recipe == Recipe::Neural, "{recipe:?} and the rod's path");
        assert_eq!(ok(net.reconstruct(q, 0, 2)).values.len(), 3 * q.time * 2);
    }
}

#[test]
fn the_hybrid_forecasts_better_than_its_physics_and_the_gp_better_than_rest() {
    let all = data(360, 2);
    let train = Sequences { items: all.items[..300].to_vec(), ..all.clone() };
    let test = Sequences { items: all.items[300..].to_vec(), ..all.clone() };
    let score = |model: &dyn Forecaster| ok(evaluate_forecast(model, &test)).mean;
    let mut training = ok(Training::new(Settings::new(Recipe::HybridPlus, 400, 1, engine()), &train));
    (0..400).for_each(|_| {
        ok(training.step());
    });
    let hybrid = score(&ok(NetModel::new(ok(training.finish()).clone())));
    let physics = score(&Physics(engine()));
    // Measured: about half of the physics' errors.
    assert!(
        hybrid.absolute.iter().zip(&physics.absolute).all(|(h, p)| *h < 0.75 * p),
        "{hybrid:?} {physics:?}"
    );
    let gp = score(&ok(GpPush::fit(&engine(), &train, GpOptions { steps: 200, seed: 1 })));
    let still = score(&Still);
    assert!(gp.absolute[0] < 0.5 * still.absolute[0], "{gp:?} {still:?}");
}

#[test]
fn calibration_finds_the_parameters_that_made_the_pushes() {
    let truth = [("c_m", 0.031), ("contact_friction", 0.19), ("rod_radius_m", 0.0045)];
    let made = declared().with_nominal(|name| truth.iter().find(|(n, _)| *n == name).map(|(_, v)| *v));
    let made = engine_of(made);
    let mut data = data(40, 3);
    for q in &mut data.items {
        q.states = made.rollout(&q.states[..3], &q.actions, q.time);
    }
    let fit = ok(calibrate(&declared(), &data));
    for (e, (name, truth)) in fit.estimates.iter().zip(truth) {
        assert_eq!(e.name, name);
        assert!((e.value / truth - 1.0).abs() < 0.01, "{e:?}, truth {truth}");
        assert!(e.ci95[0] <= e.value && e.value <= e.ci95[1]);
    }
}

#[test]
fn windows_and_thinning_keep_measured_samples() {
    let whole = ok(Sequences::with_actions(&ok(layout(40).generate(1)).data, &STATES, &ACTIONS));
    let thin = data(40, 1);
    for (a, b) in whole.items.iter().zip(&thin.items) {
        assert!(b.time <= 50 && b.time >= 10, "{}: {} samples", b.id, b.time);
        let stride = (a.time - 1) / (b.time - 1).max(1);
        assert_eq!(a.state(0), b.state(0));
        let again = (1..=stride).find(|&k| a.action(k) == b.action(1));
        let k = again.expect("the second sample is a measured one");
        assert!((0..b.time).all(|t| a.state(k * t) == b.state(t) && a.action(k * t) == b.action(t)));
        assert!(b.action(1)[2] - b.action(0)[2] >= 0.02 - 1e-9, "more than 50 samples a second");
    }
    let cut = windows(&whole, 26, 13);
    assert!(cut.items.iter().all(|q| q.time == 26 && q.states.len() == 78));
    assert_eq!(cut.items[1].state(0), whole.items[0].state(13));
}

#[test]
fn unfit_data_and_settings_are_refused() {
    let refused = |r: Result<Training, augsim_trainer::TrainerError>| {
        r.map_or_else(|e| e.to_string(), |_| "accepted".into())
    };
    let pushes = data(3, 1);
    let mut blind = pushes.clone();
    blind.action_columns.clear();
    let text = refused(Training::new(settings(Recipe::Hybrid), &blind));
    assert!(
        text.contains("the engine has the actions pusher_x_m, pusher_y_m, t_s, but the data have "),
        "{text}"
    );
    let ball = Engine::PybulletBall(augsim_physics::ball::drop_distribution::published_predictor());
    let text =
        refused(Training::new(Settings { engine: ball.clone(), ..settings(Recipe::NeuralPlus) }, &pushes));
    let rule = "needs an engine of an object pushed by a rod; use `step` for other engines";
    assert_eq!(text, format!("setting `correction` = rollout: {rule}"));
    let steps = Settings { correction: Correction::Step, ..settings(Recipe::NeuralPlus) };
    let text = refused(Training::new(steps, &pushes));
    assert_eq!(text, "setting `recipe` = Neural+: is for pushing only");
    let few = GpPush::fit(&engine(), &data(1, 1), GpOptions { steps: 100, seed: 0 });
    assert!(few.is_err_and(|e| e.to_string().contains("at least 20 steps of 5 mm")));
    let none = Sequences { items: Vec::new(), ..pushes.clone() };
    assert!(calibrate(&declared(), &none).is_err());
    assert!(evaluate_forecast(&Still, &none).is_err());
    let untrained = ok(NetModel::new(run(Recipe::HybridPlus, &pushes, 1)));
    let q = &pushes.items[0];
    let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: 0 };
    assert!(untrained.forecast(task, 2).is_err_and(|e| e.to_string().contains("training has not ended")));
    assert!(GpPush::fit(&ball, &pushes, GpOptions { steps: 100, seed: 0 }).is_err());
    assert!(untrained.with_engine(ball).is_err());
    let net = trained(Recipe::HybridPlus, &pushes, 1);
    let drop = Task { start: &[4.5, 0.0], actions: &[], time: 5, index: 0 };
    assert!(net.forecast(drop, 2).is_err_and(|e| e.to_string().contains("pusher_x_m")), "a drop is no push");
    assert!(net.reconstruct(q, 0, 2).is_err_and(|e| e.to_string().contains("only forecast")));
}
