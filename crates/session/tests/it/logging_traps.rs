//! Contract: a controller, a late input, a spring that differs between recordings, and a force with a period are told for what they
//! are, on recordings of a mass on a spring.

use crate::answers::answer;
use augsim_data::random_stream;
use augsim_discovery::{Discovery, Verdict};
use augsim_session::DataFrom;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;

const MODEL: &str = "scenario = \"system\"\n[states]\nx_m = { start = \"position_m\" }\nv_m_s = { start = \"slope(position_m)\" }\n\
    [inputs]\nforce_N = { hold = \"zero\" }\n[parameters]\nmass_kg = { nominal = 1.0, min = 0.1, max = 10.0 }\n\
    stiffness_N_per_m = { nominal = 80.0, min = 0.0, max = 1e4 }\ndamping_N_s_per_m = { nominal = 1.0, min = 0.0, max = 100.0 }\n\
    [rates]\nx_m = \"v_m_s\"\nv_m_s = \"(force_N - stiffness_N_per_m * x_m - damping_N_s_per_m * v_m_s) / mass_kg\"\n\
    [outputs]\nposition_m = { value = \"x_m\", sd = \"estimate\" }\n";
const STEP_S: f64 = 0.02;
/// Number of integration steps per sample.
const STEPS: u32 = 20;
const RECORDINGS: u32 = 10;
const SAMPLES: u32 = 250;

/// What the recordings have that the model lacks.
struct Rig {
    /// Standard deviation of the readings, m.
    noise_m: f64,
    /// Gains of a controller on the reading: N/m, and N s/m on its change since the last sample.
    controller: [f64; 2],
    /// Dry friction, N.
    friction_newton: f64,
    /// Amplitude, N, and period, m, of a force that depends on the position.
    ripple: [f64; 2],
    /// Relative increase of the stiffness from one recording to the next.
    stiffening: f64,
    /// Number of samples by which the force acts later than recorded.
    late: u32,
}

impl Rig {
    /// A rig that the model describes.
    const RIGHT: Self = Self {
        noise_m: 0.003,
        controller: [0.0; 2],
        friction_newton: 0.0,
        ripple: [0.0, 1.0],
        stiffening: 0.0,
        late: 0,
    };

    fn discovery(&self) -> Discovery {
        let mut csv = "trajectory,t_s,force_N,position_m\n".to_owned();
        for recording in 0..RECORDINGS {
            self.record(recording, &mut csv);
        }
        answer(MODEL, &DataFrom::Table { name: "rig".into(), csv: csv.into_bytes().into() })
    }

    /// Simulates a recording under steps of the force. The mass is 1.3 kg, the stiffness 95 N/m and the damping 0.9 N s/m.
    fn record(&self, recording: u32, csv: &mut String) {
        let mut rng = random_stream(3, "logging traps", u64::from(recording));
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let stiffness = 95.0 * (1.0 + self.stiffening * f64::from(recording));
        let (mut x, mut v, mut before) = (0.05 * normal(), 0.3 * normal(), 0.0);
        let mut levels = vec![0.0; (SAMPLES + self.late) as usize];
        for k in 0..levels.len() {
            levels[k] = if k % 13 == 0 { 12.0 * normal() } else { levels[k - 1] };
        }
        for k in 0..SAMPLES {
            let reading = x + self.noise_m * normal();
            let [proportional, derivative] = self.controller;
            let controlled = proportional * reading + derivative * (reading - before) / STEP_S;
            before = reading;
            let recorded = levels[(k + self.late) as usize] - controlled;
            let acting = levels[k as usize] - controlled;
            // Writing to a string cannot fail.
            let _ = writeln!(csv, "{recording},{},{recorded},{reading}", STEP_S * f64::from(k));
            let h = STEP_S / f64::from(STEPS);
            for _ in 0..STEPS {
                let rate = |x: f64, v: f64| {
                    let [amplitude, period] = self.ripple;
                    let friction = self.friction_newton * f64::tanh(v / 0.01);
                    let ripple = amplitude * f64::sin(std::f64::consts::TAU * x / period);
                    (acting - stiffness * x - 0.9 * v - friction + ripple) / 1.3
                };
                // Classical Runge-Kutta step.
                let a1 = rate(x, v);
                let v2 = v + 0.5 * h * a1;
                let a2 = rate(x + 0.5 * h * v, v2);
                let v3 = v + 0.5 * h * a2;
                let a3 = rate(x + 0.5 * h * v2, v3);
                let v4 = v + h * a3;
                let a4 = rate(x + h * v3, v4);
                x += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
                v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            }
        }
    }
}

fn named(found: &Discovery) -> Vec<&str> {
    found.effects.iter().map(|effect| &*effect.kind).collect()
}

#[test]
fn the_noise_that_a_controller_passes_on_is_no_disturbance_of_the_readings() {
    let right = Rig { controller: [20.0, 4.0], ..Rig::RIGHT }.discovery();
    assert_eq!((named(&right), right.verdict), (vec![], Verdict::NothingToAdd), "{}", right.sentence);
    assert!(
        right.notes.iter().any(|note| note.contains("a controller uses the readings")),
        "{:?}",
        right.notes
    );
    // The model error without the friction is larger than the noise.
    let rubbing = Rig { controller: [20.0, 4.0], friction_newton: 0.6, ..Rig::RIGHT }.discovery();
    assert_eq!(named(&rubbing), ["coulomb"], "{}", rubbing.sentence);
}

#[test]
fn a_parameter_that_differs_between_recordings_is_no_effect() {
    let found = Rig { stiffening: 0.02, ..Rig::RIGHT }.discovery();
    assert_eq!((named(&found), found.verdict), (vec![], Verdict::Unknown), "{}", found.sentence);
    assert!(found.sentence.contains("the trajectories differ from each other"), "{}", found.sentence);
}

#[test]
fn readings_whose_inputs_lie_before_the_recording_are_left_out() {
    // The force of the first two samples was set before the recording.
    let found = Rig { late: 2, ..Rig::RIGHT }.discovery();
    assert_eq!(named(&found), ["input-delay"], "{}", found.sentence);
    let delay = found.effects[0].parameters["d"].value;
    assert!((delay - 0.04).abs() < 0.002, "{delay} s");
}

#[test]
fn the_period_of_a_force_is_found_from_afar() {
    // 28 periods over the range of the positions, between the starting values of the library.
    let found = Rig { noise_m: 0.0005, ripple: [0.3, 0.037], ..Rig::RIGHT }.discovery();
    assert_eq!(named(&found), ["ripple"], "{}", found.sentence);
    let period = &found.effects[0].parameters["l"];
    assert!((period.value - 0.037).abs() < 1e-4, "{period:?}");
}
