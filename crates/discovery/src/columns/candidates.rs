//! Candidate effects that the data can support.

use crate::addition::Addition;
use crate::hypothesis::Hypothesis;
use crate::record::Measured;
use crate::score::{Blocks, are_comparable};
use augsim_system::{Event, Per};

/// Name of the time in formulas.
const TIME: &str = "t";

/// Source of the candidate effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// Effects that the library lists and that depend on present values of states and inputs, and all that the model file
    /// offers.
    Library,
    /// Effects that the library lists and that depend on the past: they have states of their own, or are delays.
    Memory,
    /// Formulas of the library's grammar.
    Grammar,
}

/// Candidates of a family that the data can support. Each effect is tried, with several groups also with one
/// value per group, and, unless the user allows named effects only, groupwise values of declared parameters.
/// Random effects are added by the search itself.
///
/// `blocks` are the blocks of the data: whole recordings predict a group only from other recordings of it.
pub(crate) fn library_candidates(data: &Measured, blocks: &Blocks, family: Family) -> Vec<Addition> {
    let (system, records) = (&*data.system, data.system_records());
    let has_other_data = blocks.are_adjacent || data.groups.len() < data.records.len();
    let grouped = are_comparable(data.groups.len()) && has_other_data;
    let mut out = Vec::new();
    let is_of_family = |i: &usize| {
        let effect = &system.library()[*i];
        family
            == match (effect.formula_domain.is_some(), effect.depends_on_past && !effect.is_offered) {
                (true, _) => Family::Grammar,
                (false, true) => Family::Memory,
                (false, false) => Family::Library,
            }
    };
    // An effect that acts through a carrier is tried together with it, so the carrier has to be allowed too.
    let is_allowed = |i: &usize| {
        let effect = &system.library()[*i];
        let carrier = effect.joins.as_ref().map(|join| join.kind.as_str());
        [Some(effect.kind.as_str()), carrier].into_iter().flatten().all(|kind| data.effects.allows(kind))
    };
    // In a single recording a law of time cannot be distinguished from the course of a hidden state.
    let is_testable = |i: &usize| {
        let domain = system.library()[*i].formula_domain.as_ref();
        data.recordings.len() > 1 || domain.is_none_or(|domain| domain.variable.name != TIME)
    };
    let indices = (0..system.library().len()).filter(is_of_family).filter(is_allowed).filter(is_testable);
    for index in indices.filter(|&i| system.can_search_effect(i, &records)) {
        out.extend(Addition::effect(system, index, Per::All));
        if grouped && system.can_vary_by_group(index) {
            out.extend(Addition::effect(system, index, Per::Group));
        }
    }
    if grouped && !data.effects.is_closed() && family != Family::Memory {
        let declared = system.parameters().iter().take(system.declared_count()).enumerate();
        let single = declared.filter(|(_, p)| !p.frozen && !p.is_knot && p.per == Per::All);
        out.extend(single.map(|(index, _)| Addition::split(system, index)));
    }
    out
}

/// Whether `addition` can be added to the hypothesis `h`.
pub(crate) fn can_join(addition: &Addition, h: &Hypothesis) -> bool {
    if h.additions.iter().any(|a| a == addition || a.excludes(addition)) {
        return false;
    }
    if matches!(addition, Addition::Scatter(_)) && h.scatter.is_some() {
        return false;
    }
    let joins = addition.listed().is_some_and(|effect| effect.joins.is_some());
    !joins || h.additions.iter().any(|a| addition.acts_through(a))
}

/// Candidate tabulated functions of one feature, for features that vary in these data. `events` are the
/// simulated events of the searched records.
pub(crate) fn table_candidates(data: &Measured, events: &[Vec<Event>]) -> Vec<Addition> {
    let tables = data.system.candidate_tables(&data.system_records(), events);
    tables.into_iter().filter_map(|table| Addition::table(&*data.system, table)).collect()
}
