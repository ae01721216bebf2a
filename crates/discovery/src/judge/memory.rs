//! Test whether residuals depend on the past: on more than the present values of states and inputs.
//!
//! Laws of present values are the effects of the library without states of their own and without delays, the
//! formulas, and the tables. Effects with states filter the states and inputs with time constants on a grid,
//! and delays shift the inputs. The residuals depend on the past if such an effect is significant beside the
//! best set of laws of present values.

use crate::addition::Addition;
use crate::columns::{Family, library_candidates, linearise, table_candidates};
use crate::linear_problem::LinearProblem;
use crate::score::Scored;
use crate::search::{ALPHA, Search, SearchResult, p_values_beside, select_among};

/// Whether residuals depend on the past.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MemoryTest {
    /// p-value of the most significant effect with memory beside the best laws of present values, times the number
    /// of such effects.
    pub p_value: f64,
    /// The addition that is most significant; `None` if none can be tested.
    pub best: Option<Addition>,
}

impl MemoryTest {
    /// A test that was not done, which finds nothing.
    pub fn untested() -> Self {
        Self { p_value: 1.0, best: None }
    }

    /// Whether the test is significant, at the level of all tests of residuals.
    pub fn is_significant(&self) -> bool {
        self.p_value <= ALPHA / 10.0
    }
}

/// Tests whether the residuals of a set of effects depend on the past.
pub(crate) fn test_memory(search: &Search<'_>, set: &Scored) -> MemoryTest {
    if !search.families.contains(&Family::Library) {
        return MemoryTest::untested();
    }
    let sample = search.sample();
    let memory = library_candidates(sample.data, &search.view.blocks, Family::Memory);
    if memory.is_empty() {
        return MemoryTest::untested();
    }
    let tables = table_candidates(sample.data, &set.fit.events);
    let others = search.library.iter().filter(|a| !memory.contains(a)).cloned();
    let candidates: Vec<Addition> = others.chain(memory.clone()).chain(tables).collect();
    let problem = linearise(&sample, &search.view.blocks, set, &candidates);
    let is_static = |g: usize| problem.fitted.contains(&g) || !problem.groups[g].addition.depends_on_past();
    let statics = select_among(&problem, search.penalty(), &is_static);
    let beside = statics.first().map_or_else(|| problem.fitted.clone(), |best| best.groups.clone());
    most_significant(&problem, &beside).0
}

/// The most significant addition with memory beside the groups `beside` of a linear problem, and the index of its group.
fn most_significant(problem: &LinearProblem, beside: &[usize]) -> (MemoryTest, Option<usize>) {
    let tested: Vec<(usize, f64)> =
        p_values_beside(problem, beside, &|g| problem.groups[g].addition.depends_on_past());
    let least = tested.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let group = least.map(|(g, _)| *g);
    let test = MemoryTest {
        p_value: least.map_or(1.0, |(_, p)| (p * tested.len() as f64).min(1.0)),
        best: group.map(|g| problem.groups[g].addition.clone()),
    };
    (test, group)
}

/// Number of the addition of a set that only stands in for a dependence on the past; `None` if there is none.
///
/// It is a law of present values that is not significant beside the most significant effect with memory, while
/// that one is significant beside it.
pub(crate) fn stand_in(search: &Search<'_>, found: &SearchResult, named: usize) -> Option<usize> {
    let set = &found.sets[named];
    let is_law = |a: &Addition| a.listed().is_some() && !a.depends_on_past();
    if !set.additions().iter().any(is_law) || !search.library.iter().any(Addition::depends_on_past) {
        return None;
    }
    let problem = linearise(&search.sample(), &search.view.blocks, set, &search.library);
    let (test, memory) = most_significant(&problem, &problem.fitted);
    let memory = memory.filter(|_| test.is_significant())?;
    let with_memory = [&problem.fitted[..], &[memory]].concat();
    let p_values = crate::search::p_values_of(&problem, &with_memory);
    let excess = |(k, g): (usize, &usize)| {
        let addition = &problem.groups[*g].addition;
        is_law(addition).then(|| (addition, p_values[k] / search.level(addition)))
    };
    let worst = problem.fitted.iter().enumerate().filter_map(excess).max_by(|a, b| a.1.total_cmp(&b.1));
    let (addition, _) = worst.filter(|(_, excess)| *excess > 1.0)?;
    set.additions().iter().position(|a| a == addition)
}

/// Fits the best set of a search with each of its effects with memory replaced by every other one.
///
/// A lag of the sensor and one of the input, for example, often fit equally well, and the linear problem ranks only one of
/// them first. The result lists those that data do not distinguish.
pub(crate) fn exchange_memory(search: &Search<'_>, found: &mut SearchResult) {
    let best = found.best().clone();
    let others: Vec<Addition> = search.library.iter().filter(|a| a.depends_on_past()).cloned().collect();
    for (number, _) in best.additions().iter().enumerate().filter(|(_, a)| a.depends_on_past()) {
        let remaining = crate::search::without(best.additions(), number);
        found.fit_exchanges(search, &best, &remaining, &others);
    }
}
