//! Cost of right-hand sides of an equation system, batched in SIMD lanes on one thread.
//!
//! The system is an oscillator with five effects: ten operations and a tanh, or without the tanh; without
//! sensitivities and with nine. The throughput is in right-hand sides, four per Runge-Kutta step.

use augsim_equations::System;
use augsim_equations::engine::{Method, Options, Record, Seed, Signal, Window};
use augsim_equations::model::{self, Hold};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

const OSCILLATOR: &str = r#"
scenario = "system"
[inputs]
drive = { hold = "linear" }
[states]
x = { start = "y" }
v = { start = 0 }
[parameters]
stiffness = 1.8e5
cubic = 2e5
damping = 20.0
offset = 1.0
friction = 0.5
gain = 1.6e5
square = 1.0
width = { nominal = 0.05, frozen = true }
[rates]
x = "v"
v = "gain * drive - stiffness * x - cubic * x^3 - damping * v - offset - friction * tanh(v / width) - square * x^2"
[outputs]
y = { value = "x", sd = 0.001 }
"#;

/// Number of samples in each window.
const SAMPLES: usize = 1000;
/// Number of windows that are simulated together in SIMD lanes.
const WINDOWS: usize = 64;

fn right_hand_sides(criterion: &mut Criterion) {
    let smooth = OSCILLATOR.replace("tanh(v / width)", "abs(v)");
    let compiled = |text: &str| {
        let model = model::parse(text, "oscillator.toml").expect("a model");
        let system = System::compile(&model, &[0, 1, 2, 3, 4, 5, 6]).expect("a system");
        (model, system)
    };
    let (model, system) = compiled(OSCILLATOR);
    let (_, without_tanh) = compiled(&smooth);
    let times: Vec<f64> = (0..SAMPLES).map(|i| i as f64 / 610.0).collect();
    let drive: Vec<f64> = times.iter().map(|t| 0.05 * (300.0 * t).sin()).collect();
    let inputs = vec![Signal::new(&times, &drive, Hold::Linear)];
    let record = Record::new("oscillator", times, inputs).expect("rising times");
    let parameters = model.nominals();
    let window =
        Window { record: &record, first: 0, last: SAMPLES - 1, start: &[0.0, 0.0], parameters: &parameters };
    let windows = vec![window; WINDOWS];
    let nine: Vec<Seed> = (0..7).map(Seed::Parameter).chain([Seed::Start(0), Seed::Start(1)]).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut group = criterion.benchmark_group("written");
    let substeps = 4;
    group.throughput(Throughput::Elements((WINDOWS * (SAMPLES - 1) * 4 * substeps) as u64));
    let options = Options { method: Method::RungeKutta, substeps };
    for (name, system, seeds) in [
        ("values", &system, &[][..]),
        ("values-without-tanh", &without_tanh, &[][..]),
        ("nine-sensitivities", &system, &nine[..]),
        ("nine-sensitivities-without-tanh", &without_tanh, &nine[..]),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| pool.install(|| black_box(system.simulate(&windows, seeds, &options))));
        });
    }
    group.finish();
}

criterion_group!(benches, right_hand_sides);
criterion_main!(benches);
