//! Contract: a training run is a function of its settings and data. It gives the same bytes with 1, 2 and 7
//! threads, in another process, and when it is saved, loaded and continued. It does not continue on other
//! data. Trajectories of unequal lengths have the same weight as alone. The runs are short and the networks
//! of full size: 24 trajectories in batches of 20 make a full tile (block of sequences), a tile of 4
//! sequences, and more than one epoch. No hash is stored, because instruction sets round differently.

use augsim_data::random_stream;
use augsim_nn::{Bound, Params, checkpoint};
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_tensor::simd::Level;
use augsim_tensor::{Scalar, Tape, TensorError};
use augsim_tests::random::normals;
use augsim_trainer::nets::{Net, Tile};
use augsim_trainer::{Engine, Losses, Recipe, Sequences, Settings, Training, TrainingState};
use std::process::Command;

const RECIPES: [Recipe; 9] = [
    Recipe::Neural,
    Recipe::Hybrid,
    Recipe::HybridStandardised,
    Recipe::HybridPlus,
    Recipe::FeedForwardResidual,
    Recipe::RecurrentResidual,
    Recipe::MixtureResidual,
    Recipe::Ensemble,
    Recipe::ConditionalVrnn,
];

fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

/// 24 trajectories of the paper's distribution; trajectory `i` has `samples(i)` samples.
///
/// They start in flight, 0.2 s after the release: at rest the initial velocity, 0, would leave the weights
/// that read it without a gradient.
fn data(seed: u64, samples: impl Fn(usize) -> usize) -> Sequences {
    let law = DropDistribution { samples: 120, ..DropDistribution::default() };
    let (dataset, _) = ok(law.generate(24, seed));
    let mut all = ok(Sequences::new(&dataset, &["height_m", "velocity_m_s"]));
    for (i, q) in all.items.iter_mut().enumerate() {
        q.time = samples(i);
        q.states.drain(..2 * 12);
        q.states.truncate(2 * q.time);
    }
    all
}

fn equal() -> Sequences {
    data(1, |_| 60)
}

fn unequal() -> Sequences {
    data(1, |i| 40 + 2 * i)
}

fn settings(recipe: Recipe) -> Settings {
    let engine = Engine::PybulletBall(published_predictor());
    Settings { batch: 20, ..Settings::new(recipe, 100, 7, engine) }
}

/// Runs `steps` more iterations; returns the training state and losses, to be compared bit for bit.
fn advance(training: &mut Training, steps: usize) -> (TrainingState, Vec<Losses>) {
    let losses = (0..steps).map(|_| ok(training.step())).collect();
    (training.state().clone(), losses)
}

fn run(recipe: Recipe, data: &Sequences, steps: usize) -> (TrainingState, Vec<Losses>) {
    advance(&mut ok(Training::new(settings(recipe), data)), steps)
}

/// Training state and losses as bytes, because a comparison of floats would take -0 for 0.
fn bytes((state, losses): &(TrainingState, Vec<Losses>)) -> Vec<u8> {
    let dir = ok(tempfile::tempdir());
    let path = dir.path().join("run");
    ok(std::fs::write(&path, ok(checkpoint::encode(&(state, losses)))));
    ok(std::fs::read(&path))
}

fn on_threads<R: Send>(threads: usize, f: impl FnOnce() -> R + Send) -> R {
    ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build()).install(f)
}

#[test]
fn one_two_and_seven_threads_give_the_same_bytes() {
    for (data, what) in [(equal(), "equal"), (unequal(), "unequal")] {
        for recipe in RECIPES {
            let [one, two, seven] = [1, 2, 7].map(|n| bytes(&on_threads(n, || run(recipe, &data, 6))));
            assert!(one == two && one == seven, "{recipe:?}, {what} lengths: threads change the run");
        }
    }
    // For the test below, which runs this one at forced levels.
    let loss = run(Recipe::Hybrid, &equal(), 6).1[5].loss;
    println!("level and loss: {} {loss}", Level::current().name());
}

/// Repeats the thread test at every SIMD level of this machine; the level is read once per process.
#[test]
fn threads_do_not_change_the_bytes_at_any_forced_level() {
    let mut losses = Vec::new();
    for level in Level::available() {
        let output = Command::new(ok(std::env::current_exe()))
            .args([
                "--exact",
                "training_contract::one_two_and_seven_threads_give_the_same_bytes",
                "--nocapture",
            ])
            .env(augsim_tensor::simd::VARIABLE, level.name())
            .output();
        let output = ok(output);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{level:?}: {text}");
        let line = text.lines().find_map(|l| l.split("level and loss: ").nth(1));
        let (name, loss) =
            line.and_then(|l| l.split_once(' ')).unwrap_or_else(|| panic!("{level:?}: {text}"));
        assert_eq!(name, level.name(), "the variable was not heeded");
        losses.push(ok(loss.parse::<f64>()));
    }
    // Levels round differently, and no more than that: six iterations from the same start.
    for loss in &losses {
        assert!((loss / losses[0] - 1.0).abs() < 1e-4, "losses by level: {losses:?}");
    }
}

#[test]
fn training_moves_every_parameter_and_lowers_the_loss() {
    for recipe in RECIPES {
        let mut training = ok(Training::new(settings(recipe), &equal()));
        let before = training.state().clone();
        let (after, losses) = advance(&mut training, 40);
        let still = before.params.iter().zip(&after.params).filter(|(b, a)| b == a).count();
        assert_eq!(still, 0, "{recipe:?}: {still} of {} parameters never moved", after.params.len());
        let [first, last] = [&losses[..5], &losses[35..]].map(|l| l.iter().map(|l| l.loss).sum::<f64>());
        assert!(last < first, "{recipe:?}: the loss went from {first} to {last}");
        assert_eq!(losses[39].iteration, 40);
        assert!(
            losses.iter().all(|l| (l.loss - l.kl - l.negative_ln_likelihood).abs() < 1e-9 && l.kl >= 0.0)
        );
    }
}

#[test]
fn saving_loading_and_continuing_is_as_if_never_stopped() {
    let dir = ok(tempfile::tempdir());
    let path = dir.path().join("checkpoint.bin");
    let data = unequal();
    for recipe in RECIPES {
        let (whole, losses) = run(recipe, &data, 9);
        // At the first step, within an epoch, and at the last step.
        for k in [0, 4, 9] {
            let (part, mut seen) = run(recipe, &data, k);
            ok(std::fs::write(&path, ok(checkpoint::encode(&part))));
            let state: TrainingState = ok(checkpoint::load(&path));
            assert_eq!(state, part);
            let mut training = ok(Training::resume(state, &data));
            assert_eq!(training.iteration(), k as u64);
            let (state, rest) = advance(&mut training, 9 - k);
            seen.extend(rest);
            assert!(
                bytes(&(state, seen)) == bytes(&(whole.clone(), losses.clone())),
                "{recipe:?}: stopping after {k} iterations changes the run"
            );
        }
    }
}

#[test]
fn a_run_is_not_resumed_on_other_data() {
    let (state, _) = run(Recipe::Hybrid, &equal(), 2);
    let refused = |state: TrainingState, data: &Sequences| {
        Training::resume(state, data).map_or_else(|e| e.to_string(), |_| "accepted".to_owned())
    };
    let foreign = |what: &str| {
        let advice = "use the data and settings of the saved run, or start a new run";
        format!("the checkpoint does not belong to this run: {what}; {advice}")
    };
    let other = foreign("it was trained on other data");
    assert_eq!(refused(state.clone(), &data(2, |_| 60)), other);
    assert_eq!(refused(state.clone(), &data(1, |_| 59)), other);
    let mut touched = equal();
    touched.items[23].states[100] += 1e-12;
    assert_eq!(refused(state.clone(), &touched), other);
    let mut swapped = equal();
    swapped.items.swap(0, 1);
    assert_eq!(refused(state.clone(), &swapped), other);
    let mut renamed = equal();
    renamed.columns[0] = "depth_m".into();
    assert_eq!(refused(state.clone(), &renamed), foreign("its state columns differ from those of the data"));

    let mut cut = state.clone();
    cut.params.truncate(10);
    let text = refused(cut, &equal());
    let n = state.params.len();
    assert_eq!(text, foreign(&format!("its settings give a net of {n} parameters, but it holds 10")));
    assert_eq!(refused(state, &equal()), "accepted");
}

#[test]
fn nothing_to_train_on_and_settings_out_of_range_are_errors() {
    let refused = |settings: Settings, data: &Sequences| {
        Training::new(settings, data).map_or_else(|e| e.to_string(), |_| "accepted".to_owned())
    };
    let empty = Sequences { items: Vec::new(), ..equal() };
    let text = "the training set contains no trajectory; give at least one";
    assert_eq!(refused(settings(Recipe::Neural), &empty), text);
    let none = Settings { batch: 0, ..settings(Recipe::Neural) };
    assert_eq!(refused(none, &equal()), "setting `batch` = 0: must be at least 1");
    let mut rate = settings(Recipe::Neural);
    rate.learning_rate.initial = f64::NAN;
    let text = "setting `learning_rate.initial` = NaN: must be a positive number";
    assert_eq!(refused(rate, &equal()), text);
}

/// A loss that is not finite stops the training, names the iteration and leaves the parameters unchanged.
#[test]
fn divergence_is_reported_and_changes_nothing() {
    let mut settings = settings(Recipe::Hybrid);
    settings.learning_rate.initial = 1e30;
    let mut training = ok(Training::new(settings, &equal()));
    let (error, before) = loop {
        let before = training.state().clone();
        match training.step() {
            Ok(_) => assert!(training.iteration() < 10, "a rate of 1e30 does not diverge"),
            Err(e) => break (e.to_string(), before),
        }
    };
    let start = format!("iteration {}: the loss is ", before.iteration + 1);
    if cfg!(debug_assertions) {
        // The tape is asked first there, and names the operation.
        assert!(error.contains(" produced "), "{error}");
    } else {
        assert!(error.starts_with(&start), "{error}");
        assert!(error.ends_with("; lower the learning rate (now 1e30) or check the data"), "{error}");
    }
    assert!(*training.state() == before);
}

/// Lengths (samples) of the trajectories of one tile (block of sequences).
const LENGTHS: [usize; 4] = [9, 3, 9, 1];

/// How the loss of a tile (block of sequences) is differentiated.
#[derive(Clone, Copy)]
enum Pass {
    /// The whole loss is recorded on one tape and differentiated at once.
    Whole,
    /// The terms of the loss are differentiated one after the other, as in training, with a factor `scale`.
    Terms { scale: f64 },
}

/// Losses `[total, KL, negative log-likelihood]`, summed over sequences, and gradients of `net`.
///
/// Inputs are `[time, width, lane]`, with the lengths [`LENGTHS`] of the chosen `lanes` (sequences); beyond a
/// sequence's end they are `padding`.
fn tile_loss<T: Scalar>(
    net: &Net,
    params: &Params<T>,
    lanes: &[usize],
    padding: f64,
    pass: Pass,
) -> ([f64; 3], Vec<f64>) {
    let time = lanes.iter().map(|&l| LENGTHS[l]).max().unwrap_or(0);
    let (state, condition) = net.extents();
    let (rows, latent) = net.noise_rows(time);
    // What a trajectory holds does not depend on its companions: one stream for each.
    let lay = |purpose: u64, rows: usize, width: usize, padding: Option<f64>| -> Vec<T> {
        let mut out = vec![T::ZERO; rows * width * lanes.len()];
        for (lane, &l) in lanes.iter().enumerate() {
            let values = normals(10 * purpose + l as u64, 9 * width);
            for at in 0..rows * width {
                let beyond = padding.filter(|_| at / width >= LENGTHS[l]);
                out[at * lanes.len() + lane] = T::from_f64(beyond.unwrap_or(values[at]));
            }
        }
        out
    };
    let (x, u) = (lay(1, time, state, Some(padding)), lay(2, time, condition, Some(padding)));
    let eps = lay(3, rows, latent, None);
    let equal = lanes.iter().all(|&l| LENGTHS[l] == time);
    let mask: Vec<T> = (0..time)
        .flat_map(|t| lanes.iter().map(move |&l| if t < LENGTHS[l] { T::ONE } else { T::ZERO }))
        .collect();
    let mask = if equal { &[][..] } else { &mask };
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    let mut grads = vec![T::ZERO; params.values().len()];
    let mut record = || -> Result<[f64; 3], TensorError> {
        params.bind(&mut tape, &mut bound)?;
        let tile = Tile { time, lanes: lanes.len(), x: &x, u: &u, eps: &eps, mask };
        if let Pass::Terms { scale } = pass {
            let loss = net.differentiate(&mut tape, &bound, tile, scale)?;
            params.gather_grads(&tape, &bound, &mut grads);
            let (kl, misfit) = (loss.kl.to_f64(), loss.negative_ln_likelihood.to_f64());
            return Ok([f64::NAN, kl, misfit]);
        }
        let loss = net.loss(&mut tape, &bound, tile)?;
        tape.backward(loss.total)?;
        params.gather_grads(&tape, &bound, &mut grads);
        Ok([loss.total, loss.kl, loss.negative_ln_likelihood].map(|v| tape.value(v)[0].to_f64()))
    };
    let loss = ok(record());
    (loss, grads.into_iter().map(Scalar::to_f64).collect())
}

#[test]
fn unequal_lengths_weigh_as_each_trajectory_alone() {
    for recipe in RECIPES {
        let mut params = Params::<f64>::new(random_stream(3, "init", 0));
        let net = Net::new(&settings(recipe), 2, &mut params);
        let (together, grads) = tile_loss(&net, &params, &[0, 1, 2, 3], 0.0, Pass::Whole);
        let alone: Vec<_> = (0..4).map(|l| tile_loss(&net, &params, &[l], 0.0, Pass::Whole)).collect();
        // Sums of a few hundred terms in another order: 1e-11 of the largest is far above rounding.
        let close = |got: f64, want: f64, what: &str| {
            let tolerance = 1e-11 * together[0].abs().max(1.0);
            assert!((got - want).abs() <= tolerance, "{recipe:?} {what}: {got}, alone {want}");
        };
        for part in 0..3 {
            close(together[part], alone.iter().map(|(loss, _)| loss[part]).sum(), "loss");
        }
        for (i, g) in grads.iter().enumerate() {
            close(*g, alone.iter().map(|(_, grads)| grads[i]).sum(), "gradient");
        }
        // And what stands beyond the end is not read.
        let (padded, padded_grads) = tile_loss(&net, &params, &[0, 1, 2, 3], 3.5, Pass::Whole);
        assert_eq!(padded, together);
        padded_grads.iter().zip(&grads).for_each(|(p, g)| close(*p, *g, "gradient with other padding"));
    }
}

/// Training differentiates the loss term by term and discards each tape; that changes no gradient.
#[test]
fn gradients_term_by_term_are_those_of_the_whole_loss() {
    for recipe in RECIPES {
        let mut params = Params::<f64>::new(random_stream(4, "init", 0));
        let net = Net::new(&settings(recipe), 2, &mut params);
        for lanes in [&[0, 1, 2, 3][..], &[1, 1]] {
            let (loss, grads) = tile_loss(&net, &params, lanes, 0.0, Pass::Whole);
            let (terms, parts) = tile_loss(&net, &params, lanes, 0.0, Pass::Terms { scale: 0.25 });
            let largest = grads.iter().fold(1.0_f64, |m, g| m.max(g.abs()));
            for part in 1..3 {
                assert!((loss[part] - terms[part]).abs() <= 1e-12 * loss[0].abs(), "{recipe:?}: {terms:?}");
            }
            for (i, (whole, part)) in grads.iter().zip(&parts).enumerate() {
                // The same sums in another order.
                assert!((0.25 * whole - part).abs() <= 1e-12 * largest, "{recipe:?} {i}: {part}, {whole}");
            }
        }
    }
}

/// Environment variable: file to which the child of [`another_process_gives_the_same_bytes`] writes its run.
const OUTPUT: &str = "AUGSIM_TEST_RUN_OUTPUT";

#[test]
fn another_process_gives_the_same_bytes() {
    let mine = |path: std::path::PathBuf| {
        let runs: Vec<_> = RECIPES.iter().flat_map(|r| bytes(&run(*r, &unequal(), 5))).collect();
        ok(std::fs::write(path, runs));
    };
    if let Some(path) = std::env::var_os(OUTPUT) {
        return mine(path.into());
    }
    let dir = ok(tempfile::tempdir());
    let paths = ["here", "there", "there again"].map(|name| dir.path().join(name));
    mine(paths[0].clone());
    for (path, threads) in paths[1..].iter().zip(["1", "3"]) {
        let status = Command::new(ok(std::env::current_exe()))
            .args(["--exact", "training_contract::another_process_gives_the_same_bytes"])
            .env(OUTPUT, path)
            .env("RAYON_NUM_THREADS", threads)
            .output();
        let output = ok(status);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    }
    let [here, there, again] = paths.map(|p| ok(std::fs::read(p)));
    assert!(here == there && here == again, "the run depends on the process");
}
