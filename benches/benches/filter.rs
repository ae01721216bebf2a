//! Cost of a filter under way: one row taken in by 100 particles (mean over the rows of a drop, impact and moves included), and
//! 100 draws of what comes behind 65 rows of 400.
//!
//! Targets, one thread: 0.5 ms for a row, 50 ms for the draws.

use augsim_physics::ball::paper_law::{PaperLaw, paper_engine};
use augsim_trainer::filter::{Filter, NetLaw, Sensor, StartLaw};
use augsim_trainer::{Engine, NetModel, Recipe, Sequences, Settings, Training};
use criterion::{Criterion, criterion_group, criterion_main};
use std::time::{Duration, Instant};

const SEEN: usize = 65;

fn ok<R, E: std::fmt::Debug>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e:?}"))
}

fn filtering(c: &mut Criterion) {
    let drops = |trajectories, seed| {
        let (data, _) = ok(PaperLaw::default().generate(trajectories, seed));
        ok(Sequences::new(&data, &["height_m", "velocity_m_s"]))
    };
    let (train, test) = (drops(40, 1), drops(1, 2));
    // Long enough to depend on its latent: how many moves are needed hangs on that.
    let settings = Settings::new(Recipe::HybridPlus, 400, 1, Engine::PybulletBall(paper_engine()));
    let mut training = ok(Training::new(settings, &train));
    for _ in 0..400 {
        ok(training.step());
    }
    let model = ok(NetModel::new(ok(training.finish()).clone()));
    let filter = || {
        let sensor = ok(Sensor::new(vec![Some(0.002), None]));
        let law = Box::new(ok(NetLaw::new(&model)));
        Filter::new(law, (sensor, StartLaw::of(&train)), (&[], 0), 100, (1, 0))
    };
    let observe = |filter: &mut Filter<'_>| {
        (0..SEEN).for_each(|t| ok(filter.observe(test.items[0].state(t))));
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
            spent / SEEN as u32
        });
    });
    let mut seen = filter();
    observe(&mut seen);
    group.bench_function("100 draws behind 65 rows", |b| {
        b.iter(|| ok(seen.forecast(400 - SEEN, 100)).count);
    });
    group.finish();
}

criterion_group!(benches, filtering);
criterion_main!(benches);
