//! Remainder of the named set: laws of one quantity that the library does not have, and records that differ.

use crate::addition::Addition;
use crate::columns::{LinearProblem, laws};
use crate::grammar::is_formula;
use crate::periodicity;
use crate::record::Record;
use crate::scattered::Scattered;
use crate::score::Scored;
use crate::search::{ALPHA, Found, Price, Search, Starts, chances_beside, differences, select};
use crate::statistics::{chi2_tail, median};
use rayon::prelude::*;

/// Most laws of one quantity in an answer.
const MOST_LAWS: usize = 3;
/// Laws that are fitted of those that the linear problem puts first.
const FITTED: usize = 2;

/// Remainder beside the named set.
pub(crate) struct Remainder {
    /// Probability that chance alone shows as much of the best candidate of the library beside the set, times their number.
    pub library: f64,
    /// The same of the best law of one quantity.
    pub laws: f64,
    /// Whether there are laws of one quantity to be tested.
    pub has_laws: bool,
    /// Probability that equal records differ as much in a parameter, times the number of parameters.
    pub records: f64,
    /// The record that differs most, by its number among those searched.
    pub outlying: Option<usize>,
    /// Probability that a scatter without a period shows one as clear.
    pub periodicity: f64,
}

impl Remainder {
    /// Whether nothing is left that the tests can see.
    pub fn is_nothing(&self) -> bool {
        [self.library, self.laws, self.records, self.periodicity].iter().all(|p| *p > ALPHA / 10.0)
    }
}

/// Tests what a set leaves. Where parameters are drawn anew for each record, what is left at the `own` values of the records counts.
pub(crate) fn remainder(
    search: &Search<'_>,
    set: &Scored,
    own: Option<&Scattered>,
    with_table: Option<f64>,
) -> Remainder {
    let sample = search.sample();
    let problem = LinearProblem::new(&sample, &search.view.blocks, set, &search.library);
    let tested = chances_beside(&problem, &problem.fitted);
    let best = tested.iter().copied().fold(1.0, f64::min);
    let parts = match own {
        Some(own) => own.parts.clone(),
        None => crate::search::parts(&sample, &set.fit),
    };
    let (records, outlying) = differing(search, set, &parts);
    let periodicity = match set.fit.hypothesis.scatter {
        Some(_) => periodicity::p_value(&sample, &set.fit),
        None => 1.0,
    };
    Remainder {
        library: (best * tested.len() as f64).min(1.0),
        laws: with_table.unwrap_or(1.0),
        has_laws: !search.system().schema().targets.is_empty(),
        records,
        outlying,
        periodicity,
    }
}

/// Probability that equal records differ as much in their parameters, and the record that differs most. What all records leave beside the
/// noise, and how long residuals last, make estimates of single records vary as well.
fn differing(search: &Search<'_>, set: &Scored, parts: &[Vec<(usize, f64, f64)>]) -> (f64, Option<usize>) {
    let sample = search.sample();
    let varied = differences(&sample, parts);
    let tested: Vec<(usize, f64, f64)> =
        varied.iter().enumerate().filter(|(_, v)| v.1 > 1.0).map(|(t, v)| (t, v.0, v.1)).collect();
    let level = level(set);
    let p = |&(_, q, df): &(usize, f64, f64)| chi2_tail(q / level, df) * tested.len() as f64;
    let Some(worst) = tested.iter().min_by(|a, b| p(a).total_cmp(&p(b))) else { return (1.0, None) };
    let own = |range: std::ops::Range<usize>| {
        let mine = parts[range].iter().flatten().filter(|(t, ..)| *t == worst.0);
        let (s, u) = mine.fold((0.0, 0.0), |a, (_, s, u)| (a.0 + s, a.1 + u));
        if s > 0.0 { u * u / s } else { 0.0 }
    };
    let each: Vec<f64> = sample.of_records().into_iter().map(own).collect();
    let outlying = (0..each.len()).max_by(|a, b| each[*a].total_cmp(&each[*b]));
    (p(worst).min(1.0), outlying)
}

/// By how much squares of the gradients of records exceed those of independent noise of the known size: by what most windows leave beside
/// it, and by how long residuals last.
fn level(set: &Scored) -> f64 {
    let mut ratios: Vec<f64> = set.fit.misfits.iter().map(|[misfit, freedom]| misfit / freedom).collect();
    median(&mut ratios).max(1.0) / set.evidence.memory.least_independent
}

/// The named set with laws of one quantity beside it, while they pay, predict left-out blocks better by more than chance, and are not
/// explained by the library; the probability of the first by chance. Nothing where none does.
pub(crate) fn tabulated(search: &Search<'_>, found: &mut Found, named: usize) -> Option<(usize, f64)> {
    let mut starts = vec![named];
    let set = found.tried[named].clone();
    let is_lawful = |a: &&Addition| !matches!(a, Addition::Scatter(_)) && !is_formula(a);
    let lawful: Vec<Addition> = set.additions().iter().filter(is_lawful).cloned().collect();
    if lawful.len() < set.additions().len() {
        // A scatter takes in what a law shows that nobody described, and several formulas follow what one table does: the law is looked for
        // without them as well.
        starts.push(found.fitted(search, &set, &lawful));
    }
    let mut best: Option<(usize, f64)> = None;
    for start in starts {
        let (mut now, mut first) = (start, None);
        for _ in 0..MOST_LAWS {
            let Some((next, chance)) = one_more(search, found, now) else { break };
            first.get_or_insert(chance);
            now = next;
        }
        let ahead = best.map_or(named, |(best, _)| best);
        if let Some(chance) = first.filter(|_| found.margin(&found.tried[now], &found.tried[ahead]) > 0.0) {
            best = Some((now, chance));
        }
    }
    best
}

fn one_more(search: &Search<'_>, found: &mut Found, from: usize) -> Option<(usize, f64)> {
    let set = found.tried[from].clone();
    let sample = search.sample();
    let tables = laws(sample.data, &set.fit.events);
    if tables.is_empty() {
        return None;
    }
    let problem = LinearProblem::new(&sample, &search.view.blocks, &set, &tables);
    let price = Price(((search.candidates + tables.len() as f64) / ALPHA).ln());
    let all = select(&problem, price).into_iter();
    let adds = |c: &crate::search::Chosen| {
        c.groups.len() == problem.fitted.len() + 1 && problem.fitted.iter().all(|g| c.groups.contains(g))
    };
    let trials: Vec<Addition> = all
        .filter(adds)
        .take(FITTED)
        .filter_map(|c| {
            let new = c.groups.iter().find(|g| !problem.fitted.contains(g))?;
            Some(problem.groups[*new].addition.clone())
        })
        .collect();
    let fitted: Vec<Scored> = trials
        .par_iter()
        .map(|table| {
            let additions = [set.additions(), std::slice::from_ref(table)].concat();
            // Directions that the data do not see have no estimate: start flat.
            let starts: Starts = vec![(table.clone(), vec![0.0; table.size()])];
            search.refit(&set.fit, &additions, &starts)
        })
        .filter(Scored::is_finite)
        .collect();
    let gain = |s: &Scored| s.gain_over(&set, s.evidence.memory.independent) - price.0;
    let best = fitted.into_iter().max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
    let chance = best.evidence.chance_of_gain(&set.evidence);
    if gain(&best) <= 0.0 || chance > ALPHA / tables.len() as f64 {
        return None;
    }
    found.tried.push(best);
    Some((found.tried.len() - 1, chance))
}

/// Name of a record among those searched.
pub(crate) fn record_name<'s>(search: &Search<'s>, number: usize) -> Option<&'s str> {
    search.sample().chosen.get(number).map(|&j| {
        let record: &Record = &search.sample().data.records[j];
        record.seen.id.as_str()
    })
}
