//! Time of one training iteration and of one forecast for the ball.
//!
//! The iteration has a batch of 100 and 400 samples, on one thread and on all; the forecast draws 100 samples
//! for one trajectory. The data have the distribution of the paper.
//!
//! The throughput of an iteration of the paper's nets is in floating-point operations (products only), so
//! criterion's `Gelem/s` are GFLOP/s. Elsewhere it is in trajectory samples.

use augsim_benches::flops::{BALL, Extents};
use augsim_benches::ok;
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::{Engine, Forecaster, NetModel, Recipe, SAMPLES, Sequences, Settings, Task, Training};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rayon::ThreadPoolBuilder;
use std::hint::black_box;

fn data() -> Sequences {
    ok(Sequences::new(&ok(DropDistribution::default().generate(200, 1)).0, &["height_m", "velocity_m_s"]))
}

fn training(recipe: Recipe, data: &Sequences) -> Training {
    let settings = Settings::new(recipe, 10_000, 1, Engine::PybulletBall(published_predictor()));
    ok(Training::new(settings, data))
}

fn iteration(c: &mut Criterion) {
    let data = data();
    let all_threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut group = c.benchmark_group("iteration");
    group.sample_size(20);
    for recipe in [Recipe::Neural, Recipe::Hybrid, Recipe::HybridPlus] {
        let mut threads = vec![1, all_threads];
        threads.dedup();
        for threads in threads {
            let mut training = training(recipe, &data);
            let samples = training.settings().batch as u64 * 400;
            let work = match recipe {
                Recipe::Neural => Extents { condition: 2, ..BALL }.training(100, 400) as u64,
                Recipe::Hybrid => BALL.training(100, 400) as u64,
                _ => samples,
            };
            group.throughput(Throughput::Elements(work));
            let pool = ok(ThreadPoolBuilder::new().num_threads(threads).build());
            group.bench_function(format!("{}, {threads} threads", recipe.label()), |b| {
                pool.install(|| {
                    b.iter(|| {
                        ok(training.step());
                    });
                });
            });
        }
    }
    group.finish();
}

fn forecast(c: &mut Criterion) {
    let data = data();
    let mut group = c.benchmark_group("forecast of 100 samples");
    group.sample_size(20);
    group.throughput(Throughput::Elements(SAMPLES as u64 * 400));
    let task = Task { start: &[4.5, 0.0], actions: &[], time: 400, index: 0 };
    for recipe in [Recipe::Hybrid, Recipe::HybridPlus] {
        let model = ok(NetModel::new(ok(training(recipe, &data).finish()).clone()));
        group.bench_function(recipe.label(), |b| b.iter(|| ok(model.forecast(black_box(task), SAMPLES))));
    }
    group.finish();
}

criterion_group!(benches, iteration, forecast);
criterion_main!(benches);
