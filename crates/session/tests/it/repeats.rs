//! Contract: the scatter between recordings with the same inputs is that of the model's errors. What follows from
//! different starts is no scatter, and what a complete model leaves is not common to the repeats.

use augsim_data::random_stream;
use augsim_equations::model;
use augsim_session::{DataFrom, DiscoverRequest, Subject, discover};
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;

const MODEL: &str = "scenario = \"system\"\n[states]\nexcess_K = { start = \"reading_K\" }\n[inputs]\nheater_W = { hold = \"zero\" }\n\
    [parameters]\nloss_per_s = { nominal = 0.15, min = 0.01, max = 1.0 }\ngain_K_per_J = { nominal = 0.8, min = 0.1, max = 5.0 }\n\
    [rates]\nexcess_K = \"gain_K_per_J * heater_W - loss_per_s * excess_K\"\n[outputs]\nreading_K = { value = \"excess_K\", sd = \"estimate\" }\n";
const STEP_S: f64 = 0.5;
const NOISE_K: f64 = 0.1;

/// Simulates five recordings of a heated block with the same steps of the heater, which begin 0 to 40 K above the surroundings.
fn table() -> DataFrom {
    let mut csv = "trajectory,t_s,heater_W,reading_K\n".to_owned();
    for j in 0..5_u32 {
        let mut rng = random_stream(7, "repeats", u64::from(j));
        let mut excess = 10.0 * f64::from(j);
        for k in 0..200_u32 {
            let heater = if k / 40 % 2 == 0 { 2.0 } else { 0.5 };
            let noise: f64 = StandardNormal.sample(&mut rng);
            // Writing to a string cannot fail.
            let _ = writeln!(csv, "{j},{},{heater},{}", STEP_S * f64::from(k), excess + NOISE_K * noise);
            let kept = (-0.2 * STEP_S).exp();
            excess = kept * excess + (1.0 - kept) / 0.2 * heater;
        }
    }
    DataFrom::Table { name: "repeats".into(), csv: csv.into_bytes().into() }
}

#[test]
fn different_starts_are_no_scatter() {
    let subject =
        Subject::Equations(Box::new(model::parse(MODEL, "block.toml").unwrap_or_else(|e| panic!("{e}"))));
    let found = discover(&subject, &table(), &DiscoverRequest::default(), &mut |_| {}).expect("an answer");
    let repeats = &found.repeats[0];
    assert_eq!(
        (&*repeats.output, &*repeats.unit, repeats.recordings, repeats.sets),
        ("reading_K", "K", 5, 1)
    );
    assert!((0.09..0.11).contains(&repeats.sd), "{repeats:?}");
    // Errors of the fitted initial states fade slowly and do not average out over time.
    assert!(repeats.common < 0.05, "{repeats:?}");
    assert!(
        found.notes.iter().any(|note| note.contains("5 recordings have the same inputs")),
        "{:?}",
        found.notes
    );
}
