//! Result of a discovery run, in the format of `result.json`.

pub use crate::estimate::Estimate;
use crate::noise_cause::NoiseCause;
use crate::repeat_scatter::RepeatScatter;
use augsim_data::checks::Warning;
use augsim_system::TopView;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the format of `result.json`.
pub const SCHEMA: &str = "augsim.discover/2";

/// Verdict on whether the declared model explains the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The calibrated model leaves only noise; no effect is missing.
    NothingToAdd,
    /// Effects of the library, added to the model, account for the data.
    Explained,
    /// Effects of the library explain part of the data; structure remains that the library cannot explain.
    PartlyExplained,
    /// The data have structure that the library cannot explain.
    Unknown,
    /// The data are not from the declared system, or not in its units; no effect was added.
    NotThisSystem,
}

/// An effect that was added to the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    /// Name of the effect in the library.
    pub kind: String,
    /// Other physical causes that the same equation describes, which one apparatus cannot distinguish.
    pub stands_for: Vec<String>,
    /// Estimates of the parameters of the effect, by name.
    pub parameters: BTreeMap<String, Estimate>,
    /// Share of the result's log-likelihood gain that is lost without the effect.
    pub share: f64,
    /// Increase of the held-out prediction error without the effect, in the unit of the errors. Absent for
    /// effects that do not change predictions, such as random effects, and if there is only one effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removed: Option<f64>,
    /// Increase of the held-out prediction error of each measure without the effect, by the measure's name and
    /// in the unit of its table. Empty if there is only one measure or one effect.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub removed_by_measure: BTreeMap<String, f64>,
    /// Share of the resamples of the data in which the effect, or an equivalent one, is selected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inclusion: Option<f64>,
    /// Expected share of false findings among those at least as significant (Benjamini and Yekutieli 2001).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q_value: Option<f64>,
    /// Number of cross-validation folds in which the search found the effect again, and number of folds.
    /// Absent without folds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folds: Option<[usize; 2]>,
    /// Text of a formula of the grammar, and the range over which it was observed; absent for other effects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub formula: Option<FoundFormula>,
    /// Unit to which each draw of a random effect belongs, in the system's words (a record, an event).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per: Option<String>,
}

/// A candidate effect that is not established.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    /// Name of the effect in the library.
    pub kind: String,
    /// Share of the resamples of the data in which the effect is selected.
    pub inclusion: f64,
    /// p-value of the coefficients of the effect; absent where it was in no fitted set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chance: Option<f64>,
    /// Condition that the effect does not meet, in words.
    pub why: String,
    /// Experiment that would confirm or refute the effect.
    pub next: String,
}

/// False-positive count on simulated records without a missing effect, made from the residuals of the best
/// model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NullRecords {
    /// Number of simulated records in which an effect was named, which are false positives.
    pub named: usize,
    /// Number of simulated records.
    pub of: usize,
}

/// A formula that was found from the grammar, and the range over which it was observed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundFormula {
    /// Text of the complete term, in the names of the model.
    pub text: String,
    /// Name of the quantity that the formula depends on.
    pub of: String,
    /// Unit of that quantity; empty for a pure number.
    pub unit: String,
    /// Smallest and largest value of that quantity in the data; the formula is not supported outside.
    pub range: [f64; 2],
}

/// Estimate of the measurement noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseFound {
    /// Standard deviation of the noise over all channels of the deciding measure, in `unit`.
    pub sd: f64,
    /// Unit of `sd`, that of the deciding measure's channels.
    pub unit: String,
    /// Standard deviation of the noise by channel, in the unit of each.
    pub by_channel: Vec<f64>,
    /// Correlation of the noise of neighbouring samples; absent where it is not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// Standard deviation of the jitter of the time stamps, s; absent where it is not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter_s: Option<f64>,
    /// Frame period, s, if the samples were moved to frame times about which their time stamps jitter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_s: Option<f64>,
    /// Number of samples masked as outliers; absent where no outliers are searched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outliers: Option<usize>,
    /// Names of the findings about the noise, such as `noise-autocorrelated`.
    pub findings: Vec<String>,
}

/// An effect that the library lacks, as a tabulated function of one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Place where the effect acts, in the system's words.
    #[serde(rename = "where")]
    pub place: String,
    /// Name of the quantity that the effect changes.
    pub target: String,
    /// Name of the quantity that the effect depends on.
    #[serde(rename = "against")]
    pub feature: String,
    /// Text of the closed-form term that fits the table best, among constants, powers and steps.
    pub term: String,
    /// Rows of the table: value of `feature`, effect on `target`, standard error of the effect.
    pub table: Vec<[f64; 3]>,
}

/// A candidate set of effects and its scores.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Names of the effects in the set; that of a random effect also says for what its values are drawn.
    pub kinds: Vec<String>,
    /// Parameter estimates by `kind.name`; for a set that was not fitted, the one-step estimates.
    pub parameters: BTreeMap<String, Estimate>,
    /// Gain of the set over the calibrated model in the log predictive density of left-out blocks, nats.
    pub gain: f64,
    /// Penalty that the gain must exceed, nats.
    pub penalty: f64,
    /// Gain over the chosen set minus the difference of the penalties, nats: the quantity that decides between two sets. The gains of both are
    /// computed with the independent share of the residuals of the larger set, so that it is not the difference of their `gain - penalty`.
    #[serde(default)]
    pub over_chosen: f64,
    /// Whether the set was fitted by simulation, rather than only tested in the linear problem.
    pub fitted: bool,
    /// Whether the set is the chosen one.
    pub chosen: bool,
    /// Reason why the set was chosen or rejected.
    pub why: String,
}

/// A root mean square prediction error with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rmse {
    /// Root mean square error, in the unit of its table.
    pub rmse: f64,
    /// Lower and upper end of the 95 % interval over trajectories.
    pub ci95: [f64; 2],
}

impl Rmse {
    /// The interval as text, each bound as `shown` writes it; a single value if both are written alike.
    pub fn interval_text(&self, shown: impl Fn(f64) -> String) -> String {
        let [low, high] = self.ci95.map(shown);
        if low == high { low } else { format!("{low} to {high}") }
    }
}

/// Prediction errors of the models on held-out trajectories, in one measure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorTable {
    /// Name of the error measure: an output, or `position`. Empty if there is only one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub measure: String,
    /// Unit of the errors.
    pub unit: String,
    /// Number of held-out trajectories that were predicted.
    pub heldout_trajectories: usize,
    /// Number of cross-validation folds; the whole search was repeated without each of them. Absent where
    /// records were held out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folds: Option<usize>,
    /// Error of the model as declared.
    pub declared: Rmse,
    /// Error of the model after calibration of the declared parameters.
    pub calibrated: Rmse,
    /// Error of the model with the added effects.
    pub augmented: Rmse,
    /// Estimated error that measurement noise and random effects alone cause.
    ///
    /// It includes the error of the initial states, which are estimated from noisy samples. The error of a
    /// model can be below it by chance.
    pub noise_floor: Rmse,
    /// Calibrated minus augmented error; an interval above 0 is a significant improvement.
    pub reduction: Rmse,
    /// Share of the squared error above the noise floor that the effects remove, at most 1. Absent if the
    /// calibrated model's error is hardly above the floor.
    pub explained_share: Option<f64>,
    /// Gain of the augmented over the calibrated model in the log predictive density of left-out blocks,
    /// nats.
    pub heldout_gain: f64,
    /// Errors of simulations of whole recordings; absent where a fit window is a whole recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free_run: Option<FreeRun>,
}

/// Errors of free runs: simulations of whole recordings from their first samples without restart, on held-out
/// parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeRun {
    /// Unit of the only output; empty for several outputs, for which the geometric mean of the errors is
    /// given.
    pub unit: String,
    /// Error of the calibrated model; absent where a simulation diverges.
    pub calibrated: Option<f64>,
    /// Error of the augmented model; absent where a simulation diverges.
    pub augmented: Option<f64>,
}

/// Explained share above which one decimal of a per cent would print as 100 %.
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

/// One bin of the residuals against a feature, such as time or speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Value of the feature at the centre of the bin.
    pub x: f64,
    /// Mean residual in the bin, in units of the noise.
    pub mean: f64,
    /// Root mean square residual in the bin, in units of the noise.
    pub rms: f64,
    /// Number of samples in the bin.
    pub count: usize,
}

/// Structure of the residuals of all trajectories: before (calibrated model) and after (augmented model).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anatomy {
    /// Bins of the calibrated model's residuals against each feature, by its name (`time_s`, …).
    pub before: BTreeMap<String, Vec<Bin>>,
    /// Bins of the augmented model's residuals against each feature, by its name.
    pub after: BTreeMap<String, Vec<Bin>>,
    /// Autocorrelation of the calibrated model's residuals at lags 0, 1, … samples.
    pub autocorrelation_before: Vec<f64>,
    /// Autocorrelation of the augmented model's residuals at lags 0, 1, … samples.
    pub autocorrelation_after: Vec<f64>,
    /// 1st, 5th, 25th, 50th, 75th, 95th and 99th percentile of the calibrated model's residuals, in units of
    /// the noise.
    pub quantiles_before: Vec<f64>,
    /// 1st, 5th, 25th, 50th, 75th, 95th and 99th percentile of the augmented model's residuals, in units of
    /// the noise.
    pub quantiles_after: Vec<f64>,
}

/// p-values of the tests of the augmented model's residuals, each corrected for the number of tests of its
/// kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tests {
    /// p-value of the best library effect that is not in the model.
    pub library: f64,
    /// p-value of the best tabulated function of one quantity; absent where the system has no targets for
    /// tables.
    #[serde(rename = "laws", default, skip_serializing_if = "Option::is_none")]
    pub tables: Option<f64>,
    /// p-value of differences in parameters between trajectories.
    pub heterogeneity: f64,
    /// Name of the trajectory that differs most, if the differences are significant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outlying: Option<String>,
    /// p-value of a period in the differences between events; absent where the system has no events.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub periodicity: Option<f64>,
    /// Whether the residuals depend on the past.
    #[serde(default)]
    pub memory: MemoryFound,
    /// Whether no test is significant.
    pub pass: bool,
}

/// Whether residuals depend on more than the present values of states and inputs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MemoryFound {
    /// p-value of the most significant effect with states of its own, or delay, beside laws of present values.
    pub p_value: f64,
    /// Whether the test is significant, at the level 0.001.
    pub depends_on_past: bool,
    /// Name of that effect; absent where the library has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub like: Option<String>,
}

/// Numbers of windows (segments of a record, each simulated from its own initial state).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Windows {
    /// Number of fitted windows: in the training records, in the held-out records.
    pub fitted: [usize; 2],
    /// Number of windows excluded from the prediction errors, in the training and in the held-out records. No
    /// model follows them.
    #[serde(rename = "left_out")]
    pub excluded: [usize; 2],
    /// Rule by which windows are excluded, in words.
    pub rule: String,
}

/// Errors of one measure at the end of predictions over one horizon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HorizonErrors {
    /// Unit of the errors.
    pub unit: String,
    /// Error of the model as declared.
    pub declared: Rmse,
    /// Error of the model after calibration of the declared parameters.
    pub calibrated: Rmse,
    /// Error of the model with the added effects.
    pub augmented: Rmse,
    /// Calibrated minus augmented error.
    pub reduction: Rmse,
}

/// Errors of predictions over a fixed time, each from a measured state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Horizon {
    /// Duration of the predictions, s.
    pub horizon_s: f64,
    /// Number of predictions over this duration.
    pub forecasts: usize,
    /// Errors at the end of the predictions, by name of the measure.
    pub errors: BTreeMap<String, HorizonErrors>,
}

/// Texts of the model files before effects were added.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Models {
    /// Text of the declared model file.
    pub declared_toml: String,
    /// Text of the declared model file calibrated on the training records, without added effects.
    pub calibrated_toml: String,
    /// Other fitted models that the data do not reject, best first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rivals: Vec<Rival>,
}

/// A fitted model that the data do not reject, beside the named one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// Names of its effects; empty for the calibrated model.
    pub kinds: Vec<String>,
    /// Gain minus penalty over the chosen set of effects, nats.
    pub over_chosen: f64,
    /// Text of the model file with its effects and fitted values.
    pub model_toml: String,
}

/// A held-out trajectory with the predictions of the declared and the augmented model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Example {
    /// Name of the trajectory in the data.
    pub id: String,
    /// Rank of its error among the held-out trajectories: `best`, `median` or `worst`.
    pub rank: String,
    /// Root mean square errors after the known samples, in the unit of the error table: declared, augmented
    /// model.
    pub rmse: [f64; 2],
    /// Times of the displayed samples, s.
    pub times_s: Vec<f64>,
    /// Number of first displayed samples to which the initial state was fitted.
    pub known: usize,
    /// Measured and predicted values of each channel.
    pub channels: Vec<ExampleChannel>,
    /// Further shapes of the top view, for planar motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<TopView>,
}

/// Values of one channel of an example, in the unit of its column; `None` where nothing was measured or
/// simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExampleChannel {
    /// Name of the channel's column in the data.
    pub column: String,
    /// Unit of the values, as displayed.
    pub unit: String,
    /// Measured values at the displayed times.
    pub measured: Vec<Option<f64>>,
    /// Values predicted by the declared model at the displayed times.
    pub declared: Vec<Option<f64>>,
    /// Values predicted by the calibrated model at the displayed times; empty in results of older versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub calibrated: Vec<Option<f64>>,
    /// Values predicted by the augmented model at the displayed times.
    pub augmented: Vec<Option<f64>>,
}

/// Work of a discovery run. The counts are the same on every machine and for any number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Number of simulations of one window with derivatives.
    pub simulations: u64,
    /// Number of minimisations (fits).
    pub fits: u64,
    /// Number of candidates whose gain was computed in the linear problem, without a fit.
    pub scores: u64,
}

/// Result of a discovery run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Discovery {
    /// Version of the format, [`SCHEMA`].
    pub schema: String,
    /// Verdict on whether the declared model explains the data.
    pub verdict: Verdict,
    /// The result as a sentence for the reader.
    pub sentence: String,
    /// Warnings that the data checks gave.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
    /// Remarks for the reader: how a recording was read, what one trajectory cannot show.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Added effects, by the prediction error that they remove. Effects that do not change predictions
    /// follow, by their share of the gain.
    pub effects: Vec<FoundEffect>,
    /// Candidate effects that are not established.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub leads: Vec<Lead>,
    /// False positives on simulated records without a missing effect; absent if none were simulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub null_records: Option<NullRecords>,
    /// Estimates of the declared parameters in the calibrated model, by name.
    pub calibrated: BTreeMap<String, Estimate>,
    /// Estimates of the declared parameters in the augmented model, by name.
    pub parameters: BTreeMap<String, Estimate>,
    /// Estimate of the measurement noise.
    pub noise: NoiseFound,
    /// Kind of noise that causes the augmented model's residuals (measurement or process noise), where it was
    /// estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_cause: Option<NoiseCause>,
    /// Scatter of each output between recordings with the same inputs; empty where there are no repeats.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub repeats: Vec<RepeatScatter>,
    /// Other sets of effects that explain the data equally well, as names of effects.
    pub alternatives: Vec<Vec<String>>,
    /// The effect that the data show but the library lacks; `None` if there is none.
    pub unexplained: Option<Unexplained>,
    /// The most useful next experiment, in words.
    pub next_experiment: String,
    /// All candidate sets: the chosen one, then the others by gain minus penalty.
    pub candidates: Vec<Candidate>,
    /// Prediction errors of the declared, calibrated and augmented model, in the deciding measure.
    pub error: ErrorTable,
    /// Structure of the residuals before (calibrated model) and after (augmented model) adding effects.
    pub anatomy: Anatomy,
    /// Tests of the residuals that the augmented model leaves.
    pub tests: Tests,
    /// Correlations of the estimated parameters of the augmented model: their names, then the matrix by rows.
    pub correlations: (Vec<String>, Vec<Vec<f64>>),
    /// Prediction errors in further measures, by name of the measure.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub errors: BTreeMap<String, ErrorTable>,
    /// Errors after fixed prediction times, for systems whose states are all measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub horizons: Vec<Horizon>,
    /// Number of fitted and excluded windows; absent where no window can be excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub windows: Option<Windows>,
    /// Share of the residuals that count as independent; gains are computed for this share of the samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub independent: Option<f64>,
    /// Text of the augmented model file.
    pub model_toml: String,
    /// Texts of the declared and the calibrated model file.
    #[serde(default)]
    pub models: Models,
    /// Names of the held-out trajectories, or of the parts of long ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub heldout: Vec<String>,
    /// Held-out trajectories with the best, the median and the worst prediction of the augmented model.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub examples: Vec<Example>,
    /// Typical prediction on a part of the data by the models fitted without it, where cross-validation gives the
    /// errors; absent where records were held out, whose predictions are under `examples`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fold_example: Option<Example>,
    /// Seconds of run time after which the deadline ended the search; absent if the search was complete.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_after_s: Option<f64>,
    /// Amount of work that the run did.
    #[serde(default)]
    pub work: Work,
}

impl Discovery {
    /// Whether any effect was added to the declared model.
    pub fn has_additions(&self) -> bool {
        !self.effects.is_empty() || self.unexplained.is_some()
    }
}
