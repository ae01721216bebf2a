//! Battery of `augsim next` and `augsim listen` on simulated pairs of explanations.
//!
//! For each pair and replicate a truth with its own parameters makes twelve first recordings under small inputs, to which both
//! explanations are fitted. Runs are then designed within the limits, and sequences of them are simulated by the truth and
//! judged after every run, beside sequences of random inputs within the same limits. Printed are the mean number of runs to
//! the verdict, the share of sequences that reach the promised odds, and false verdicts, also of sequences that go on
//! for `MAX_RUNS` runs.
//!
//! ```sh
//! cargo run --release -p augsim-tests --bin next_battery -- --seed 1
//! ```

use anyhow::Result;
use augsim_data::random_stream;
use augsim_design::{
    Evidence, Experiment, Explanation, InputLimits, Limits, PosteriorSample, Request, Run, Tally, Verdict,
    design, draw_recording, judge, promise, random_run,
};
use augsim_session::equations::fit::fit;
use augsim_session::next::{Source, evidence};
use augsim_system::Record;
use augsim_tests::next_battery::pairs::{PAIRS, Pair};
use clap::Parser;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::io::Write;

/// Duration of a run, s, and time between samples, s.
const DURATION_S: f64 = 4.0;
const STEP_S: f64 = 0.04;
/// Expected log odds, nats, that the noise leaves to the first designed run.
const LOG_ODDS_OF_RUN: f64 = 8.0;
/// Maximum number of runs of a sequence.
const MAX_RUNS: usize = 30;
/// Budget of the promise.
const BUDGET: usize = 5;
/// Maximum number of new plans after the first one in a sequence; later runs repeat the plan.
const NEW_PLANS: usize = 2;
/// Factors of the inputs of the first recordings.
const FACTORS: [f64; 12] = [0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 0.75, 0.95, 1.05, 1.25];
/// Relative standard deviation of the true parameters about those of the pair.
const SPREAD: f64 = 0.1;

#[derive(Parser)]
struct Options {
    /// Seed of all random draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Truths of each pair, half of each explanation.
    #[arg(long, default_value_t = 6)]
    replicates: u64,
    /// Simulated sequences of each truth.
    #[arg(long, default_value_t = 14)]
    sequences: u64,
    /// Only pairs whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// The explanations estimate the starts of runs from the first samples; only pairs of a mass alone.
    #[arg(long)]
    estimated_starts: bool,
    /// Print the promised and the reached log odds of each truth to standard error.
    #[arg(long)]
    details: bool,
}

/// Results of one replicate.
#[derive(Default, Clone, Debug)]
struct Counts {
    sequences: usize,
    designed_runs: usize,
    random_runs: usize,
    unfinished: [usize; 2],
    false_verdicts: [usize; 2],
    promised: usize,
    kept: usize,
    none_fits: usize,
    failed: usize,
    /// Log odds for the truth, nats: expected and reached by the first designed run, reached by the first random run.
    first_run: [f64; 3],
    promised_runs: Vec<usize>,
    /// Promised and reached log odds of each truth, as text.
    details: Vec<String>,
}

fn main() -> Result<()> {
    let options = Options::parse();
    let mut out = std::io::stdout();
    writeln!(
        out,
        "| pair | runs, design | runs, random | ratio | promised runs | promise kept | false, design | false, random | unfinished | none fits | failed | log odds of the first run: expected, designed, random, nats |"
    )?;
    writeln!(out, "|---|---|---|---|---|---|---|---|---|---|---|---|")?;
    let mut total = Counts::default();
    let is_chosen = |pair: &Pair| {
        pair.name.contains(&options.only) && (!options.estimated_starts || pair.is_of_a_mass_alone())
    };
    for (index, pair) in PAIRS.iter().enumerate().filter(|(_, pair)| is_chosen(pair)) {
        let run = |replicate: u64| {
            let seed = options.seed + 1000 * index as u64;
            let case = Case { pair, estimates_starts: options.estimated_starts, seed, replicate };
            replicate_of(&case, options.sequences)
        };
        let all: Vec<Result<Counts>> = (0..options.replicates).into_par_iter().map(run).collect();
        let mut sum = Counts::default();
        for counts in all {
            match counts {
                Ok(counts) => {
                    for details in counts.details.iter().filter(|_| options.details) {
                        writeln!(std::io::stderr(), "{}: {details}", pair.name)?;
                    }
                    add(&mut sum, &counts);
                }
                Err(error) => {
                    writeln!(std::io::stderr(), "{}: {error:#}", pair.name)?;
                    sum.failed += 1;
                }
            }
        }
        add(&mut total, &sum);
        print_row(&mut out, pair.name, &sum)?;
    }
    print_row(&mut out, "all", &total)
}

fn add(sum: &mut Counts, other: &Counts) {
    sum.sequences += other.sequences;
    sum.designed_runs += other.designed_runs;
    sum.random_runs += other.random_runs;
    for k in 0..2 {
        sum.unfinished[k] += other.unfinished[k];
        sum.false_verdicts[k] += other.false_verdicts[k];
    }
    sum.promised += other.promised;
    sum.kept += other.kept;
    sum.none_fits += other.none_fits;
    sum.failed += other.failed;
    for k in 0..3 {
        sum.first_run[k] += other.first_run[k];
    }
    sum.promised_runs.extend(&other.promised_runs);
}

fn print_row(out: &mut impl Write, name: &str, c: &Counts) -> Result<()> {
    let n = c.sequences.max(1) as f64;
    let mut promised = c.promised_runs.clone();
    promised.sort_unstable();
    writeln!(
        out,
        "| {name} | {:.2} | {:.2} | {:.2} | {promised:?} | {} of {} ({:.1} %) | {} | {} | {:?} | {} | {} | {:.1?} |",
        c.designed_runs as f64 / n,
        c.random_runs as f64 / n,
        c.designed_runs as f64 / c.random_runs.max(1) as f64,
        c.kept,
        c.promised,
        100.0 * c.kept as f64 / c.promised.max(1) as f64,
        c.false_verdicts[0],
        c.false_verdicts[1],
        c.unfinished,
        c.none_fits,
        c.failed,
        c.first_run.map(|sum| sum / n)
    )?;
    out.flush()?;
    Ok(())
}

fn limits(pair: &Pair) -> Limits {
    let input = |i: &augsim_tests::next_battery::pairs::Input| InputLimits {
        name: i.name.to_owned(),
        range: i.range,
        rate_per_s: None,
        energy: None,
    };
    Limits {
        inputs: pair.inputs.iter().map(input).collect(),
        ranges: BTreeMap::from([(pair.output.0.to_owned(), pair.output.1)]),
        starts: BTreeMap::new(),
        duration_s: DURATION_S,
        step_s: STEP_S,
    }
}

/// Explanations with small given uncertainty of all parameters, for the truth.
fn truth_of(pair: &Pair, which: usize, sd: f64, values: &[f64]) -> Result<Explanation> {
    let mut model = augsim_equations::model::parse(&pair.text(which, sd, values), "truth.toml")?;
    for p in model.parameters.iter_mut().filter(|p| !p.frozen) {
        p.ci95 = Some([0.99 * p.nominal, 1.01 * p.nominal]);
    }
    let source = Source::new("truth", model);
    let blank = Record { values: vec![vec![f64::NAN; 101]], ..first_experiment(pair, 1.0).record("blank") };
    let mut truth = evidence(&[source], &[], &[blank])?.swap_remove(0).explanation().clone();
    // The recording has no readings, so the values are those of the prior; the truth has its own.
    truth.values = truth.system.parameters().iter().map(|p| p.nominal).collect();
    Ok(truth)
}

/// A first experiment: small inputs that hardly change.
fn first_experiment(pair: &Pair, factor: f64) -> Experiment {
    let times = limits(pair).times();
    let input = |i: &augsim_tests::next_battery::pairs::Input| {
        let value = |t: &f64| i.first * if *t < 0.5 * DURATION_S { factor } else { 0.8 * factor };
        times.iter().map(value).collect()
    };
    let inputs = pair.inputs.iter().map(input).collect();
    Experiment { inputs, starts: BTreeMap::new(), times }
}

/// A truth of a pair.
#[derive(Clone, Copy)]
struct Case<'a> {
    pair: &'a Pair,
    estimates_starts: bool,
    seed: u64,
    replicate: u64,
}

impl Case<'_> {
    /// Model file of explanation `which` before its fit, with measurement noise `sd`.
    fn explanation(&self, which: usize, sd: f64) -> String {
        let nominal: Vec<f64> = self.pair.models[which].parameters.iter().map(|(_, value)| *value).collect();
        let text = self.pair.text(which, sd, &nominal);
        if self.estimates_starts { self.pair.with_estimated_starts(&text) } else { text }
    }
}

/// The fitted explanations of a pair after the first recordings of a truth.
struct Fitted {
    truth: Explanation,
    which: usize,
    explanations: Vec<Explanation>,
    live: Vec<Evidence>,
    samples: Vec<PosteriorSample>,
}

fn fitted(case: &Case<'_>, sd: f64) -> Result<Fitted> {
    let Case { pair, seed, replicate, .. } = *case;
    let which = (replicate % 2) as usize;
    let mut rng = random_stream(seed, "truth", replicate);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let draw = |(_, value): &(&str, f64)| value * (SPREAD * normal()).exp();
    let values: Vec<f64> = pair.models[which].parameters.iter().map(draw).collect();
    let truth = truth_of(pair, which, sd, &values)?;
    let mut rng = random_stream(seed, "first recordings", replicate);
    let records: Vec<Record> = FACTORS
        .iter()
        .map(|factor| {
            draw_recording(&truth, &truth.values, &first_experiment(pair, *factor), "first", &mut rng)
        })
        .collect::<Result<_, _>>()?;
    let source = |k: usize| -> Result<Source> {
        let model = augsim_equations::model::parse(&case.explanation(k, sd), "model.toml")?;
        let model = fit(&model, &records, None)?.model;
        Ok(Source::new(["first", "second"][k], model))
    };
    let live = evidence(&[source(0)?, source(1)?], &records, &records)?;
    let explanations = live.iter().map(|e| e.explanation().clone()).collect();
    let samples = samples(&live, seed + replicate)?;
    Ok(Fitted { truth, which, explanations, live, samples })
}

/// Possible true parameters of each explanation, as `augsim next` draws them.
fn samples(evidence: &[Evidence], seed: u64) -> Result<Vec<PosteriorSample>> {
    let sample = |(k, evidence): (u64, &Evidence)| Ok(PosteriorSample::new(evidence, seed, k)?);
    (0..).zip(evidence).map(sample).collect()
}

fn request<'a>(fitted: &'a Fitted, limits: &'a Limits, seed: u64) -> Request<'a> {
    let Fitted { explanations, live: evidence, samples, .. } = fitted;
    Request { explanations, evidence, samples, limits, budget: BUDGET, odds: 1000.0, seed }
}

fn replicate_of(case: &Case<'_>, sequences: u64) -> Result<Counts> {
    let Case { pair, seed, replicate, .. } = *case;
    let limits = limits(pair);
    let mut sd = 0.01 * (pair.output.1[1] - pair.output.1[0]);
    let rough = fitted(case, sd)?;
    let first = design(&Request { budget: 1, ..request(&rough, &limits, seed) })?;
    let odds = 0.5 * (first[0].log_odds[0][1] + first[0].log_odds[1][0]);
    sd *= (odds / LOG_ODDS_OF_RUN).sqrt();
    let fitted = fitted(case, sd)?;
    let request = request(&fitted, &limits, seed + replicate);
    let Fitted { truth, which, live, .. } = &fitted;
    let which = *which;
    let runs = design(&request)?;
    let experiments: Vec<&Experiment> = runs.iter().map(|r: &Run| &r.experiment).collect();
    let promised = promise(live, &fitted.samples, &experiments, BUDGET, 1000.0, 100, seed + replicate);
    let promised_odds = promised.truths[which].log_odds[promised.runs - 1];
    let mut counts = Counts { promised_runs: vec![promised.runs], ..Counts::default() };
    let mut all_reached = Vec::new();
    let random: Vec<Experiment> =
        (0..MAX_RUNS as u64).map(|k| Ok(random_run(&request, k)?.experiment)).collect::<Result<_>>()?;
    for s in 0..sequences {
        let mut rng = random_stream(seed, "sequence", (replicate << 32) + s);
        // After the plan, a new one is made from what is known then, as `augsim next` on the folder of `listen`.
        let mut plan: Vec<Experiment> =
            (0..promised.runs).map(|k| experiments[k % experiments.len()].clone()).collect();
        let mut new_plans = 0;
        let mut next = |k: usize, evidence: &[Evidence]| {
            if k >= plan.len() && new_plans < NEW_PLANS {
                new_plans += 1;
                let current: Vec<Explanation> = evidence.iter().map(Evidence::updated).collect();
                let samples = samples(evidence, seed + replicate)?;
                let again = Request {
                    explanations: &current,
                    evidence,
                    samples: &samples,
                    budget: 2,
                    ..request.clone()
                };
                plan.extend(design(&again)?.into_iter().map(|run| run.experiment));
            }
            Ok(plan[k % plan.len()].clone())
        };
        let path = sequence(truth, live, &mut next, promised.runs, &mut rng)?;
        let mut next = |k: usize, _: &[Evidence]| Ok(random[(k + 7 * s as usize) % random.len()].clone());
        let by_chance = sequence(truth, live, &mut next, 1, &mut rng)?;
        counts.sequences += 1;
        for (arm, path) in [&path, &by_chance].into_iter().enumerate() {
            counts.false_verdicts[arm] += usize::from(path.verdict.is_some_and(|v| v != which));
            counts.unfinished[arm] += usize::from(path.verdict.is_none());
            counts.none_fits += usize::from(path.has_none_fitting);
        }
        counts.designed_runs += path.runs;
        counts.random_runs += by_chance.runs;
        let reached =
            path.log_odds[which].iter().take(promised.runs).copied().fold(f64::NEG_INFINITY, f64::max);
        let expected = runs[0].log_odds[which][1 - which];
        let reached_first = [expected, path.log_odds[which][0], by_chance.log_odds[which][0]];
        counts.first_run.iter_mut().zip(reached_first).for_each(|(sum, odds)| *sum += odds);
        counts.promised += 1;
        counts.kept += usize::from(reached >= promised_odds);
        all_reached.push(reached);
    }
    all_reached.sort_by(f64::total_cmp);
    let quantile = |share: f64| all_reached[(share * (all_reached.len() - 1) as f64).round() as usize];
    counts.details.push(format!(
        "truth {which} {:.3?}, fitted {:.3?}, effective draws {:.0?}; {} runs promise {promised_odds:.1} nats, reached {:.1?} (10, 50, 90 %)",
        truth.values,
        fitted.explanations[which].values,
        fitted.samples.iter().map(PosteriorSample::effective_number).collect::<Vec<_>>(),
        promised.runs,
        [0.1, 0.5, 0.9].map(quantile)
    ));
    Ok(counts)
}

/// A sequence of runs, judged after each.
struct Path {
    /// Number of runs to the verdict, or all.
    runs: usize,
    verdict: Option<usize>,
    has_none_fitting: bool,
    /// Log odds for each explanation after each run, `[explanation][run]`.
    log_odds: [Vec<f64>; 2],
}

fn sequence(
    truth: &Explanation,
    live: &[Evidence],
    next: &mut dyn FnMut(usize, &[Evidence]) -> Result<Experiment>,
    at_least: usize,
    rng: &mut impl rand::Rng,
) -> Result<Path> {
    let mut evidence = live.to_vec();
    let mut path =
        Path { runs: MAX_RUNS, verdict: None, has_none_fitting: false, log_odds: [Vec::new(), Vec::new()] };
    let mut rejected = vec![false; live.len()];
    for k in 0..MAX_RUNS {
        let experiment = next(k, &evidence)?;
        let record = draw_recording(truth, &truth.values, &experiment, "new", rng)?;
        for one in &mut evidence {
            one.add(&record)?;
        }
        let tallies: Vec<Tally> = evidence.iter().map(Evidence::tally).collect();
        let judgement = judge(&tallies, &rejected, 1000.0);
        path.log_odds[0].push(judgement.log_e_values[1]);
        path.log_odds[1].push(judgement.log_e_values[0]);
        for (k, is_rejected) in rejected.iter_mut().enumerate() {
            *is_rejected = !judgement.left.contains(&k);
        }
        match judgement.verdict {
            Verdict::Enough(one) => {
                if path.verdict.is_none() {
                    (path.runs, path.verdict) = (k + 1, Some(one));
                }
            }
            Verdict::NoneFits => {
                path.has_none_fitting = true;
                break;
            }
            Verdict::More => {}
        }
        // The promise is about a number of runs that may be larger than that to the verdict.
        if path.verdict.is_some() && k + 1 >= at_least {
            break;
        }
    }
    Ok(path)
}
