//! Cost of a running particle filter on one thread.
//!
//! - One row processed by 100 particles: mean over the first 65 rows of a drop, including the impact and the
//!   particle moves (target 0.5 ms).
//! - 100 sampled forecasts of the remaining 335 rows (target 50 ms).

use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::filter::{Filter, InitialStatePrior, NetTransition, Sensor};
use augsim_trainer::{Engine, NetModel, Recipe, Sequences, Settings, Training};
use criterion::{Criterion, criterion_group, criterion_main};
use std::time::{Duration, Instant};

/// Number of rows that the filter processes before it forecasts.
const OBSERVED_ROWS: usize = 65;

/// Returns the value of a result, or stops the benchmark with its error.
fn ok<R, E: std::fmt::Debug>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e:?}"))
}

fn filtering(c: &mut Criterion) {
    let drops = |trajectories, seed| {
        let (data, _) = ok(DropDistribution::default().generate(trajectories, seed));
        ok(Sequences::new(&data, &["height_m", "velocity_m_s"]))
    };
    let (train, test) = (drops(40, 1), drops(1, 2));
    // Trained long enough to depend on the latent variables, because the number of particle moves depends on
    // that.
    let settings = Settings::new(Recipe::HybridPlus, 400, 1, Engine::PybulletBall(published_predictor()));
    let mut training = ok(Training::new(settings, &train));
    for _ in 0..400 {
        ok(training.step());
    }
    let model = ok(NetModel::new(ok(training.finish()).clone()));
    let filter = || {
        let sensor = ok(Sensor::new(vec![Some(0.002), None]));
        let law = Box::new(ok(NetTransition::new(&model)));
        Filter::new(law, (sensor, InitialStatePrior::from_training_set(&train)), (&[], 0), 100, (1, 0))
    };
    let observe = |filter: &mut Filter<'_>| {
        (0..OBSERVED_ROWS).for_each(|t| ok(filter.observe(test.items[0].state(t))));
    };
    let mut group = c.benchmark_group("filter");
    group.sample_size(10);
    group.bench_function("one row, 100 particles", |b| {
        b.iter_custom(|times| {
            let mut spent = Duration::ZERO;
            for _ in 0..times {
                let mut filter = filter();
                let started = Instant::now();
                observe(&mut filter);
                spent += started.elapsed();
            }
            spent / OBSERVED_ROWS as u32
        });
    });
    let mut observed = filter();
    observe(&mut observed);
    group.bench_function("100 draws behind 65 rows", |b| {
        b.iter(|| ok(observed.forecast(400 - OBSERVED_ROWS, 100)).count);
    });
    group.finish();
}

criterion_group!(benches, filtering);
criterion_main!(benches);
