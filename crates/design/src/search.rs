//! Search for the experiments of a plan: random candidates, refined coordinate by coordinate, one run after the other.

use crate::candidate::{Candidate, Experiment};
use crate::draw::draw_run;
use crate::error::DesignError;
use crate::evidence::Evidence;
use crate::explanation::Explanation;
use crate::limits::Limits;
use crate::noise_free::NoiseFree;
use crate::posterior_sample::PosteriorSample;
use crate::score::{Scored, Study, exceeded, sufficient_mean};
use augsim_data::random_stream;
use rayon::prelude::*;

/// Number of random candidates for each run.
const CANDIDATES: u64 = 128;
/// Number of the best candidates that are scored with full refits.
const FULLY_SCORED: usize = 16;
/// Number of the best of these that are refined.
const REFINED: usize = 2;
/// Number of the best recorded runs that are scored with full refits: a pool is chosen from after each run of each order.
const FULLY_SCORED_RECORDED: usize = 4;
/// Step of the coordinates in the refinement.
const STEP: f64 = 0.15;
/// Number of parameter draws of each explanation in a score; the fitted values are the first.
const SCORE_DRAWS: u64 = 3;
/// Number of parameter draws of each explanation with which the limits of a chosen experiment are checked.
const CHECK_DRAWS: u64 = 64;
/// Factor of the inputs after a draw that exceeds a limit.
const SHRINK: f64 = 0.9;
/// Maximum number of times the inputs of a chosen experiment are made smaller.
const MAX_SHRINKS: usize = 40;
/// Half width of the 95 % interval of a parameter, in standard deviations.
const INTERVAL: f64 = augsim_system::NORMAL_95;

/// What to design for.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The live explanations after all recordings so far, with their weights.
    pub explanations: &'a [Explanation],
    /// Evidence of the recordings so far for each of them.
    pub evidence: &'a [Evidence],
    /// Possible true parameters of each of them.
    pub samples: &'a [PosteriorSample],
    /// Limits of the experiment.
    pub limits: &'a Limits,
    /// Maximum number of runs.
    pub budget: usize,
    /// Required odds for one explanation against each other one.
    pub odds: f64,
    /// Seed of all random draws.
    pub seed: u64,
}

/// A designed run with its expected log odds.
#[derive(Clone, Debug)]
pub struct Run {
    /// The experiment.
    pub experiment: Experiment,
    /// Names of the input signals' families, in the order of the inputs.
    pub families: Vec<&'static str>,
    /// Expected log odds of this run, nats, `[truth][rival]`.
    pub log_odds: Vec<Vec<f64>>,
    /// As `log_odds` where the rival keeps its parameters.
    pub without_refit: Vec<Vec<f64>>,
    /// Expected information gain on the parameters of each explanation, nats.
    pub information: Vec<f64>,
    /// Name of the limit that made the inputs smaller; `None` if none did.
    pub limited_by: Option<String>,
    /// The explanations with the covariance that this run and the earlier ones leave.
    pub after: Vec<Explanation>,
}

/// Normalised weights from log weights.
pub fn weights(explanations: &[Explanation]) -> Vec<f64> {
    let most = explanations.iter().map(|e| e.log_weight).fold(f64::NEG_INFINITY, f64::max);
    let relative: Vec<f64> = explanations.iter().map(|e| (e.log_weight - most).exp()).collect();
    let sum: f64 = relative.iter().sum();
    relative.into_iter().map(|w| w / sum).collect()
}

/// Designs up to `budget` runs; stops earlier once the expected log odds of all pairs are sufficient.
///
/// # Errors
/// No candidate keeps all explanations within the limits.
pub fn design(request: &Request<'_>) -> Result<Vec<Run>, DesignError> {
    let count = request.explanations.len();
    let sufficient = sufficient_mean(request.odds.ln());
    let mut explanations = request.explanations.to_vec();
    let draws = draws(request);
    let mut sequences = NoiseFree::new(request.explanations, request.evidence, &draws);
    let mut runs = Vec::new();
    while runs.len() < request.budget.max(1) {
        let study = study(&explanations, request, sufficient);
        let best = best_of(&study, &sequences, request.seed, runs.len() as u64)
            .ok_or_else(|| no_design(request.limits))?;
        let best = within_limits(&study, &sequences, best, request)?;
        explanations.clone_from(&best.after);
        if count > 1 {
            sequences = sequences.with_run(&best.experiment)?;
        }
        runs.push(run_of(best));
        let planned = means(&sequences.log_odds);
        let is_separated = |i: usize, j: usize| i == j || planned[i][j] >= sufficient;
        if count > 1 && (0..count).all(|i| (0..count).all(|j| is_separated(i, j))) {
            break;
        }
    }
    Ok(runs)
}

/// Means over the draws, `[truth][rival]`.
fn means(log_odds: &[Vec<Vec<f64>>]) -> Vec<Vec<f64>> {
    let mean = |draws: &Vec<f64>| draws.iter().sum::<f64>() / draws.len().max(1) as f64;
    log_odds.iter().map(|row| row.iter().map(mean).collect()).collect()
}

/// A random experiment within the limits, by number: the choice with which a design is compared.
///
/// # Errors
/// None of many candidates keeps all explanations within the limits.
pub fn random_run(request: &Request<'_>, number: u64) -> Result<Run, DesignError> {
    let study = study(request.explanations, request, sufficient_mean(request.odds.ln()));
    for attempt in 0..CANDIDATES {
        let mut rng = random_stream(request.seed, "random design", number * CANDIDATES + attempt);
        let Some(scored) = study.score(&Candidate::random(request.limits, &mut rng)) else { continue };
        let sequences = NoiseFree::new(request.explanations, request.evidence, &study.draws);
        return Ok(run_of(within_limits(&study, &sequences, scored, request)?));
    }
    Err(no_design(request.limits))
}

/// Index of the recorded experiment that separates the explanations best, as a design is chosen; `None` if none can be
/// simulated.
pub fn choose(request: &Request<'_>, pool: &[Experiment]) -> Option<usize> {
    let study = study(request.explanations, request, sufficient_mean(request.odds.ln()));
    let sequences = NoiseFree::new(request.explanations, request.evidence, &study.draws);
    let planned = means(&sequences.log_odds);
    let scored = |(index, experiment): (usize, &Experiment)| {
        let scored = study.score_experiment(experiment)?;
        Some((study.value(&scored, &planned), (index, scored)))
    };
    let all = largest(pool.par_iter().enumerate().filter_map(scored).collect(), FULLY_SCORED_RECORDED);
    let full = |(linear, (index, scored)): (f64, (usize, Scored))| {
        let value = full_score(&study, &sequences, scored).map_or(linear, |(value, _)| value);
        (value, index)
    };
    let all: Vec<(f64, usize)> = all.into_par_iter().map(full).collect();
    all.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a }).map(|(_, index)| index)
}

/// The `count` entries with the largest scores, in their order; equal scores stay in the order of the list.
fn largest<T>(mut scored: Vec<(f64, T)>, count: usize) -> Vec<(f64, T)> {
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.truncate(count);
    scored
}

fn no_design(limits: &Limits) -> DesignError {
    let names: Vec<&str> = limits.ranges.keys().map(String::as_str).collect();
    DesignError::NoDesign(format!(
        "no input within the limits keeps all explanations within the ranges of {}; widen these ranges, or set starts inside them",
        names.join(", ")
    ))
}

fn run_of(scored: Scored) -> Run {
    Run {
        families: scored.candidate.inputs.iter().map(|shape| shape.family.word()).collect(),
        log_odds: means(&scored.log_odds),
        without_refit: scored.without_refit,
        information: scored.information,
        limited_by: scored.limited_by,
        experiment: scored.experiment,
        after: scored.after,
    }
}

/// The context in which candidates are scored.
fn study<'a>(explanations: &'a [Explanation], request: &Request<'a>, sufficient: f64) -> Study<'a> {
    Study {
        explanations,
        limits: request.limits,
        weights: weights(explanations),
        draws: draws(request),
        sufficient,
    }
}

/// Draws the parameters with which candidates are scored, `[explanation][draw]`; the first are the fitted values.
fn draws(request: &Request<'_>) -> Vec<Vec<Vec<f64>>> {
    let of_explanation = |(index, e): (usize, &Explanation)| {
        let drawn = (1..SCORE_DRAWS).map(|k| {
            let mut rng = random_stream(request.seed, "design draws", ((index as u64) << 32) + k);
            request.samples[index].draw(&mut rng)
        });
        std::iter::once(e.values.clone()).chain(drawn).collect()
    };
    request.explanations.iter().enumerate().map(of_explanation).collect()
}

/// The best of random candidates after refinement; `None` if no candidate is within the limits.
///
/// All candidates are scored with linear refits of the rivals, the best of them with full refits.
fn best_of(study: &Study<'_>, sequences: &NoiseFree<'_>, seed: u64, run: u64) -> Option<Scored> {
    let planned = means(&sequences.log_odds);
    let scored = |k: u64| {
        let mut rng = random_stream(seed, "design", run * CANDIDATES + k);
        let scored = study.score(&Candidate::random(study.limits, &mut rng))?;
        Some((study.value(&scored, &planned), scored))
    };
    let all = largest((0..CANDIDATES).into_par_iter().filter_map(scored).collect(), FULLY_SCORED);
    let full = |(_, scored): (f64, Scored)| full_score(study, sequences, scored);
    let best = largest(all.into_par_iter().filter_map(full).collect(), REFINED);
    let refined: Vec<(f64, Scored)> =
        best.into_par_iter().map(|start| refine(study, sequences, start)).collect();
    refined.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a }).map(|(_, best)| best)
}

/// A candidate with full refits instead of formula (1), and its value; `None` if a refit fails.
///
/// A single explanation has no rivals to refit.
fn full_score(study: &Study<'_>, sequences: &NoiseFree<'_>, mut scored: Scored) -> Option<(f64, Scored)> {
    let before = &sequences.log_odds;
    if study.explanations.len() > 1 {
        scored.log_odds = sequences.with_run(&scored.experiment).ok()?.log_odds;
        let all = scored.log_odds.iter_mut().flatten().flatten();
        all.zip(before.iter().flatten().flatten()).for_each(|(odds, before)| *odds -= before);
    }
    Some((study.value(&scored, &means(before)), scored))
}

/// Improves a candidate coordinate by coordinate.
fn refine(study: &Study<'_>, sequences: &NoiseFree<'_>, mut best: (f64, Scored)) -> (f64, Scored) {
    for place in 0..best.1.candidate.clone().coordinates().len() {
        for change in [STEP, -STEP] {
            let mut candidate = best.1.candidate.clone();
            if !candidate.move_coordinate(place, change) {
                continue;
            }
            let better = study.score(&candidate).and_then(|scored| full_score(study, sequences, scored));
            if let Some(better) = better.filter(|b| b.0 > best.0) {
                best = better;
                break;
            }
        }
    }
    best
}

/// Makes the inputs of a chosen experiment smaller until many draws of all explanations stay within the limits.
///
/// The draws include both ends of each parameter's 95 % interval, and process noise.
fn within_limits(
    study: &Study<'_>,
    sequences: &NoiseFree<'_>,
    chosen: Scored,
    request: &Request<'_>,
) -> Result<Scored, DesignError> {
    let draws: Vec<Vec<Vec<f64>>> = (0..study.explanations.len()).map(|i| check_values(request, i)).collect();
    let mut scale = chosen.scale;
    let mut limited_by = None;
    for _ in 0..MAX_SHRINKS {
        let experiment = chosen.candidate.experiment(study.limits, scale);
        match first_exceeded(study, &experiment, &draws, request.seed) {
            None if scale == chosen.scale => return Ok(chosen),
            None => {
                let rescored = study.score_at(&chosen.candidate, scale, limited_by.or(chosen.limited_by));
                let scored = rescored.ok_or_else(|| no_design(study.limits))?;
                return Ok(full_score(study, sequences, scored.clone()).map_or(scored, |(_, scored)| scored));
            }
            Some(limit) => limited_by = Some(limit),
        }
        scale *= SHRINK;
    }
    Err(no_design(study.limits))
}

/// Parameter values at which limits are checked: ends of each 95 % interval, and draws.
fn check_values(request: &Request<'_>, index: usize) -> Vec<Vec<f64>> {
    let e = &request.explanations[index];
    let mut list = vec![e.values.clone()];
    for (place, sd) in e.uncertain.iter().zip(e.coordinate_sds()) {
        list.extend([-INTERVAL, INTERVAL].map(|side| e.moved(e.values.clone(), *place, side * sd)));
    }
    let drawn = |k: u64| {
        let mut rng = random_stream(request.seed, "limit draws", ((index as u64) << 32) + k);
        request.samples[index].draw(&mut rng)
    };
    list.extend((0..CHECK_DRAWS).map(drawn));
    list
}

/// Name of the first limit that a draw of an explanation exceeds.
fn first_exceeded(
    study: &Study<'_>,
    experiment: &Experiment,
    draws: &[Vec<Vec<f64>>],
    seed: u64,
) -> Option<String> {
    let tasks: Vec<(usize, usize)> =
        draws.iter().enumerate().flat_map(|(i, list)| (0..list.len()).map(move |k| (i, k))).collect();
    let check = |&(i, k): &(usize, usize)| {
        let e = &study.explanations[i];
        let mut rng = random_stream(seed, "limit noise", ((i as u64) << 32) + k as u64);
        match draw_run(e, &draws[i][k], experiment, &mut rng) {
            Ok(out) => exceeded(e, study.limits, &out),
            Err(_) => Some("an explanation that cannot be simulated".to_owned()),
        }
    };
    tasks.par_iter().filter_map(check).collect::<Vec<_>>().into_iter().next()
}
