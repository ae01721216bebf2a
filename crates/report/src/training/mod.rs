//! The report of a training run: what `train`, `reproduce ball` and `demo` write.

pub(crate) mod page;

use serde::{Deserialize, Serialize};

use crate::page::{KeyFigure, Method, Provenance};

/// Everything that a training report shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrainingReport {
    /// Title, e.g. `Bouncing ball: forecasts from the initial state`.
    pub title: String,
    /// The outcome in one or two sentences.
    pub summary: String,
    /// Scenario, e.g. `ball`.
    pub scenario: String,
    /// What was tested on, e.g. `test_1000: 1000 trajectories of 400 steps at 60 Hz`.
    pub test_set: String,
    /// The model that the report is about, e.g. `Hybrid`: it keeps the first colour.
    pub subject: String,
    /// Numbers in large type; from `rows` where empty.
    #[serde(default)]
    pub key_figures: Vec<KeyFigure>,
    /// The table.
    pub rows: Vec<MetricRow>,
    /// Loss parts over the iterations, one entry per trained model.
    #[serde(default)]
    pub learning: Vec<LearningCurve>,
    /// Forecasts over true trajectories: one entry per model, trajectory and channel.
    #[serde(default)]
    pub forecasts: Vec<Forecast>,
    /// Error over time: one entry per model, protocol and channel.
    #[serde(default)]
    pub errors: Vec<ErrorCurve>,
    /// Iterations and time of each trained model, and its recipe.
    #[serde(default)]
    pub training: Vec<TrainingRun>,
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

/// How a number came about. Protocols are never compared with each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// Samples of the prior given the initial state only: a prediction.
    #[default]
    Forecast,
    /// The encoder saw the trajectory: not a prediction.
    Reconstruction,
    /// The best that any predictor can do from the initial state, from the known law.
    Floor,
}

impl Protocol {
    /// The word for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forecast => "forecast",
            Self::Reconstruction => "reconstruction",
            Self::Floor => "floor",
        }
    }
}

/// A row of the table. Absent values are shown as "–".
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MetricRow {
    /// Model, e.g. `Hybrid`.
    pub model: String,
    /// Protocol.
    pub protocol: Protocol,
    /// How samples became one prediction, e.g. `mean of 10`; empty for a deterministic model.
    #[serde(default)]
    pub estimator: String,
    /// Mean over trajectories of the summed absolute over the summed true translation, percent.
    pub trans_percent: Option<f64>,
    /// Mean absolute error of the position, m.
    pub pos_m: Option<f64>,
    /// Mean absolute error of the velocity, m/s.
    pub vel_m_s: Option<f64>,
    /// Continuous ranked probability score of the position, m.
    pub crps_pos_m: Option<f64>,
    /// Continuous ranked probability score of the velocity, m/s.
    pub crps_vel_m_s: Option<f64>,
    /// Share of true values in the 50 % band, as a fraction.
    pub coverage50: Option<f64>,
    /// Share of true values in the 90 % band, as a fraction.
    pub coverage90: Option<f64>,
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
    /// What happened.
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
    /// The recipe in a few words.
    pub recipe: String,
    /// Parameters that were trained.
    pub parameters: Option<u64>,
    /// Iterations.
    pub iterations: Option<u64>,
}

/// The report as one HTML page.
#[must_use]
pub fn training_report(report: &TrainingReport) -> String {
    page::page(report).render()
}
