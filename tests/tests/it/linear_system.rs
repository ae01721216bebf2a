//! Contract: the linear test system is linear and its derivatives form its design matrix, so that results of
//! the discovery can be compared with formulas. Also tests defaults of the trait `System`: a record as one
//! window, and the places of added effects.

use augsim_system::{
    Augment, InitialValue, ModelTerm, Offsets, Prepare, Record, Seed, Simulate, Simulated, Task,
};
use augsim_tests::linear::{EVENTS_S, Linear};

fn record() -> Record {
    Record {
        times: (0..80).map(|k| 0.025 * f64::from(k)).collect(),
        values: vec![vec![0.0; 80]],
        covariates: vec![0.7],
        ..Record::default()
    }
}

#[test]
fn values_are_the_design_matrix_times_the_unknowns() {
    let system =
        Linear::new(6).augmented(&[ModelTerm::Effect(4), ModelTerm::Effect(1)]).expect("in the library");
    let record = record();
    let unknowns = [0.3, -0.2, 0.05, 0.11, 1.4, 0.02, -0.03, 0.01];
    let (parameters, rest) = unknowns.split_at(4);
    let (start, xi) = rest.split_at(1);
    let mut seeds: Vec<Seed> = (0..4).map(Seed::Parameter).collect();
    seeds.push(Seed::Start(0));
    seeds.extend((0..3).map(Seed::Offset));
    let offsets = Offsets::PerEvent(xi);
    let task = Task { parameters, record: &record, window: 10..80, start, offsets, seeds: &seeds };
    let mut out = Simulated::default();
    system.simulate(&task, &mut out).expect("it is linear");
    for k in 0..70 {
        let row = out.slopes(k, 0);
        let product: f64 = row.iter().zip(unknowns).map(|(a, b)| a * b).sum();
        assert!((out.value(k, 0) - product).abs() < 1e-14, "{k}");
        let t = record.times[k + 10];
        assert!((row[2] - 1.35 * (8.0 * t).sin()).abs() < 1e-15, "the effect of index 4 is a sine of 8 t");
    }
    assert_eq!(out.event_times(), EVENTS_S);
    assert_eq!(system.term_parameter_ranges(), [2..3, 3..4]);
    assert_eq!(system.declared_count(), 2);
}

#[test]
fn a_record_is_one_window_that_begins_where_the_schema_says() {
    let system = Linear::new(0);
    let mut record = record();
    record.values[0][0] = f64::NAN;
    record.values[0][1] = 0.25;
    system.prepare(&mut record, &[1e-3]).expect("nothing to object to");
    assert_eq!((record.windows[0].samples.clone(), &record.windows[0].start[..]), (0..80, &[0.0][..]));
    let mut schema = system.schema().clone();
    for (begin, start) in [
        (InitialValue::Measured(0), 0.25),
        (InitialValue::Fixed(3.0), 3.0),
        (InitialValue::Prior(2.0, 0.1), 2.0),
    ] {
        schema.states[0].initial = begin;
        record.use_as_one_window(&schema);
        assert_eq!(record.windows[0].start, [start]);
    }
    assert_eq!(schema.free_states().collect::<Vec<_>>(), [0]);
}
