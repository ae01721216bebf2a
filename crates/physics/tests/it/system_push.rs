//! Contract: through the trait a push gives bit for bit what its engine gives, values and derivatives, with the steps that
//! fits take; more seeds than one simulation carries come in blocks of the same bytes; what the engine refuses, the trait
//! refuses in the engine's words. Windows that do not begin a record are under way.

use augsim_physics::Dual;
use augsim_physics::model::PushModel;
use augsim_physics::push::{Pose, Push, Pushing, Recorded, Steps, effects, simulate_poses};
use augsim_physics::system::{Law, Offsets, Record, Seed, Simulated, Stream, System, Task};

const TEXT: &str = "scenario = \"push\"\nobject = \"rect1\"\n[[effect]]\nkind = \"frame-registration\"\nscale = 0.004\nangle_rad = 0.01\ndx_m = 1e-4\ndy_m = -2e-4\n";

/// The steps of fits, as the loop has taken them so far.
const STEPS: Steps = Steps { travel_m: 2e-3, duration_s: f64::INFINITY, inertial_s: 2e-3 };

fn system() -> (Pushing, PushModel) {
    let model = PushModel::parse(TEXT, "push.toml").expect("a model");
    (model.open(), model)
}

/// A rod that pushes a side of `rect1` off its middle for 6 cm, sampled on another clock than the pose.
fn record() -> Record {
    let rod: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    let x: Vec<f64> = rod.iter().map(|t| -0.0505 - 0.0003 + 0.0155 * t).collect();
    let y: Vec<f64> = rod.iter().map(|t| 0.012 + 0.002 * t).collect();
    Record {
        times: (0..60).map(|k| 0.06 * f64::from(k) + 0.01).collect(),
        inputs: [Stream { times: rod, values: vec![x, y] }].into(),
        ..Record::default()
    }
}

#[test]
fn a_window_through_the_trait_is_that_of_the_engine() {
    let (base, model) = system();
    let inside = |kind: &str| effects::index_of(kind).expect("in the library");
    let system = base.augmented(&[Law::Effect(inside("table-anisotropy"))]).expect("in the library");
    let (mut world, mut values) = model.world();
    world.add(inside("table-anisotropy")).expect("in the library");
    values.extend([1.2, 0.4]);
    let record = record();
    // Eleven parameters and three states of the start: as many lanes as the loop's widest dual number has had.
    let mut seeds: Vec<Seed> = (0..values.len()).map(Seed::Parameter).collect();
    seeds.extend((0..3).map(Seed::Start));
    assert_eq!(seeds.len(), 14);
    let lane = Dual::<14>::variable;
    let duals: Vec<Dual<14>> = values.iter().enumerate().map(|(i, v)| lane(*v, i)).collect();
    let rod = &record.inputs[0];
    let path = Recorded::new(&rod.times, &rod.values[0], &rod.values[1]).expect("well formed");
    for (window, start) in [(0..60, [0.0, 0.0, 0.0]), (20..45, [0.012, 0.002, 0.01])] {
        let task = Task {
            parameters: &values,
            record: &record,
            window: window.clone(),
            start: &start,
            offsets: Offsets::None,
            seeds: &seeds,
        };
        let mut out = Simulated::default();
        system.simulate(&task, &mut out).expect("it moves");
        let start = Pose::new(lane(start[0], 11), lane(start[1], 12), lane(start[2], 13));
        let push = Push { world: &world, parameters: &duals, start, path: &path, field: None, steps: STEPS };
        let mut poses = Vec::new();
        simulate_poses(&push, &record.times[window.clone()], window.start > 0, &mut poses).expect("it moves");
        assert!(poses[poses.len() - 1].position[0].value > 0.02, "the object is pushed");
        for (k, pose) in poses.iter().enumerate() {
            for (c, x) in [pose.position[0], pose.position[1], pose.angle].into_iter().enumerate() {
                assert_eq!(out.value(k, c).to_bits(), x.value.to_bits(), "sample {k}, channel {c}");
                for (i, slope) in out.slopes(k, c).iter().take(14).enumerate() {
                    assert_eq!(slope.to_bits(), x.d[i].to_bits(), "sample {k}, channel {c}, lane {i}");
                }
            }
        }
    }
}

#[test]
fn more_seeds_than_one_simulation_carries_come_in_blocks() {
    // Five base parameters, four of the frames, pose-offset with three, tip-offset with two, table-tilt with two, and the
    // start: 19 derivatives. The loop panicked at 15.
    let (base, _) = system();
    let laws = ["pose-offset", "tip-offset", "table-tilt"]
        .map(|kind| Law::Effect(base.library().iter().position(|e| e.kind == kind).expect("in the library")));
    let system = base.augmented(&laws).expect("in the library");
    let values: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let mut seeds: Vec<Seed> = (0..values.len()).map(Seed::Parameter).collect();
    seeds.extend((0..3).map(Seed::Start));
    assert!(seeds.len() > 16, "{}", seeds.len());
    let record = record();
    let simulated = |seeds| {
        let task = Task {
            parameters: &values,
            record: &record,
            window: 0..60,
            start: &[0.0; 3],
            offsets: Offsets::None,
            seeds,
        };
        let mut out = Simulated::default();
        system.simulate(&task, &mut out).expect("it moves");
        out
    };
    let wide = simulated(&seeds);
    for (first, chunk) in seeds.chunks(5).enumerate() {
        let narrow = simulated(chunk);
        for k in 0..60 {
            for c in 0..3 {
                assert_eq!(narrow.value(k, c).to_bits(), wide.value(k, c).to_bits());
                let slopes = &wide.slopes(k, c)[5 * first..];
                for (i, (a, b)) in narrow.slopes(k, c).iter().zip(slopes).take(chunk.len()).enumerate() {
                    assert_eq!(a.to_bits(), b.to_bits(), "sample {k}, channel {c}, lane {}", 5 * first + i);
                }
            }
        }
    }
}

#[test]
fn a_rod_inside_the_object_is_refused_in_the_words_of_the_engine() {
    let (system, _) = system();
    let values: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let record = record();
    let task = Task {
        parameters: &values,
        record: &record,
        window: 0..60,
        start: &[-0.04, 0.0, 0.0],
        offsets: Offsets::None,
        seeds: &[],
    };
    let error = system.simulate(&task, &mut Simulated::default()).expect_err("refused").to_string();
    assert!(error.contains("inside rect1") && error.contains("check the outline"), "{error}");
}
