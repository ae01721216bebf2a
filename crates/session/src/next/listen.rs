//! Takes in new recordings: evidence, weights, verdict, and the promise compared with what came.

use super::explanation::write_back;
use super::plan::compiled;
use super::source::Source;
use super::state::{HeardRun, State};
use super::text::listen_sentence;
use augsim_design::{Explanation, Judgement, Verdict, hear, judge};
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
/// # Errors
/// An explanation cannot be simulated over a recording.
pub fn listen(request: &ListenRequest<'_>) -> anyhow::Result<State> {
    let mut state = request.state.clone();
    let mut models = state.models()?;
    let sources: Vec<Source> = state
        .explanations
        .iter()
        .zip(&models)
        .map(|(e, model)| Source {
            name: e.name.clone(),
            model: model.clone(),
            log_weight: e.log_weight,
            widths: e.widths.clone(),
        })
        .collect();
    let compiled = compiled(&sources, &(request.records.to_vec(), BTreeMap::new()))?;
    let mut explanations: Vec<Explanation> = compiled.into_iter().map(|(e, _)| e).collect();
    let mut judgement = None;
    for record in request.records {
        let mut run = HeardRun { id: record.id.clone(), log_evidence: Vec::new(), log_odds: 0.0 };
        for (e, explained) in explanations.iter_mut().zip(&mut state.explanations) {
            let heard = hear(e, record)?;
            explained.log_evidence += heard.log_evidence;
            explained.squares += heard.squares;
            explained.count += heard.count;
            run.log_evidence.push(heard.log_evidence);
            *e = heard.updated;
        }
        let rejected: Vec<bool> = state.explanations.iter().map(|e| e.rejected).collect();
        let now = judge(&state.tallies(), &rejected, state.odds);
        for (explained, log_e_value) in state.explanations.iter_mut().zip(&now.log_e_values) {
            explained.rejected |= *log_e_value >= state.odds.ln();
        }
        run.log_odds = log_odds_of_leader(&now);
        state.heard.push(run);
        judgement = Some(now);
    }
    if let Some(judgement) = judgement {
        apply(&mut state, &judgement);
    }
    for ((model, e), explained) in models.iter_mut().zip(&explanations).zip(&mut state.explanations) {
        write_back(model, e);
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
fn apply(state: &mut State, judgement: &Judgement) {
    for ((explained, weight), log_e_value) in
        state.explanations.iter_mut().zip(&judgement.weights).zip(&judgement.log_e_values)
    {
        (explained.weight, explained.log_e_value) = (*weight, *log_e_value);
    }
    state.dispersion = judgement.dispersion;
    state.verdict = match judgement.verdict {
        Verdict::Enough(_) => "enough",
        Verdict::More => "more",
        Verdict::NoneFits => "none-fits",
    }
    .to_owned();
}
