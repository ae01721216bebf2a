//! Contract: noise that was estimated on some trajectories gives prediction bands with the nominal coverage
//! on others. This holds for process noise (without it the bands are far too narrow), white and
//! autocorrelated measurement noise.

use augsim_data::random_stream;
use augsim_discovery::{NoiseSource, PredictOptions};
use augsim_equations::{Model, model};
use augsim_session::equations::{noise, records};
use augsim_session::predict::predict;
use augsim_session::{DataFrom, Subject};
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;

const MODEL: &str = "scenario = \"system\"\n[states]\nexcess_K = { start = \"reading_K\" }\n\
    [parameters]\nloss_per_s = { nominal = 0.2, frozen = true }\n[rates]\nexcess_K = \"-loss_per_s * excess_K\"\n\
    [outputs]\nreading_K = { value = \"excess_K\", sd = \"estimate\" }\n";
const STEP_S: f64 = 0.5;
const SAMPLES: usize = 200;
/// Number of samples that an initial state is fitted to: too few to estimate the noise from them alone.
const BURN_IN: usize = 5;

/// Simulates trajectories with coloured process noise of 1 K/s (correlation time 2 s) and measurement noise of 0.1 K.
fn table(seed: u64, trajectories: usize) -> DataFrom {
    let mut csv = "trajectory,t_s,reading_K\n".to_owned();
    for j in 0..trajectories {
        let mut rng = random_stream(seed, "shaken", j as u64);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut excess, mut push) = (20.0, normal());
        let (kept, falls) = ((-STEP_S / 2.0_f64).exp(), (-0.2 * STEP_S).exp());
        for k in 0..SAMPLES {
            // Writing to a string cannot fail.
            let _ = writeln!(csv, "{j},{},{}", STEP_S * k as f64, excess + 0.1 * normal());
            excess = falls * excess + (1.0 - falls) / 0.2 * push;
            push = kept * push + (1.0 - kept * kept).sqrt() * normal();
        }
    }
    DataFrom::Table { name: "shaken".into(), csv: csv.into_bytes().into() }
}

/// Share of the measured values after the burn-in that lie in the 90 % bands.
fn coverage(model: &Model, data: &DataFrom) -> f64 {
    let options = PredictOptions { draws: 200, seed: 3, ..PredictOptions::default() };
    let subject = Subject::Equations(Box::new(model.clone()));
    let found = predict(&subject, data, BURN_IN, &options).expect("forecasts");
    let (mut inside, mut count) = (0, 0);
    for record in &found.records {
        let channel = &record.channels[0];
        for k in record.initial_sample_count..record.times.len() {
            let [low, high] = [0, channel.quantiles.len() - 1].map(|q| channel.quantiles[q][k]);
            inside += usize::from((low..=high).contains(&channel.measured[k]));
            count += 1;
        }
    }
    f64::from(inside as u32) / f64::from(count as u32)
}

/// Simulates trajectories without process noise, with 0.1 K of white or autocorrelated (2 s) measurement noise.
fn quiet(seed: u64, trajectories: usize, autocorrelated: bool) -> DataFrom {
    let mut csv = "trajectory,t_s,reading_K\n".to_owned();
    for j in 0..trajectories {
        let mut rng = random_stream(seed, "measurement noise", j as u64);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let kept = if autocorrelated { (-STEP_S / 2.0_f64).exp() } else { 0.0 };
        let mut error = 0.1 * normal();
        for k in 0..SAMPLES {
            let time = STEP_S * k as f64;
            // Writing to a string cannot fail.
            let _ = writeln!(csv, "{j},{time},{}", 20.0 * (-0.2 * time).exp() + error);
            error = kept * error + 0.1 * (1.0 - kept * kept).sqrt() * normal();
        }
    }
    DataFrom::Table { name: "quiet".into(), csv: csv.into_bytes().into() }
}

/// The first samples, to which the initial state is fitted, are too few to estimate the measurement noise.
#[test]
fn estimated_measurement_noise_gives_bands_with_nominal_coverage() {
    for (autocorrelated, cause) in [(false, NoiseSource::Sensor), (true, NoiseSource::AutocorrelatedSensor)] {
        let mut model = model::parse(MODEL, "lag.toml").unwrap_or_else(|e| panic!("{e}"));
        let read = records::read(quiet(1, 8, autocorrelated), &model).expect("data");
        let list = records::records(&read.data, &model, true).expect("records");
        assert_eq!(noise::find(&mut model, &list).expect("an answer").source, cause);
        let noise = model.outputs[0].noise.expect("it is written into the model");
        assert!((0.085..0.115).contains(&noise.sd()), "{noise:?}");
        assert_eq!(noise.autocorrelated_sd > 0.05, autocorrelated, "{noise:?}");
        let covered = coverage(&model, &quiet(2, 30, autocorrelated));
        assert!((0.87..0.93).contains(&covered), "{covered} with {noise:?}");
        let text = model.to_toml().expect("a model file");
        assert_eq!(
            model::parse(&text, "again.toml").expect("it is read again").outputs[0].noise,
            model.outputs[0].noise
        );
    }
}

#[test]
fn estimated_process_noise_gives_bands_with_nominal_coverage() {
    let mut model = model::parse(MODEL, "lag.toml").unwrap_or_else(|e| panic!("{e}"));
    let read = records::read(table(1, 8), &model).expect("data");
    let list = records::records(&read.data, &model, true).expect("records");
    let narrow = coverage(&model, &table(2, 20));
    let found = noise::find(&mut model, &list).expect("an answer");
    assert_eq!(found.source, NoiseSource::ProcessNoise);
    let pushed = model.states[0].process_noise.expect("it is written into the model");
    assert!(
        (0.8..1.25).contains(&pushed.sd) && (1.2..3.5).contains(&pushed.correlation_time_s),
        "{pushed:?}"
    );
    assert_eq!(found.disturbances[0].unit, "K/s");
    let wide = coverage(&model, &table(2, 20));
    assert!(narrow < 0.6 && (0.85..0.95).contains(&wide), "{narrow} without, {wide} with");
}

/// A model with two losses of which data determine only the sum, with or without a covariance that says so.
fn two_losses(covariance: &str) -> Model {
    let rate = "excess_K = \"-(first_per_s + second_per_s) * excess_K\"";
    let text = MODEL
        .replace(
            "loss_per_s = { nominal = 0.2, frozen = true }",
            "first_per_s = { nominal = 0.12, min = 0.0, max = 1.0, ci95 = [0.04, 0.2] }\n\
             second_per_s = { nominal = 0.08, min = 0.0, max = 1.0, ci95 = [0.0, 0.16] }",
        )
        .replace("excess_K = \"-loss_per_s * excess_K\"", rate)
        .replace("sd = \"estimate\"", "sd = 0.1");
    model::parse(&format!("{text}{covariance}"), "losses.toml").expect("a model")
}

#[test]
fn parameters_that_compensate_for_each_other_do_not_widen_the_bands() {
    let width = |model: &Model| {
        let options = PredictOptions { draws: 200, seed: 3, ..PredictOptions::default() };
        let subject = Subject::Equations(Box::new(model.clone()));
        let found = predict(&subject, &quiet(5, 3, false), 20, &options).expect("forecasts");
        let channel = &found.records[0].channels[0];
        channel.quantiles[4][30] - channel.quantiles[0][30]
    };
    // The variance of an interval of 0.16 is (0.16 / 3.92)^2 = 0.001666.
    let covariance =
        "[covariance]\nfirst_per_s = [0.001666, -0.001665]\nsecond_per_s = [-0.001665, 0.001666]\n";
    let [joint, independent] = [two_losses(covariance), two_losses("")].map(|model| width(&model));
    // White noise of 0.1 K alone has a 90 % band of 0.33 K.
    assert!((0.25..0.5).contains(&joint) && independent > 2.0 * joint, "{joint} {independent}");
}
