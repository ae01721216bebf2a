//! Takes in new recordings: evidence, weights, verdict, and the promise compared with what came.

use super::evidence::evidence_of;
use super::explanation::write_back;
use super::state::{HeardRun, Recording, State};
use super::text::listen_sentence;
use augsim_design::{Evidence, Judgement, Tally, Verdict, judge};
use augsim_system::Record;
use std::collections::BTreeMap;

/// New recordings for a plan.
#[derive(Debug)]
pub struct ListenRequest<'a> {
    /// The plan, with the runs that were heard before.
    pub state: &'a State,
    /// The new recordings, in the order in which they were made.
    pub records: &'a [Record],
}

/// Updates the weights by new recordings, one after the other.
///
/// The runs that were heard before are judged again together with the new ones.
///
/// # Errors
/// An explanation cannot be simulated over a recording.
pub fn listen(request: &ListenRequest<'_>) -> anyhow::Result<State> {
    let mut state = request.state.clone();
    let [earlier, heard] = [state.earlier_records(), state.heard_records()];
    let all: Vec<Record> = [&earlier[..], &heard, request.records].concat();
    let records = all[earlier.len()..].to_vec();
    state.heard.clear();
    let mut evidence = evidence_of(&state, &(all, BTreeMap::new()))?;
    for record in &records {
        let before: Vec<f64> = evidence.iter().map(Evidence::log_density).collect();
        for one in &mut evidence {
            one.add(record)?;
        }
        let tallies: Vec<Tally> = evidence.iter().map(Evidence::tally).collect();
        let rejected: Vec<bool> = state.explanations.iter().map(|e| e.rejected).collect();
        let judgement = judge(&tallies, &rejected, state.odds);
        state.heard.push(HeardRun {
            recording: Recording::of(record),
            log_density: tallies.iter().zip(before).map(|(t, before)| t.log_density - before).collect(),
            log_odds: log_odds_of_leader(&judgement),
        });
        apply(&mut state, &tallies, &judgement);
    }
    for ((source, one), explained) in
        state.planned_sources()?.into_iter().zip(&evidence).zip(&mut state.explanations)
    {
        let mut model = source.model;
        write_back(&mut model, &one.updated());
        explained.model_toml = model.to_toml()?;
    }
    state.sentence = listen_sentence(&state);
    Ok(state)
}

/// Log odds of the leading explanation against its strongest rival, nats: the second smallest e-value.
fn log_odds_of_leader(judgement: &Judgement) -> f64 {
    let mut sorted = judgement.log_e_values.clone();
    sorted.sort_by(f64::total_cmp);
    sorted.get(1).copied().unwrap_or(0.0)
}

/// Writes a judgement into the state.
fn apply(state: &mut State, tallies: &[Tally], judgement: &Judgement) {
    for (k, (explained, tally)) in state.explanations.iter_mut().zip(tallies).enumerate() {
        explained.log_density = tally.log_density;
        explained.log_maximum = tally.log_maximum;
        (explained.squares, explained.count) = (tally.squares, tally.count);
        explained.weight = judgement.weights[k];
        explained.log_e_value = judgement.log_e_values[k];
        explained.rejected = !judgement.left.contains(&k);
    }
    state.dispersion = judgement.dispersion;
    state.verdict = match judgement.verdict {
        Verdict::Enough(_) => "enough",
        Verdict::More => "more",
        Verdict::NoneFits => "none-fits",
    }
    .to_owned();
}
