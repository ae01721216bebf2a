//! Which effects and laws the data allow to look for.

use crate::addition::Addition;
use crate::hypothesis::Hypothesis;
use crate::record::Measured;
use augsim_physics::model::Per;
use augsim_physics::system::Event;

/// Most groups for which an effect is offered with one value a group: beyond, that is a description, not a law.
const MOST_GROUPS: usize = 20;

/// Source that candidates are taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// Effects that somebody described.
    Described,
    /// Formulas of a grammar.
    Grammar,
}

/// Effects of a family that these data can speak about; with several groups each in two variants, and values by group of
/// declared parameters. Scatter is tried by another
/// rule.
pub(crate) fn library(data: &Measured, family: Family) -> Vec<Addition> {
    let (system, records) = (&*data.system, data.seen());
    let grouped = (2..=MOST_GROUPS).contains(&data.groups.len()) && data.groups.len() < data.records.len();
    let mut out = Vec::new();
    let wanted = |i: &usize| system.library()[*i].grammar.is_some() == (family == Family::Grammar);
    let list = (0..system.library().len()).filter(wanted);
    for index in list.filter(|&i| system.possible(i, &records)) {
        out.extend(Addition::effect(system, index, Per::All));
        if grouped && system.by_group(index) {
            out.extend(Addition::effect(system, index, Per::Group));
        }
    }
    if grouped {
        let declared = system.parameters().iter().take(system.declared()).enumerate();
        let single = declared.filter(|(_, p)| !p.frozen && p.per == Per::All);
        out.extend(single.map(|(index, _)| Addition::split(system, index, data.groups.len())));
    }
    out
}

/// Whether an addition may join a hypothesis.
pub(crate) fn may_join(addition: &Addition, h: &Hypothesis) -> bool {
    if h.additions.iter().any(|a| a == addition || a.excludes(addition)) {
        return false;
    }
    if matches!(addition, Addition::Scatter(_)) && h.scatter.is_some() {
        return false;
    }
    let joins = addition.listed().is_some_and(|effect| effect.joins.is_some());
    !joins || h.additions.iter().any(|a| addition.acts_through(a))
}

/// One-feature laws over the features that vary in these data; `events` are those of the simulated training records.
pub(crate) fn laws(data: &Measured, events: &[Vec<Event>]) -> Vec<Addition> {
    let tables = data.system.tables(&data.seen(), events);
    tables.into_iter().filter_map(|table| Addition::table(&*data.system, table)).collect()
}
