//! The loop, stage by stage: records and noise, calibration and search, judgement, errors, answer.

use crate::DiscoveryError;
use crate::addition::Addition;
use crate::answer::{AnswerParts, Errors, errors, forecast_limit, starts};
use crate::columns::Family;
use crate::cut::cut_short;
use crate::error_table::Lists;
use crate::examples::examples;
use crate::fit::{fit, fit_nuisance};
use crate::formulas::with_formulas;
use crate::judge::{self, Doubt, judged, remainder, tabulated};
use crate::options::{Options, Progress, onward};
use crate::prepare::{Prepared, misfit, prepare};
use crate::records::View;
use crate::report::report;
use crate::result::{Discovery, Verdict};
use crate::scattered::{self, scattered};
use crate::score::Scored;
use crate::search::{Found, Price, Search, calibrated, lengthened, refitted};
use crate::stages::{Judged, Searched, searched_on};
use augsim_data::checks::{Admitted, admit};
use augsim_data::{DataError, Dataset};
use augsim_physics::system::Declaration;
use std::time::Instant;

/// Times that a search is repeated because its windows, or the noise, turn out otherwise beside what it found.
const REPEATS: usize = 2;

/// Finds what `model` lacks to explain `data`.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads. The crate's documentation has an
/// example that runs, and the sources of the method.
///
/// # Errors
/// [`DiscoveryError`], when the data or the model do not allow an answer.
pub fn discover(
    model: &dyn Declaration,
    data: &Dataset,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Discovery, DiscoveryError> {
    let begun = Instant::now();
    let progress = &mut onward(progress);
    progress(Progress::Noise);
    let Admitted { data, warnings } =
        admit(data.clone(), &model.expected(), options.accepted).map_err(DataError::from)?;
    let mut prepared = prepare(model, &data, options)?;
    let doubt = judge::before_search(&prepared);
    let mut searched = match doubt {
        Some(_) => unsearched(&prepared, progress),
        None => search(&mut prepared, options, progress),
    };
    progress(Progress::Adequacy);
    let mut judged = judge(&prepared, &mut searched, doubt, options);
    progress(Progress::Errors);
    let mut measured = measure(&prepared, &searched, &judged, options);
    if withdraw(&prepared, &mut searched, &mut judged, &measured) {
        measured = measure(&prepared, &searched, &judged, options);
    }
    let found = answer(model, &prepared, &searched, &judged, &measured, options)?;
    let mut notes = prepared.notes.clone();
    if !data.notes().is_empty() {
        notes.insert(0, format!("{}: read as a recording: {}", data.origin(), data.notes().join("; ")));
    }
    let found = Discovery { warnings, notes, ..found };
    Ok(if prepared.clock.was_cut() { cut_short(found, begun) } else { found })
}

/// The calibrated model and nothing else.
fn unsearched(prepared: &Prepared, progress: &mut dyn FnMut(Progress)) -> Searched {
    progress(Progress::Calibration);
    let (view, base) = calibrated(prepared, &prepared.searched);
    Searched { view, families: Vec::new(), found: Found::of(base, Price(0.0)) }
}

/// Calibration and search, over windows and with noise that suit what was found.
fn search(prepared: &mut Prepared, options: &Options, progress: &mut dyn FnMut(Progress)) -> Searched {
    progress(Progress::Calibration);
    let families = vec![if options.library { Family::Described } else { Family::Grammar }];
    let (view, base) = calibrated(prepared, &prepared.searched);
    let mut told = |share: f64| progress(Progress::Searched((1000.0 * share) as u16));
    let mut searched = searched_on(prepared, view, &families, base, Vec::new(), &mut told);
    for _ in 0..REPEATS {
        let best = searched.found.best().fit.clone();
        let left = misfit(&searched.view.sample(), &best);
        let is_quieter = prepared.quieter(left);
        let short = View::new(prepared, &prepared.searched, 1);
        let on_short = if searched.view.joined == 1 && !is_quieter { best } else { refitted(&short, &best) };
        let (view, known) = lengthened(prepared, &prepared.searched, short, on_short);
        if view.joined == searched.view.joined && !is_quieter || prepared.clock.is_over() {
            break;
        }
        let base = refitted(&view, &searched.found.base().fit);
        let base = Scored::new(&view.sample(), &view.blocks, base);
        searched = searched_on(prepared, view, &families, base, vec![known], &mut told);
    }
    with_formulas(prepared, searched, options, progress)
}

/// Established findings, the remainder, and the verdict.
fn judge(prepared: &Prepared, searched: &mut Searched, doubt: Option<String>, options: &Options) -> Judged {
    let Searched { view, families, found } = searched;
    let search = Search::new(view, families, &prepared.clock);
    let judgement = judged(&search, found, options.seed, options.null_runs);
    let named = judgement.named;
    let table = if doubt.is_some() { None } else { tabulated(&search, found, named) };
    let best = table.map_or(named, |(best, _)| best);
    let scattered = scattered(&search, &found.tried[named], found.price);
    let left = remainder(&search, &found.tried[best], scattered.as_ref(), table.map(|t| t.1));
    // A law of one quantity may stand in the place of formulas that follow it: what remains beside it is named.
    let is_law = |a: &Addition| !matches!(a, Addition::Table(_));
    let is_named =
        found.tried[best].additions().iter().any(is_law) || scattered.as_ref().is_some_and(|s| !s.declared);
    let verdict = judge::verdict(is_named, table.is_some(), &left);
    let mut judged = Judged { judgement, best, scattered, left, verdict, doubt };
    if judged.doubt.is_none()
        && let Some(Doubt::NotThisSystem(why)) =
            [best, named].iter().find_map(|n| judge::of_values(&found.tried[*n].fit))
    {
        judged.doubt = Some(why);
    }
    if judged.doubt.is_some() {
        without_findings(&mut judged, Verdict::NotThisSystem);
    }
    judged
}

/// Takes back what was named: the answer is the calibrated model.
fn without_findings(judged: &mut Judged, verdict: Verdict) {
    (judged.best, judged.verdict) = (0, verdict);
    let judgement = &mut judged.judgement;
    judgement.named = 0;
    (judgement.chances, judgement.q_values, judgement.inclusion) = (Vec::new(), Vec::new(), Vec::new());
    judgement.alternatives = Vec::new();
}

/// Errors on data that no decision has seen.
fn measure(prepared: &Prepared, searched: &Searched, judged: &Judged, options: &Options) -> Errors {
    let Searched { view, families, found } = searched;
    errors(prepared, view.joined, families, found, judged.best, options.seed)
}

/// Takes back findings that predict no better than the declared or the calibrated model, or a system that predicts worse than a mean.
/// Whether anything was taken back.
fn withdraw(prepared: &Prepared, searched: &mut Searched, judged: &mut Judged, errors: &Errors) -> bool {
    if judged.doubt.is_some() {
        return false;
    }
    let schema = prepared.data.system.schema();
    // A scatter alone changes no prediction.
    let is_law = |a: &Addition| !matches!(a, Addition::Scatter(_));
    let adds = searched.found.tried[judged.best].additions().iter().any(is_law);
    let table = errors.lists.first(schema, 0, 0.0);
    match judge::of_errors(&table, prepared.spread(), adds, schema.decides()) {
        Some(Doubt::NotThisSystem(why)) => {
            without_findings(judged, Verdict::NotThisSystem);
            judged.doubt = Some(why);
            adds
        }
        Some(Doubt::DoesNotHelp) => {
            without_findings(judged, Verdict::Unknown);
            true
        }
        None => false,
    }
}

/// The answer in numbers and words.
fn answer(
    model: &dyn Declaration,
    prepared: &Prepared,
    searched: &Searched,
    judged: &Judged,
    errors: &Errors,
    options: &Options,
) -> Result<Discovery, DiscoveryError> {
    let everything: Vec<usize> = (0..prepared.data.records.len()).collect();
    let all = View::new(prepared, &everything, searched.view.joined);
    let on_all = |set: &Scored| -> Scored {
        if prepared.kept_out.is_empty() {
            return set.clone();
        }
        let Scored { fit: known, .. } = set;
        let fitted = fit(&all.sample(), &known.hypothesis, &known.theta, &starts(prepared, known));
        Scored::new(&all.sample(), &all.blocks, fitted)
    };
    let (base, best) = (searched.found.base(), &searched.found.tried[judged.best]);
    let [calibrated, full] = [base, best].map(on_all);
    let kept = if prepared.kept_out.is_empty() { &prepared.searched } else { &prepared.kept_out };
    let shown_on = prepared.sample(kept);
    let held = fit_nuisance(&shown_on, &best.fit.hypothesis, &best.fit.theta, &[]);
    let shown = Lists::of(&shown_on, [&base.fit, &best.fit], &held, &[], options.seed);
    let limit = forecast_limit(prepared, &best.fit);
    let drawn_sd = judged.scattered.as_ref().and_then(|_| scattered::size(&all.sample(), &full.fit));
    let search = searched.search(prepared);
    let parts = AnswerParts {
        model,
        prepared,
        search: &search,
        found: &searched.found,
        judged,
        base,
        best,
        all: &all,
        calibrated: &calibrated,
        full: &full,
        errors,
        limit,
        drawn_sd,
        shown_on: &shown_on,
        seed: options.seed,
    };
    let found = report(&parts)?;
    Ok(Discovery { examples: examples(&shown_on, [&base.fit, &best.fit], &shown), ..found })
}
