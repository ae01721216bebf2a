//! Scores of predictions against measured values: RMSE, CRPS and coverage of the bands, by output.

use super::draws::RecordDraws;
use crate::equations::forecast::{FreeRun, Row, rows};
use augsim_equations::Model;
use augsim_trainer::score::{crps_from_samples, quantile};
use serde::Serialize;

/// Scores of one model's predictions of one output.
#[derive(Debug, Serialize)]
pub struct OutputScores {
    /// Name of the model that predicts.
    pub model: String,
    /// Errors of the noise-free prediction of the output.
    #[serde(flatten)]
    pub row: Row,
    /// Continuous ranked probability score of the draws (CRPS), in the unit of the output.
    pub crps: f64,
    /// Share of the measured values in the central 50 % band of the draws, from 0 to 1.
    pub coverage50: f64,
    /// Share of the measured values in the central 90 % band of the draws, from 0 to 1.
    pub coverage90: f64,
}

/// Computes the scores of all outputs over the samples after the burn-in.
pub fn scores(name: &str, model: &Model, list: &[RecordDraws]) -> Vec<OutputScores> {
    let run = |drawn: &RecordDraws| FreeRun {
        times: drawn.times.clone(),
        measured: drawn.measured.clone(),
        predicted: drawn.forecast.clone(),
        first: drawn.initial_sample_count,
    };
    let runs: Vec<FreeRun> = list.iter().map(run).collect();
    let score = |(o, row): (usize, Row)| {
        let period = model.outputs[o].period;
        let (mut crps, mut inside, mut count) = (0.0, [0.0; 2], 0.0);
        for drawn in list {
            for k in
                (drawn.initial_sample_count..drawn.times.len()).filter(|&k| drawn.measured[o][k].is_finite())
            {
                let truth = drawn.measured[o][k];
                // Of a periodic output each draw is moved by whole periods to the value nearest to the
                // measured one.
                let unwrap = |v: &f64| match period {
                    Some(period) => v - period * ((v - truth) / period).round(),
                    None => *v,
                };
                let mut sorted: Vec<f32> = drawn.draws[o][k].iter().map(|v| unwrap(v) as f32).collect();
                sorted.sort_unstable_by(f32::total_cmp);
                crps += crps_from_samples(&sorted, truth);
                for (inside, level) in inside.iter_mut().zip([0.5, 0.9]) {
                    let [low, high] = [0.5 - 0.5 * level, 0.5 + 0.5 * level].map(|q| quantile(&sorted, q));
                    *inside += f64::from(u8::from((low..=high).contains(&truth)));
                }
                count += 1.0;
            }
        }
        let [coverage50, coverage90] = inside.map(|n| n / f64::max(count, 1.0));
        let crps = crps / f64::max(count, 1.0);
        OutputScores { model: name.to_owned(), row, crps, coverage50, coverage90 }
    };
    rows(model, &runs).into_iter().enumerate().map(score).collect()
}
