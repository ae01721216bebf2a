//! The findings of a discovery, in the form of `result.json`.

use crate::noise_cause::NoiseCause;
use augsim_data::checks::Warning;
use augsim_physics::system::TopView;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the format.
pub const SCHEMA: &str = "augsim.discover/2";

/// The answer in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The declared model, calibrated, leaves nothing but noise.
    NothingToAdd,
    /// Effects of the library account for the data.
    Explained,
    /// Effects of the library and a law that it does not have.
    PartlyExplained,
    /// Something is there that the library does not know.
    Unknown,
    /// The data are not those of the declared system, or not in its units: nothing was added.
    NotThisSystem,
}

/// A fitted value. For a parameter with one value per group, the mean over the groups, and `groups` has them all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Unit; empty for a pure number.
    pub unit: String,
    /// The estimate of each group.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub groups: BTreeMap<String, Estimate>,
}

impl Estimate {
    /// Decimals that the interval lends meaning to: two digits of its half width; at least four, at most twelve.
    pub fn decimals(&self) -> usize {
        let half = 0.5 * (self.ci95[1] - self.ci95[0]);
        if !(half > 0.0 && half.is_finite()) {
            return 4;
        }
        (1.0 - half.log10().floor()).clamp(4.0, 12.0) as usize
    }

    /// The words of a sentence for the parameter `name`.
    pub fn phrase(&self, name: &str) -> String {
        if self.groups.is_empty() {
            return format!("{name} = {self}");
        }
        let (low, high) = self
            .groups
            .values()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.value), high.max(v.value)));
        format!("{name} from {low:.4} to {high:.4}, its own for each group")
    }
}

/// Value and interval, `0.00040 [0.00038, 0.00042]`.
impl std::fmt::Display for Estimate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let d = self.decimals();
        write!(f, "{:.d$} [{:.d$}, {:.d$}]", self.value, self.ci95[0], self.ci95[1])
    }
}

/// An effect that was added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    /// Kind in the library.
    pub kind: String,
    /// Other causes with the same term, which one apparatus cannot tell apart.
    pub stands_for: Vec<String>,
    /// Parameters of the effect, by name.
    pub parameters: BTreeMap<String, Estimate>,
    /// Share of the gain in likelihood that is lost without it.
    pub share: f64,
    /// By how much the forecast error on held-out records grows without it, in the unit of the errors; absent for what changes
    /// no forecast, such as a scatter, and for the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removed: Option<f64>,
    /// Share of the resamples of the data in which it comes back, or another reading of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inclusion: Option<f64>,
    /// Share of false findings to be expected among those that are as significant (Benjamini and Yekutieli 2001).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q_value: Option<f64>,
    /// In how many folds the search found it again, of how many; absent where it was not repeated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folds: Option<[usize; 2]>,
    /// For a formula that fits, and is no law that somebody described: where it was seen to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub formula: Option<FoundFormula>,
    /// For a scatter: what one draw of it belongs to, in the system's words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per: Option<String>,
}

/// A finding that is not established.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    /// Kind in the library.
    pub kind: String,
    /// Share of the resamples of the data in which it is selected.
    pub inclusion: f64,
    /// Probability that chance alone moves its amount as far from none; absent where it was in no fitted set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chance: Option<f64>,
    /// Condition that it does not meet.
    pub why: String,
    /// Experiment that would establish it, or show that it is none.
    pub next: String,
}

/// Records like these, made of the answer's residuals, in which nothing is missing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NullRecords {
    /// How many of them named an effect.
    pub named: usize,
    /// How many there were.
    pub of: usize,
}

/// Where a formula stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundFormula {
    /// The whole term, in the names of the model.
    pub text: String,
    /// The quantity that it is a shape of.
    pub of: String,
    /// Unit of that quantity; empty for a pure number.
    pub unit: String,
    /// Smallest and largest value of the quantity in the data: outside nothing is known.
    pub range: [f64; 2],
}

/// The sensor's noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseFound {
    /// Standard deviation (of all channels together).
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
    /// From one frame to the next, s: the samples were put on the frames that their time stamps jitter about; absent where they
    /// stayed at the stamps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_s: Option<f64>,
    /// Samples that were masked as outliers; absent where none are sought.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outliers: Option<usize>,
    /// Findings by kind.
    pub findings: Vec<String>,
}

/// A law that the library does not have, as far as the data show it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Where it acts, in the system's words.
    #[serde(rename = "where")]
    pub place: String,
    /// The quantity that it changes.
    pub target: String,
    /// The feature it depends on.
    pub against: String,
    /// A closed term that fits the table best among constants, powers and steps.
    pub term: String,
    /// Knots and values of the tabulated law, with standard errors.
    pub table: Vec<[f64; 3]>,
}

/// A candidate as it came out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Kinds in the candidate, together.
    pub kinds: Vec<String>,
    /// Parameters of the candidate by `kind.name`; for one that was only tested, the one-step estimates.
    pub parameters: BTreeMap<String, Estimate>,
    /// Gain over the calibrated model in predictions of left-out blocks, nats.
    pub gain: f64,
    /// Price that the gain has to beat, nats.
    pub penalty: f64,
    /// Whether it was fitted through the simulator, or only tested.
    pub fitted: bool,
    /// Whether it is the answer.
    pub chosen: bool,
    /// Why it is the answer, or why it lost.
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

/// Forecast errors on held-out trajectories.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorTable {
    /// Unit.
    pub unit: String,
    /// How many trajectories.
    pub heldout_trajectories: usize,
    /// Folds, where the whole loop was repeated without each in turn and the errors are those on all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folds: Option<usize>,
    /// Errors of the model as declared.
    pub declared: Rmse,
    /// Errors of the model after calibration of the declared parameters.
    pub calibrated: Rmse,
    /// Errors of the model with the added effects.
    pub augmented: Rmse,
    /// The error that noise and scatter leave to the best model.
    pub noise_floor: Rmse,
    /// Calibrated minus augmented: an interval above 0 is a gain that is no accident.
    pub reduction: Rmse,
    /// Share of the removable squared error that was removed; absent where there was hardly any, at most 1 (where less noise was
    /// in the data than the floor has).
    pub explained_share: Option<f64>,
    /// Gain in predictions of left-out blocks, nats.
    pub heldout_gain: f64,
    /// Errors of free runs of whole recordings; absent where fits see recordings whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free_run: Option<FreeRun>,
}

/// Errors over held-out stretches of recordings that are simulated from their first samples without a break.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeRun {
    /// Unit of the one output; empty where there are several, whose errors' geometric mean is given.
    pub unit: String,
    /// Error of the calibrated model; absent where a run does not stay finite.
    pub calibrated: Option<f64>,
    /// Error of the augmented model; absent where a run does not stay finite.
    pub augmented: Option<f64>,
}

impl ErrorTable {
    /// The share that [`explained_share`](Self::explained_share) has, of root mean squares.
    pub(crate) fn explained(calibrated: f64, augmented: f64, floor: f64) -> Option<f64> {
        let [calibrated, augmented, floor] = [calibrated, augmented, floor].map(|e| e * e);
        let removable = calibrated - floor;
        (removable > 0.02 * floor).then(|| f64::min((calibrated - augmented) / removable, 1.0))
    }
}

/// One bin of the residuals against a feature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Middle of the bin.
    pub x: f64,
    /// Mean residual in units of the noise.
    pub mean: f64,
    /// Root mean square residual in units of the noise.
    pub rms: f64,
    /// Samples in the bin.
    pub count: usize,
}

/// Residuals against features, before (calibrated) and after (augmented), all trajectories.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anatomy {
    /// Bins of the residuals by feature (`time_s`, …) before anything was added.
    pub before: BTreeMap<String, Vec<Bin>>,
    /// Bins of the residuals by feature with what was added.
    pub after: BTreeMap<String, Vec<Bin>>,
    /// Autocorrelation of the residuals at lags 0, 1, … before.
    pub autocorrelation_before: Vec<f64>,
    /// Autocorrelation of the residuals at lags 0, 1, … after.
    pub autocorrelation_after: Vec<f64>,
    /// 1st, 5th, 25th, 50th, 75th, 95th and 99th percentile of the residuals in units of the noise, before.
    pub quantiles_before: Vec<f64>,
    /// 1st, 5th, 25th, 50th, 75th, 95th and 99th percentile of the residuals in units of the noise, after.
    pub quantiles_after: Vec<f64>,
}

/// The tests of what the augmented model leaves: p-values, each corrected for the number of tests in its family.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tests {
    /// Library effects not in the model.
    pub library: f64,
    /// Laws of one feature; absent where the system has no targets for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laws: Option<f64>,
    /// Parameters that differ between trajectories.
    pub heterogeneity: f64,
    /// The trajectory that differs most, where they differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outlying: Option<String>,
    /// Periodicity of the scatter; absent where the system has no events.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub periodicity: Option<f64>,
    /// Whether all pass.
    pub pass: bool,
}

/// Windows of the records: what is simulated from a start of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Windows {
    /// Windows that the fits used, of the training part and of the held-out part.
    pub fitted: [usize; 2],
    /// Windows that no model follows and that were not forecast, of the training part and of the held-out part.
    pub left_out: [usize; 2],
    /// The rule by which windows were left out, in words.
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

/// Forecasts over one time, each from a measured state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Horizon {
    /// The time, s.
    pub horizon_s: f64,
    /// How many forecasts.
    pub forecasts: usize,
    /// Errors at the end, by measure.
    pub errors: BTreeMap<String, HorizonErrors>,
}

/// Texts of model files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Models {
    /// The declared model.
    pub declared_toml: String,
    /// The declared model calibrated on the training part, nothing added.
    pub calibrated_toml: String,
}

/// A held-out trajectory as the models forecast it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Example {
    /// Name in the data.
    pub id: String,
    /// Where it stands among the held-out trajectories: `best`, `median` or `worst`.
    pub rank: String,
    /// Root mean square errors behind the known samples, in the unit of the error table: declared, augmented.
    pub rmse: [f64; 2],
    /// Times, s.
    pub times_s: Vec<f64>,
    /// Samples, from the first, that the start was fitted to.
    pub known: usize,
    /// Channels.
    pub channels: Vec<ExampleChannel>,
    /// For a motion in the plane: what a view from above shows beside the poses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<TopView>,
}

/// A channel of an example, in the unit of its column; nothing where nothing was measured, or nothing could be simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExampleChannel {
    /// Column of the data.
    pub column: String,
    /// Unit in print.
    pub unit: String,
    /// Measured values.
    pub measured: Vec<Option<f64>>,
    /// Values that the declared model foretells.
    pub declared: Vec<Option<f64>>,
    /// Values that the augmented model foretells.
    pub augmented: Vec<Option<f64>>,
}

/// How much work an answer took. The counts are the same on every machine and for any number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Simulations of one trajectory (or one window of it) with derivatives.
    pub simulations: u64,
    /// Minimisations.
    pub fits: u64,
    /// Candidates whose gain was predicted without a fit.
    pub scores: u64,
}

/// A discovery.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Discovery {
    /// [`SCHEMA`].
    pub schema: String,
    /// The answer.
    pub verdict: Verdict,
    /// The answer in one sentence.
    pub sentence: String,
    /// Suspicions about the data, none of which refuses them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
    /// Remarks for the reader of the result: how a recording was read, what one trajectory cannot show.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Effects that were added, by the error that it removes; then what changes no forecast, by its share of the gain.
    pub effects: Vec<FoundEffect>,
    /// Findings that are not established.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub leads: Vec<Lead>,
    /// How often records like these name an effect where none is missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub null_records: Option<NullRecords>,
    /// The declared parameters calibrated, nothing added.
    pub calibrated: BTreeMap<String, Estimate>,
    /// The declared parameters after the last fit.
    pub parameters: BTreeMap<String, Estimate>,
    /// The noise.
    pub noise: NoiseFound,
    /// Noise by which records differ from runs of the augmented model, where somebody has looked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_cause: Option<NoiseCause>,
    /// Other sets of kinds that explain the data as well.
    pub alternatives: Vec<Vec<String>>,
    /// The law that the library lacks.
    pub unexplained: Option<Unexplained>,
    /// The measurement that would help most.
    pub next_experiment: String,
    /// All candidates: the chosen one, those that were fitted by gain less penalty, those that were only tested.
    pub candidates: Vec<Candidate>,
    /// Errors before and after.
    pub error: ErrorTable,
    /// Residuals before and after.
    pub anatomy: Anatomy,
    /// Tests of the final model.
    pub tests: Tests,
    /// Correlations of the parameters of the final model: names, then the matrix row by row.
    pub correlations: (Vec<String>, Vec<Vec<f64>>),
    /// Errors before and after of further measures, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub errors: BTreeMap<String, ErrorTable>,
    /// Errors after fixed times, where every state is measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub horizons: Vec<Horizon>,
    /// Windows of the records, where some may be left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub windows: Option<Windows>,
    /// Share of the residuals of the answer that are independent of each other: gains count so many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub independent: Option<f64>,
    /// The augmented model file.
    pub model_toml: String,
    /// The models before it.
    #[serde(default)]
    pub models: Models,
    /// Names of the held-out trajectories, or of the parts of long ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub heldout: Vec<String>,
    /// Held-out trajectories: those that the augmented model forecasts best, as most, and worst.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub examples: Vec<Example>,
    /// Seconds after which the search was ended before everything was tried; absent where nothing was cut.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_after_s: Option<f64>,
    /// How much work the answer took.
    #[serde(default)]
    pub work: Work,
}

impl Discovery {
    /// Whether anything was added to the declared model.
    pub fn adds(&self) -> bool {
        !self.effects.is_empty() || self.unexplained.is_some()
    }
}

#[cfg(test)]
mod tests {
    //! Contract: an estimate is printed to the digits that its interval supports.
    use super::*;

    #[test]
    fn small_values_keep_their_digits() {
        let e = |value: f64, half: f64| Estimate {
            value,
            ci95: [value - half, value + half],
            unit: String::new(),
            groups: BTreeMap::new(),
        };
        assert_eq!(e(4.042e-4, 2.1e-5).to_string(), "0.000404 [0.000383, 0.000425]");
        assert_eq!(e(1.3, 0.02).to_string(), "1.3000 [1.2800, 1.3200]");
        assert_eq!(e(1.3, 0.0).to_string(), "1.3000 [1.3000, 1.3000]");
        assert_eq!(e(1.3, f64::NAN).decimals(), 4);
    }
}
