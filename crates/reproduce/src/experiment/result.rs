//! `result.json` of an experiment.

use super::repeat::Repeated;
use super::rows::{self, Row};
use augsim_trainer::Protocol;
use augsim_trainer::push::calibrate::Estimate;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A point of the learning curve: errors on the test set for one training-set size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Name of the model.
    pub model: String,
    /// Number of training pushes.
    pub train_pushes: usize,
    /// Position error of the mean of 100 samples, mm.
    pub pos_mm: f64,
    /// Angle error of the mean of 100 samples, degrees.
    pub rot_deg: f64,
    /// Continuous ranked probability score of the position, mm.
    pub crps_mm: f64,
}

/// Content of `result.json`; missing parts are omitted.
#[derive(Debug, Serialize)]
pub struct ResultFile {
    /// Name and version of the file format: `augsim.reproduce/1`.
    pub schema: &'static str,
    /// Name of the scenario: `ball` or `push`.
    pub scenario: &'static str,
    /// Name of the test set, if there is only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test_set: Option<String>,
    /// Number of test trajectories.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test_trajectories: Option<usize>,
    /// Source of the pushes: `virtual laboratory` or `published MIT Push files`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<&'static str>,
    /// Rows of the tables; each names its test set.
    pub rows: Vec<Row>,
    /// Points of the learning curve.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<CurvePoint>,
    /// Comparison of models on one repeated push.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeated: Option<Repeated>,
    /// Parameters of the physics that were fitted to the measured runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Vec<Estimate>>,
    /// Names of the measured test runs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub test_runs: Vec<String>,
    /// After subsampling: `[maximum number of samples of a trajectory, maximum samples per second]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thinning: Option<[f64; 2]>,
    /// Number of training iterations, by model name.
    pub iterations: BTreeMap<String, u64>,
    /// Remarks about the data.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Seed of generated data and of the training.
    pub seed: u64,
}

impl ResultFile {
    /// Returns the row of the forecasts of a model on the first test set; `None` if it has none.
    pub fn forecast(&self, model: &str) -> Option<&Row> {
        let first = self.rows.first().and_then(Row::set);
        self.rows
            .iter()
            .find(|r| r.model == model && r.set() == first && r.protocol != Protocol::Reconstruction)
    }
}

/// Formats the text tables: one per test set, the repeated push, the fitted parameters.
pub fn table(result: &ResultFile) -> String {
    let mut out = rows::table(&result.rows);
    if let Some(r) = &result.repeated {
        let _ = writeln!(
            out,
            "\none push {} times, {} s after its start, {}\n  {:<16} {:>10} {:>8} {:>10}",
            r.points, r.horizon_s, r.data, "cloud", "Chamfer mm", "x floor", "energy mm"
        );
        for d in &r.distances {
            let _ = writeln!(
                out,
                "  {:<16} {:>10.4} {:>8.2} {:>10.4}",
                d.model, d.chamfer_mm, d.over_floor, d.energy_mm
            );
        }
    }
    for e in result.calibration.iter().flatten() {
        let _ = writeln!(
            out,
            "fitted {:<18} {:.5} [{:.5}, {:.5}], declared {:.5}",
            e.name, e.value, e.ci95[0], e.ci95[1], e.nominal
        );
    }
    out
}
