//! Contract: a smoother tells a sensor's noise, a sensor whose errors last, and a shaken motion from one another, says how much and
//! for how long, and comes nearer to the true states than what was measured; missing samples and the number of threads change
//! nothing of that. The scene is a damped oscillator, integrated here once more.

use augsim_calibrate::{
    CalibrationError, Cause, Fitted, Known, Pushed, Readings, Smoothed, fit_if_shaken, smooth,
};
use augsim_physics::system::{Offsets, Record, Simulated, System, Task};
use augsim_written::{WrittenSystem, model};

const MODEL: &str = "scenario = \"system\"\n[states]\nx_m = { start = \"y_m\" }\nv_m_s = { start = \"slope(y_m)\" }\n\
    [parameters]\nstiffness_per_s2 = { nominal = 40.0, frozen = true }\ndamping_per_s = { nominal = 0.1, frozen = true }\n\
    [rates]\nx_m = \"v_m_s\"\nv_m_s = \"-stiffness_per_s2 * x_m - damping_per_s * v_m_s\"\n\
    [outputs]\ny_m = { value = \"x_m\", sd = \"estimate\" }\n";
const STEP_S: f64 = 0.02;
const SAMPLES: usize = 2000;

/// Numbers of a normal distribution, nearly: sums of twelve without a pattern.
fn normal(stream: usize, k: usize) -> f64 {
    let one = |j: usize| {
        let x = ((stream * 1_000_003 + k * 12 + j) as f64 * 12.9898 + 4.1).sin() * 43758.5453;
        x - x.floor() - 0.5
    };
    (0..12).map(one).sum()
}

/// Numbers that wander about 0 with a standard deviation, with a memory in steps.
fn wandering(stream: usize, sd: f64, memory: f64) -> Vec<f64> {
    let kept = (-1.0 / memory).exp();
    let fresh = (1.0 - kept * kept).sqrt();
    let mut now = sd * normal(stream, SAMPLES);
    (0..SAMPLES)
        .map(|k| {
            let value = now;
            now = kept * now + sd * fresh * normal(stream, k);
            value
        })
        .collect()
}

/// States of the oscillator at all samples, its rate pushed by these numbers.
fn moved(pushes: &[f64]) -> Vec<[f64; 2]> {
    let mut now = [1.0, 0.0];
    let mut states = Vec::new();
    for push in pushes {
        states.push(now);
        const PARTS: usize = 20;
        let dt = STEP_S / PARTS as f64;
        for _ in 0..PARTS {
            let rates = |[x, v]: [f64; 2]| [v, -40.0 * x - 0.1 * v + push];
            let at = |k: [f64; 2], by: f64| [now[0] + by * k[0], now[1] + by * k[1]];
            let a = rates(now);
            let b = rates(at(a, 0.5 * dt));
            let c = rates(at(b, 0.5 * dt));
            let d = rates(at(c, dt));
            now = [0, 1].map(|i| now[i] + dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
    }
    states
}

fn record(values: Vec<f64>) -> Record {
    let times = (0..values.len()).map(|k| STEP_S * k as f64).collect();
    Record { id: "1".into(), times, values: vec![values], ..Record::default() }
}

fn smoothed(record: Record) -> Result<Smoothed, CalibrationError> {
    let model = model::parse(MODEL, "oscillator.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = WrittenSystem::declared_only(&model).expect("a system");
    let mut record = record;
    system.prepare(&mut record, &[]).expect("a record");
    let shown = system.showing_states().expect("a system");
    assert_eq!(system.pushed_states(), [1], "the position has the speed as its rate");
    smooth(&shown, 1, &[record], &[40.0, 0.1], &system.pushed_states(), &[None])
}

/// Root mean square errors of smoothed states.
fn errors(found: &Smoothed, states: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|i| {
        let each =
            found.paths[0].chunks_exact(2).zip(states).map(|(found, state)| (found[i] - state[i]).powi(2));
        (each.sum::<f64>() / states.len() as f64).sqrt()
    })
}

fn within(value: f64, expected: f64, share: f64) {
    assert!((value / expected - 1.0).abs() < share, "{value} is not {expected}");
}

#[test]
fn white_noise_of_a_sensor_is_the_sensors() {
    let states = moved(&[0.0; SAMPLES]);
    let values = states.iter().enumerate().map(|(k, s)| s[0] + 5e-3 * normal(1, k)).collect();
    let found = smoothed(record(values)).expect("an answer");
    assert_eq!((found.cause, &found.drive_sd[..], found.memory_s), (Cause::Sensor, &[][..], 0.0));
    within(found.sensor_sd[0], 5e-3, 0.06);
    // Two numbers of a start from 2,000 readings.
    let [x, v] = errors(&found, &states);
    assert!(x < 5e-4 && v < 4e-3, "{x} {v}");
}

#[test]
fn what_pushes_a_rate_is_found_with_its_size_and_its_memory() {
    let states = moved(&wandering(2, 2.0, 10.0));
    let values = states.iter().enumerate().map(|(k, s)| s[0] + 2e-3 * normal(3, k)).collect();
    let found = smoothed(record(values)).expect("an answer");
    assert_eq!(found.cause, Cause::Motion);
    within(found.sensor_sd[0], 2e-3, 0.1);
    within(found.drive_sd[0], 2.0, 0.25);
    assert!((0.1..=0.5).contains(&found.memory_s), "{} s", found.memory_s);
    let [x, v] = errors(&found, &states);
    assert!(x < 1.2e-3 && v < 0.05, "{x} {v}");
}

#[test]
fn errors_of_a_sensor_that_last_are_the_sensors() {
    let states = moved(&[0.0; SAMPLES]);
    let lasting = wandering(4, 5e-3, 20.0);
    let values = states.iter().enumerate().map(|(k, s)| s[0] + lasting[k] + 1e-3 * normal(5, k)).collect();
    let found = smoothed(record(values)).expect("an answer");
    assert_eq!(found.cause, Cause::LastingSensor);
    within(found.drive_sd[0], 5e-3, 0.25);
    within(found.sensor_sd[0], 1e-3, 0.1);
    assert!((0.2..=1.2).contains(&found.memory_s), "{} s", found.memory_s);
}

/// A mass on a spring that a stop throws back.
const STOP: &str = "scenario = \"system\"\n[states]\nx_m = { start = \"y_m\" }\nv_m_s = { start = \"slope(y_m)\" }\n\
    [parameters]\nstiffness_per_s2 = { nominal = 40.0, frozen = true }\nstop_m = { nominal = 0.1, frozen = true }\n\
    restitution = { nominal = 0.9, frozen = true }\n\
    [rates]\nx_m = \"v_m_s\"\nv_m_s = \"-stiffness_per_s2 * x_m\"\n\
    [outputs]\ny_m = { value = \"x_m\", sd = \"estimate\" }\n\
    [[events]]\nname = \"stop\"\nwhen = \"x_m - stop_m\"\ndirection = \"rising\"\nset = { v_m_s = \"-restitution * v_m_s\" }\n";

#[test]
fn a_rebound_is_no_push() {
    let model = model::parse(STOP, "stop.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = WrittenSystem::declared_only(&model).expect("a system");
    let values = [40.0, 0.1, 0.9];
    let mut record = record(vec![0.0; 250]);
    let task = Task {
        parameters: &values,
        record: &record,
        window: 0..250,
        start: &[-1.0, 0.0],
        offsets: Offsets::None,
        seeds: &[],
    };
    let mut out = Simulated::default();
    system.simulate(&task, &mut out).expect("a run");
    assert!(out.event_times().len() >= 4, "the stop is met");
    record.values = vec![(0..250).map(|k| out.value(k, 0) + 5e-3 * normal(6, k)).collect()];
    system.prepare(&mut record, &[]).expect("a record");
    let shown = system.showing_states().expect("a system");
    let found = smooth(&shown, 1, &[record], &values, &system.pushed_states(), &[None]).expect("an answer");
    assert_eq!(found.cause, Cause::Sensor);
    within(found.sensor_sd[0], 5e-3, 0.15);
}

#[test]
fn missing_samples_leave_the_states_near_the_truth() {
    let states = moved(&wandering(2, 2.0, 10.0));
    let read = |(k, s): (usize, &[f64; 2])| if k % 3 == 1 { f64::NAN } else { s[0] + 2e-3 * normal(3, k) };
    let found = smoothed(record(states.iter().enumerate().map(read).collect())).expect("an answer");
    assert_eq!(found.cause, Cause::Motion);
    let [x, v] = errors(&found, &states);
    assert!(x < 1.5e-3 && v < 0.06, "{x} {v}");
}

#[test]
fn threads_change_no_bit() {
    let states = moved(&wandering(2, 2.0, 10.0));
    let values: Vec<f64> = states.iter().enumerate().map(|(k, s)| s[0] + 2e-3 * normal(3, k)).collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| smoothed(record(values.clone())).expect("an answer"))
    };
    let one = run(1);
    for threads in [2, 7] {
        let other = run(threads);
        assert!(one.paths == other.paths && one.ln_likelihood == other.ln_likelihood, "{threads} threads");
    }
}

#[test]
fn nothing_measured_is_said() {
    let error = smoothed(record(vec![f64::NAN; 40])).expect_err("no answer");
    assert!(matches!(error, CalibrationError::NothingMeasured), "{error}");
}

#[test]
fn a_push_that_shows_at_once_leaves_the_sensor_its_noise() {
    // Under white pushes the readings are likeliest without a sensor's noise; under pushes that last they are not.
    let text = "scenario = \"system\"\n[states]\nexcess_K = { start = \"reading_K\" }\n\
    [parameters]\nloss_per_s = { nominal = 0.2, frozen = true }\n[rates]\nexcess_K = \"-loss_per_s * excess_K\"\n\
    [outputs]\nreading_K = { value = \"excess_K\", sd = \"estimate\" }\n";
    let model = model::parse(text, "lag.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = WrittenSystem::declared_only(&model).expect("a system");
    let (kept, falls) = ((-0.25_f64).exp(), (-0.1_f64).exp());
    let mut list = Vec::new();
    for j in 0..8 {
        let (mut x, mut p) = (20.0, normal(50 + j, 900));
        let mut y = Vec::new();
        for k in 0..200 {
            y.push(x + 0.1 * normal(20 + j, k));
            x = falls * x + (1.0 - falls) / 0.2 * p;
            p = kept * p + (1.0 - kept * kept).sqrt() * normal(35 + j, k);
        }
        let mut r = record(y);
        r.times = (0..200).map(|k| 0.5 * f64::from(k)).collect();
        system.prepare(&mut r, &[]).expect("a record");
        list.push(r);
    }
    let shown = system.showing_states().expect("a system");
    let found = smooth(&shown, 1, &list, &[0.2], &system.pushed_states(), &[None]).expect("an answer");
    assert_eq!(found.cause, Cause::Motion);
    within(found.drive_sd[0], 1.0, 0.15);
    within(found.memory_s, 2.0, 0.3);
    within(found.sensor_sd[0], 0.1, 0.25);
}

#[test]
fn parameters_of_a_shaken_motion_are_fitted_through_a_filter() {
    let states = moved(&wandering(2, 2.0, 10.0));
    let values: Vec<f64> = states.iter().enumerate().map(|(k, s)| s[0] + 2e-3 * normal(3, k)).collect();
    let model = model::parse(MODEL, "oscillator.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = WrittenSystem::declared_only(&model).expect("a system");
    let mut seen = record(values);
    system.prepare(&mut seen, &[]).expect("a record");
    let (shown, pushed) = system.with_states_shown().expect("a system that can be filtered");
    let records = [seen];
    let at = |start: [f64; 2], free: &[Fitted]| {
        let readings = Readings { outputs: 1, records: &records, declared: &[None] };
        let model = Pushed { system: &*shown, states: &pushed, values: &start };
        let known = smooth(&*shown, 1, &records, &start, &pushed, &[None]).expect("an answer");
        fit_if_shaken(readings, model, free, Known::Smoothed(&known)).expect("a fit")
    };
    let both = [(0, [10.0, 100.0]), (1, [0.0, 20.0])];
    let [still, near, far] = [at([40.0, 0.1], &[]), at([40.0, 0.1], &both), at([46.0, 2.0], &both)];
    // What is fitted is likelier than the truth, by no more than two numbers bring; and it is found from afar.
    let gain = near.ln_likelihood - still.ln_likelihood;
    assert!((0.0..6.0).contains(&gain), "{still:?} {near:?}");
    assert!((near.ln_likelihood - far.ln_likelihood).abs() < 0.3, "{near:?} {far:?}");
    within(far.values[0], 40.0, 0.05);
    within(far.values[0], near.values[0], 0.01);
    // Another damping is much less likely.
    assert!(at([40.0, 3.0], &[]).ln_likelihood < still.ln_likelihood - 20.0);
}
