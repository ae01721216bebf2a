//! Contract: noise that was found on some trajectories makes the bands of forecasts of others hold what they promise: process noise, without
//! which they are far too narrow; white measurement noise, and autocorrelated measurement noise.

use augsim_data::random_stream;
use augsim_discovery::{ForetellOptions, ShakenBy};
use augsim_session::foretell::foretell;
use augsim_session::written::{noise, records};
use augsim_session::{DataFrom, Subject};
use augsim_written::{Model, model};
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;

const MODEL: &str = "scenario = \"system\"\n[states]\nexcess_K = { start = \"reading_K\" }\n\
    [parameters]\nloss_per_s = { nominal = 0.2, frozen = true }\n[rates]\nexcess_K = \"-loss_per_s * excess_K\"\n\
    [outputs]\nreading_K = { value = \"excess_K\", sd = \"estimate\" }\n";
const STEP_S: f64 = 0.5;
const SAMPLES: usize = 200;
/// Samples that a start is fitted to: so few that they alone say little of the noise.
const BURN_IN: usize = 5;

/// Trajectories that a wandering rate of 1 K/s pushes for some 2 s at a time, read with 0.1 K.
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

/// Share of what is measured after the burn-in that is in the 90 % bands.
fn cover(model: &Model, data: &DataFrom) -> f64 {
    let options = ForetellOptions { draws: 200, seed: 3, ..ForetellOptions::default() };
    let subject = Subject::Written(Box::new(model.clone()));
    let found = foretell(&subject, data, BURN_IN, &options).expect("forecasts");
    let (mut inside, mut count) = (0, 0);
    for record in &found.records {
        let channel = &record.channels[0];
        for k in record.known..record.times.len() {
            let [low, high] = [0, channel.quantiles.len() - 1].map(|q| channel.quantiles[q][k]);
            inside += usize::from((low..=high).contains(&channel.measured[k]));
            count += 1;
        }
    }
    f64::from(inside as u32) / f64::from(count as u32)
}

/// Trajectories without process noise, read with 0.1 K of white noise, or with an error of 0.1 K that lasts for some 2 s.
fn quiet(seed: u64, trajectories: usize, lasting: bool) -> DataFrom {
    let mut csv = "trajectory,t_s,reading_K\n".to_owned();
    for j in 0..trajectories {
        let mut rng = random_stream(seed, "measurement noise", j as u64);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let kept = if lasting { (-STEP_S / 2.0_f64).exp() } else { 0.0 };
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

/// The start is fitted to the first samples alone: bands have to hold although these few say little of the sensor.
#[test]
fn measurement_noise_that_a_fit_found_makes_bands_that_hold() {
    for (lasting, cause) in [(false, ShakenBy::Sensor), (true, ShakenBy::LastingSensor)] {
        let mut model = model::parse(MODEL, "lag.toml").unwrap_or_else(|e| panic!("{e}"));
        let read = records::read(quiet(1, 8, lasting), &model).expect("data");
        let list = records::records(&read.data, &model, true).expect("records");
        assert_eq!(noise::find(&mut model, &list).expect("an answer").by, cause);
        let noise = model.outputs[0].noise.expect("it is written into the model");
        assert!((0.085..0.115).contains(&noise.sd()), "{noise:?}");
        assert_eq!(noise.autocorrelated_sd > 0.05, lasting, "{noise:?}");
        let held = cover(&model, &quiet(2, 30, lasting));
        assert!((0.87..0.93).contains(&held), "{held} with {noise:?}");
        let text = model.to_toml().expect("a model file");
        assert_eq!(
            model::parse(&text, "again.toml").expect("it is read again").outputs[0].noise,
            model.outputs[0].noise
        );
    }
}

#[test]
fn noise_of_the_motion_makes_bands_as_wide_as_forecasts_miss() {
    let mut model = model::parse(MODEL, "lag.toml").unwrap_or_else(|e| panic!("{e}"));
    let read = records::read(table(1, 8), &model).expect("data");
    let list = records::records(&read.data, &model, true).expect("records");
    let narrow = cover(&model, &table(2, 20));
    let found = noise::find(&mut model, &list).expect("an answer");
    assert_eq!(found.by, ShakenBy::Motion);
    let pushed = model.states[0].shaken.expect("it is written into the model");
    assert!((0.8..1.25).contains(&pushed.sd) && (1.2..3.5).contains(&pushed.memory_s), "{pushed:?}");
    assert_eq!(found.lasting[0].unit, "K/s");
    let wide = cover(&model, &table(2, 20));
    assert!(narrow < 0.6 && (0.85..0.95).contains(&wide), "{narrow} without, {wide} with");
}
