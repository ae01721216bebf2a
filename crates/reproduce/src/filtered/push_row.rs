//! Rows of the table of pushes with a measured prefix.

use augsim_trainer::filter::FilteredScore;
use serde::Serialize;

/// Scores of one model on pushes with one prefix length.
#[derive(Debug, Serialize)]
pub struct Row {
    /// Name of the protocol, always `filtered`.
    pub protocol: &'static str,
    /// `repeat`: one repeated push; `mit`: pushes at different places, angles and speeds.
    pub layout: &'static str,
    pub model: &'static str,
    /// Prefix length in s (next field: in samples); `None` if it differs between pushes.
    pub seen_s: Option<f64>,
    pub seen: Option<usize>,
    /// Measured share of the samples in %; `None` if it differs between pushes.
    pub seen_percent: Option<f64>,
    /// Number of test pushes.
    pub pushes: usize,
    /// Position error (mm) of the median over the forecast rows; the next field is the angle error (degrees).
    pub position_mm: f64,
    pub rotation_deg: f64,
    /// Position error (mm) of the median over the last 70 % of the samples, the same for every prefix length.
    pub late_position_mm: f64,
    pub late_rotation_deg: f64,
    /// Continuous ranked probability score of the position (mm) over forecast rows; next field: of the angle.
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
            position_mm: 1e3 * s.forecast_rows[0],
            rotation_deg: s.forecast_rows[1].to_degrees(),
            late_position_mm: 1e3 * s.last_70_percent[0],
            late_rotation_deg: s.last_70_percent[1].to_degrees(),
            crps_mm: 1e3 * s.crps[0],
            crps_deg: s.crps[1].to_degrees(),
            coverage50: s.coverage50,
            coverage90: s.coverage90,
        }
    }

    /// Sets the measured fraction of the samples, shown in %.
    pub fn with_prefix_share(self, share: f64) -> Self {
        Row { seen_percent: Some(100.0 * share), ..self }
    }

    /// Describes the prefix length: in s, or in % of the samples.
    pub fn prefix(&self) -> String {
        match (self.seen_s, self.seen_percent) {
            (Some(seconds), _) => format!("{seconds} s"),
            (None, percent) => format!("{} %", percent.unwrap_or_default()),
        }
    }
}
