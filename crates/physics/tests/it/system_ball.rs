//! The `System` trait of the ball returns values and derivatives that are bit-identical to those of its
//! engine.
//!
//! This holds for any number of seeds and for added effects. Calibration and discovery use the trait only, so
//! that a difference in the last bit could change their results.

use augsim_physics::ball::effects::{Feature, Target};
use augsim_physics::ball::{Axes, Ball, Covariates, Run, State, Throw};
use augsim_physics::model::Model;
use augsim_physics::{Dual, Scalar, ball};
use augsim_system::{
    Augment, InitialValue, ModelTerm, Offsets, Record, Seed, Simulate, Simulated, System, SystemError, Table,
    Task,
};
use std::sync::Arc;

const PARAMETERS: [f64; 5] = [9.81, 0.8, 0.02, 0.4, 0.0];

fn plain(axes: Axes, release: &str) -> Ball {
    let text = format!(
        "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = 9.81\nrestitution = 0.8\nradius_m = 0.02\n[release]\nkind = \"{release}\"\n"
    );
    Model::parse(&text, "model.toml").expect("a model").open(axes)
}

/// Model term for the library effect of this kind.
fn law(system: &dyn System, kind: &str) -> ModelTerm {
    let index = system.library().iter().position(|e| e.kind == kind);
    ModelTerm::Effect(index.unwrap_or_else(|| panic!("{kind} in the library")))
}

/// Model term for a table of a target against a feature, by their names.
fn table(
    system: &dyn System,
    target: &str,
    against: &str,
    [first, last]: [f64; 2],
    knots: usize,
) -> ModelTerm {
    let schema = system.schema();
    let target = schema.targets.iter().position(|t| t.quantity.name == target).expect("a target");
    let against = schema.features.iter().position(|f| f.name == against).expect("a feature");
    ModelTerm::Table(Table { target, feature: against, first, last, knots })
}

fn record(radius: f64) -> Record {
    let mut covariates = vec![0.0; 6];
    (covariates[0], covariates[2], covariates[5]) = (7.0, 30.0, radius);
    Record { times: (0..200).map(|k| f64::from(k) / 100.0).collect(), covariates, ..Record::default() }
}

/// Asserts that two simulations have bit-identical values, derivatives and event times.
fn assert_same(a: &Simulated, b: &Simulated) {
    assert_eq!((a.samples(), a.channels(), a.lanes()), (b.samples(), b.channels(), b.lanes()));
    for k in 0..a.samples() {
        for c in 0..a.channels() {
            assert_eq!(a.value(k, c).to_bits(), b.value(k, c).to_bits(), "sample {k}, channel {c}");
            for (lane, (x, y)) in a.slopes(k, c).iter().zip(b.slopes(k, c)).enumerate() {
                assert_eq!(x.to_bits(), y.to_bits(), "sample {k}, channel {c}, lane {lane}: {x} {y}");
            }
        }
    }
    assert_eq!(a.event_times(), b.event_times());
}

#[test]
fn trait_and_engine_give_bit_identical_throws() {
    let base = plain(Axes::Plane, "free");
    let laws = [law(&base, "quadratic-drag"), law(&base, "wind"), law(&base, "coulomb-friction")];
    let restitution = table(&base, "restitution", "impact-speed", [0.5, 5.0], 3);
    let system = base.augmented(&[&laws[..], &[restitution]].concat()).expect("laws of the library");
    let parameters = [&PARAMETERS[..], &[0.02, 1.5, 0.1, 0.01, -0.02, 0.03]].concat();
    let (record, start, xi) = (record(0.021), [0.1, 1.2, 1.1, 0.3], [0.01, -0.02, 0.0]);
    // All parameters, initial states and offsets.
    let mut seeds: Vec<Seed> = (0..parameters.len()).map(Seed::Parameter).collect();
    seeds.extend((0..4).map(Seed::Start));
    seeds.extend((0..3).map(Seed::Offset));
    let task = Task {
        parameters: &parameters,
        record: &record,
        window: 0..200,
        start: &start,
        offsets: Offsets::PerEvent(&xi),
        seeds: &seeds,
    };
    let mut out = Simulated::default();
    system.simulate(&task, &mut out).expect("it flies");

    // The same throw by the engine itself, with the same lanes.
    let mut world = ball::World::new(Axes::Plane);
    for kind in ["quadratic-drag", "wind", "coulomb-friction"] {
        world.add_kind(kind).expect("in the library");
    }
    let shape = augsim_physics::ball::effects::Table {
        target: Target::Restitution,
        feature: Feature::NormalSpeed,
        first: 0.5,
        last: 5.0,
    };
    world.add(ball::LawRef::Table(shape), 3);
    let lane = Dual::<24>::variable;
    let mut duals: Vec<Dual<24>> = parameters.iter().enumerate().map(|(i, v)| lane(*v, i)).collect();
    duals[ball::RADIUS] = lane(0.021, ball::RADIUS);
    let n = parameters.len();
    let mut state = State { time: Dual::constant(0.0), ..State::at_rest(Dual::constant(0.0)) };
    (state.position[0], state.position[2]) = (lane(start[0], n), lane(start[1], n + 1));
    (state.velocity[0], state.velocity[2]) = (lane(start[2], n + 2), lane(start[3], n + 3));
    state.spin[1] = Dual::constant(30.0);
    let offsets: Vec<Dual<24>> = xi.iter().enumerate().map(|(i, x)| lane(*x, n + 4 + i)).collect();
    let covariates = Covariates { clock_s: 7.0, spin_rad_s: [0.0, 30.0, 0.0], area_per_mass_m2_kg: 0.0 };
    let throw = Throw {
        world: &world,
        parameters: &duals,
        start: state,
        covariates: &covariates,
        offsets: ball::Offsets::PerImpact(&offsets),
        velocities: false,
    };
    let mut run = Run { positions: vec![], velocities: vec![], impacts: vec![], rest_time: None };
    ball::simulate(&throw, &record.times, &mut run);
    assert!(run.impacts.len() > 2, "{} impacts", run.impacts.len());
    for (k, position) in run.positions.iter().enumerate() {
        for (c, axis) in [0, 2].into_iter().enumerate() {
            assert_eq!(out.value(k, c).to_bits(), position[axis].value.to_bits(), "sample {k}");
            for (lane, slope) in out.slopes(k, c).iter().take(seeds.len()).enumerate() {
                assert_eq!(slope.to_bits(), position[axis].d[lane].to_bits(), "sample {k}, lane {lane}");
            }
        }
    }
    let speed = system.schema().features.iter().position(|f| f.name == "impact-speed").expect("a feature");
    for (i, impact) in run.impacts.iter().enumerate() {
        assert_eq!(out.event_times()[i], impact.time.value);
        assert_eq!(out.event(i)[speed], impact.speed_in.value);
    }
}

#[test]
fn blocks_of_seeds_give_bit_identical_derivatives() {
    let base = plain(Axes::Vertical, "rest");
    // Tables of 30 and 29 knots: 66 derivatives, more than the widest dual number has.
    let laws =
        [("restitution", "impact-speed", [0.0, 5.0], 30), ("acceleration-z", "height", [0.0, 1.2], 29)]
            .map(|(target, against, span, knots)| table(&base, target, against, span, knots));
    let system = base.augmented(&laws).expect("targets and features of the schema");
    let values: Vec<f64> =
        (0..64).map(|i| if i < 5 { PARAMETERS[i] } else { 1e-3 * (i as f64).sin() }).collect();
    let record = record(f64::NAN);
    let mut seeds: Vec<Seed> = (0..64).map(Seed::Parameter).collect();
    seeds.extend([Seed::Start(0), Seed::Offset(0)]);
    let task = |seeds| Task {
        parameters: &values,
        record: &record,
        window: 0..200,
        start: &[1.2, 0.0],
        offsets: Offsets::Shared(0.01),
        seeds,
    };
    let simulated = |seeds| {
        let mut out = Simulated::default();
        system.simulate(&task(seeds), &mut out).expect("it falls");
        out
    };
    let wide = simulated(&seeds);
    assert_eq!(wide.lanes(), 66);
    for first in (0..66).step_by(11) {
        let narrow = simulated(&seeds[first..first + 11]);
        for k in 0..200 {
            assert_eq!(narrow.value(k, 0).to_bits(), wide.value(k, 0).to_bits());
            for lane in 0..11 {
                let (a, b) = (narrow.slopes(k, 0)[lane], wide.slopes(k, 0)[first + lane]);
                assert_eq!(a.to_bits(), b.to_bits(), "sample {k}, lane {}", first + lane);
            }
        }
    }
    // Reused buffers do not change the result.
    let mut reused = wide.clone();
    system.simulate(&task(&seeds[..1]), &mut reused).expect("it falls");
    system.simulate(&task(&seeds), &mut reused).expect("it falls");
    assert_same(&reused, &wide);
}

#[test]
fn effects_can_be_added_one_by_one_or_together() {
    let base = plain(Axes::Plane, "free");
    let laws =
        [law(&base, "camera-roll"), table(&base, "drag", "speed", [0.0, 4.0], 5), law(&base, "magnus")];
    let together = base.augmented(&laws).expect("known laws");
    let one_by_one = base.augmented(&laws[..1]).and_then(|s| s.augmented(&laws[1..])).expect("known laws");
    assert_eq!(together.parameters(), one_by_one.parameters());
    assert_eq!(
        (one_by_one.declared_count(), one_by_one.term_parameter_ranges()),
        (5, vec![5..6, 6..11, 11..12])
    );
    assert_eq!(one_by_one.terms(), &laws);
    let names: Vec<&str> = one_by_one.parameters()[5..].iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["phi_rad", "knot0", "knot1", "knot2", "knot3", "knot4", "s"]);
}

#[test]
fn release_at_rest_fixes_the_initial_velocity() {
    let initial_velocity = |release| plain(Axes::Vertical, release).schema().states[1].initial;
    assert_eq!(initial_velocity("rest"), InitialValue::Fixed(0.0));
    assert_eq!(initial_velocity("free"), InitialValue::Free);
}

#[test]
fn mismatched_tasks_are_refused_with_a_message() {
    let system: Arc<dyn System> = Arc::new(plain(Axes::Vertical, "free"));
    let record = record(f64::NAN);
    let base = Task {
        parameters: &PARAMETERS,
        record: &record,
        window: 0..200,
        start: &[1.0, 0.0],
        offsets: Offsets::None,
        seeds: &[],
    };
    let refusal = |task: Task<'_>| {
        let mut out = Simulated::default();
        system.simulate(&task, &mut out).expect_err("refused").to_string()
    };
    assert_eq!(
        refusal(Task { parameters: &PARAMETERS[..3], ..base.clone() }),
        "the ball system takes 5 parameters, and the task has 3"
    );
    assert_eq!(
        refusal(Task { seeds: &[Seed::Offset(0)], ..base.clone() }),
        "the ball system takes 0 seeds of offsets, and the task has 1"
    );
    assert_eq!(
        refusal(Task { window: 0..201, ..base }),
        "the ball system takes 200 samples, and the task has 201"
    );
    let count = system.library().len();
    let missing = system.augmented(&[ModelTerm::Effect(count)]).expect_err("refused");
    assert_eq!(missing, SystemError::Effect { index: count, count });
}
