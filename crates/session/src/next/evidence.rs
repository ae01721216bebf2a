//! Evidence of a plan: the explanations after the earlier recordings, and after the runs that were heard.

use super::explanation::{Tuning, compile};
use super::source::Source;
use super::state::{Explained, State};
use augsim_design::{Evidence, Explanation};
use augsim_system::Record;

/// Maximum number of samples of the earlier recordings that take part in tests of the explanations.
///
/// It bounds the time of a judgement, which simulates them several times. A test stays valid with fewer: the choice
/// depends on the number of recordings and samples alone.
const MAX_EARLIER_SAMPLES: usize = 20_000;

/// Recordings for tests of the explanations: all of them, or else evenly chosen ones, and of these the first samples.
pub(super) fn tested_records(records: &[Record]) -> Vec<Record> {
    let samples: usize = records.iter().map(|r| r.times.len()).sum();
    let step = samples.div_ceil(MAX_EARLIER_SAMPLES).min(records.len() / 2).max(1);
    let mut chosen: Vec<Record> = records.iter().step_by(step).cloned().collect();
    let most = MAX_EARLIER_SAMPLES / chosen.len().max(1);
    if samples > MAX_EARLIER_SAMPLES {
        for record in &mut chosen {
            record.times.truncate(most);
            record.values.iter_mut().for_each(|column| column.truncate(most));
        }
    }
    chosen
}

/// Evidence of the runs that a plan has heard, for each explanation; integration steps are chosen on `tuning`.
///
/// # Errors
/// An explanation cannot be compiled, or not be simulated over a recording.
pub(super) fn evidence_of(state: &State, tuning: &Tuning) -> anyhow::Result<Vec<Evidence>> {
    let [earlier, heard] = [state.earlier_records(), state.heard_records()];
    let evidence = |source: Source| -> anyhow::Result<Evidence> {
        let (explanation, _) = compile(&source, tuning)?;
        let mut evidence = Evidence::after(&explanation, &earlier)?;
        evidence.add_all(&heard)?;
        Ok(evidence)
    };
    state.planned_sources()?.into_iter().map(evidence).collect()
}

/// The explanations that a plan has not rejected, with their weights and evidence after the runs that were heard.
///
/// # Errors
/// As [`evidence_of`].
pub(super) fn live_evidence(
    state: &State,
    tuning: &Tuning,
) -> anyhow::Result<(Vec<Explanation>, Vec<Evidence>)> {
    let live = |(evidence, explained): (Evidence, &Explained)| {
        let log_weight = explained.log_weight + explained.log_density / state.dispersion;
        (!explained.rejected).then(|| (Explanation { log_weight, ..evidence.updated() }, evidence))
    };
    Ok(evidence_of(state, tuning)?.into_iter().zip(&state.explanations).filter_map(live).unzip())
}
