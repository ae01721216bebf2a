//! Contract: pushing behind the `System` trait is bit-identical to its engine.
//!
//! - Values and derivatives are those of the engine with the sub-steps of fits.
//! - More seeds than one simulation has lanes are computed in blocks with the same bytes.
//! - Errors of the engine are returned with its message.
//! - Windows that do not begin a record start with the push in progress.

use augsim_physics::Dual;
use augsim_physics::model::PushModel;
use augsim_physics::push::{Pose, Push, Pushing, Recorded, Steps, effects, simulate_poses};
use augsim_system::{Augment, ModelTerm, Offsets, Record, Seed, Simulate, Simulated, Stream, Task};

const TEXT: &str = "scenario = \"push\"\nobject = \"rect1\"\n[[effect]]\nkind = \"frame-registration\"\nscale = 0.004\nangle_rad = 0.01\ndx_m = 1e-4\ndy_m = -2e-4\n";

/// Bounds on the sub-steps in fits, as in `push/system.rs`.
const STEPS: Steps = Steps { travel_m: 2e-3, duration_s: f64::INFINITY, inertial_s: 2e-3 };

fn system() -> (Pushing, PushModel) {
    let model = PushModel::parse(TEXT, "push.toml").expect("a model");
    (model.open(), model)
}

/// Record of a rod that pushes one side of `rect1` off-centre for 6 cm.
///
/// Rod and pose are sampled at different times.
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
fn a_window_through_the_trait_equals_that_of_the_engine() {
    let (base, model) = system();
    let effect_index = |kind: &str| effects::index_of(kind).expect("in the library");
    let system =
        base.augmented(&[ModelTerm::Effect(effect_index("table-anisotropy"))]).expect("in the library");
    let (mut world, mut values) = model.world();
    world.add(effect_index("table-anisotropy")).expect("in the library");
    values.extend([1.2, 0.4]);
    let record = record();
    // Eleven parameters and three start states need 14 of the 16 lanes, so one simulation carries them all.
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
        system.simulate(&task, &mut out).expect("simulated");
        let start = Pose::new(lane(start[0], 11), lane(start[1], 12), lane(start[2], 13));
        let push = Push { world: &world, parameters: &duals, start, path: &path, field: None, steps: STEPS };
        let mut poses = Vec::new();
        simulate_poses(&push, &record.times[window.clone()], window.start > 0, &mut poses)
            .expect("simulated");
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
fn more_seeds_than_lanes_are_computed_in_equal_blocks() {
    // Five base parameters, four of frame-registration, three of pose-offset, two each of tip-offset and
    // table-tilt, and three start states: 19 derivatives, more than one simulation carries.
    let (base, _) = system();
    let laws = ["pose-offset", "tip-offset", "table-tilt"].map(|kind| {
        ModelTerm::Effect(base.library().iter().position(|e| e.kind == kind).expect("in the library"))
    });
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
        system.simulate(&task, &mut out).expect("simulated");
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
fn a_rod_inside_the_object_gives_the_error_of_the_engine() {
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
