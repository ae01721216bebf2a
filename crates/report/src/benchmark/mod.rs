//! The report of a benchmark, as `reproduce` and `demo` write it: models scored on test sets.
//!
//! Empty sections are left out.

mod curves;
mod page;
mod sections;
mod tones;

use serde::{Deserialize, Serialize};

use crate::page::{Column, KeyFigure, Method, Provenance};

/// Content of the report of a benchmark.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BenchmarkReport {
    /// Kind of report, e.g. `training report · ball`.
    pub kind: String,
    /// Title, e.g. `Bouncing ball: forecasts from the initial state`.
    pub title: String,
    /// The outcome in one or two sentences.
    pub summary: String,
    /// The model that the report is about, e.g. `Hybrid`; it has the first colour.
    pub subject: String,
    /// Word for one and for several trajectories, e.g. `push`, `pushes`.
    #[serde(default)]
    pub words: [String; 2],
    /// Key figures, shown in large type.
    #[serde(default)]
    pub key_figures: Vec<KeyFigure>,
    /// One table for each test set.
    pub results: Vec<Results>,
    /// Error over the size of the training set: one entry per model and measure.
    #[serde(default)]
    pub sizes: Vec<Curve>,
    /// Displacements in a repeated experiment, one cloud each for the truth (first) and the models.
    #[serde(default)]
    pub clouds: Vec<Cloud>,
    /// Caption of the clouds.
    #[serde(default)]
    pub clouds_caption: String,
    /// Forecasts over true trajectories: one entry per model, trajectory and channel.
    #[serde(default)]
    pub forecasts: Vec<Forecast>,
    /// Error over time: one entry per model, protocol and channel.
    #[serde(default)]
    pub errors: Vec<ErrorCurve>,
    /// Error of a measure over equal parts of the duration: one entry per model.
    #[serde(default)]
    pub parts: Vec<Curve>,
    /// Caption of the errors over parts of the duration.
    #[serde(default)]
    pub parts_caption: String,
    /// Fitted parameters: name, declared value, fitted value, 95 % interval.
    #[serde(default)]
    pub parameters: Vec<(String, f64, f64, [f64; 2])>,
    /// Loss parts over the iterations, one entry per trained model.
    #[serde(default)]
    pub learning: Vec<LearningCurve>,
    /// Iterations of each trained model, and its recipe.
    #[serde(default)]
    pub training: Vec<TrainingRun>,
    /// Remarks, one paragraph each.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Commands that reproduce the results.
    pub reproduce: Vec<String>,
    /// Methods with references.
    #[serde(default)]
    pub methods: Vec<Method>,
    /// Version, seed and data.
    pub provenance: Provenance,
}

/// How a prediction was made. Numbers of different protocols are never compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// Prediction from the initial state alone, with samples from the prior.
    #[default]
    Forecast,
    /// Reconstruction of a trajectory that the encoder has seen; not a prediction.
    Reconstruction,
    /// Smallest possible error of a prediction from the initial state, computed from the known equations.
    Floor,
}

impl Protocol {
    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forecast => "forecast",
            Self::Reconstruction => "reconstruction",
            Self::Floor => "floor",
        }
    }
}

/// Models on one test set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Meaning of the numbers, and the test set.
    pub caption: String,
    /// Columns of the numbers.
    pub columns: Vec<Column>,
    /// The rows.
    pub rows: Vec<ResultRow>,
    /// Notes under the table.
    #[serde(default)]
    pub footnotes: Vec<String>,
}

/// Results of a model under a protocol; absent values are shown as "–".
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResultRow {
    /// Model, e.g. `Hybrid`.
    pub model: String,
    /// Protocol.
    pub protocol: Protocol,
    /// How samples were combined into one prediction, e.g. `mean of 10`.
    ///
    /// The columns for protocol and prediction are shown if any row has this.
    #[serde(default)]
    pub estimator: String,
    /// One number per column, in its unit.
    pub values: Vec<Option<f64>>,
}

/// A curve of one model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Model.
    pub model: String,
    /// Measure, e.g. `Position`.
    pub measure: String,
    /// Its unit.
    pub unit: String,
    /// Horizontal values, ascending.
    #[serde(with = "crate::nullable")]
    pub x: Vec<f64>,
    /// Errors.
    #[serde(with = "crate::nullable")]
    pub y: Vec<f64>,
}

/// Loss parts of one model over the iterations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LearningCurve {
    /// Model.
    pub model: String,
    /// Iteration numbers, ascending.
    #[serde(with = "crate::nullable")]
    pub iteration: Vec<f64>,
    /// Parts, e.g. KL and reconstruction, each with one value per iteration.
    pub parts: Vec<LossPart>,
}

/// One part of a loss.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LossPart {
    /// Name, e.g. `KL`; the same in every model.
    pub name: String,
    /// Unit, e.g. `nats per step`.
    pub unit: String,
    /// One value per iteration; NaN where missing.
    #[serde(with = "crate::nullable")]
    pub values: Vec<f64>,
}

/// A forecast of one channel of one trajectory. All vectors have one value per time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Model.
    pub model: String,
    /// Trajectory, e.g. `trajectory 17`.
    pub trajectory: String,
    /// Channel, e.g. `height`.
    pub channel: String,
    /// Its unit, e.g. `m`.
    pub unit: String,
    /// Times, s.
    #[serde(with = "crate::nullable")]
    pub t_s: Vec<f64>,
    /// The measured values.
    #[serde(with = "crate::nullable")]
    pub truth: Vec<f64>,
    /// Median of the samples, or the only prediction of a deterministic model.
    #[serde(with = "crate::nullable")]
    pub median: Vec<f64>,
    /// 25 % quantile; empty for a deterministic model.
    #[serde(default, with = "crate::nullable")]
    pub lower50: Vec<f64>,
    /// 75 % quantile.
    #[serde(default, with = "crate::nullable")]
    pub upper50: Vec<f64>,
    /// 5 % quantile.
    #[serde(default, with = "crate::nullable")]
    pub lower90: Vec<f64>,
    /// 95 % quantile.
    #[serde(default, with = "crate::nullable")]
    pub upper90: Vec<f64>,
}

/// Mean absolute error over the test trajectories at each time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorCurve {
    /// Model; for the floor, the name of its predictor.
    pub model: String,
    /// Protocol.
    pub protocol: Protocol,
    /// Channel, e.g. `height`.
    pub channel: String,
    /// Its unit.
    pub unit: String,
    /// Times, s.
    #[serde(with = "crate::nullable")]
    pub t_s: Vec<f64>,
    /// Mean absolute error at each time.
    #[serde(with = "crate::nullable")]
    pub error: Vec<f64>,
}

/// How a model was trained.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrainingRun {
    /// Model.
    pub model: String,
    /// Short description of the recipe.
    pub recipe: String,
    /// Number of trained parameters.
    pub parameters: Option<u64>,
    /// Number of iterations.
    pub iterations: Option<u64>,
}

/// A cloud of displacements, with its distance from the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cloud {
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
    /// Chamfer distance to the truth, divided by that of a second truth.
    pub over_floor: Option<f64>,
    /// Energy distance to the truth, mm.
    pub energy_mm: Option<f64>,
}

/// The report as one HTML page.
#[must_use]
pub fn benchmark_report(report: &BenchmarkReport) -> String {
    page::page(report).render()
}
