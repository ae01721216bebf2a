//! The discovery procedure: records and noise, calibration and search, judgement, errors, result.

use crate::DiscoveryError;
use crate::addition::Addition;
use crate::answer::{AnswerParts, Errors, forecast_limit, measure_errors, nuisances_of_all};
use crate::columns::Family;
use crate::error_table::ForecastErrors;
use crate::examples::examples;
use crate::feedback::exclude_feedback;
use crate::fit::{fit, fit_nuisance};
use crate::formulas::search_formulas;
use crate::interim::interim;
use crate::judge::{self, WithdrawalReason, add_tables, judge_findings, test_memory, test_residuals};
use crate::options::{Monotone, Observer, Options, Progress};
use crate::prepare::{Prepared, prepare, residual_sds};
use crate::random_effect_test::{self, find_random_effect};
use crate::records::View;
use crate::report::report;
use crate::result::{Discovery, Verdict};
use crate::score::Scored;
use crate::search::{
    Penalty, Search, SearchResult, calibrate_windows, choose_window_length, complete, refit_on,
};
use crate::stages::{Judged, SearchStage, search_in, search_with};
use crate::unknown_inputs::without_unknown_inputs;
use augsim_data::checks::{CheckedData, check_data};
use augsim_data::{DataError, Dataset};
use augsim_system::Declaration;
use std::time::Instant;

/// Maximum number of repetitions of the search, done if the effects found change the best window length or the
/// noise.
const REPEATS: usize = 2;

/// Reason of a stop at the deadline, worded for [`Discovery::mark_stopped`].
const TIME_LIMIT: &str = "at its time limit";

/// Finds the effects that `model` lacks to explain `data`.
///
/// Deterministic: the same inputs and seed give the same result for any number of threads. The documentation
/// of the crate has an example and the sources of the method.
///
/// # Errors
/// [`DiscoveryError`], when the data or the model do not allow a result.
pub fn discover(
    model: &dyn Declaration,
    data: &Dataset,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Discovery, DiscoveryError> {
    let start_time = Instant::now();
    let observer = &mut Monotone::new(observer);
    observer.report(Progress::Noise);
    let CheckedData { data, warnings } =
        check_data(data.clone(), &model.expected(), options.accepted).map_err(DataError::from)?;
    let mut prepared = prepare(model, &data, options)?;
    let rejection = judge::reason_from_data(&prepared);
    let mut searched = match rejection {
        Some(_) => calibrate_only(&prepared, observer),
        None => search(model, &mut prepared, options, observer),
    };
    if let Some((later, note)) = without_unknown_inputs(&prepared, &searched, &data)? {
        let clock = prepared.clock;
        prepared = prepare(model, &later, options)?;
        (prepared.data.clock, prepared.clock) = (clock.clone(), clock);
        prepared.notes.push(note);
        searched = search(model, &mut prepared, options, observer);
    }
    if !data.notes().is_empty() {
        let notes = data.notes().join("; ");
        prepared.notes.insert(0, format!("{}: read as a recording: {notes}", data.origin()));
    }
    prepared.clock.end_search();
    let was_cut = prepared.clock.was_cut();
    if was_cut && rejection.is_none() {
        if searched.found.sets.len() == 1 {
            let mut found = interim(model, &prepared, &searched, None, options.seed)?;
            found.warnings = warnings;
            found.mark_stopped(TIME_LIMIT, start_time.elapsed().as_secs_f64());
            return Ok(found);
        }
        let SearchStage { view, families, found } = &mut searched;
        complete(&Search::new(view, families, &prepared.clock), found);
    }
    observer.report(Progress::ResidualTests);
    // The test on null records would take longer than the time that is left.
    let options = &Options { null_runs: if was_cut { 0 } else { options.null_runs }, ..options.clone() };
    let mut judged = judge(&prepared, &mut searched, rejection, options);
    report_interim(model, &prepared, &searched, Some(&judged), options, observer);
    observer.report(Progress::Errors);
    let mut measured = prediction_errors(&prepared, &searched, &judged, options);
    if withdraw_unsupported(&prepared, &mut searched, &mut judged, &measured, options.seed) {
        measured = prediction_errors(&prepared, &searched, &judged, options);
    }
    let found = write_result(model, &prepared, &searched, &judged, &measured, options)?;
    let mut found = Discovery { warnings, notes: prepared.notes.clone(), ..found };
    if was_cut {
        found.mark_stopped(TIME_LIMIT, start_time.elapsed().as_secs_f64());
    }
    Ok(found)
}

/// Passes the best result so far to the observer, if it accepts interim results.
fn report_interim(
    model: &dyn Declaration,
    prepared: &Prepared,
    searched: &SearchStage,
    judged: Option<&Judged>,
    options: &Options,
    observer: &mut dyn Observer,
) {
    if observer.takes_interim()
        && let Ok(best_so_far) = interim(model, prepared, searched, judged, options.seed)
    {
        observer.interim(best_so_far);
    }
}

/// Calibrates the declared model without a search for effects.
fn calibrate_only(prepared: &Prepared, observer: &mut dyn Observer) -> SearchStage {
    observer.report(Progress::Calibration);
    let (view, base) = calibrate_windows(prepared, &prepared.searched);
    SearchStage { view, families: Vec::new(), found: SearchResult::calibrated_only(base, Penalty(0.0)) }
}

/// Calibrates the model and searches for effects. Repeats both if the effects found change the best window
/// length or lower the noise estimate.
fn search(
    model: &dyn Declaration,
    prepared: &mut Prepared,
    options: &Options,
    observer: &mut dyn Observer,
) -> SearchStage {
    observer.report(Progress::Calibration);
    let families = match (options.library, options.effects.is_closed()) {
        (true, true) => vec![Family::Library, Family::Memory],
        (true, false) => vec![Family::Library],
        (false, _) => vec![Family::Grammar],
    };
    let (mut view, base) = calibrate_windows(prepared, &prepared.searched);
    if exclude_feedback(prepared, &view, &base) {
        view = View::new(prepared, &prepared.searched, view.joined);
    }
    let calibrated = SearchStage {
        view: view.clone(),
        families: families.clone(),
        found: SearchResult::calibrated_only(base.clone(), Penalty(0.0)),
    };
    report_interim(model, prepared, &calibrated, None, options, observer);
    let report_share = |observer: &mut dyn Observer, share: f64| {
        observer.report(Progress::Search((1000.0 * share) as u16));
    };
    let first_search = |prepared: &Prepared, view, observer: &mut dyn Observer| {
        let shares = &mut |share| report_share(observer, share);
        search_in(prepared, view, &families, base.clone(), Vec::new(), shares)
    };
    let mut searched = first_search(prepared, view, observer);
    // A model error may have hidden the noise that a controller passes on.
    let without_readings = searched.found.best_without(&|a| a.is_added_to_reading());
    if exclude_feedback(prepared, &searched.view, without_readings) {
        let view = View::new(prepared, &prepared.searched, searched.view.joined);
        searched = first_search(prepared, view, observer);
    }
    searched = search_memory(prepared, searched);
    for _ in 0..REPEATS {
        let best = searched.found.best().fit.clone();
        let residual_sd = residual_sds(&searched.view.sample(), &best);
        let is_quieter = prepared.lower_noise(residual_sd);
        let short_view = View::new(prepared, &prepared.searched, 1);
        let short_fit =
            if searched.view.joined == 1 && !is_quieter { best } else { refit_on(&short_view, &best) };
        let (view, best_set) = choose_window_length(prepared, &prepared.searched, short_view, short_fit);
        if view.joined == searched.view.joined && !is_quieter || prepared.clock.is_over() {
            break;
        }
        let base = refit_on(&view, &searched.found.base().fit);
        let base = Scored::new(&view.sample(), &view.blocks, base);
        if prepared.clock.is_over() {
            break;
        }
        let shares = &mut |share| report_share(observer, share);
        searched = search_in(prepared, view, &searched.families, base, vec![best_set], shares);
        searched = search_memory(prepared, searched);
    }
    report_interim(model, prepared, &searched, None, options, observer);
    search_formulas(prepared, searched, options, observer)
}

/// Repeats the search with effects that depend on the past, if the residuals exceed the noise or depend on the past, or if
/// laws of present values were found. Each may be an imitation of the other.
///
/// In a single recording only a dependence of the residuals on the past counts. Process noise leaves residuals beyond the noise
/// there, which a state of an effect, whose start is estimated in each window, imitates beside the right law.
fn search_memory(prepared: &Prepared, mut searched: SearchStage) -> SearchStage {
    let is_possible =
        searched.families.contains(&Family::Library) && !searched.families.contains(&Family::Memory);
    if !is_possible || prepared.clock.is_over() {
        return searched;
    }
    let has_laws_or_excess = !prepared.has_single_recording() && {
        let named = searched.named_set(prepared);
        !named.additions().is_empty() || searched.exceeds_noise(prepared, &named)
    };
    let is_needed =
        has_laws_or_excess || test_memory(&searched.search(prepared), searched.found.best()).is_significant();
    if is_needed { search_with(prepared, &searched, Family::Memory) } else { searched }
}

/// Selects the established effects, tests the residuals that they leave, and derives the verdict.
fn judge(
    prepared: &Prepared,
    searched: &mut SearchStage,
    withdrawal_reason: Option<String>,
    options: &Options,
) -> Judged {
    let SearchStage { view, families, found } = searched;
    let search = Search::new(view, families, &prepared.clock);
    let findings = judge_findings(&search, found, options.seed, options.null_runs);
    let named = findings.named;
    let table = if withdrawal_reason.is_some() { None } else { add_tables(&search, found, named) };
    let best = table.map_or(named, |(best, _)| best);
    let random_effect = find_random_effect(&search, &found.sets[named], found.penalty);
    let tests = test_residuals(&search, &found.sets[best], random_effect.as_ref(), table.map(|t| t.1));
    // A tabulated law may replace formulas that fit the same curve, so the final set decides whether
    // something is named.
    let is_not_table = |a: &Addition| !matches!(a, Addition::Table(_));
    let is_named = found.sets[best].additions().iter().any(is_not_table)
        || random_effect.as_ref().is_some_and(|s| !s.is_declared);
    let verdict = judge::verdict(is_named, table.is_some(), &tests);
    let mut judged =
        Judged { findings, best, random_effect, residual_tests: tests, verdict, withdrawal_reason };
    if judged.withdrawal_reason.is_none()
        && let Some(WithdrawalReason::NotThisSystem(why)) =
            [best, named].iter().find_map(|n| judge::reason_from_values(&found.sets[*n].fit))
    {
        judged.withdrawal_reason = Some(why);
    }
    if judged.withdrawal_reason.is_some() {
        withdraw_findings(&mut judged, Verdict::NotThisSystem);
    }
    judged
}

/// Withdraws all findings and sets the verdict; the result is then the calibrated model.
fn withdraw_findings(judged: &mut Judged, verdict: Verdict) {
    (judged.best, judged.verdict) = (0, verdict);
    let findings = &mut judged.findings;
    findings.named = 0;
    (findings.p_values, findings.q_values, findings.inclusion) = (Vec::new(), Vec::new(), Vec::new());
    findings.alternatives = Vec::new();
}

/// Measures prediction errors on data that no decision used.
fn prediction_errors(
    prepared: &Prepared,
    searched: &SearchStage,
    judged: &Judged,
    options: &Options,
) -> Errors {
    let SearchStage { view, families, found } = searched;
    measure_errors(prepared, view.joined, families, found, judged.best, options.seed)
}

/// Withdraws findings that do not improve the predictions, and rejects the system if it predicts worse than
/// the mean of the data. Returns whether findings were withdrawn.
fn withdraw_unsupported(
    prepared: &Prepared,
    searched: &mut SearchStage,
    judged: &mut Judged,
    errors: &Errors,
    seed: u64,
) -> bool {
    if judged.withdrawal_reason.is_some() {
        return false;
    }
    let schema = prepared.data.system.schema();
    // Random effects alone do not change predictions.
    let changes_predictions = |a: &Addition| !matches!(a, Addition::Scatter(_));
    let adds = searched.found.sets[judged.best].additions().iter().any(changes_predictions);
    let table = errors.lists.first(schema, seed, 0.0);
    match judge::reason_from_errors(&table, prepared.spread(), adds, schema.primary_unit()) {
        Some(WithdrawalReason::NotThisSystem(_)) if prepared.has_single_recording() => {
            // The parts of one recording predict each other. That extrapolates: a model that lacks a slow state can predict
            // worse than the mean although it is of the right system.
            withdraw_findings(judged, Verdict::Unknown);
            adds
        }
        Some(WithdrawalReason::NotThisSystem(why)) => {
            withdraw_findings(judged, Verdict::NotThisSystem);
            judged.withdrawal_reason = Some(why);
            adds
        }
        Some(WithdrawalReason::DoesNotHelp) => {
            withdraw_findings(judged, Verdict::Unknown);
            true
        }
        None => false,
    }
}

/// Refits the chosen sets of effects to all records and assembles the result.
fn write_result(
    model: &dyn Declaration,
    prepared: &Prepared,
    searched: &SearchStage,
    judged: &Judged,
    errors: &Errors,
    options: &Options,
) -> Result<Discovery, DiscoveryError> {
    let record_numbers: Vec<usize> = (0..prepared.data.records.len()).collect();
    let all_records = View::new(prepared, &record_numbers, searched.view.joined);
    let refit_on_all = |set: &Scored| -> Scored {
        if prepared.held_out.is_empty() {
            return set.clone();
        }
        let Scored { fit: on_search, .. } = set;
        let (sample, h, theta) = (all_records.sample(), &on_search.hypothesis, &on_search.theta);
        let nuisances = match all_records.joined {
            1 => nuisances_of_all(prepared, on_search),
            _ => fit_nuisance(&sample, h, theta, &[]).nuisance,
        };
        let fitted = fit(&sample, h, theta, &nuisances);
        Scored::new(&all_records.sample(), &all_records.blocks, fitted)
    };
    let (base, best) = (searched.found.base(), &searched.found.sets[judged.best]);
    let [calibrated, full] = [base, best].map(refit_on_all);
    let shown_records = if prepared.held_out.is_empty() { &prepared.searched } else { &prepared.held_out };
    let shown_on = prepared.sample(shown_records);
    let fit_on_shown = fit_nuisance(&shown_on, &best.fit.hypothesis, &best.fit.theta, &[]);
    let shown_errors =
        ForecastErrors::measure(&shown_on, [&base.fit, &best.fit], &fit_on_shown, &[], options.seed);
    let limit = forecast_limit(prepared, &best.fit);
    let random_effect_sd = judged
        .random_effect
        .as_ref()
        .and_then(|_| random_effect_test::size(&all_records.sample(), &full.fit));
    let search = searched.search(prepared);
    let parts = AnswerParts {
        model,
        prepared,
        search: &search,
        found: &searched.found,
        judged,
        base,
        best,
        all_records: &all_records,
        calibrated: &calibrated,
        full: &full,
        errors,
        limit,
        random_effect_sd,
        example_records: &shown_on,
        seed: options.seed,
    };
    let found = report(&parts)?;
    Ok(Discovery { examples: examples(&shown_on, [&base.fit, &best.fit], &shown_errors), ..found })
}
