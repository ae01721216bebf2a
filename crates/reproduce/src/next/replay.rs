//! Replay of a pool: runs chosen one by one by the design, against random order.
//!
//! The first recordings are drawn at random, and the explanations are fitted to them. The outputs of the other runs stay
//! hidden until a run is chosen: by the design from the recorded inputs, or at random. The verdict of the whole
//! pool is the set of explanations that all its runs together leave; counted are the runs after which a sequence has
//! rejected the same ones.

use super::pools::Pool;
use anyhow::Context;
use augsim_data::random_stream;
use augsim_design::{
    Evidence, Experiment, Explanation, Judgement, Limits, PosteriorSample, Request, Tally, choose, judge,
};
use augsim_session::equations::{fit::fit, noise};
use augsim_session::next::{Source, default_limits, evidence, read_limits};
use augsim_system::{Record, Stream};
use rand::seq::SliceRandom;
use serde::Serialize;
use std::collections::BTreeMap;

/// Settings of a replay.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Number of random orders.
    pub orders: usize,
    /// Number of first recordings.
    pub first: usize,
    /// Seed of all random draws.
    pub seed: u64,
}

/// Required odds, the default of `next`.
const ODDS: f64 = 1000.0;
/// Maximum number of runs of a sequence; a verdict that needs more counts as not reached.
const MAX_RUNS: usize = 40;

/// Result of one order of the runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Order {
    /// Names of the first recordings.
    pub first: Vec<String>,
    /// Explanations that all runs together leave.
    pub left: Vec<String>,
    /// Errors of the best explanation in multiples of its noise, over the whole pool.
    pub error_ratio: f64,
    /// Number of runs to that verdict as designed; `None` if 40 runs did not come to it.
    pub designed: Option<usize>,
    /// The same in random order.
    pub random: Option<usize>,
}

/// Replays a pool in one random order.
///
/// # Errors
/// An explanation cannot be fitted to the first recordings, or not be simulated over a run.
pub fn replay(pool: &Pool, settings: Settings, order: u64) -> anyhow::Result<Order> {
    let mut places: Vec<usize> = (0..pool.runs.len()).collect();
    places.shuffle(&mut random_stream(settings.seed, "replay", order));
    let ordered: Vec<Record> = places.iter().map(|k| pool.runs[*k].clone()).collect();
    let (first, rest) = ordered.split_at(settings.first.min(ordered.len()));
    let fitted = |source: &Source| -> anyhow::Result<Source> {
        let fitted = fit(&source.model, first, None);
        let mut model =
            fitted.with_context(|| format!("{}: {} cannot be fitted", pool.name, source.name))?.model;
        noise::find(&mut model, first)?;
        Ok(Source { model, ..source.clone() })
    };
    let sources: Vec<Source> = pool.explanations.iter().map(fitted).collect::<Result<_, _>>()?;
    let live = evidence(&sources, first, &pool.runs)?;
    let whole = judged(&live, rest)?;
    let starts = usual_starts(&sources, first)?;
    let runs: Vec<Experiment> = rest.iter().map(|r| experiment(r, &starts)).collect();
    let by_design = |current: &[Explanation], evidence: &[Evidence], unheard: &[usize]| {
        let choice: Vec<Experiment> = unheard.iter().map(|k| runs[*k].clone()).collect();
        let limits = Limits::default();
        // Thousands of choices: each draws from the normal distribution about the fit.
        let samples: Vec<PosteriorSample> = current.iter().map(PosteriorSample::normal).collect();
        let request = Request {
            explanations: current,
            evidence,
            samples: &samples,
            limits: &limits,
            budget: 1,
            odds: ODDS,
            seed: settings.seed,
        };
        choose(&request, &choice).unwrap_or(0)
    };
    let designed = sequence(&live, rest, &whole.left, by_design)?;
    let random = sequence(&live, rest, &whole.left, |_, _, _| 0)?;
    Ok(Order {
        first: first.iter().map(|r| r.id.clone()).collect(),
        left: whole.left.iter().map(|k| live[*k].explanation().name.clone()).collect(),
        error_ratio: whole.dispersion.sqrt(),
        designed,
        random,
    })
}

/// Judgement of recordings that are heard together.
fn judged(live: &[Evidence], records: &[Record]) -> anyhow::Result<Judgement> {
    let mut tallies = Vec::with_capacity(live.len());
    for evidence in live {
        let mut evidence = evidence.clone();
        evidence.add_all(records)?;
        tallies.push(evidence.tally());
    }
    Ok(judge(&tallies, &vec![false; live.len()], ODDS))
}

/// Number of runs after which `wanted` are left; the next run is that of `choice` among the places of unheard runs.
///
/// The choice is by the explanations that are not rejected, with their weights. `None` if `wanted` are never left.
fn sequence(
    live: &[Evidence],
    records: &[Record],
    wanted: &[usize],
    choice: impl Fn(&[Explanation], &[Evidence], &[usize]) -> usize,
) -> anyhow::Result<Option<usize>> {
    let mut evidence = live.to_vec();
    let mut unheard: Vec<usize> = (0..records.len()).collect();
    let mut current: Vec<Explanation> = live.iter().map(|e| e.explanation().clone()).collect();
    let mut current_evidence = live.to_vec();
    let mut rejected = vec![false; live.len()];
    for heard in 1..=records.len().min(MAX_RUNS) {
        let place = unheard.remove(choice(&current, &current_evidence, &unheard));
        for one in &mut evidence {
            one.add(&records[place])?;
        }
        let tallies: Vec<Tally> = evidence.iter().map(Evidence::tally).collect();
        let judgement = judge(&tallies, &rejected, ODDS);
        let left = &judgement.left;
        (0..live.len()).for_each(|k| rejected[k] = !left.contains(&k));
        if left == wanted {
            return Ok(Some(heard));
        }
        // A wanted explanation that is rejected stays so.
        if wanted.iter().any(|k| rejected[*k]) || left.is_empty() {
            return Ok(None);
        }
        current_evidence = left.iter().map(|k| evidence[*k].clone()).collect();
        current = left.iter().map(|k| weighted(&evidence[*k], judgement.weights[*k])).collect();
    }
    Ok(None)
}

/// An explanation after the runs that were heard, with its weight.
fn weighted(evidence: &Evidence, weight: f64) -> Explanation {
    Explanation { log_weight: weight.max(f64::MIN_POSITIVE).ln(), ..evidence.updated() }
}

/// Usual initial values of the states that have none by declaration, from the first recordings.
fn usual_starts(sources: &[Source], first: &[Record]) -> anyhow::Result<BTreeMap<String, f64>> {
    let mut starts = BTreeMap::new();
    for source in sources {
        let limits = read_limits(None, default_limits(&source.model, first)?, std::slice::from_ref(source))?;
        starts.extend(limits.starts.into_iter().map(|(name, [low, _])| (name, low)));
    }
    Ok(starts)
}

/// Inputs of a recorded run, without its outputs.
fn experiment(record: &Record, starts: &BTreeMap<String, f64>) -> Experiment {
    Experiment {
        times: record.times.clone(),
        inputs: record.inputs.iter().map(|input| at_times(input, &record.times)).collect(),
        starts: starts.clone(),
    }
}

/// Values of an input at these times: linear in between, constant outside.
fn at_times(input: &Stream, times: &[f64]) -> Vec<f64> {
    let Some(values) = input.values.first() else { return vec![0.0; times.len()] };
    let value = |t: &f64| {
        let after = input.times.partition_point(|time| time < t);
        match (after.checked_sub(1), values.get(after)) {
            (_, None) => values.last().copied().unwrap_or(0.0),
            (None, Some(first)) => *first,
            (Some(before), Some(next)) => {
                let share = (t - input.times[before]) / (input.times[after] - input.times[before]);
                values[before] + share * (next - values[before])
            }
        }
    };
    times.iter().map(value).collect()
}
