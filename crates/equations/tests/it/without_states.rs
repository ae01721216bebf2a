//! Contract: outputs of models without states pass their low-pass with the gain that the model file promises, with exact
//! derivatives, whatever window a sample is in; models with states refuse a low-pass.

use augsim_equations::System;
use augsim_equations::engine::{Method, Options, Record, Seed, Signal, Simulated, Window};
use augsim_equations::model::Hold;
use std::f64::consts::PI;

use super::robot::read;

const CUTOFF_HZ: f64 = 2.0;

/// Checks that two numbers differ by at most this, or by this share of the second.
fn assert_near(found: f64, expected: f64, tolerance: f64) {
    let allowed = tolerance * expected.abs().max(1.0);
    assert!((found - expected).abs() <= allowed, "{found} {expected}");
}

/// A model of a force with friction and a product of parameter and input, with and without a low-pass.
const MODEL: &str = r#"
scenario = "system"
name = "slider"
[robot] # which allows a model without states; it rests without gravity, so its torque is 0
file = "two-link-planar.urdf"
joints = ["shoulder", "elbow"]
gravity_m_s2 = [0.0, 0.0, 0.0]
position = ["0", "0"]
speed = ["0", "0"]
acceleration = ["0", "0"]
[inputs]
v_m_s = { hold = "linear" }
[parameters]
damping = { nominal = 3.0, unit = "N s/m" }
friction_N = { nominal = 0.7 }
width_m_s = { nominal = 0.05 }
[outputs]
force_N = { value = "inverse_dynamics(shoulder) + damping * v_m_s + friction_N * tanh(v_m_s / width_m_s)", low_pass_hz = 2.0 }
linear_N = { value = "inverse_dynamics(shoulder) + damping * v_m_s", low_pass_hz = 2.0 }
raw_N = { value = "inverse_dynamics(shoulder) + damping * v_m_s" }
"#;

fn system(text: &str) -> Result<System, String> {
    let model = read(text)?;
    let all: Vec<usize> = (0..model.parameters.len()).collect();
    System::compile(&model, &all).map_err(|e| e.to_string())
}

/// Samples of the outputs, and of the speed at 128 Hz, a sine of this frequency.
fn record(outputs_at: &[f64], frequency_hz: f64) -> Record {
    let times: Vec<f64> = (0..1280).map(|k| f64::from(k) / 128.0).collect();
    let speeds: Vec<f64> = times.iter().map(|t| (2.0 * PI * frequency_hz * t).sin()).collect();
    Record::new("1", outputs_at.to_vec(), vec![Signal::new(&times, &speeds, Hold::Linear)])
        .expect("times increase")
}

fn simulated(system: &System, record: &Record, samples: [usize; 2], parameters: &[f64]) -> Simulated {
    let [first, last] = samples;
    let window = Window { record, first, last, start: &[], parameters };
    let seeds = [0, 1, 2].map(Seed::Parameter);
    let options = Options { method: Method::RungeKutta, substeps: 1 };
    system.simulate(&[window], &seeds, &options).remove(0).expect("outputs")
}

/// Times in the middle of the record, which are multiples of an eighth of a second or lie between the samples of the speed.
fn sample_times() -> Vec<f64> {
    (0..40).map(|k| 2.0 + f64::from(k) / 8.0 + if k % 3 == 0 { 0.003 } else { 0.0 }).collect()
}

#[test]
fn a_sine_passes_with_the_gain_of_the_filter() {
    let system = system(MODEL).expect("a model");
    for frequency in [0.5, 1.5, 2.0, 3.0] {
        let times = sample_times();
        let result = simulated(&system, &record(&times, frequency), [0, times.len() - 1], &[3.0, 0.7, 0.05]);
        let gain = 1.0 / (1.0 + (frequency / CUTOFF_HZ).powi(8));
        for (t, row) in times.iter().zip(result.values.chunks(3)) {
            let speed = (2.0 * PI * frequency * t).sin();
            assert_near(row[1], 3.0 * gain * speed, 6e-3);
            assert_near(row[2], 3.0 * speed, 1e-2);
        }
    }
}

#[test]
fn derivatives_are_those_of_the_filtered_outputs() {
    let system = system(MODEL).expect("a model");
    let times = sample_times();
    let record = record(&times, 0.8);
    let nominal = [3.0, 0.7, 0.05];
    let at = |parameters: &[f64]| simulated(&system, &record, [0, times.len() - 1], parameters);
    let found = at(&nominal);
    for (seed, value) in nominal.iter().enumerate() {
        let h = 1e-6 * value;
        let moved = |sign: f64| {
            let mut parameters = nominal;
            parameters[seed] += sign * h;
            at(&parameters).values
        };
        for (index, (up, down)) in moved(1.0).iter().zip(moved(-1.0)).enumerate() {
            assert_near(found.slopes[index * 3 + seed], (up - down) / (2.0 * h), 1e-7);
        }
    }
}

#[test]
fn a_sample_has_the_same_value_in_every_window() {
    let system = system(MODEL).expect("a model");
    // More samples than are computed together.
    let times: Vec<f64> = (0..300).map(|k| 1.5 + f64::from(k) / 50.0).collect();
    let record = record(&times, 0.8);
    let whole = simulated(&system, &record, [0, 299], &[3.0, 0.7, 0.05]);
    let part = simulated(&system, &record, [117, 223], &[3.0, 0.7, 0.05]);
    assert_eq!(whole.values.len(), 900);
    for (a, b) in part.values.iter().zip(&whole.values[117 * 3..]) {
        assert_near(*a, *b, 1e-12);
    }
}

#[test]
fn a_low_pass_needs_a_model_without_states_and_a_positive_cutoff() {
    let with_state = format!("{MODEL}[states]\nx_m = {{ start = \"force_N\" }}\n[rates]\nx_m = \"v_m_s\"\n");
    let message = system(&with_state).expect_err("refused");
    assert!(
        message.contains("outputs.force_N.low_pass_hz: low_pass_hz needs a model without states"),
        "{message}"
    );
    let message = system(&MODEL.replace("low_pass_hz = 2.0", "low_pass_hz = 0.0")).expect_err("refused");
    assert!(message.starts_with("arm.toml:18: outputs.force_N.low_pass_hz"), "{message}");
}
