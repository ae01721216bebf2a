//! Cost of simulating a training set of pushes: 150 samples over 15 cm, in parallel over all threads.
//!
//! The throughput is in pushes, so criterion's `elem/s` are pushes per second. The target is 10,000 pushes
//! with the ellipsoidal surface in 10 s on two cores.

use augsim_physics::push::{Object, Pose, Push, Steps, StraightPush, World, simulate_batch};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

/// Returns the value of a result, or stops the benchmark with its error.
fn ok<R, E: std::fmt::Debug>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e:?}"))
}

/// Paths of `count` pushes as in the MIT design: contact along a side, angle of -60 to 60 degrees.
fn paths(count: usize) -> Vec<StraightPush> {
    let path = |i: usize| {
        let (position, angle) = (i % 11, (i / 11) % 7);
        let x = 0.045 - 0.09 * (0.05 + 0.09 * position as f64);
        let angle = (-60.0 + 20.0 * angle as f64).to_radians();
        StraightPush {
            start_m: [x, 0.04975],
            direction: [angle.sin(), -angle.cos()],
            speed_m_s: 0.02,
            acceleration_m_s2: 0.0,
            travel_m: 0.15,
        }
    };
    (0..count).map(path).collect()
}

fn pushing(c: &mut Criterion) {
    let Some(object) = Object::named("rect1") else { panic!("rect1 is built in") };
    let times: Vec<f64> = (0..150).map(|i| f64::from(i) * 7.5 / 149.0).collect();
    let mut group = c.benchmark_group("pushes of 150 samples");
    group.sample_size(10);
    for (name, kind, count) in [
        ("ellipsoid", None, 10_000),
        ("superellipsoid", Some("superelliptic-surface"), 200),
        ("exact surface", Some("exact-surface"), 200),
        ("patches", Some("speed-dependent-friction"), 50),
    ] {
        let mut world = World::new(object.clone());
        if let Some(kind) = kind {
            ok(world.add_kind(kind).ok_or(kind));
        }
        let parameters = world.nominal();
        let paths = paths(count);
        let pushes: Vec<_> = paths
            .iter()
            .map(|path| Push {
                world: &world,
                parameters: &parameters,
                start: Pose::new(0.0, 0.0, 0.0),
                path,
                field: None,
                steps: Steps::default(),
            })
            .collect();
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(name, |b| {
            b.iter_batched(|| (), |()| ok(simulate_batch(&pushes, |_| &times[..])), BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group!(benches, pushing);
criterion_main!(benches);
