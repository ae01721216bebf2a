//! The report of a benchmark, as `reproduce` and `demo` write it: models scored on test sets.
//!
//! Empty sections are left out.

mod curves;
mod page;
mod sections;
mod tones;

use serde::{Deserialize, Serialize};

use crate::page::{Column, KeyFigure, Method, Provenance};

/// Content of the report of a benchmark: scores of models, figures, methods and provenance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BenchmarkReport {
    /// Kind of the report, e.g. `training report · ball`.
    pub kind: String,
    /// Title of the report, e.g. `Bouncing ball: forecasts from the initial state`.
    pub title: String,
    /// Outcome of the benchmark in one or two sentences.
    pub summary: String,
    /// The model that the report is about, e.g. `Hybrid`; it has the first colour.
    pub subject: String,
    /// Words for one and for several trajectories, e.g. `push`, `pushes`.
    #[serde(default)]
    pub words: [String; 2],
    /// Key figures of the report, shown in large type.
    #[serde(default)]
    pub key_figures: Vec<KeyFigure>,
    /// Scores of the models: one table for each test set.
    pub results: Vec<Results>,
    /// Errors over the size of the training set: one curve per model and measure.
    #[serde(default)]
    pub sizes: Vec<Curve>,
    /// Displacements in a repeated push, one cloud for the truth (first) and one for each model.
    #[serde(default)]
    pub clouds: Vec<Cloud>,
    /// Caption of the figure with the clouds of displacements.
    #[serde(default)]
    pub clouds_caption: String,
    /// Forecasts over true trajectories: one entry per model, trajectory and channel.
    #[serde(default)]
    pub forecasts: Vec<Forecast>,
    /// Error over time: one entry per model, protocol and channel.
    #[serde(default)]
    pub errors: Vec<ErrorCurve>,
    /// Errors over equal parts of the duration: one curve per model.
    #[serde(default)]
    pub parts: Vec<Curve>,
    /// Caption of the figure with the errors over parts of the duration.
    #[serde(default)]
    pub parts_caption: String,
    /// Fitted parameters, each with name, declared value, fitted value and 95 % confidence interval.
    #[serde(default)]
    pub parameters: Vec<(String, f64, f64, [f64; 2])>,
    /// Learning curves: parts of the loss over the iterations, one entry per trained model.
    #[serde(default)]
    pub learning: Vec<LearningCurve>,
    /// Recipe, size and iterations of each trained model.
    #[serde(default)]
    pub training: Vec<TrainingRun>,
    /// Remarks of the report, one paragraph each.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Commands that reproduce the results of the benchmark.
    pub reproduce: Vec<String>,
    /// Methods that were used, with references.
    #[serde(default)]
    pub methods: Vec<Method>,
    /// Version, seed and data files of the run.
    pub provenance: Provenance,
}

/// How a prediction was made; numbers of different protocols are never compared.
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
    /// Name of the protocol in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forecast => "forecast",
            Self::Reconstruction => "reconstruction",
            Self::Floor => "floor",
        }
    }
}

/// Scores of the models on one test set, as a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Caption of the table: meaning of the numbers, and the test set.
    pub caption: String,
    /// Columns with the scores.
    pub columns: Vec<Column>,
    /// Rows of the table with the scores of the models.
    pub rows: Vec<ResultRow>,
    /// Notes under the table.
    #[serde(default)]
    pub footnotes: Vec<String>,
}

/// Scores of a model under a protocol (way to predict); absent values are shown as "–".
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResultRow {
    /// Name of the model, e.g. `Hybrid`.
    pub model: String,
    /// How the model's predictions were made.
    pub protocol: Protocol,
    /// How forecast samples were combined into one prediction, e.g. `mean of 10`.
    ///
    /// The columns for protocol and prediction are shown if any row has this.
    #[serde(default)]
    pub estimator: String,
    /// Scores of the model, one per column and in its unit; `None` if absent.
    pub values: Vec<Option<f64>>,
}

/// Error of one model over the size of the training set or over parts of the duration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Name of the model.
    pub model: String,
    /// Name of the error measure, e.g. `Position`.
    pub measure: String,
    /// Unit of the error measure.
    pub unit: String,
    /// Training-set sizes or parts of the duration, ascending.
    #[serde(with = "crate::nullable")]
    pub x: Vec<f64>,
    /// Errors, one for each `x`.
    #[serde(with = "crate::nullable")]
    pub y: Vec<f64>,
}

/// Learning curve of one model: the parts of its loss over the iterations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LearningCurve {
    /// Name of the model.
    pub model: String,
    /// Iteration numbers of the training, ascending.
    #[serde(with = "crate::nullable")]
    pub iteration: Vec<f64>,
    /// Parts of the loss, e.g. KL and reconstruction, each with one value per iteration.
    pub parts: Vec<LossPart>,
}

/// One part of a training loss, e.g. the KL divergence, over the iterations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LossPart {
    /// Name of the loss part, e.g. `KL`; the same in every model.
    pub name: String,
    /// Unit of the loss part, e.g. `nats per step`.
    pub unit: String,
    /// Value of the loss part in each iteration; NaN where missing.
    #[serde(with = "crate::nullable")]
    pub values: Vec<f64>,
}

/// A forecast of one channel of one trajectory. All vectors have one value per sample time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Name of the model.
    pub model: String,
    /// Name of the trajectory, e.g. `trajectory 17`.
    pub trajectory: String,
    /// Name of the channel, e.g. `height`.
    pub channel: String,
    /// Unit of the channel, e.g. `m`.
    pub unit: String,
    /// Sample times of the forecast, s.
    #[serde(with = "crate::nullable")]
    pub t_s: Vec<f64>,
    /// Measured values of the channel.
    #[serde(with = "crate::nullable")]
    pub truth: Vec<f64>,
    /// Median of the forecast samples, or the only prediction of a deterministic model.
    #[serde(with = "crate::nullable")]
    pub median: Vec<f64>,
    /// 25 % quantile of the forecast samples; empty for a deterministic model.
    #[serde(default, with = "crate::nullable")]
    pub lower50: Vec<f64>,
    /// 75 % quantile of the forecast samples; empty for a deterministic model.
    #[serde(default, with = "crate::nullable")]
    pub upper50: Vec<f64>,
    /// 5 % quantile of the forecast samples; empty for a deterministic model.
    #[serde(default, with = "crate::nullable")]
    pub lower90: Vec<f64>,
    /// 95 % quantile of the forecast samples; empty for a deterministic model.
    #[serde(default, with = "crate::nullable")]
    pub upper90: Vec<f64>,
}

/// Mean absolute error of a model over the test trajectories, at each time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorCurve {
    /// Name of the model; for the smallest possible error (floor), the name of its predictor.
    pub model: String,
    /// How the model's predictions were made.
    pub protocol: Protocol,
    /// Name of the channel, e.g. `height`.
    pub channel: String,
    /// Unit of the channel.
    pub unit: String,
    /// Sample times of the curve, s.
    #[serde(with = "crate::nullable")]
    pub t_s: Vec<f64>,
    /// Mean absolute error at each time, in the unit of the channel.
    #[serde(with = "crate::nullable")]
    pub error: Vec<f64>,
}

/// How a model was trained: recipe, number of parameters and iterations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrainingRun {
    /// Name of the model.
    pub model: String,
    /// Short description of the training recipe.
    pub recipe: String,
    /// Number of trained parameters; `None` if unknown.
    pub parameters: Option<u64>,
    /// Number of training iterations; `None` if unknown.
    pub iterations: Option<u64>,
}

/// Displacements of the object in a repeated push, with their distance from the true ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cloud {
    /// Name of the cloud, e.g. of the model.
    pub name: String,
    /// Displacement of the object along the first axis of its first pose, mm.
    #[serde(with = "crate::nullable")]
    pub x_mm: Vec<f64>,
    /// Displacement along the second axis of the first pose, mm.
    #[serde(with = "crate::nullable")]
    pub y_mm: Vec<f64>,
    /// Chamfer distance to the true displacements, mm; `None` for the truth itself.
    pub chamfer_mm: Option<f64>,
    /// Chamfer distance to the truth divided by that of a second true set; `None` for the truth.
    pub over_floor: Option<f64>,
    /// Energy distance to the true displacements, mm; `None` for the truth itself.
    pub energy_mm: Option<f64>,
}

/// Renders the report as one HTML page.
#[must_use]
pub fn benchmark_report(report: &BenchmarkReport) -> String {
    page::page(report).render()
}
