//! What an experiment with pushes comes to.

use super::repeat::{Clouds, Repeated};
use super::rows::{Row, sets};
use crate::session::Trained;
use augsim_trainer::push::calibrate::Estimate;
use augsim_trainer::{Forecaster, Losses, Recipe, Sequences};
use serde::Serialize;
use std::fmt::Write;

/// A point of the training-set-size curve, on the test pushes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Model.
    pub model: String,
    /// Training pushes.
    pub train_pushes: usize,
    /// Position error of the mean of 100 samples, mm.
    pub pos_mm: f64,
    /// Angle error, degrees.
    pub rot_deg: f64,
    /// Continuous ranked probability score of the position, mm.
    pub crps_mm: f64,
}

/// What `result.json` holds.
#[derive(Debug, Serialize)]
pub struct ResultFile {
    /// `augsim.reproduce/1`.
    pub schema: &'static str,
    /// `push`.
    pub scenario: &'static str,
    /// `virtual laboratory` or `published MIT Push files`.
    pub data: &'static str,
    /// The tables; each row says what it was measured on.
    pub rows: Vec<Row>,
    /// Training-set-size curve.
    pub curve: Vec<CurvePoint>,
    /// The repeated push; absent on published files.
    pub repeated: Option<Repeated>,
    /// Parameters fitted to the measured runs; absent without them.
    pub calibration: Option<Vec<Estimate>>,
    /// Measured runs that were tested on.
    pub test_runs: Vec<String>,
    /// Most samples of a push and samples a second, after thinning.
    pub thinning: [f64; 2],
    /// Iterations of the paper's nets, and of Hybrid+ and Neural+.
    pub iterations: [u64; 2],
    /// Remarks about the data.
    pub notes: Vec<String>,
    /// Seed.
    pub seed: u64,
}

/// What the report draws, beside the result.
pub struct Drawn<'a> {
    /// Nets trained on the whole set.
    pub nets: &'a [Trained],
    /// Other models that sample.
    pub others: Vec<&'a dyn Forecaster>,
    /// Losses of each net.
    pub losses: Vec<(Recipe, Vec<Losses>)>,
    /// Position error over the push, by model.
    pub over_push: Vec<(String, Vec<f64>)>,
    /// The test pushes.
    pub test: &'a Sequences,
    /// Clouds of the repeated push.
    pub clouds: Option<&'a Clouds>,
}

/// The tables as text: one a set, the repeated push, the fitted parameters.
pub fn table(result: &ResultFile) -> String {
    let mut out = sets(&result.rows);
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
