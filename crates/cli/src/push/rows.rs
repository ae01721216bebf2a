//! Rows of the pushing tables.

use super::data::Set;
use augsim_trainer::push::score::{PushError, PushScore};
use serde::Serialize;
use std::fmt::Write;

/// One model on one set of pushes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Where the pushes come from.
    pub data: &'static str,
    /// Model.
    pub model: String,
    /// `forecast`: the model sees the first pose and the rod's path.
    pub protocol: &'static str,
    /// Support.
    pub surface: String,
    /// Object.
    pub object: String,
    /// `test`, `unseen surface`, `unseen object`, `test runs`, `test runs without knocks`.
    pub split: &'static str,
    /// Pushes (or windows) that the model was trained on.
    pub train_pushes: usize,
    /// Pushes (or windows) that it is scored on.
    pub test_pushes: usize,
    /// How samples became the prediction of the next numbers.
    pub estimate: &'static str,
    /// Errors of that estimate.
    #[serde(flatten)]
    pub errors: PushError,
    /// Errors of the mean of 10 samples, the paper's estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_of_10: Option<PushError>,
    /// Continuous ranked probability score, mean of x and y, mm.
    pub crps_mm: f64,
    /// The same of the angle, degrees.
    pub crps_deg: f64,
    /// Share of true values in the 50 % band.
    pub coverage50: Option<f64>,
    /// Share in the 90 % band.
    pub coverage90: Option<f64>,
}

impl Row {
    /// A scored model.
    pub fn new(data: &'static str, model: &str, set: &Set, train_pushes: usize, s: &PushScore) -> Self {
        let sampled = s.coverage50.is_some();
        Row {
            data,
            model: model.to_owned(),
            protocol: "forecast",
            surface: set.surface.clone(),
            object: set.object.clone(),
            split: set.split,
            train_pushes,
            test_pushes: s.pushes,
            estimate: if sampled { "mean of 100" } else { "single" },
            errors: s.mean,
            mean_of_10: sampled.then_some(s.mean_of_10),
            crps_mm: s.crps_mm,
            crps_deg: s.crps_deg,
            coverage50: s.coverage50,
            coverage90: s.coverage90,
        }
    }

    /// What the row was measured on, in a few words.
    pub fn set(&self) -> String {
        format!(
            "{}: {} on {}, {} pushes, {}",
            self.split, self.object, self.surface, self.test_pushes, self.data
        )
    }
}

/// One table of each set that the rows were measured on.
pub fn sets(rows: &[Row]) -> String {
    let width = rows.iter().map(|r| r.model.chars().count()).max().unwrap_or(0).max(16);
    let mut out = String::new();
    let mut set = String::new();
    for r in rows {
        if r.set() != set {
            set = r.set();
            let _ = writeln!(
                out,
                "{}{set}\n  {:<width$} {:>6} {:>8} {:>8} {:>8} {:>8} {:>9} {:>9} {:>7} {:>6}",
                if out.is_empty() { "" } else { "\n" },
                "model",
                "train",
                "trans %",
                "moved %",
                "pos mm",
                "rot deg",
                "CRPS mm",
                "CRPS deg",
                "in 50%",
                "in 90%"
            );
        }
        let share = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.1}", 100.0 * v));
        let e = &r.errors;
        let _ = writeln!(
            out,
            "  {:<width$} {:>6} {:>8.3} {:>8.2} {:>8.3} {:>8.3} {:>9.3} {:>9.3} {:>7} {:>6}",
            r.model,
            r.train_pushes,
            e.trans_percent,
            e.moved_percent,
            e.pos_mm,
            e.rot_deg,
            r.crps_mm,
            r.crps_deg,
            share(r.coverage50),
            share(r.coverage90)
        );
    }
    out
}
