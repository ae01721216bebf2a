//! Result of a discovery run, in the format of `result.json`.

pub use crate::estimate::Estimate;
use crate::noise_cause::NoiseCause;
use augsim_data::checks::Warning;
use augsim_system::TopView;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the format.
pub const SCHEMA: &str = "augsim.discover/2";

/// Verdict on the declared model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The calibrated model leaves only noise.
    NothingToAdd,
    /// Library effects account for the data.
    Explained,
    /// Library effects, beside structure that the library cannot explain.
    PartlyExplained,
    /// There is structure that the library cannot explain.
    Unknown,
    /// The data are not from the declared system, or not in its units; nothing was added.
    NotThisSystem,
}

/// An effect that was added to the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    /// Kind in the library.
    pub kind: String,
    /// Other physical causes with the same equation, which one apparatus cannot distinguish.
    pub stands_for: Vec<String>,
    /// Parameters of the effect, by name.
    pub parameters: BTreeMap<String, Estimate>,
    /// Share of the log-likelihood gain that is lost without the effect.
    pub share: f64,
    /// Increase of the held-out prediction error without the effect, in the unit of the errors; absent for
    /// what does not change predictions, such as a random effect, and where there is only one effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removed: Option<f64>,
    /// Share of the resamples in which the effect, or an equivalent one, is selected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inclusion: Option<f64>,
    /// Expected share of false findings among those that are as significant (Benjamini and Yekutieli 2001).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q_value: Option<f64>,
    /// Number of folds in which the search found the effect again, and number of folds; absent without
    /// folds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folds: Option<[usize; 2]>,
    /// For a formula of the grammar: its text and the range over which it was observed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub formula: Option<FoundFormula>,
    /// For a random effect: the unit that each draw belongs to, in the system's words (a record, an event).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per: Option<String>,
}

/// A candidate effect that is not established.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    /// Kind in the library.
    pub kind: String,
    /// Share of the resamples in which it is selected.
    pub inclusion: f64,
    /// p-value of its coefficients; absent where it was in no fitted set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chance: Option<f64>,
    /// Condition that it does not meet.
    pub why: String,
    /// Experiment that would confirm or refute it.
    pub next: String,
}

/// Simulated records without a missing effect, made from the residuals of the best model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NullRecords {
    /// Number of them in which an effect was named (false positives).
    pub named: usize,
    /// Number of simulated records.
    pub of: usize,
}

/// A formula of the grammar, and the range over which it was observed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundFormula {
    /// The complete term, in the names of the model.
    pub text: String,
    /// Quantity that the formula depends on.
    pub of: String,
    /// Unit of that quantity; empty for a pure number.
    pub unit: String,
    /// Smallest and largest value of the quantity in the data; the formula is not supported outside.
    pub range: [f64; 2],
}

/// Measurement noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseFound {
    /// Standard deviation over all channels of the deciding measure.
    pub sd: f64,
    /// Unit.
    pub unit: String,
    /// Standard deviation by channel.
    pub by_channel: Vec<f64>,
    /// Correlation of neighbouring samples; absent where it is not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// Standard deviation of the time stamps, s; absent where it is not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter_s: Option<f64>,
    /// Frame period, s, where the samples were moved to the frames about which their time stamps jitter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_s: Option<f64>,
    /// Number of samples masked as outliers; absent where outliers are not searched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outliers: Option<usize>,
    /// Findings, by kind.
    pub findings: Vec<String>,
}

/// An effect that the library does not have, as a tabulated function of one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Where it acts, in the system's words.
    #[serde(rename = "where")]
    pub place: String,
    /// The quantity that it changes.
    pub target: String,
    /// The quantity that it depends on.
    #[serde(rename = "against")]
    pub feature: String,
    /// Closed-form term that fits the table best, among constants, powers and steps.
    pub term: String,
    /// Knots: value of the quantity, effect, standard error.
    pub table: Vec<[f64; 3]>,
}

/// A candidate set of effects and its scores.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Kinds of the effects in the set.
    pub kinds: Vec<String>,
    /// Parameters by `kind.name`; for a set that was not fitted, the one-step estimates.
    pub parameters: BTreeMap<String, Estimate>,
    /// Gain over the calibrated model in the log predictive density of left-out blocks, nats.
    pub gain: f64,
    /// Penalty that the gain has to exceed, nats.
    pub penalty: f64,
    /// Gain over the chosen set minus the difference of the penalties, nats: the quantity that decides between two sets. The gains of both are
    /// computed with the independent share of the residuals of the larger set, so that it is not the difference of their `gain - penalty`.
    #[serde(default)]
    pub over_chosen: f64,
    /// Whether it was fitted by simulation, or only tested in the linear problem.
    pub fitted: bool,
    /// Whether it is the chosen set.
    pub chosen: bool,
    /// Why it was chosen or rejected.
    pub why: String,
}

/// A root mean square error with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rmse {
    /// The error.
    pub rmse: f64,
    /// 95 % interval over trajectories.
    pub ci95: [f64; 2],
}

/// Prediction errors on held-out trajectories.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorTable {
    /// Name of the measure, where there are several: an output, or `position`.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub measure: String,
    /// Unit.
    pub unit: String,
    /// Number of held-out trajectories.
    pub heldout_trajectories: usize,
    /// Number of cross-validation folds where the whole search was repeated without each; absent where
    /// records were held out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folds: Option<usize>,
    /// Errors of the model as declared.
    pub declared: Rmse,
    /// Errors of the model after calibration of the declared parameters.
    pub calibrated: Rmse,
    /// Errors of the model with the added effects.
    pub augmented: Rmse,
    /// Estimate of the error that measurement noise and random effects alone leave.
    ///
    /// It includes the error of the initial states, which are estimated from noisy samples. A reached error can
    /// be below it by chance.
    pub noise_floor: Rmse,
    /// Calibrated minus augmented error; a positive interval is a significant improvement.
    pub reduction: Rmse,
    /// Removed share of the squared error above the estimated noise floor, at most 1; absent where there was
    /// hardly any.
    pub explained_share: Option<f64>,
    /// Gain in the log predictive density of left-out blocks, nats.
    pub heldout_gain: f64,
    /// Errors of free runs of whole recordings; absent where a fit window is a whole recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free_run: Option<FreeRun>,
}

/// Errors on held-out parts of recordings that are simulated from their first samples without restart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeRun {
    /// Unit of the only output; empty for several outputs, for which the geometric mean of the errors is
    /// given.
    pub unit: String,
    /// Error of the calibrated model; absent where a run diverges.
    pub calibrated: Option<f64>,
    /// Error of the augmented model; absent where a run diverges.
    pub augmented: Option<f64>,
}

/// Share from which one decimal of a per cent would print as 100 %.
const NEARLY_ALL: f64 = 0.9995;

impl ErrorTable {
    /// Text of [`explained_share`](Self::explained_share), such as `93.2 %`; never 100 % while the error is
    /// above the noise floor.
    pub fn explained_text(&self) -> Option<String> {
        let share = self.explained_share?;
        Some(match share {
            _ if self.augmented.rmse <= self.noise_floor.rmse => "all".to_owned(),
            share if share >= NEARLY_ALL => "more than 99.9 %".to_owned(),
            share => format!("{:.1} %", 100.0 * share),
        })
    }

    /// Computes [`explained_share`](Self::explained_share) from root mean square errors.
    pub(crate) fn explained(calibrated: f64, augmented: f64, floor: f64) -> Option<f64> {
        let [calibrated, augmented, floor] = [calibrated, augmented, floor].map(|e| e * e);
        let removable = calibrated - floor;
        (removable > 0.02 * floor).then(|| f64::min((calibrated - augmented) / removable, 1.0))
    }
}

/// One bin of the residuals against a feature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Centre of the bin.
    pub x: f64,
    /// Mean residual in units of the noise.
    pub mean: f64,
    /// Root mean square residual in units of the noise.
    pub rms: f64,
    /// Samples in the bin.
    pub count: usize,
}

/// Residuals of all trajectories against features, before (calibrated model) and after (augmented model).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anatomy {
    /// Bins of the residuals by feature (`time_s`, …), calibrated model.
    pub before: BTreeMap<String, Vec<Bin>>,
    /// Bins of the residuals by feature, augmented model.
    pub after: BTreeMap<String, Vec<Bin>>,
    /// Autocorrelation of the residuals at lags 0, 1, …, calibrated model.
    pub autocorrelation_before: Vec<f64>,
    /// Autocorrelation of the residuals at lags 0, 1, …, augmented model.
    pub autocorrelation_after: Vec<f64>,
    /// 1st, 5th, 25th, 50th, 75th, 95th and 99th percentile of the residuals in units of the noise,
    /// calibrated model.
    pub quantiles_before: Vec<f64>,
    /// The same percentiles, augmented model.
    pub quantiles_after: Vec<f64>,
}

/// Tests of the residuals of the augmented model: p-values, each corrected for the number of tests of its
/// kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tests {
    /// Library effects that are not in the model.
    pub library: f64,
    /// Tabulated functions of one quantity; absent where the system has no targets for them.
    #[serde(rename = "laws", default, skip_serializing_if = "Option::is_none")]
    pub tables: Option<f64>,
    /// Parameters that differ between trajectories.
    pub heterogeneity: f64,
    /// The trajectory that differs most, if they differ significantly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outlying: Option<String>,
    /// Periodicity of the event offsets; absent where the system has no events.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub periodicity: Option<f64>,
    /// Whether all tests pass.
    pub pass: bool,
}

/// Windows: segments of a record, each simulated from its own initial state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Windows {
    /// Number of fitted windows in the training and in the held-out records.
    pub fitted: [usize; 2],
    /// Number of windows excluded from the predictions, in the training and in the held-out records. No
    /// model follows them.
    #[serde(rename = "left_out")]
    pub excluded: [usize; 2],
    /// The exclusion rule, in words.
    pub rule: String,
}

/// Errors of one measure after one horizon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HorizonErrors {
    /// Unit of the errors.
    pub unit: String,
    /// Errors of the model as declared.
    pub declared: Rmse,
    /// Errors of the model after calibration of the declared parameters.
    pub calibrated: Rmse,
    /// Errors of the model with the added effects.
    pub augmented: Rmse,
    /// Calibrated minus augmented.
    pub reduction: Rmse,
}

/// Predictions over a fixed time, each from a measured state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Horizon {
    /// Prediction horizon, s.
    pub horizon_s: f64,
    /// Number of predictions.
    pub forecasts: usize,
    /// Errors at the end of the horizon, by measure.
    pub errors: BTreeMap<String, HorizonErrors>,
}

/// Texts of model files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Models {
    /// The declared model.
    pub declared_toml: String,
    /// The declared model calibrated on the training records, nothing added.
    pub calibrated_toml: String,
}

/// A held-out trajectory with the predictions of the models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Example {
    /// Name in the data.
    pub id: String,
    /// Rank of its error among the held-out trajectories: `best`, `median` or `worst`.
    pub rank: String,
    /// Root mean square errors after the known samples, in the unit of the error table: declared, augmented.
    pub rmse: [f64; 2],
    /// Times, s.
    pub times_s: Vec<f64>,
    /// Number of first samples that the initial state was fitted to.
    pub known: usize,
    /// Channels.
    pub channels: Vec<ExampleChannel>,
    /// For planar motion: further shapes of the top view.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<TopView>,
}

/// A channel of an example, in the unit of its column; `None` where nothing was measured or simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExampleChannel {
    /// Column of the data.
    pub column: String,
    /// Displayed unit.
    pub unit: String,
    /// Measured values.
    pub measured: Vec<Option<f64>>,
    /// Prediction of the declared model.
    pub declared: Vec<Option<f64>>,
    /// Prediction of the augmented model.
    pub augmented: Vec<Option<f64>>,
}

/// Work of a discovery run. The counts are the same on every machine and for any number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Simulations of one window with derivatives.
    pub simulations: u64,
    /// Minimisations.
    pub fits: u64,
    /// Candidates whose gain was computed in the linear problem.
    pub scores: u64,
}

/// Result of a discovery run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Discovery {
    /// [`SCHEMA`].
    pub schema: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The result as a sentence.
    pub sentence: String,
    /// Warnings of the data checks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
    /// Remarks for the reader: how a recording was read, what one trajectory cannot show.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Added effects, by the prediction error that they remove; then those that do not change predictions,
    /// by their share of the gain.
    pub effects: Vec<FoundEffect>,
    /// Candidate effects that are not established.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub leads: Vec<Lead>,
    /// False-positive rate on simulated records without a missing effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub null_records: Option<NullRecords>,
    /// Declared parameters of the calibrated model.
    pub calibrated: BTreeMap<String, Estimate>,
    /// Declared parameters of the augmented model.
    pub parameters: BTreeMap<String, Estimate>,
    /// Measurement noise.
    pub noise: NoiseFound,
    /// Cause of the residuals of the augmented model (measurement or process noise), where it was estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_cause: Option<NoiseCause>,
    /// Other sets of effects that explain the data equally well.
    pub alternatives: Vec<Vec<String>>,
    /// The effect that the library does not have.
    pub unexplained: Option<Unexplained>,
    /// The most useful next experiment.
    pub next_experiment: String,
    /// All candidate sets: the chosen one, then the others by gain minus penalty.
    pub candidates: Vec<Candidate>,
    /// Prediction errors before and after.
    pub error: ErrorTable,
    /// Residuals before and after.
    pub anatomy: Anatomy,
    /// Tests of the residuals of the augmented model.
    pub tests: Tests,
    /// Correlations of the parameters of the augmented model: names, then the matrix by rows.
    pub correlations: (Vec<String>, Vec<Vec<f64>>),
    /// Errors of further measures, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub errors: BTreeMap<String, ErrorTable>,
    /// Errors after fixed times, where every state is measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub horizons: Vec<Horizon>,
    /// Number of windows, where some may be excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub windows: Option<Windows>,
    /// Independent share of the residuals; gains count this share of the samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub independent: Option<f64>,
    /// The augmented model file.
    pub model_toml: String,
    /// The declared and the calibrated model file.
    #[serde(default)]
    pub models: Models,
    /// Names of the held-out trajectories, or of the parts of long ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub heldout: Vec<String>,
    /// Held-out trajectories with the best, the median and the worst prediction of the augmented model.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub examples: Vec<Example>,
    /// Seconds after which the deadline ended the search; absent where it was complete.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_after_s: Option<f64>,
    /// Work of the run.
    #[serde(default)]
    pub work: Work,
}

impl Discovery {
    /// Whether anything was added to the declared model.
    pub fn has_additions(&self) -> bool {
        !self.effects.is_empty() || self.unexplained.is_some()
    }
}
