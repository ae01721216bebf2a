//! Contract: forecasters get the first state and their index in the set, and nothing else. The simple ones
//! behave as defined on data with a known distribution: the error of `Zero` is the size of the state, physics
//! with the data's own parameters is exact, and exact samples of the distribution are calibrated. The median
//! of such samples is better than a single one, and no forecast has a smaller mean error.

use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::models::{ExactDistribution, NetModel, Physics, Zero};
use augsim_trainer::score::{Score, Scoring, score};
use augsim_trainer::{
    Engine, Forecaster, Recipe, SAMPLES, Samples, Sequences, Settings, Task, Training, evaluate_forecast,
    evaluate_reconstruction,
};

const COLUMNS: [&str; 2] = ["height_m", "velocity_m_s"];

fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

fn law() -> DropDistribution {
    DropDistribution { samples: 150, ..DropDistribution::default() }
}

fn data(law: &DropDistribution, trajectories: usize, seed: u64) -> Sequences {
    ok(Sequences::new(&ok(law.generate(trajectories, seed)).0, &COLUMNS))
}

/// Networks of four recipes (model classes), each trained for a few iterations.
fn nets(train: &Sequences) -> Vec<NetModel> {
    let engine = Engine::PybulletBall(published_predictor());
    [Recipe::Neural, Recipe::Hybrid, Recipe::HybridStandardised, Recipe::HybridPlus]
        .map(|recipe| {
            let mut training = ok(Training::new(Settings::new(recipe, 20, 1, engine.clone()), train));
            (0..20).for_each(|_| {
                ok(training.step());
            });
            ok(NetModel::new(ok(training.finish()).clone()))
        })
        .into()
}

fn trajectory(samples: &Samples, sample: usize) -> Vec<f64> {
    samples.values[sample..].iter().step_by(samples.count).map(|v| f64::from(*v)).collect()
}

#[test]
fn zero_errs_by_the_size_of_the_state() {
    let test = data(&law(), 7, 1);
    let got = ok(evaluate_forecast(&Zero, &test));
    for column in 0..2 {
        let sizes: Vec<f64> = test
            .items
            .iter()
            .map(|q| q.states.iter().skip(column).step_by(2).map(|v| v.abs()).sum::<f64>() / q.time as f64)
            .collect();
        let want = sizes.iter().sum::<f64>() / 7.0;
        for error in [got.mean_of_10.absolute[column], got.median.absolute[column], got.crps[column]] {
            assert!((error - want).abs() <= 1e-12 * want, "column {column}: {error}, mean size {want}");
        }
    }
    assert!((got.mean_of_10.trans_percent - 100.0).abs() < 1e-9);
    assert_eq!((got.coverage50, got.coverage90, got.trajectories), (None, None, 7));
}

#[test]
fn physics_with_the_parameters_of_the_data_is_exact_and_others_are_not() {
    let fixed = DropDistribution { restitution_sd: 0.0, ..law() };
    let test = data(&fixed, 5, 2);
    let ball = BulletBall { restitution: fixed.restitution_mean, ..fixed.ball };
    let exact = Physics(Engine::PybulletBall(ball));
    for q in &test.items {
        let got =
            ok(exact.forecast(Task { start: q.state(0), actions: &[], time: q.time, index: 0 }, SAMPLES));
        assert_eq!(got.count, 1);
        // Forecasts are single precision; the data are at most 10 in size: half a unit in the last place.
        for (g, want) in got.values.iter().zip(&q.states) {
            assert_eq!(*g, *want as f32);
        }
    }
    let other = ok(evaluate_forecast(&Physics(Engine::PybulletBall(published_predictor())), &test));
    assert!(
        other.mean_of_10.absolute[0] > 0.05,
        "restitution 0.65 instead of 0.5 errs by {}",
        other.mean_of_10.absolute[0]
    );
}

#[test]
fn the_exact_law_is_calibrated_and_its_median_beats_a_single_sample() {
    let law = law();
    let test = data(&law, 150, 3);
    let exact = ExactDistribution { law, seed: 4 };
    let got = ok(evaluate_forecast(&exact, &test));
    // Mean over trajectories of a single sample's absolute error.
    let singles: Vec<Score> = test
        .items
        .iter()
        .enumerate()
        .map(|(i, q)| {
            score(
                &ok(exact
                    .forecast(Task { start: q.state(0), actions: &[], time: q.time, index: i as u64 }, 1)),
                &q.states,
                &Scoring::for_columns(&test),
            )
        })
        .collect();
    for column in 0..2 {
        let single = singles.iter().map(|s| s.mean_of_10.absolute[column]).sum::<f64>() / 150.0;
        let (median, mean, crps) =
            (got.median.absolute[column], got.mean_of_10.absolute[column], got.crps[column]);
        // For any law E|X - X'| >= min over a of E|X - a|, which the median reaches; the restitution
        // spreads the samples so widely that the gap is far above the error of 150 trajectories.
        assert!(median < 0.9 * single, "column {column}: median {median}, single sample {single}");
        assert!(mean < 0.95 * single, "column {column}: mean of ten {mean}, single sample {single}");
        assert!(crps < median, "column {column}: CRPS {crps}, median {median}");
    }
    // Until the first impact every sample is the truth; from then on a band of level p covers the share p.
    // Whole trajectories are covered or not together, and six tenths of the samples lie after the impact:
    // the standard error of 150 trajectories is at most 0.6 sqrt(p (1 - p) / 150), four of them 0.1 and 0.06.
    let flights: f64 = test
        .items
        .iter()
        .map(|q| q.states.chunks_exact(2).take_while(|s| s[1] <= 0.0).count() as f64 / q.time as f64)
        .sum();
    let flight = flights / 150.0;
    for (got, level, tolerance) in [(got.coverage50, 0.5, 0.1), (got.coverage90, 0.9, 0.06)] {
        let (share, want) = (got.unwrap_or(f64::NAN), flight + (1.0 - flight) * level);
        assert!((share - want).abs() < tolerance, "{level}: {share} are covered, should be {want}");
    }

    let physics = ok(evaluate_forecast(&Physics(Engine::PybulletBall(published_predictor())), &test));
    for column in 0..2 {
        assert!(got.median.absolute[column] < physics.median.absolute[column]);
        assert!(got.crps[column] < physics.crps[column]);
    }
}

#[test]
fn a_forecast_depends_on_the_first_state_and_the_index_alone() {
    let train = data(&DropDistribution { samples: 50, ..law() }, 16, 5);
    let nets = nets(&train);
    let engine = Engine::PybulletBall(published_predictor());
    let (exact, physics) = (ExactDistribution { law: law(), seed: 4 }, Physics(engine));
    let mut models: Vec<&dyn Forecaster> = vec![&Zero, &physics, &exact];
    models.extend(nets.iter().map(|n| n as &dyn Forecaster));
    for model in models {
        let name = model.name();
        // 90 steps are 1.5 s: the first impact comes after 0.96 s, and before it nothing is random.
        let task = Task { start: &[4.5, 0.0], actions: &[], time: 90, index: 3 };
        let got = ok(model.forecast(task, 12));
        assert_eq!(got.count, if model.is_deterministic() { 1 } else { 12 }, "{name}");
        assert_eq!(got.values.len(), 90 * 2 * got.count, "{name}");
        assert!(got.values.iter().all(|v| v.is_finite()), "{name}");
        assert_eq!(ok(model.forecast(task, 12)), got, "{name} gives other forecasts when asked again");
        let elsewhere = ok(model.forecast(Task { index: 4, ..task }, 12));
        assert_eq!(elsewhere == got, model.is_deterministic(), "{name}: index");
        let higher = ok(model.forecast(Task { start: &[4.9, 0.0], ..task }, 12));
        assert_eq!(higher == got, name == "Zero", "{name}: start");
        if !model.is_deterministic() {
            assert_ne!(trajectory(&got, 0), trajectory(&got, 1), "{name} draws the same twice");
        }
    }
}

/// Evaluates forecasts on trajectories whose future was changed.
///
/// The forecast must stay the same, so its error against the changed truth is known from the unchanged run.
#[test]
fn changing_the_future_changes_no_forecast_but_every_reconstruction() {
    let train = data(&DropDistribution { samples: 50, ..law() }, 16, 6);
    let test = Sequences { items: train.items[..2].to_vec(), ..train.clone() };
    let mut changed = test.clone();
    for q in &mut changed.items {
        q.states[2..].iter_mut().for_each(|v| *v = 0.5 * *v + 0.1);
    }
    for model in nets(&train) {
        let forecast = ok(evaluate_forecast(&model, &changed));
        let by_hand: f64 = test
            .items
            .iter()
            .zip(&changed.items)
            .enumerate()
            .map(|(i, (old, new))| {
                let task = Task { start: old.state(0), actions: &[], time: old.time, index: i as u64 };
                score(&ok(model.forecast(task, SAMPLES)), &new.states, &Scoring::for_columns(&changed)).crps
                    [0]
            })
            .sum::<f64>()
            / 2.0;
        assert_eq!(forecast.crps[0], by_hand, "{}", model.name());
        let [old, new] = [&test, &changed].map(|set| ok(model.reconstruct(&set.items[0], 0, 5)));
        assert_ne!(old, new, "{}: the encoder does not see the trajectory", model.name());
        let rows = ok(evaluate_reconstruction(&model, &test));
        assert_eq!(rows.trajectories, 2);
    }
}
