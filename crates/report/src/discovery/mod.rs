//! The report of a discovery run: what the model lacks, the evidence, and the gain.

mod anatomy;
mod examples;
mod findings;
mod page;
mod tones;

use serde::{Deserialize, Serialize};

use crate::figure::Figure;
use crate::page::{Block, Method, Provenance};

/// Everything that a discovery report shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiscoveryReport {
    /// Title, e.g. `Table-tennis flights: what the ball model lacks`.
    pub title: String,
    /// Scenario, e.g. `ball`.
    pub scenario: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict in one sentence, e.g. `Quadratic drag is missing: …`.
    pub sentence: String,
    /// Suspicions about the data, one paragraph each.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Errors before and after on trajectories that no fit has seen.
    pub error: ErrorSummary,
    /// The declared parameters, before and after calibration.
    #[serde(default)]
    pub calibrated: Vec<CalibratedParameter>,
    /// The established effects, strongest first.
    #[serde(default)]
    pub effects: Vec<FoundEffect>,
    /// Findings that are not established.
    #[serde(default)]
    pub leads: Vec<Lead>,
    /// How often records like these name an effect where none is missing.
    #[serde(default)]
    pub null_records: Option<NullRecords>,
    /// Residuals before and after.
    #[serde(default)]
    pub anatomy: Anatomy,
    /// Trajectories with the predictions of the declared and the augmented model.
    #[serde(default)]
    pub examples: Vec<Example>,
    /// Whether fits have seen the examples.
    #[serde(default)]
    pub examples_fitted: bool,
    /// Sentence below the examples; empty: whether fits have seen them.
    #[serde(default)]
    pub examples_note: String,
    /// Laws that were added, as curves over what they depend on.
    #[serde(default)]
    pub laws: Vec<LawCurve>,
    /// All candidates, best first.
    #[serde(default)]
    pub candidates: Vec<Candidate>,
    /// Unit and meaning of `Candidate::score`, e.g. `nats`.
    pub score_unit: String,
    /// Correlations of the fitted parameters.
    #[serde(default)]
    pub correlations: Correlations,
    /// The noise that was found in the data.
    #[serde(default)]
    pub noise: Noise,
    /// Sets of effects that fit equally well, the chosen one included; empty where there is no other.
    #[serde(default)]
    pub alternatives: Vec<Vec<String>>,
    /// Structure that no effect in the library explains.
    #[serde(default)]
    pub unexplained: Option<Unexplained>,
    /// The experiment that would tell the alternatives apart, or show more.
    #[serde(default)]
    pub next_experiment: Option<String>,
    /// The augmented model as TOML.
    pub model_toml: String,
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

/// The outcome of a discovery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The calibrated model is as good as the data can tell.
    #[default]
    NothingToAdd,
    /// The added effects explain the residual.
    Explained,
    /// They explain a part of it.
    PartlyExplained,
    /// There is structure, and no effect in the library explains it.
    Unknown,
    /// The data are not those of the declared system.
    NotThisSystem,
}

impl Verdict {
    /// The words for it.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::NothingToAdd => "nothing to add",
            Self::Explained => "explained",
            Self::PartlyExplained => "partly explained",
            Self::Unknown => "unknown effect",
            Self::NotThisSystem => "not this system",
        }
    }
}

/// A root mean square error with its 95 % interval, in the unit of its summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rmse {
    /// The error.
    pub rmse: f64,
    /// Bootstrap interval over trajectories.
    #[serde(default)]
    pub ci95: Option<[f64; 2]>,
}

/// Errors on trajectories that no fit has seen, stage by stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorSummary {
    /// The predicted quantity, e.g. `height`.
    pub quantity: String,
    /// The user's unit, e.g. `mm`.
    pub unit: String,
    /// Number of these trajectories.
    pub heldout_trajectories: u64,
    /// The model as declared.
    pub declared: Option<Rmse>,
    /// After calibration of the declared parameters.
    pub calibrated: Option<Rmse>,
    /// With the effects added; absent where nothing was added.
    pub augmented: Option<Rmse>,
    /// The error that the sensor's noise alone gives.
    pub noise_floor: Option<Rmse>,
    /// Calibrated minus augmented.
    #[serde(default)]
    pub reduction: Option<Rmse>,
    /// Folds of the cross-validation that the errors come from; absent where trajectories were kept out from the beginning.
    #[serde(default)]
    pub folds: Option<u64>,
    /// Share of the removable error that was removed, as a fraction.
    pub explained_share: Option<f64>,
}

/// A fitted parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name with the unit in it, e.g. `k_per_m`.
    pub name: String,
    /// The estimate.
    pub value: f64,
    /// Its 95 % interval.
    #[serde(default)]
    pub ci95: Option<[f64; 2]>,
    /// Its unit; empty for a pure number.
    pub unit: String,
}

/// A declared parameter before and after calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CalibratedParameter {
    /// The calibrated parameter.
    pub parameter: Parameter,
    /// The value in the model file.
    pub declared: f64,
    /// Whether the model file holds it fixed.
    #[serde(default)]
    pub frozen: bool,
}

/// An established effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    /// Kind, e.g. `quadratic-drag`.
    pub kind: String,
    /// Other causes that it may stand for, in words.
    pub stands_for: String,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Share of the total gain that is lost when this effect is left out, as a fraction.
    #[serde(default)]
    pub share: Option<f64>,
    /// By how much the forecast error grows without it, in the unit of the error.
    #[serde(default)]
    pub removed: Option<f64>,
    /// Share of the resamples of the data in which it comes back, as a fraction.
    #[serde(default)]
    pub inclusion: Option<f64>,
    /// Share of false findings to be expected among those that are as significant.
    #[serde(default)]
    pub q_value: Option<f64>,
    /// In how many folds it was found again, of how many.
    #[serde(default)]
    pub folds: Option<[u64; 2]>,
}

/// A finding that is not established.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    /// Kind, e.g. `stribeck`.
    pub kind: String,
    /// Share of the resamples of the data that select it, as a fraction.
    pub inclusion: f64,
    /// Probability that chance alone moves its amount as far from none; absent where no fitted set has it.
    #[serde(default)]
    pub chance: Option<f64>,
    /// Which condition of an established finding it does not meet.
    pub why: String,
    /// Experiment that would establish it, or show that it is none.
    pub next: String,
}

/// Records like those that were measured, made without a missing effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NullRecords {
    /// How many of them named an effect.
    pub named: u64,
    /// How many there were.
    pub of: u64,
}

/// Residuals before (calibrated model) and after (augmented model).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anatomy {
    /// The mean residual against time, speed, height, …
    #[serde(default)]
    pub profiles: Vec<Profile>,
    /// The size of the residual by contact: in flight, just after an impact, by bounce, …
    #[serde(default)]
    pub contact: Vec<ContactError>,
    /// Unit of `contact`.
    #[serde(default)]
    pub contact_unit: String,
    /// Autocorrelation of the whitened residual.
    #[serde(default)]
    pub autocorrelation: Option<ResidualAutocorrelation>,
    /// Quantiles of the whitened residual.
    #[serde(default)]
    pub quantiles: Option<ResidualQuantiles>,
}

/// The mean residual in bins of a quantity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// The quantity, e.g. `time since release`.
    pub against: String,
    /// Its unit.
    pub against_unit: String,
    /// The residual, e.g. `height residual`.
    pub residual: String,
    /// Its unit.
    pub unit: String,
    /// Bins before.
    pub before: Bins,
    /// Bins after; empty where nothing was added.
    #[serde(default)]
    pub after: Bins,
}

/// Means in bins, with 95 % intervals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bins {
    /// Bin centres.
    #[serde(with = "crate::nullable")]
    pub x: Vec<f64>,
    /// Mean residuals.
    #[serde(with = "crate::nullable")]
    pub mean: Vec<f64>,
    /// Lower ends; may be empty.
    #[serde(default, with = "crate::nullable")]
    pub lower95: Vec<f64>,
    /// Upper ends; may be empty.
    #[serde(default, with = "crate::nullable")]
    pub upper95: Vec<f64>,
}

/// Root mean square residual in one kind of contact.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactError {
    /// Where, e.g. `before the first impact`.
    pub label: String,
    /// Before.
    pub before: Option<Rmse>,
    /// After.
    pub after: Option<Rmse>,
}

/// Autocorrelations by lag, without lag 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResidualAutocorrelation {
    /// Lags.
    #[serde(with = "crate::nullable")]
    pub lag: Vec<f64>,
    /// Unit of the lags.
    pub lag_unit: String,
    /// Correlations before.
    #[serde(with = "crate::nullable")]
    pub before: Vec<f64>,
    /// Correlations after; may be empty.
    #[serde(default, with = "crate::nullable")]
    pub after: Vec<f64>,
    /// Half width of the 95 % band of white noise.
    pub white95: Option<f64>,
}

/// Quantiles in units of the sensor's standard deviation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResidualQuantiles {
    /// Standard normal quantiles.
    #[serde(with = "crate::nullable")]
    pub normal: Vec<f64>,
    /// Residual quantiles before.
    #[serde(with = "crate::nullable")]
    pub before: Vec<f64>,
    /// Residual quantiles after; may be empty.
    #[serde(default, with = "crate::nullable")]
    pub after: Vec<f64>,
}

/// A trajectory with predictions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Example {
    /// Trajectory, e.g. `worst: trajectory 31`.
    pub trajectory: String,
    /// Channel, e.g. `height`.
    pub channel: String,
    /// Its unit.
    pub unit: String,
    /// Times, s.
    #[serde(with = "crate::nullable")]
    pub t_s: Vec<f64>,
    /// Measured values.
    #[serde(with = "crate::nullable")]
    pub measured: Vec<f64>,
    /// Predictions of the declared model.
    #[serde(with = "crate::nullable")]
    pub before: Vec<f64>,
    /// Predictions of the augmented model; may be empty.
    #[serde(default, with = "crate::nullable")]
    pub after: Vec<f64>,
    /// Time until which the initial state was fitted, s; what follows is predicted.
    #[serde(default)]
    pub known_until_s: Option<f64>,
    /// For a pushed object: what is seen from above.
    #[serde(default)]
    pub top_view: Option<TopView>,
}

/// A push seen from above, m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TopView {
    /// Outline of the object where it began.
    pub start: Vec<[f64; 2]>,
    /// Outline at the end: measured, by the declared model, by the augmented model.
    pub ends: [Vec<[f64; 2]>; 3],
    /// Path of the rod's centre.
    pub rod: Vec<[f64; 2]>,
    /// The rod where it began and ended.
    pub rod_outlines: [Vec<[f64; 2]>; 2],
}

/// A law that was added, over the values that its quantity takes in the data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LawCurve {
    /// Its name.
    pub title: String,
    /// The quantity that the law changes, e.g. `d(speed)/dt`.
    pub adds: String,
    /// Unit of the addition.
    pub unit: String,
    /// The quantity that it depends on.
    pub of: String,
    /// Unit of that quantity.
    pub of_unit: String,
    /// Values of the quantity.
    #[serde(with = "crate::nullable")]
    pub x: Vec<f64>,
    /// The addition at each place of `x`.
    #[serde(with = "crate::nullable")]
    pub y: Vec<f64>,
}

/// A candidate model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// The kinds of its effects; empty for the calibrated model itself.
    pub kinds: Vec<String>,
    /// Their parameters.
    #[serde(default)]
    pub parameters: Vec<Parameter>,
    /// Gain over the calibrated model less the penalty, in `score_unit`; larger is better.
    pub score: Option<f64>,
    /// Whether it was chosen.
    #[serde(default)]
    pub chosen: bool,
    /// Why it won or lost, in a few words.
    pub why: String,
}

/// Correlations of fitted parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Correlations {
    /// Parameter names.
    pub names: Vec<String>,
    /// One row per name.
    pub values: Vec<Vec<Option<f64>>>,
}

/// The noise that was found in the data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Estimated standard deviation of the sensor.
    pub sd: Option<f64>,
    /// Its 95 % interval.
    #[serde(default)]
    pub ci95: Option<[f64; 2]>,
    /// The declared one.
    #[serde(default)]
    pub declared_sd: Option<f64>,
    /// Unit of all three.
    pub unit: String,
    /// Findings, e.g. `noise-autocorrelated` with a sentence.
    #[serde(default)]
    pub findings: Vec<NoiseFinding>,
}

/// Something about the noise that is not as declared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NoiseFinding {
    /// Kind, e.g. `timing-jitter`.
    pub kind: String,
    /// The finding, in a sentence.
    pub text: String,
}

/// A residual that no effect in the library explains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Where it lives, e.g. `impact` or `rate`.
    pub r#where: String,
    /// Quantity that the residual adds to, e.g. `v_m_s`.
    pub target: String,
    /// The quantity that it depends on, e.g. `impact speed`.
    pub against: String,
    /// The sparse-regression term that removes most of it, e.g. `0.031·v²`; may be empty.
    pub term: String,
}

/// The report as one HTML page.
#[must_use]
pub fn discovery_report(report: &DiscoveryReport) -> String {
    page::page(report).render()
}

/// Sections of an excerpt.
const EXCERPT: usize = 3;

/// The beginning of the report as one HTML page of its own, for where there is little room: title, outcome and the first
/// sections that have content.
#[must_use]
pub fn discovery_excerpt(report: &DiscoveryReport) -> String {
    let mut page = page::page(report);
    page.sections.retain(|section| !section.blocks.is_empty());
    page.sections.truncate(EXCERPT);
    page.render()
}

/// All figures of the report in its order, each with its title.
#[must_use]
pub fn discovery_figures(report: &DiscoveryReport) -> Vec<Figure> {
    let blocks = page::page(report).sections.into_iter().flat_map(|section| section.blocks);
    let figures = |block| match block {
        Block::Figure(figure) => vec![figure.figure],
        Block::Grid(grid) => grid.figures,
        _ => Vec::new(),
    };
    blocks.flat_map(figures).collect()
}

/// Names of [`discovery_figures`], in their order: the words of each title before a colon or comma, in small letters with
/// hyphens, and a number where several have the same.
#[must_use]
pub fn figure_names(figures: &[Figure]) -> Vec<String> {
    let mut plain: Vec<String> = Vec::new();
    let mut names = Vec::new();
    for figure in figures {
        let title = figure.title().split([':', ',']).next().unwrap_or_default().to_lowercase();
        let words: Vec<&str> =
            title.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
        let name = words.join("-");
        let same = plain.iter().filter(|n| **n == name).count();
        names.push(if same == 0 { name.clone() } else { format!("{name}-{}", same + 1) });
        plain.push(name);
    }
    names
}
