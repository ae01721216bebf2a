//! Designs the next runs and promises their odds.

use super::evidence::{live_evidence, tested_records};
use super::explanation::{Compiled, Tuning, compile, write_back};
use super::source::Source;
use super::state::{Explained, PlannedRun, PromiseOf, Recording, RunOdds, State};
use super::text::{note_on_starts, plan_sentence, why_not};
use crate::equations::unit_text;
use augsim_data::random_stream;
use augsim_design::{
    Candidate, DesignError, Evidence, Experiment, Explanation, Limits, PosteriorSample, Promise, Request,
    Run, after_recordings, design, nominal_run, promise, weights,
};
use augsim_equations::Model;
use augsim_system::Record;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Number of random experiments on which integration steps are chosen where there are no recordings.
const TUNING_EXPERIMENTS: u64 = 16;

/// Size of a plan, and the random draws that it is made with.
#[derive(Debug, Clone, Copy)]
pub struct PlanOptions {
    /// Maximum number of runs.
    pub budget: usize,
    /// Required odds against each other explanation.
    pub odds: f64,
    /// Number of simulated sequences for each explanation as the truth.
    pub sequences: u64,
    /// Seed of all random draws.
    pub seed: u64,
}

/// What to plan.
#[derive(Debug)]
pub struct PlanRequest<'a> {
    /// The live explanations.
    pub sources: &'a [Source],
    /// Limits of a run.
    pub limits: &'a Limits,
    /// Recordings so far; may be empty.
    pub records: &'a [Record],
    /// Whether the parameters are estimated again from the recordings; else they are distributed as the models say.
    pub is_estimated_again: bool,
    /// Plan to go on with, with the runs that it has heard: instead of `sources` and `records`.
    pub continued: Option<&'a State>,
    /// Size of the plan, and its seed.
    pub options: PlanOptions,
}

/// A plan: its state, the inputs of each run as CSV files, and the predictions of each run.
#[derive(Debug)]
pub struct Planned {
    /// Content of `plan.json`.
    pub state: State,
    /// Name and text of the CSV file of each run.
    pub files: Vec<(String, String)>,
    /// Experiment of each run, for figures.
    pub experiments: Vec<Experiment>,
    /// Predicted outputs of each run by each explanation, `[run][explanation][output][sample]`.
    pub predictions: Vec<Vec<Vec<Vec<f64>>>>,
    /// Names and units of the inputs and of the outputs, for figures.
    pub columns: [Vec<(String, String)>; 2],
}

/// Experiments at random within the limits, as records for the choice of integration steps.
pub(super) fn tuning_records(limits: &Limits, outputs: usize, seed: u64) -> Tuning {
    let experiment = |k: u64| {
        let mut rng = random_stream(seed, "tuning", k);
        Candidate::random(limits, &mut rng).experiment(limits, 1.0)
    };
    let experiments: Vec<Experiment> = (0..TUNING_EXPERIMENTS).map(experiment).collect();
    let starts = experiments.first().map(|e| e.starts.clone()).unwrap_or_default();
    let blank = |e: &Experiment| Record {
        values: vec![vec![f64::NAN; e.times.len()]; outputs],
        ..e.record("tuning")
    };
    (experiments.iter().map(blank).collect(), starts)
}

/// Compiles the explanations.
///
/// # Errors
/// A model has no fitted uncertainty or no noise, or cannot be compiled or simulated.
pub(super) fn compiled(sources: &[Source], tuning: &Tuning) -> anyhow::Result<Vec<Compiled>> {
    sources.iter().map(|source| compile(source, tuning)).collect()
}

/// Designs runs that separate the explanations within the limits, and promises their odds by simulation.
///
/// # Errors
/// A model cannot be used, or no input keeps all explanations within the limits.
pub(super) fn plan(request: &PlanRequest<'_>) -> anyhow::Result<Planned> {
    let PlanOptions { budget, odds, sequences, seed } = request.options;
    let mut state = match request.continued {
        Some(state) => State { plan: Vec::new(), verdict: "plan".to_owned(), ..state.clone() },
        None => first_state(request)?,
    };
    let model = state.first_model()?;
    let tuning = match [state.earlier_records(), state.heard_records()].concat() {
        none if none.is_empty() => tuning_records(request.limits, model.outputs.len(), seed),
        records => (records, BTreeMap::new()),
    };
    let (explanations, evidence) = live_evidence(&state, &tuning)?;
    let limits = request.limits;
    let samples = (0..).zip(&evidence).map(|(k, evidence)| PosteriorSample::new(evidence, seed, k));
    let samples: Vec<PosteriorSample> = samples.collect::<Result<_, _>>()?;
    let (live, drawn) = (&explanations, &samples);
    let request =
        Request { explanations: live, evidence: &evidence, samples: drawn, limits, budget, odds, seed };
    let (runs, note_on_limits) = designed(&request)?;
    let experiments: Vec<&Experiment> = runs.iter().map(|r| &r.experiment).collect();
    let promised = (explanations.len() > 1)
        .then(|| promise(&evidence, &samples, &experiments, budget, odds, sequences, seed));
    state.odds = odds;
    state.plan = runs.iter().enumerate().map(|(k, run)| planned_run(k, run, &explanations)).collect();
    state.promise = promised.as_ref().map(|p| {
        let why = (!p.is_enough).then(|| why_not(&explanations, &runs, request.limits));
        let truths = explanations.iter().map(|e| e.name.clone()).collect();
        let effective = |s: &PosteriorSample| Some(s.effective_number()).filter(|n| n.is_finite());
        PromiseOf {
            truths,
            heard_before: state.heard.len(),
            why_not: why,
            effective_draws: samples.iter().map(effective).collect(),
            ..promise_of(p, sequences)
        }
    });
    let notes: Vec<String> = note_on_limits.into_iter().chain(note_on_starts(&explanations)).collect();
    state.note = (!notes.is_empty()).then(|| notes.join(" "));
    state.sentence = plan_sentence(&state, request.limits);
    let files =
        runs.iter().zip(&state.plan).map(|(run, p)| (p.file.clone(), csv(run, request.limits))).collect();
    let predict = |run: &Run| -> anyhow::Result<Vec<Vec<Vec<f64>>>> {
        explanations.iter().map(|e| Ok(nominal_run(e, &run.experiment)?)).collect()
    };
    let predictions = runs.iter().map(predict).collect::<anyhow::Result<_>>()?;
    let experiments = runs.into_iter().map(|r| r.experiment).collect();
    Ok(Planned { state, files, experiments, predictions, columns: columns(&model) })
}

/// Designs runs with draws of the parameters from what the recordings leave of them.
///
/// Where some of these draws leave the ranges whatever the inputs are, as with a tabulated force at speeds that were not reached,
/// the draws are from the normal distributions about the fits, and a note says so.
fn designed(request: &Request<'_>) -> Result<(Vec<Run>, Option<String>), DesignError> {
    match design(request) {
        Err(DesignError::NoDesign(_)) => {
            let normal: Vec<PosteriorSample> =
                request.explanations.iter().map(PosteriorSample::normal).collect();
            let runs = design(&Request { samples: &normal, ..request.clone() })?;
            let note = "Some parameter values that the recordings allow leave the ranges with any input: the limits were checked with normal \
                        distributions about the fitted values alone.";
            Ok((runs, Some(note.to_owned())))
        }
        runs => Ok((runs?, None)),
    }
}

/// Names and units of the inputs and of the outputs of a model.
fn columns(model: &Model) -> [Vec<(String, String)>; 2] {
    let column = |name: &str, unit| (name.to_owned(), unit_text(unit).trim_start().to_owned());
    [
        model.inputs.iter().map(|i| column(&i.name, i.unit)).collect(),
        model.outputs.iter().map(|o| column(&o.name, o.unit)).collect(),
    ]
}

/// State of a first plan: the explanations as all recordings leave them, before any run was heard.
fn first_state(request: &PlanRequest<'_>) -> anyhow::Result<State> {
    let outputs = request.sources.first().map_or(0, |s| s.model.outputs.len());
    let tuning = match request.records {
        [] => tuning_records(request.limits, outputs, request.options.seed),
        records => (records.to_vec(), BTreeMap::new()),
    };
    let (mut list, mut widths) = (Vec::new(), Vec::new());
    for (explanation, chosen) in compiled(request.sources, &tuning)? {
        list.push(match request.is_estimated_again {
            false => explanation,
            true => after_recordings(&explanation, request.records)?,
        });
        widths.push(chosen);
    }
    let mut state = State::new(request.options.odds, explained(request.sources, &list, widths)?);
    state.earlier = tested_records(request.records).iter().map(Recording::of).collect();
    Ok(state)
}

/// The explanations of a plan, before any run was heard.
fn explained(
    sources: &[Source],
    explanations: &[Explanation],
    widths: Vec<BTreeMap<String, f64>>,
) -> anyhow::Result<Vec<Explained>> {
    let weights = weights(explanations);
    let mut explained = Vec::with_capacity(explanations.len());
    for (k, ((source, e), widths)) in sources.iter().zip(explanations).zip(widths).enumerate() {
        let mut model = source.model.clone();
        write_back(&mut model, e);
        let toml = model.to_toml()?;
        explained.push(Explained {
            name: e.name.clone(),
            log_weight: e.log_weight,
            log_density: 0.0,
            log_maximum: 0.0,
            squares: 0.0,
            count: 0,
            weight: weights[k],
            log_e_value: 0.0,
            rejected: false,
            widths,
            file: model.file.clone(),
            planned_toml: toml.clone(),
            model_toml: toml,
        });
    }
    Ok(explained)
}

fn planned_run(k: usize, run: &Run, explanations: &[Explanation]) -> PlannedRun {
    let names = || explanations.iter().map(|e| e.name.clone()).enumerate();
    let pairs = names().flat_map(|(i, truth)| {
        names().filter(move |(j, _)| *j != i).map(move |(j, rival)| (i, truth.clone(), j, rival))
    });
    let odds = pairs.map(|(i, truth, j, rival)| RunOdds {
        truth,
        rival,
        log_odds: run.log_odds[i][j],
        without_refit: run.without_refit[i][j],
    });
    PlannedRun {
        file: format!("run-{}.csv", k + 1),
        signals: run.families.iter().map(|f| (*f).to_owned()).collect(),
        starts: run.experiment.starts.clone(),
        duration_s: run.experiment.times.last().copied().unwrap_or(0.0),
        odds: odds.collect(),
        information: run.information.clone(),
        limited_by: run.limited_by.clone(),
    }
}

/// The promise as it is in `plan.json`, without the names of the explanations.
fn promise_of(p: &Promise, sequences: u64) -> PromiseOf {
    PromiseOf {
        runs: p.runs,
        is_enough: p.is_enough,
        share: p.share(),
        // JSON has no infinities: a sequence that cannot be judged counts as certain odds for the rival.
        log_odds: p.log_odds().max(f64::MIN),
        log_odds_by_truth: p
            .truths
            .iter()
            .map(|t| t.log_odds.iter().map(|o| o.max(f64::MIN)).collect())
            .collect(),
        share_by_truth: p.truths.iter().map(|t| t.reached.clone()).collect(),
        sequences,
        heard_before: 0,
        effective_draws: Vec::new(),
        truths: Vec::new(),
        why_not: None,
    }
}

/// The inputs of a run as a CSV file: time and one column for each input.
fn csv(run: &Run, limits: &Limits) -> String {
    let names: Vec<&str> = limits.inputs.iter().map(|i| i.name.as_str()).collect();
    let mut text = format!("t_s,{}\n", names.join(",")).replace("t_s,\n", "t_s\n");
    for (k, t) in run.experiment.times.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{t}");
        for input in &run.experiment.inputs {
            let _ = write!(text, ",{}", input[k]);
        }
        text.push('\n');
    }
    text
}

/// Compiles fitted models, with parameters distributed as `records` leave them, to explanations before any new recording.
///
/// Integration steps are chosen on `tuning`, recordings whose outputs are not used.
///
/// # Errors
/// A model has no fitted uncertainty or no noise, or cannot be compiled or simulated.
pub fn evidence(sources: &[Source], records: &[Record], tuning: &[Record]) -> anyhow::Result<Vec<Evidence>> {
    let blank = |r: &Record| {
        let mut blank = r.clone();
        blank.values.iter_mut().flatten().for_each(|v| *v = f64::NAN);
        blank
    };
    let tuning: Tuning = (tuning.iter().map(blank).collect(), BTreeMap::new());
    let evidence = |(e, _): Compiled| Evidence::after(&after_recordings(&e, records)?, records);
    Ok(compiled(sources, &tuning)?.into_iter().map(evidence).collect::<Result<_, _>>()?)
}
