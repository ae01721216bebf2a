//! Tests of the residuals of the named set: remaining library effects, tabulated effects, records that
//! differ, periodicity.

use super::memory::{MemoryTest, test_memory};
use crate::addition::Addition;
use crate::columns::{linearise, table_candidates};
use crate::periodicity;
use crate::random_effect_test::RandomEffectEstimate;
use crate::record::{ChosenRecords, Record};
use crate::score::Scored;
use crate::search::{
    ALPHA, InitialValues, MIN_INFORMATION, Penalty, Search, SearchResult, differences, p_values_given, select,
};
use crate::statistics::{chi2_tail, f_tail, median};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Maximum number of tabulated effects that a result contains.
const MAX_TABLES: usize = 3;
/// Number of tabulated effects, the best in the linear problem, that are refitted in each step.
const MAX_REFITTED_TABLES: usize = 2;

/// p-values of the tests of the residuals of the named set.
pub(crate) struct ResidualTests {
    /// p-value of the best library candidate that is not in the set, times the number of candidates.
    pub library: f64,
    /// p-value of the best tabulated effect; 1 without one.
    pub tables: f64,
    /// Whether the system has tabulated effects that can be tested.
    pub has_tables: bool,
    /// p-value of the differences between records in the most different parameter, times the number of
    /// parameters.
    pub records: f64,
    /// Number, among the searched records, of the record that differs most; `None` if no parameter was
    /// tested.
    pub outlying: Option<usize>,
    /// p-value of a period in the event offsets (deviations of the events' parameter); 1 without such
    /// offsets.
    pub periodicity: f64,
    /// Whether the residuals depend on the past.
    pub memory: MemoryTest,
}

impl ResidualTests {
    /// p-values before any test: nothing is significant.
    pub fn untested() -> Self {
        Self {
            library: 1.0,
            tables: 1.0,
            has_tables: false,
            records: 1.0,
            outlying: None,
            periodicity: 1.0,
            memory: MemoryTest::untested(),
        }
    }

    /// Whether every p-value is above 0.001, so that no test is significant.
    pub fn none_is_significant(&self) -> bool {
        let tests = [self.library, self.tables, self.records, self.periodicity, self.memory.p_value];
        tests.iter().all(|p| *p > ALPHA / 10.0)
    }
}

/// Tests the residuals of a set of effects. With a random effect per record, the records are compared at
/// their own values in `random_effect`; `with_table` is the p-value of a table that was found.
pub(crate) fn test_residuals(
    search: &Search<'_>,
    set: &Scored,
    random_effect: Option<&RandomEffectEstimate>,
    with_table: Option<f64>,
) -> ResidualTests {
    let sample = search.sample();
    let problem = linearise(&sample, &search.view.blocks, set, &search.library);
    let tested = p_values_given(&problem, &problem.fitted);
    let best = tested.iter().copied().fold(1.0, f64::min);
    let parts = match random_effect {
        Some(estimated) => estimated.parts.clone(),
        None => crate::search::parts(&sample, &set.fit),
    };
    let (records, outlying) = record_differences_test(search, set, &parts);
    let periodicity = match set.fit.hypothesis.scatter {
        Some(_) => periodicity::p_value(&sample, &set.fit),
        None => 1.0,
    };
    ResidualTests {
        library: (best * tested.len() as f64).min(1.0),
        tables: with_table.unwrap_or(1.0),
        has_tables: !search.system().schema().targets.is_empty(),
        records,
        outlying,
        periodicity,
        memory: test_memory(search, set),
    }
}

/// p-value of the differences between records, and the number of the record that differs most.
///
/// It is twice the smaller p-value of two tests. One compares the scatter of the estimates of single records with the noise;
/// model error common to all records, and autocorrelated residuals, are allowed for. The other compares the scatter between
/// recordings with that between the windows of each, which have initial states of their own.
fn record_differences_test(
    search: &Search<'_>,
    set: &Scored,
    parts: &[Vec<(usize, f64, f64)>],
) -> (f64, Option<usize>) {
    let sample = search.sample();
    let varied = differences(&sample, parts);
    let tested: Vec<(usize, f64, f64)> =
        varied.iter().enumerate().filter(|(_, v)| v.1 > 1.0).map(|(t, v)| (t, v.0, v.1)).collect();
    let level = dispersion(set);
    let p = |&(_, q, df): &(usize, f64, f64)| chi2_tail(q / level, df) * tested.len() as f64;
    let Some(worst) = tested.iter().min_by(|a, b| p(a).total_cmp(&p(b))) else { return (1.0, None) };
    let statistic = |range: std::ops::Range<usize>| {
        let of_worst = parts[range].iter().flatten().filter(|(t, ..)| *t == worst.0);
        let (s, u) = of_worst.fold((0.0, 0.0), |a, (_, s, u)| (a.0 + s, a.1 + u));
        if s > 0.0 { u * u / s } else { 0.0 }
    };
    let statistics: Vec<f64> = sample.windows_by_record().into_iter().map(statistic).collect();
    let outlying = (0..statistics.len()).max_by(|a, b| statistics[*a].total_cmp(&statistics[*b]));
    let p_between = p_between_recordings(&sample, parts) * tested.len() as f64;
    ((2.0 * p(worst).min(p_between)).min(1.0), outlying)
}

/// Smallest p-value over the parameters of an analysis of variance of their scores between recordings (Fisher 1925): the mean
/// square between recordings over that between the windows of a recording; 1 without recordings of several windows.
fn p_between_recordings(sample: &ChosenRecords<'_>, parts: &[Vec<(usize, f64, f64)>]) -> f64 {
    // For each parameter and recording: number of windows, curvature, gradient, and sum of their squared gradients over curvature.
    let mut sums: BTreeMap<usize, BTreeMap<&str, [f64; 4]>> = BTreeMap::new();
    for (window, entries) in sample.windows().iter().zip(parts) {
        for &(t, s, u) in entries.iter().filter(|entry| entry.1 > MIN_INFORMATION) {
            let of_recording = sums.entry(t).or_default().entry(&window.record.recording).or_default();
            of_recording.iter_mut().zip([1.0, s, u, u * u / s]).for_each(|(sum, x)| *sum += x);
        }
    }
    let p_value = |recordings: &BTreeMap<&str, [f64; 4]>| {
        let [windows, s, u, squares] =
            recordings.values().fold([0.0; 4], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]);
        let of_recordings: f64 = recordings.values().map(|[_, s, u, _]| u * u / s).sum();
        let count = recordings.len() as f64;
        let [between, within] = [count - 1.0, windows - count];
        let ratio = (of_recordings - u * u / s) / between / ((squares - of_recordings) / within);
        if between > 0.0 && within > 0.0 { f_tail(ratio, between, within) } else { 1.0 }
    };
    sums.values().map(p_value).fold(1.0, f64::min)
}

/// Dispersion factor of the squared gradients of records. It is the typical squared residual over the noise
/// variance (at least 1), divided by the independent share of the residuals.
fn dispersion(set: &Scored) -> f64 {
    let mut ratios: Vec<f64> =
        set.fit.residual_norms.iter().map(|[misfit, freedom]| misfit / freedom).collect();
    median(&mut ratios).max(1.0) / set.evidence.independence.min_share
}

/// Adds tabulated effects to the named set while their gain exceeds the penalty and is significant, and drops effects that are not significant beside
/// them. Returns the index of the extended set and the p-value of the first table; `None` where no table qualifies.
pub(crate) fn add_tables(
    search: &Search<'_>,
    found: &mut SearchResult,
    named: usize,
) -> Option<(usize, f64)> {
    let mut starts = vec![named];
    let set = found.sets[named].clone();
    let is_library_effect = |a: &&Addition| !matches!(a, Addition::Scatter(_)) && !a.is_formula();
    let library_effects: Vec<Addition> = set.additions().iter().filter(is_library_effect).cloned().collect();
    if library_effects.len() < set.additions().len() {
        // A random effect can absorb an unlisted effect, and several formulas can follow the curve of one
        // table, so tables are also tried without both.
        starts.push(found.index_or_fit(search, &set, &library_effects));
    }
    let mut best: Option<(usize, f64)> = None;
    for start in starts {
        let (mut current, mut first_p) = (start, None);
        for _ in 0..MAX_TABLES {
            let Some((next, p_value)) = add_table(search, found, current) else { break };
            first_p.get_or_insert(p_value);
            current = next;
        }
        let best_so_far = best.map_or(named, |(best, _)| best);
        if let Some(p_value) =
            first_p.filter(|_| found.margin(&found.sets[current], &found.sets[best_so_far]) > 0.0)
        {
            best = Some((current, p_value));
        }
    }
    // Beside a table an effect may no longer be needed: it fitted the curve of the table in part.
    let is_effect = |a: &Addition| !matches!(a, Addition::Table(_));
    best.map(|(set, p_value)| (found.drop_insignificant_among(search, set, &is_effect), p_value))
}

/// Adds the best tabulated effect to the set with index `from`, if its gain exceeds the penalty and is
/// significant over blocks. Returns the index of the new set and the p-value of the gain; `None` if no table
/// qualifies.
fn add_table(search: &Search<'_>, found: &mut SearchResult, from: usize) -> Option<(usize, f64)> {
    let set = found.sets[from].clone();
    let sample = search.sample();
    let tables = table_candidates(sample.data, &set.fit.events);
    if tables.is_empty() {
        return None;
    }
    let problem = linearise(&sample, &search.view.blocks, &set, &tables);
    let penalty = Penalty(((search.candidates + tables.len() as f64) / ALPHA).ln());
    let selected = select(&problem, penalty).into_iter();
    let adds_one = |c: &crate::search::LinearSet| {
        c.groups.len() == problem.fitted.len() + 1 && problem.fitted.iter().all(|g| c.groups.contains(g))
    };
    let trials: Vec<Addition> = selected
        .filter(adds_one)
        .take(MAX_REFITTED_TABLES)
        .filter_map(|c| {
            let new = c.groups.iter().find(|g| !problem.fitted.contains(g))?;
            Some(problem.groups[*new].addition.clone())
        })
        .collect();
    let fitted: Vec<Scored> = trials
        .par_iter()
        .map(|table| {
            let additions = [set.additions(), std::slice::from_ref(table)].concat();
            // The initial table is zero, because unidentifiable directions have no linear estimate.
            let starts: InitialValues = vec![(table.clone(), vec![0.0; table.size()])];
            search.refit(&set.fit, &additions, &starts)
        })
        .filter(Scored::is_finite)
        .collect();
    let gain = |s: &Scored| s.gain_over(&set, s.evidence.independence.share) - penalty.0;
    let best = fitted.into_iter().max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
    let p_value = best.evidence.p_value_of_gain(&set.evidence);
    if gain(&best) <= 0.0 || p_value > ALPHA / tables.len() as f64 {
        return None;
    }
    found.sets.push(best);
    Some((found.sets.len() - 1, p_value))
}

/// Name in the data of the recording that the searched record with this number is, or is a part of.
pub(crate) fn record_name<'s>(search: &Search<'s>, number: usize) -> Option<&'s str> {
    search.sample().chosen.get(number).map(|&j| {
        let record: &Record = &search.sample().data.records[j];
        &*record.recording
    })
}
