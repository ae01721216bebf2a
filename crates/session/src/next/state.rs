//! `plan.json`: the explanations with their evidence, the plan with its promise, and the runs that were heard.

use super::fault::NextFault;
use super::source::Source;
use crate::Usage;
use augsim_system::{Record, Stream};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the file in the folder of a plan.
const PLAN: &str = "plan.json";
/// Version of the format.
const SCHEMA: &str = "augsim-next-3";

/// An explanation with its evidence from the runs that were heard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Explained {
    /// Name of the explanation.
    pub name: String,
    /// Logarithm of the prior weight, nats, up to a constant.
    pub log_weight: f64,
    /// Log density of the runs that were heard, nats.
    pub log_density: f64,
    /// Logarithm of the largest likelihood of these runs, nats.
    pub log_maximum: f64,
    /// Sum of squares of the standardised prediction errors of these runs.
    pub squares: f64,
    /// Number of these prediction errors.
    pub count: usize,
    /// Weight after all data.
    pub weight: f64,
    /// Logarithm of the e-value against the explanation, nats.
    pub log_e_value: f64,
    /// Whether the e-value has reached the required odds after some run.
    pub rejected: bool,
    /// Widths of smoothed jumps, by the text of their argument: as in the plan for all later runs.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub widths: BTreeMap<String, f64>,
    /// File that the model was read from.
    pub file: String,
    /// Model file with the values and the covariance before the runs that were heard.
    pub planned_toml: String,
    /// Model file with the values and the covariance after all data.
    pub model_toml: String,
}

/// Expected log odds of a run for one explanation against another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunOdds {
    /// Name of the explanation that is true.
    pub truth: String,
    /// Name of the rival.
    pub rival: String,
    /// Expected log odds, nats.
    pub log_odds: f64,
    /// Expected log odds if the rival could not change its parameters, nats.
    pub without_refit: f64,
}

/// A designed run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedRun {
    /// Name of the CSV file with the inputs.
    pub file: String,
    /// Family of the signal of each input.
    pub signals: Vec<String>,
    /// Start values that are to be set, by name of the state.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub starts: BTreeMap<String, f64>,
    /// Duration, s.
    pub duration_s: f64,
    /// Expected log odds of each pair.
    pub odds: Vec<RunOdds>,
    /// Expected information gain on the parameters of each explanation, nats.
    pub information: Vec<f64>,
    /// Name of the limit that made the inputs smaller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limited_by: Option<String>,
}

/// Promise of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PromiseOf {
    /// Number of runs.
    pub runs: usize,
    /// Whether these runs reach the required odds in nine of ten cases, whichever explanation is true.
    pub is_enough: bool,
    /// Smallest share of cases, over the explanations as the truth, in which they reach them.
    pub share: f64,
    /// Log odds, nats, that they reach in nine of ten cases, whichever explanation is true.
    pub log_odds: f64,
    /// Number of runs that were heard before the plan.
    pub heard_before: usize,
    /// Names of the explanations that are the truth in turn.
    pub truths: Vec<String>,
    /// For each of these, the log odds, nats, that nine of ten cases reach after each run.
    pub log_odds_by_truth: Vec<Vec<f64>>,
    /// The same for the share of cases that reach the required odds.
    pub share_by_truth: Vec<Vec<f64>>,
    /// Number of simulated sequences for each explanation.
    pub sequences: u64,
    /// Effective number of draws of the true parameters of each explanation; `None` for draws from a normal distribution.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effective_draws: Vec<Option<f64>>,
    /// Why the explanations cannot be separated; `None` if they can.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}

/// A run that was heard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeardRun {
    /// The recording.
    pub recording: Recording,
    /// Log density of the recording given all before, nats, in the order of the explanations.
    pub log_density: Vec<f64>,
    /// Largest log odds, nats, of the leading explanation against its strongest rival after this run.
    pub log_odds: f64,
}

/// A recording that was heard: later runs are judged together with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// Name of the recording.
    pub id: String,
    /// Sample times, s.
    pub times_s: Vec<f64>,
    /// Measured outputs, `[output][sample]`; `None` where not measured.
    pub outputs: Vec<Vec<Option<f64>>>,
    /// Times, s, and values of each input.
    pub inputs: Vec<(Vec<f64>, Vec<f64>)>,
    /// Values of the constants of the recording, in the order of the model; `None` where not recorded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub constants: Vec<Option<f64>>,
}

impl Recording {
    /// Keeps the samples and inputs of a record.
    pub(super) fn of(record: &Record) -> Self {
        let finite =
            |values: &Vec<f64>| -> Vec<_> { values.iter().map(|v| v.is_finite().then_some(*v)).collect() };
        let input = |s: &Stream| (s.times.clone(), s.values.first().cloned().unwrap_or_default());
        Self {
            id: record.id.clone(),
            times_s: record.times.clone(),
            outputs: record.values.iter().map(finite).collect(),
            inputs: record.inputs.iter().map(input).collect(),
            constants: finite(&record.covariates),
        }
    }

    /// The record of these samples.
    pub(super) fn record(&self) -> Record {
        let values = |column: &Vec<Option<f64>>| -> Vec<f64> {
            column.iter().map(|v| v.unwrap_or(f64::NAN)).collect()
        };
        let stream = |(times, values): &(Vec<f64>, Vec<f64>)| Stream {
            times: times.clone(),
            values: vec![values.clone()],
        };
        Record {
            id: self.id.clone(),
            times: self.times_s.clone(),
            values: self.outputs.iter().map(values).collect(),
            inputs: self.inputs.iter().map(stream).collect(),
            covariates: values(&self.constants),
            ..Record::default()
        }
    }
}

/// Content of `plan.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Version of the format.
    pub schema: String,
    /// Required odds.
    pub odds: f64,
    /// Sentence that sums up the plan, or the judgement of the runs.
    pub sentence: String,
    /// What would make fewer runs enough; `None` if nothing is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// `plan`, `enough`, `more` or `none-fits`.
    pub verdict: String,
    /// The explanations.
    pub explanations: Vec<Explained>,
    /// The designed runs.
    pub plan: Vec<PlannedRun>,
    /// The promise of the plan; `None` for a single explanation.
    pub promise: Option<PromiseOf>,
    /// Earlier recordings that the explanations were fitted to, for tests of the explanations.
    pub earlier: Vec<Recording>,
    /// The runs that were heard since the explanations were fitted.
    pub heard: Vec<HeardRun>,
    /// Dispersion of the standardised prediction errors of the best explanation; 1 without excess.
    pub dispersion: f64,
}

impl State {
    /// Makes a state with the current format version.
    pub(super) fn new(odds: f64, explanations: Vec<Explained>) -> Self {
        State {
            schema: SCHEMA.to_owned(),
            odds,
            sentence: String::new(),
            note: None,
            verdict: "plan".to_owned(),
            explanations,
            plan: Vec::new(),
            promise: None,
            earlier: Vec::new(),
            heard: Vec::new(),
            dispersion: 1.0,
        }
    }

    /// Reads the plan in a folder; `None` if the path is no folder with a plan.
    ///
    /// # Errors
    /// The file is not a plan of this version.
    pub fn read_if_there(folder: &Path) -> anyhow::Result<Option<Self>> {
        let file = folder.join(PLAN);
        if !folder.is_dir() || !file.is_file() {
            return Ok(None);
        }
        let text = augsim_data::read_text(&file)?;
        let state: State = serde_json::from_str(&text).map_err(|_| no_plan(folder))?;
        Ok(Some(state).filter(|s| s.schema == SCHEMA))
    }

    /// Reads the plan in a folder.
    ///
    /// # Errors
    /// There is none.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        Ok(Self::read_if_there(folder)?.ok_or_else(|| no_plan(folder))?)
    }

    /// The model of the first explanation; all have the same inputs and outputs.
    ///
    /// # Errors
    /// The plan has no explanation, or its model cannot be read.
    pub fn first_model(&self) -> anyhow::Result<augsim_equations::Model> {
        let first = self.explanations.first().ok_or_else(|| no_plan(Path::new("plan.json")))?;
        Ok(augsim_equations::model::parse(&first.model_toml, &first.file)?)
    }

    /// The earlier recordings.
    pub fn earlier_records(&self) -> Vec<Record> {
        self.earlier.iter().map(Recording::record).collect()
    }

    /// The recordings of the runs that were heard.
    pub fn heard_records(&self) -> Vec<Record> {
        self.heard.iter().map(|run| run.recording.record()).collect()
    }

    /// The explanations before the runs that were heard.
    ///
    /// # Errors
    /// A model of the plan cannot be read.
    pub fn planned_sources(&self) -> anyhow::Result<Vec<Source>> {
        self.explanations.iter().map(|e| e.source(&e.planned_toml, e.log_weight)).collect()
    }

    /// The explanations that are not rejected, with their weights after all data.
    pub(super) fn live_sources(&self) -> anyhow::Result<Vec<Source>> {
        let source = |e: &Explained| e.source(&e.model_toml, e.log_weight + e.log_density / self.dispersion);
        self.explanations.iter().filter(|e| !e.rejected).map(source).collect()
    }

    /// Names of the explanations that are not rejected.
    pub(super) fn live_names(&self) -> Vec<&str> {
        self.explanations.iter().filter(|e| !e.rejected).map(|e| e.name.as_str()).collect()
    }
}

impl Explained {
    /// The explanation with the values of one of its model files, and its log weight with them.
    fn source(&self, toml: &str, log_weight: f64) -> anyhow::Result<Source> {
        let model = augsim_equations::model::parse(toml, &self.file)?;
        Ok(Source { name: self.name.clone(), model, log_weight, widths: self.widths.clone() })
    }
}

fn no_plan(folder: &Path) -> Usage {
    Usage::model(folder.display(), crate::usage::ModelFault::Next(NextFault::NoPlan))
}
