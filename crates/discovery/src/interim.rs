//! Interim results: the best set of effects so far as a complete result, for a run that may be stopped.
//!
//! Nothing is refitted: the fits of the search are written as they are, and their errors are measured on the
//! held-out records or, where there are none, on the records that the fits used.

use crate::DiscoveryError;
use crate::answer::{AnswerParts, Errors, errors_of_fits, forecast_limit};
use crate::examples::examples;
use crate::judge::{Findings, ResidualTests};
use crate::options::Clock;
use crate::prepare::Prepared;
use crate::report::report;
use crate::result::{Discovery, Verdict};
use crate::search::Search;
use crate::stages::{Judged, SearchStage};
use augsim_system::Declaration;
use std::sync::Arc;

/// Assembles the best result so far. Without `judged`, its sentence says that the effects were not tested.
pub(crate) fn interim(
    model: &dyn Declaration,
    prepared: &Prepared,
    searched: &SearchStage,
    judged: Option<&Judged>,
    seed: u64,
) -> Result<Discovery, DiscoveryError> {
    // The simulations for an interim result must not count as work of the run, nor end at its deadline.
    let mut prepared = prepared.clone();
    (prepared.data.work, prepared.data.clock, prepared.clock) =
        (Arc::default(), Clock::default(), Clock::default());
    let untested = Judged {
        findings: Findings::untested(searched.found.best),
        best: searched.found.best,
        random_effect: None,
        residual_tests: ResidualTests::untested(),
        verdict: Verdict::Unknown,
        withdrawal_reason: None,
    };
    let found = &searched.found;
    let (base, best) = (found.base(), &found.sets[judged.map_or(found.best, |j| j.best)]);
    let records = if prepared.held_out.is_empty() { &prepared.searched } else { &prepared.held_out };
    let errors: Errors = errors_of_fits(&prepared, records, [&base.fit, &best.fit], seed);
    let sample = prepared.sample(records);
    let view = searched.view.detached();
    let search = Search::new(&view, &searched.families, &prepared.clock);
    let parts = AnswerParts {
        model,
        prepared: &prepared,
        search: &search,
        found,
        judged: judged.unwrap_or(&untested),
        base,
        best,
        all_records: &view,
        calibrated: base,
        full: best,
        errors: &errors,
        limit: forecast_limit(&prepared, &best.fit),
        random_effect_sd: None,
        example_records: &sample,
        seed,
    };
    let mut result = report(&parts)?;
    result.examples = examples(&sample, [&base.fit, &best.fit], &errors.lists);
    if judged.is_none() {
        result.tests.pass = false;
        result.sentence = sentence(&result);
        result.next_experiment.clear();
    }
    if prepared.held_out.is_empty() {
        result.sentence =
            result.sentence.replace("error on held-out trajectories", "error on the fitted trajectories");
        result.sentence += " Its errors are those on the trajectories that it was fitted to.";
    }
    result.notes.clone_from(&prepared.notes);
    Ok(result)
}

/// Sentence of an interim result whose effects were not tested.
fn sentence(result: &Discovery) -> String {
    let kinds: Vec<&str> = result.effects.iter().map(|effect| effect.kind.as_str()).collect();
    if kinds.is_empty() {
        return "The best result so far is the calibrated model; no effect was found yet that it lacks."
            .into();
    }
    format!(
        "The best result so far is the calibrated model with {}; whether these effects are significant was not tested yet.",
        kinds.join(" and ")
    )
}
