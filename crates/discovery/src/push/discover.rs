//! The loop: noise, calibration, search, adequacy, errors.

use super::adequacy;
use super::anatomy::anatomy;
use super::crossed::{crossed, worth_crossing};
use super::decide::{Decided, sample, searched, settled};
use super::error_table::Lists;
use super::examples::examples;
use super::hypothesis::kind_of;
use super::measured::measure;
use super::report::{Parts, report};
use super::scatter;
use super::search::Search;
use crate::assess::Assessment;
use crate::cut::cut_short;
use crate::result::{Discovery, ErrorTable, Verdict};
use crate::{DiscoveryError, Options, Progress};
use augsim_data::checks::{Admitted, admit};
use augsim_data::{DataError, Dataset};
use augsim_physics::model::PushModel;
use augsim_physics::push::effects::SCATTER_KIND;
use std::time::Instant;

/// Finds what `model` lacks to explain pushes.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads.
///
/// # Errors
/// [`DiscoveryError`], when the data or the model do not allow an answer.
pub fn discover_push(
    model: &PushModel,
    data: &Dataset,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Discovery, DiscoveryError> {
    let begun = Instant::now();
    progress(Progress::Noise);
    let Admitted { data, warnings } =
        admit(data.clone(), &model.expected(), options.accepted).map_err(DataError::from)?;
    let measured = measure(model, &data, options)?;
    progress(Progress::Search);
    let mut was_cut = false;
    let goes_on = &mut || {
        progress(Progress::Search);
        was_cut |= options.is_over();
        !was_cut
    };
    let search = searched(model, &measured, &measured.train, &measured.test, goes_on);
    let mut best = search.best();
    let mut decided = settled(search.clone(), best);

    progress(Progress::Errors);
    let (seed, gain) = (options.seed, decided.heldout_gain());
    let kept = &decided.search.test.windows;
    let mut lists = Lists::of(model, &measured, &measured.test, kept, decided.fits(), seed);
    let examples = examples(model, &measured, &lists, decided.fits());
    let mut folds = Vec::new();
    if !was_cut && worth_crossing(&decided, &lists.positions(seed, gain)) {
        progress(Progress::Folds);
        if let Some(crossed) = crossed(model, &measured, options) {
            let kinds = search.tried[best].kinds().to_vec();
            let stable = crossed.stable(&kinds);
            if stable.len() < kinds.len() {
                let mut search = search;
                best = search.place_of(&stable, best);
                decided = settled(search, best);
            }
            (lists, folds) = (crossed.lists, crossed.found);
        }
    }
    let count = (!folds.is_empty()).then_some(folds.len());

    progress(Progress::Adequacy);
    let Decided { search, rejected, scatter, .. } = &decided;
    let own = scatter.as_ref().map(|s| &s.pieces[0][..]);
    let tests = adequacy::tests(search, &search.tried[best].fit, rejected, own);
    let scattered = scatter.as_ref().is_some_and(|s| !s.declared);
    let named = scattered || !search.tried[best].kinds().is_empty();
    let verdict = match (named, tests.pass) {
        (false, true) => Verdict::NothingToAdd,
        (true, true) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
        (false, false) => Verdict::Unknown,
    };

    // The answer's numbers come from all windows.
    let everything = decided.everything();
    let [calibrated, last] = decided.refitted(&everything);
    let sd_m = scatter.as_ref().and_then(|_| scatter::size(model, &everything, &last));
    let residual_anatomy = anatomy(&everything, &calibrated, &last);
    let discovery = report(Parts {
        model,
        decided: &decided,
        everything: &everything,
        full: &last,
        sd_m,
        tests,
        verdict,
        error: ErrorTable { folds: count, ..lists.positions(seed, gain) },
        rotation: ErrorTable { folds: count, ..lists.rotations(seed, gain) },
        horizons: lists.horizons(seed),
        folds,
        anatomy: residual_anatomy,
    })?;
    let discovery = Discovery { warnings, examples, ..discovery };
    Ok(if was_cut { cut_short(discovery, begun) } else { discovery })
}

/// Fits the calibrated model with the effects `kinds` (unknown kinds are left out): what someone would gain who is told what
/// to look for.
///
/// # Errors
/// As [`discover_push`].
pub fn assess_push(
    model: &PushModel,
    data: &Dataset,
    kinds: &[&str],
    options: &Options,
) -> Result<Assessment, DiscoveryError> {
    let measured = measure(model, data, options)?;
    let search =
        Search::new(model, sample(&measured, &measured.train), sample(&measured, &measured.test), None);
    let scatters = kinds.contains(&SCATTER_KIND);
    let kinds: Vec<&'static str> = kinds.iter().filter_map(|k| kind_of(k)).collect();
    let mut now = search.base().fit.clone();
    for (i, _) in kinds.iter().enumerate() {
        let scored = search.scores(&now).into_iter().find(|s| s.kind == kinds[i]);
        now = search.refit(&now, &kinds[..=i], scored.as_ref().map(|s| &s.theta[..])).fit;
    }
    let base = &search.base().fit;
    let lists = Lists::of(model, &measured, &measured.test, &search.test.windows, [base, &now], options.seed);
    let rmse_m = lists.positions(options.seed, 0.0).augmented.rmse;
    let gain = search.base().fit.cost(&search.train) - now.cost(&search.train);
    let judged = search.judged(now);
    let own = if scatters { scatter::promise(&search, &judged.fit) } else { [0.0; 2] };
    Ok(Assessment { gain: gain + own[0], penalty: judged.penalty + own[1], rmse: rmse_m })
}
