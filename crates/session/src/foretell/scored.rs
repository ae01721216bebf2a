//! Scores of draws beside what was measured, output by output.

use super::drawn::Drawn;
use crate::written::forecast::{FreeRun, Row, rows};
use augsim_trainer::score::{crps_of, quantile};
use augsim_written::Model;
use serde::Serialize;

/// Scores of an output by one model.
#[derive(Debug, Serialize)]
pub struct ScoredRow {
    /// Who forecasts.
    pub model: String,
    /// Errors of the forecast.
    #[serde(flatten)]
    pub row: Row,
    /// Continuous ranked probability score of the draws, in the unit of the output.
    pub crps: f64,
    /// Share of the measured values in the central 50 % band of the draws.
    pub coverage50: f64,
    /// Share in the central 90 % band.
    pub coverage90: f64,
}

/// Scores of all outputs over everything behind the first samples.
pub fn scored(name: &str, model: &Model, list: &[Drawn]) -> Vec<ScoredRow> {
    let run = |drawn: &Drawn| FreeRun {
        times: drawn.times.clone(),
        measured: drawn.measured.clone(),
        foretold: drawn.forecast.clone(),
        first: drawn.known,
    };
    let runs: Vec<FreeRun> = list.iter().map(run).collect();
    let of = |(o, row): (usize, Row)| {
        let period = model.outputs[o].period;
        let (mut crps, mut inside, mut count) = (0.0, [0.0; 2], 0.0);
        for drawn in list {
            for k in (drawn.known..drawn.times.len()).filter(|&k| drawn.measured[o][k].is_finite()) {
                let truth = drawn.measured[o][k];
                let near = |v: &f64| match period {
                    Some(period) => v - period * ((v - truth) / period).round(),
                    None => *v,
                };
                let mut near: Vec<f32> = drawn.draws[o][k].iter().map(|v| near(v) as f32).collect();
                near.sort_unstable_by(f32::total_cmp);
                crps += crps_of(&near, truth);
                for (inside, level) in inside.iter_mut().zip([0.5, 0.9]) {
                    let [low, high] = [0.5 - 0.5 * level, 0.5 + 0.5 * level].map(|q| quantile(&near, q));
                    *inside += f64::from(u8::from((low..=high).contains(&truth)));
                }
                count += 1.0;
            }
        }
        let [coverage50, coverage90] = inside.map(|n| n / f64::max(count, 1.0));
        let crps = crps / f64::max(count, 1.0);
        ScoredRow { model: name.to_owned(), row, crps, coverage50, coverage90 }
    };
    rows(model, &runs).into_iter().enumerate().map(of).collect()
}
