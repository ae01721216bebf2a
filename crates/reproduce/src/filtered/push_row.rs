//! Rows of the table of filtered pushes.

use augsim_trainer::filter::FilteredScore;
use serde::Serialize;

/// A model behind a prefix.
#[derive(Debug, Serialize)]
pub struct Row {
    /// Always `filtered`.
    pub protocol: &'static str,
    /// `repeat`: one push over tables that differ; `mit`: pushes at many places, angles and speeds.
    pub layout: &'static str,
    pub model: &'static str,
    /// Seconds and samples seen, where they are the same for every push.
    pub seen_s: Option<f64>,
    pub seen: Option<usize>,
    /// Share of a push's samples that is seen, %, where that is.
    pub seen_percent: Option<f64>,
    /// Test pushes.
    pub pushes: usize,
    /// Errors of the median over the rest.
    pub position_mm: f64,
    pub rotation_deg: f64,
    /// The same in the last seven tenths of the samples, whatever the prefix.
    pub late_position_mm: f64,
    pub late_rotation_deg: f64,
    /// Continuous ranked probability scores over the rest.
    pub crps_mm: f64,
    pub crps_deg: f64,
    pub coverage50: Option<f64>,
    pub coverage90: Option<f64>,
}

impl Row {
    pub fn new(layout: &'static str, model: &'static str, s: &FilteredScore) -> Self {
        Row {
            protocol: "filtered",
            layout,
            model,
            seen_s: None,
            seen: None,
            seen_percent: None,
            pushes: s.trajectories,
            position_mm: 1e3 * s.rest[0],
            rotation_deg: s.rest[1].to_degrees(),
            late_position_mm: 1e3 * s.common[0],
            late_rotation_deg: s.common[1].to_degrees(),
            crps_mm: 1e3 * s.crps[0],
            crps_deg: s.crps[1].to_degrees(),
            coverage50: s.coverage50,
            coverage90: s.coverage90,
        }
    }

    /// The row as behind a share of the samples.
    pub fn behind_share(self, share: f64) -> Self {
        Row { seen_percent: Some(100.0 * share), ..self }
    }

    /// Words for what is seen.
    pub fn prefix(&self) -> String {
        match (self.seen_s, self.seen_percent) {
            (Some(seconds), _) => format!("{seconds} s"),
            (None, percent) => format!("{} %", percent.unwrap_or_default()),
        }
    }
}
