//! The report of planar pushing: what `reproduce push` writes.

mod page;

use serde::{Deserialize, Serialize};

use crate::page::{KeyFigure, Method, Provenance};
use crate::training::{Forecast, LearningCurve, TrainingRun};

/// Everything that a pushing report shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PushReport {
    /// Title.
    pub title: String,
    /// The outcome in one or two sentences.
    pub summary: String,
    /// Numbers in large type.
    #[serde(default)]
    pub key_figures: Vec<KeyFigure>,
    /// The model that the report is about: it keeps the first colour.
    pub subject: String,
    /// The tables, one entry a row; rows of one set stand together.
    pub rows: Vec<PushRow>,
    /// Error against the number of training pushes.
    #[serde(default)]
    pub curve: Vec<PushCurve>,
    /// Position error over the push, in equal parts of its duration.
    #[serde(default)]
    pub over_push: Vec<OverPush>,
    /// Forecasts over what happened.
    #[serde(default)]
    pub forecasts: Vec<Forecast>,
    /// Loss parts over the iterations.
    #[serde(default)]
    pub learning: Vec<LearningCurve>,
    /// Iterations and recipe of each net.
    #[serde(default)]
    pub training: Vec<TrainingRun>,
    /// The repeated push: clouds of displacements, the truth first.
    #[serde(default)]
    pub clouds: Vec<PushCloud>,
    /// What the clouds are.
    #[serde(default)]
    pub clouds_caption: String,
    /// Fitted parameters: name, declared value, fitted value, 95 % interval.
    #[serde(default)]
    pub parameters: Vec<(String, f64, f64, [f64; 2])>,
    /// Remarks, one paragraph each.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Commands, one per line.
    pub reproduce: Vec<String>,
    /// Methods with references.
    #[serde(default)]
    pub methods: Vec<Method>,
    /// Where it comes from.
    pub provenance: Provenance,
}

/// A row of a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PushRow {
    /// What it was measured on, e.g. `test: rect1 on abs, 628 pushes, virtual laboratory`.
    pub set: String,
    /// Model.
    pub model: String,
    /// Pushes it was trained on.
    pub train_pushes: usize,
    /// Position error over distance from the robot's base, per cent.
    pub trans_percent: f64,
    /// Position error over distance moved, per cent.
    pub moved_percent: f64,
    /// Position error, mm.
    pub pos_mm: f64,
    /// Angle error, degrees.
    pub rot_deg: f64,
    /// Continuous ranked probability score of the position, mm.
    pub crps_mm: f64,
    /// The same of the angle, degrees.
    pub crps_deg: f64,
    /// Share of true values in the 50 % band, as a fraction.
    pub coverage50: Option<f64>,
    /// Share in the 90 % band.
    pub coverage90: Option<f64>,
}

/// Error of one model against the number of training pushes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PushCurve {
    /// Model.
    pub model: String,
    /// Training pushes, ascending.
    #[serde(with = "crate::nullable")]
    pub train_pushes: Vec<f64>,
    /// Position error, mm.
    #[serde(with = "crate::nullable")]
    pub pos_mm: Vec<f64>,
    /// Angle error, degrees.
    #[serde(with = "crate::nullable")]
    pub rot_deg: Vec<f64>,
}

/// Position error of one model over the push.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OverPush {
    /// Model.
    pub model: String,
    /// Position error, mm, in equal parts of the duration.
    #[serde(with = "crate::nullable")]
    pub pos_mm: Vec<f64>,
}

/// A cloud of displacements, and how far it is from the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PushCloud {
    /// Name.
    pub name: String,
    /// Displacement along the first axis of the first pose, mm.
    #[serde(with = "crate::nullable")]
    pub x_mm: Vec<f64>,
    /// Displacement along the second axis, mm.
    #[serde(with = "crate::nullable")]
    pub y_mm: Vec<f64>,
    /// Chamfer distance to the truth, mm; absent for the truth.
    pub chamfer_mm: Option<f64>,
    /// The same over that of a second truth.
    pub over_floor: Option<f64>,
    /// Energy distance to the truth, mm.
    pub energy_mm: Option<f64>,
}

/// The report as one HTML page.
#[must_use]
pub fn push_report(report: &PushReport) -> String {
    page::page(report).render()
}
