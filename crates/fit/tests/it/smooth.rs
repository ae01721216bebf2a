//! Contract: the smoother distinguishes white measurement noise, autocorrelated measurement noise and process
//! noise, estimates their size and correlation time, and its states are closer to the true ones than the
//! readings. This holds with missing samples, and the result does not depend on the number of threads. The
//! system is a damped oscillator, which the tests integrate themselves.

use augsim_equations::{EquationSystem, model};
use augsim_fit::{CalibrationError, Cause, Smoothed, smooth};
use augsim_system::{Offsets, Prepare, Record, Simulate, Simulated, Task};

const MODEL: &str = "scenario = \"system\"\n[states]\nx_m = { start = \"y_m\" }\nv_m_s = { start = \"slope(y_m)\" }\n\
    [parameters]\nstiffness_per_s2 = { nominal = 40.0, frozen = true }\ndamping_per_s = { nominal = 0.1, frozen = true }\n\
    [rates]\nx_m = \"v_m_s\"\nv_m_s = \"-stiffness_per_s2 * x_m - damping_per_s * v_m_s\"\n\
    [outputs]\ny_m = { value = \"x_m\", sd = \"estimate\" }\n";
const STEP_S: f64 = 0.02;
const SAMPLES: usize = 2000;

/// Draws from an approximate standard normal distribution: the sum of twelve pseudo-random numbers.
fn normal(stream: usize, k: usize) -> f64 {
    let one = |j: usize| {
        let x = ((stream * 1_000_003 + k * 12 + j) as f64 * 12.9898 + 4.1).sin() * 43758.5453;
        x - x.floor() - 0.5
    };
    (0..12).map(one).sum()
}

/// Simulates an Ornstein-Uhlenbeck process with standard deviation `sd` and correlation time in steps.
fn ornstein_uhlenbeck(stream: usize, sd: f64, correlation_steps: f64) -> Vec<f64> {
    let correlation = (-1.0 / correlation_steps).exp();
    let innovation = (1.0 - correlation * correlation).sqrt();
    let mut now = sd * normal(stream, SAMPLES);
    (0..SAMPLES)
        .map(|k| {
            let value = now;
            now = correlation * now + sd * innovation * normal(stream, k);
            value
        })
        .collect()
}

/// Simulates the oscillator with these disturbances of its acceleration; returns its states at all samples.
fn simulate(disturbances: &[f64]) -> Vec<[f64; 2]> {
    let mut now = [1.0, 0.0];
    let mut states = Vec::new();
    for disturbance in disturbances {
        states.push(now);
        const SUBSTEPS: usize = 20;
        let dt = STEP_S / SUBSTEPS as f64;
        for _ in 0..SUBSTEPS {
            let rates = |[x, v]: [f64; 2]| [v, -40.0 * x - 0.1 * v + disturbance];
            let advance = |k: [f64; 2], dt: f64| [now[0] + dt * k[0], now[1] + dt * k[1]];
            let a = rates(now);
            let b = rates(advance(a, 0.5 * dt));
            let c = rates(advance(b, 0.5 * dt));
            let d = rates(advance(c, dt));
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
    let system = EquationSystem::declared_only(&model).expect("a system");
    let mut record = record;
    system.prepare(&mut record, &[]).expect("a record");
    let shown = system.with_states_as_channels().expect("a system");
    assert_eq!(
        system.process_noise_states(),
        [1],
        "only the velocity can have process noise: the rate of the position is the velocity"
    );
    smooth(&shown, 1, &[record], &[40.0, 0.1], &system.process_noise_states(), &[None])
}

/// RMSE of the smoothed states: position, velocity.
fn state_rmse(found: &Smoothed, states: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|i| {
        let squares =
            found.paths[0].chunks_exact(2).zip(states).map(|(found, state)| (found[i] - state[i]).powi(2));
        (squares.sum::<f64>() / states.len() as f64).sqrt()
    })
}

/// Panics if the relative error of `value` is `share` or more.
fn assert_within(value: f64, expected: f64, share: f64) {
    assert!((value / expected - 1.0).abs() < share, "{value} is not {expected}");
}

#[test]
fn white_measurement_noise_is_recognised() {
    let states = simulate(&[0.0; SAMPLES]);
    let values = states.iter().enumerate().map(|(k, s)| s[0] + 5e-3 * normal(1, k)).collect();
    let found = smoothed(record(values)).expect("smoothed states");
    assert_eq!(
        (found.cause, &found.disturbance_sd[..], found.correlation_time_s),
        (Cause::Sensor, &[][..], 0.0)
    );
    assert_within(found.sensor_sd[0], 5e-3, 0.06);
    // Only the two numbers of the initial state are estimated from 2,000 readings, so the states are precise.
    let [x, v] = state_rmse(&found, &states);
    assert!(x < 5e-4 && v < 4e-3, "{x} {v}");
}

#[test]
fn process_noise_is_recognised_with_its_size_and_correlation_time() {
    let states = simulate(&ornstein_uhlenbeck(2, 2.0, 10.0));
    let values = states.iter().enumerate().map(|(k, s)| s[0] + 2e-3 * normal(3, k)).collect();
    let found = smoothed(record(values)).expect("smoothed states");
    assert_eq!(found.cause, Cause::ProcessNoise);
    assert_within(found.sensor_sd[0], 2e-3, 0.1);
    assert_within(found.disturbance_sd[0], 2.0, 0.25);
    assert!((0.1..=0.5).contains(&found.correlation_time_s), "{} s", found.correlation_time_s);
    let [x, v] = state_rmse(&found, &states);
    assert!(x < 1.2e-3 && v < 0.05, "{x} {v}");
}

#[test]
fn autocorrelated_measurement_noise_is_recognised() {
    let states = simulate(&[0.0; SAMPLES]);
    let correlated = ornstein_uhlenbeck(4, 5e-3, 20.0);
    let values = states.iter().enumerate().map(|(k, s)| s[0] + correlated[k] + 1e-3 * normal(5, k)).collect();
    let found = smoothed(record(values)).expect("smoothed states");
    assert_eq!(found.cause, Cause::AutocorrelatedSensor);
    assert_within(found.disturbance_sd[0], 5e-3, 0.25);
    assert_within(found.sensor_sd[0], 1e-3, 0.1);
    assert!((0.2..=1.2).contains(&found.correlation_time_s), "{} s", found.correlation_time_s);
}

/// Model file of a mass on a spring that rebounds from a stop.
const STOP: &str = "scenario = \"system\"\n[states]\nx_m = { start = \"y_m\" }\nv_m_s = { start = \"slope(y_m)\" }\n\
    [parameters]\nstiffness_per_s2 = { nominal = 40.0, frozen = true }\nstop_m = { nominal = 0.1, frozen = true }\n\
    restitution = { nominal = 0.9, frozen = true }\n\
    [rates]\nx_m = \"v_m_s\"\nv_m_s = \"-stiffness_per_s2 * x_m\"\n\
    [outputs]\ny_m = { value = \"x_m\", sd = \"estimate\" }\n\
    [[events]]\nname = \"stop\"\nwhen = \"x_m - stop_m\"\ndirection = \"rising\"\nset = { v_m_s = \"-restitution * v_m_s\" }\n";

#[test]
fn rebounds_are_not_taken_for_process_noise() {
    let model = model::parse(STOP, "stop.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = EquationSystem::declared_only(&model).expect("a system");
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
    assert!(out.event_times().len() >= 4, "the mass reaches the stop");
    record.values = vec![(0..250).map(|k| out.value(k, 0) + 5e-3 * normal(6, k)).collect()];
    system.prepare(&mut record, &[]).expect("a record");
    let shown = system.with_states_as_channels().expect("a system");
    let found = smooth(&shown, 1, &[record], &values, &system.process_noise_states(), &[None])
        .expect("smoothed states");
    assert_eq!(found.cause, Cause::Sensor);
    assert_within(found.sensor_sd[0], 5e-3, 0.15);
}

#[test]
fn states_are_estimated_across_missing_samples() {
    let states = simulate(&ornstein_uhlenbeck(2, 2.0, 10.0));
    let read = |(k, s): (usize, &[f64; 2])| if k % 3 == 1 { f64::NAN } else { s[0] + 2e-3 * normal(3, k) };
    let found = smoothed(record(states.iter().enumerate().map(read).collect())).expect("smoothed states");
    assert_eq!(found.cause, Cause::ProcessNoise);
    let [x, v] = state_rmse(&found, &states);
    assert!(x < 1.5e-3 && v < 0.06, "{x} {v}");
}

#[test]
fn result_does_not_depend_on_the_number_of_threads() {
    let states = simulate(&ornstein_uhlenbeck(2, 2.0, 10.0));
    let values: Vec<f64> = states.iter().enumerate().map(|(k, s)| s[0] + 2e-3 * normal(3, k)).collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| smoothed(record(values.clone())).expect("smoothed states"))
    };
    let one = run(1);
    for threads in [2, 7] {
        let other = run(threads);
        assert!(one.paths == other.paths && one.ln_likelihood == other.ln_likelihood, "{threads} threads");
    }
}

#[test]
fn records_without_measurements_are_an_error() {
    let error = smoothed(record(vec![f64::NAN; 40])).expect_err("no answer");
    assert!(matches!(error, CalibrationError::NothingMeasured), "{error}");
}

#[test]
fn process_noise_of_a_measured_state_is_separated_from_measurement_noise() {
    // The process noise acts on the state that is measured. If it were white, the likelihood would be highest
    // without measurement noise; a correlation time separates the two.
    let text = "scenario = \"system\"\n[states]\nexcess_K = { start = \"reading_K\" }\n\
    [parameters]\nloss_per_s = { nominal = 0.2, frozen = true }\n[rates]\nexcess_K = \"-loss_per_s * excess_K\"\n\
    [outputs]\nreading_K = { value = \"excess_K\", sd = \"estimate\" }\n";
    let model = model::parse(text, "lag.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = EquationSystem::declared_only(&model).expect("a system");
    let (correlation, decay) = ((-0.25_f64).exp(), (-0.1_f64).exp());
    let mut list = Vec::new();
    for j in 0..8 {
        let (mut x, mut p) = (20.0, normal(50 + j, 900));
        let mut y = Vec::new();
        for k in 0..200 {
            y.push(x + 0.1 * normal(20 + j, k));
            x = decay * x + (1.0 - decay) / 0.2 * p;
            p = correlation * p + (1.0 - correlation * correlation).sqrt() * normal(35 + j, k);
        }
        let mut r = record(y);
        r.times = (0..200).map(|k| 0.5 * f64::from(k)).collect();
        system.prepare(&mut r, &[]).expect("a record");
        list.push(r);
    }
    let shown = system.with_states_as_channels().expect("a system");
    let found =
        smooth(&shown, 1, &list, &[0.2], &system.process_noise_states(), &[None]).expect("smoothed states");
    assert_eq!(found.cause, Cause::ProcessNoise);
    assert_within(found.disturbance_sd[0], 1.0, 0.15);
    assert_within(found.correlation_time_s, 2.0, 0.3);
    assert_within(found.sensor_sd[0], 0.1, 0.25);
}
