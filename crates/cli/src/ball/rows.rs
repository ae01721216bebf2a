//! Rows of the ball's table.

use augsim_trainer::Protocol;
use augsim_trainer::score::{PointError, Score};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// Errors of a point estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean over trajectories of sum |error| / sum |height|, per cent.
    pub trans_percent: f64,
    /// Mean absolute error of the height, m.
    pub pos_m: f64,
    /// Mean absolute error of the velocity, m/s.
    pub vel_m_s: f64,
}

impl Errors {
    fn of(e: &PointError) -> Self {
        Errors { trans_percent: e.trans_percent, pos_m: e.absolute[0], vel_m_s: e.absolute[1] }
    }
}

/// One model under one protocol.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Model.
    pub model: String,
    /// What it could see.
    pub protocol: Protocol,
    /// How samples became the one prediction of the next three numbers.
    pub estimate: String,
    /// Errors of that estimate.
    #[serde(flatten)]
    pub errors: Errors,
    /// Errors of the median of 100 samples, where there are samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median_of_100: Option<Errors>,
    /// Continuous ranked probability score of the height, m.
    pub crps_pos_m: Option<f64>,
    /// The same of the velocity, m/s.
    pub crps_vel_m_s: Option<f64>,
    /// Share of true values in the 50 % band.
    pub coverage50: Option<f64>,
    /// Share in the 90 % band.
    pub coverage90: Option<f64>,
}

impl Row {
    /// Of a model that samples: the paper's mean of 10, and the median of 100.
    pub fn of_net(model: &str, protocol: Protocol, score: &Score) -> Self {
        Row {
            model: model.to_owned(),
            protocol,
            estimate: "mean of 10".to_owned(),
            errors: Errors::of(&score.mean),
            median_of_100: Some(Errors::of(&score.median)),
            crps_pos_m: Some(score.crps[0]),
            crps_vel_m_s: Some(score.crps[1]),
            coverage50: score.coverage50,
            coverage90: score.coverage90,
        }
    }

    /// Of a model that always predicts the same. Its CRPS is its absolute error.
    pub fn of_point(model: &str, score: &Score) -> Self {
        Row {
            estimate: "single".to_owned(),
            median_of_100: None,
            ..Row::of_net(model, Protocol::Forecast, score)
        }
    }

    /// Of the floor: the conditional median, which has no samples.
    pub fn of_floor(errors: Errors, [crps_pos_m, crps_vel_m_s]: [f64; 2]) -> Self {
        Row {
            model: "Floor".to_owned(),
            protocol: Protocol::Floor,
            estimate: "median of the law".to_owned(),
            errors,
            median_of_100: None,
            crps_pos_m: Some(crps_pos_m),
            crps_vel_m_s: Some(crps_vel_m_s),
            coverage50: None,
            coverage90: None,
        }
    }
}

/// The rows as text, one block per protocol: what one protocol gives is not comparable with another.
pub fn table(rows: &[Row]) -> String {
    let mut out = String::new();
    let width = rows.iter().map(|r| r.model.chars().count()).max().unwrap_or(0).max(10);
    for protocol in [Protocol::Forecast, Protocol::Reconstruction, Protocol::Floor] {
        let mut rows = rows.iter().filter(|r| r.protocol == protocol).peekable();
        if rows.peek().is_none() {
            continue;
        }
        let explanation = match protocol {
            Protocol::Forecast => "the model sees the first state only",
            Protocol::Reconstruction => "the encoder sees the whole trajectory: not a prediction",
            Protocol::Floor => "the best from the first state, from the known law of the data",
        };
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{} ({explanation})", protocol.label());
        let _ = writeln!(
            out,
            "  {:<width$} {:<18} {:>8} {:>8} {:>8} {:>8} {:>9} {:>6} {:>6}",
            "model", "estimate", "trans %", "pos m", "vel m/s", "CRPS m", "CRPS m/s", "in 50%", "in 90%"
        );
        for r in rows {
            let score = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{v:.4}"));
            let share = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.1}", 100.0 * v));
            let _ = writeln!(
                out,
                "  {:<width$} {:<18} {:>8.2} {:>8.4} {:>8.4} {:>8} {:>9} {:>6} {:>6}",
                r.model,
                r.estimate,
                r.errors.trans_percent,
                r.errors.pos_m,
                r.errors.vel_m_s,
                score(r.crps_pos_m),
                score(r.crps_vel_m_s),
                share(r.coverage50),
                share(r.coverage90),
            );
            if let Some(m) = &r.median_of_100 {
                let _ = writeln!(
                    out,
                    "  {:<width$} {:<18} {:>8.2} {:>8.4} {:>8.4}",
                    "", "median of 100", m.trans_percent, m.pos_m, m.vel_m_s
                );
            }
        }
        out.push('\n');
    }
    out
}
