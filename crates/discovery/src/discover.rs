//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::adequacy::{Adequacy, adequacy};
use crate::anatomy::anatomy;
use crate::fit::{Fit, Sample, fit, fit_nuisance};
use crate::forecast;
use crate::hypothesis::{Addition, Hypothesis};
use crate::prepare::{Prepared, prepare};
use crate::report::{Parts, report};
use crate::result::{Discovery, ErrorTable, Rmse, Verdict};
use crate::search::{Judged, Search};
use crate::statistics::median;
use crate::unlisted::unlisted;
use crate::{DiscoveryError, Options, Progress};
use augsim_data::Dataset;
use augsim_physics::ball::{GRAVITY, RESTITUTION};
use augsim_physics::model::{Model, Per};
use std::time::Instant;

/// By how much a table must lower the criterion before the library's answer is given up.
const MARGIN: f64 = 10.0;

/// Ratio of forecast errors (of the training part) at which laws without scatter are taken for better than laws with it.
const LAWFUL: f64 = 0.8;

/// Share of the spread of the first flight that gravity with a free start may leave: twice that of a ball at half its
/// terminal speed, below the quarter that wrong units leave.
const HOPELESS: f64 = 0.2;

/// Finds what `model` lacks to explain `data`.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads, but for
/// [`Discovery::seconds`]. Source of the method: see the crate's documentation.
///
/// # Errors
/// [`DiscoveryError`], when the data or the model do not allow an answer.
pub fn discover(
    model: &Model,
    data: &Dataset,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Discovery, DiscoveryError> {
    let begun = Instant::now();
    progress(Progress::Noise);
    let prepared = prepare(model, data, options)?;
    let Prepared { data: measured, noise, train, test } = &prepared;
    let on = |chosen| Sample { data: measured, chosen, correlation: noise.correlation };
    let mut search = Search::new(model, on(train), on(test));

    progress(Progress::Calibration);
    check_calibration(model, &search.train)?;
    let base = calibrate(model, &search.train);

    progress(Progress::Search);
    let mut found = search.run(base);
    let base = found.pool.iter().find(|j| j.additions().is_empty());
    let base = base.or(found.tried.first()).cloned();
    let Some(base) = base else {
        let (data, found) = (measured.name.clone(), 0);
        return Err(DiscoveryError::TooFew { data, found });
    };
    let mut best = confirmed(&found, &base);
    let forecast_of = |j: &Judged| forecast::rmse(&forecast::errors(&search.train, &j.fit, &j.fit.theta));
    if best.fit.hypothesis.scatter.is_some() && forecast_of(&best) > 0.95 * forecast_of(&base) {
        // Chance can be made to explain anything: where it forecasts no better, laws of the mean alone have to be tried.
        search.scatter = false;
        let other = search.run(base.fit.clone());
        let lawful = confirmed(&other, &base);
        let forecast_of = |j: &Judged| forecast::rmse(&forecast::errors(&search.train, &j.fit, &j.fit.theta));
        if forecast_of(&lawful) < LAWFUL * forecast_of(&best) {
            (found, best) = (other, lawful);
        }
    }

    progress(Progress::Adequacy);
    let mut tests = adequacy(&search, &best);
    let (mut verdict, mut severe) = (Verdict::NothingToAdd, false);
    if !best.additions().is_empty() {
        verdict = Verdict::Explained;
    }
    if !tests.ok() || best.additions().len() > 3 {
        progress(Progress::Unlisted);
        severe = tests.severe();
        if let Some(wider) = widen(&search, &base, &best) {
            let better = wider.criterion < best.criterion - MARGIN && wider.heldout_ll > best.heldout_ll;
            if better {
                let listed = wider.additions().iter().any(|a| !matches!(a, Addition::Law(_)));
                verdict = if listed { Verdict::PartlyExplained } else { Verdict::Unknown };
                tests = adequacy(&search, &wider);
                best = wider;
                severe = false;
            }
        }
        if severe {
            verdict = if best.additions().is_empty() { Verdict::Unknown } else { Verdict::PartlyExplained };
        }
    }

    progress(Progress::Errors);
    let error = error_table(&search, model, &base, &best, options);
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = on(&everything);
    let full = |j: &Judged| {
        let held = search.heldout(&j.fit);
        let mut nuisance = vec![Vec::new(); everything.len()];
        let parts = train.iter().zip(&j.fit.nuisance).chain(test.iter().zip(&held.nuisance));
        parts.for_each(|(&record, n)| nuisance[record] = n.clone());
        fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance)
    };
    let (calibrated, last) = (full(&base), full(&best));
    let residual_anatomy = anatomy(&all, &calibrated, &last);
    Ok(report(Parts {
        model,
        search: &search,
        noise,
        found: &found,
        base: &base,
        best: &best,
        full: &last,
        tests: &tests,
        verdict,
        severe,
        error,
        anatomy: residual_anatomy,
        seconds: begun.elapsed().as_secs_f64(),
    }))
}

/// The best of a search, if the held-out part confirms it.
fn confirmed(found: &crate::search::Found, base: &Judged) -> Judged {
    found.pool.first().filter(|best| best.heldout_ll > base.heldout_ll).unwrap_or(base).clone()
}

/// The declared model fitted.
pub(crate) fn calibrate(model: &Model, train: &Sample<'_>) -> Fit {
    let h = Hypothesis::new(model, train.data, &[]);
    fit(train, &h, &calibration_start(train, &h), &[])
}

/// Nominal values, with the restitution (of each group, where it has its own) at the median of the rough speed ratios.
pub(crate) fn calibration_start(train: &Sample<'_>, h: &Hypothesis) -> Vec<f64> {
    let mut theta = h.theta_start(0.0);
    let rough = |group: Option<usize>| {
        let chosen = train.records().filter(|r| group.is_none_or(|g| r.group == g));
        median(&mut chosen.flat_map(|r| r.ratios.iter().copied()).collect::<Vec<_>>())
    };
    let all = rough(None);
    let mut at = 0;
    for f in &h.free {
        let width = h.width(f);
        if f.index == RESTITUTION && all > 0.0 {
            for (group, value) in theta[at..at + width].iter_mut().enumerate() {
                let own = if width > 1 { rough(Some(group)) } else { all };
                *value = if own > 0.0 { own } else { all }.clamp(f.min, f.max);
            }
        }
        at += width;
    }
    theta
}

/// A model that does not even follow the first flight is in other units or upside down.
fn check_calibration(model: &Model, train: &Sample<'_>) -> Result<(), DiscoveryError> {
    let vertical = train.data.axes.count() - 1;
    let mut shares = Vec::new();
    let (mut misfits, mut noises) = (Vec::new(), Vec::new());
    for r in train.records() {
        let (Some(arc), (p, v)) = (r.arcs.first(), r.start) else { continue };
        let (mut n, mut sum, mut square, mut misfit, mut noise) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for k in arc.clone().filter(|&k| r.weight[vertical][k] > 0.0) {
            let (y, t) = (r.y[vertical][k], r.times[k] - r.times[0]);
            let g = model.parameters[GRAVITY].nominal;
            n += 1.0;
            sum += y;
            square += y * y;
            misfit += (y - p[2] - v[2] * t + 0.5 * g * t * t).powi(2);
            noise += r.weight[vertical][k].powi(-2);
        }
        let spread = (square - sum * sum / n).max(0.0);
        let visible = misfit > 100.0 * noise;
        shares.push(if visible { (misfit / spread.max(1e-300)).sqrt() } else { 0.0 });
        misfits.push((misfit / f64::max(n, 1.0)).sqrt());
        noises.push((noise / f64::max(n, 1.0)).sqrt());
    }
    if median(&mut shares) < HOPELESS {
        return Ok(());
    }
    let (rmse, sd) = (median(&mut misfits), median(&mut noises));
    Err(DiscoveryError::NotCalibrated {
        model: model.file.clone(),
        data: train.data.name.clone(),
        rmse_m: format!("{rmse:.3}"),
        sd_m: format!("{sd:.2e}"),
        ratio: format!("{:.0}", rmse / sd),
    })
}

/// Looks for tables from the base and from the best library model.
fn widen(search: &Search<'_>, base: &Judged, best: &Judged) -> Option<Judged> {
    let mut starts = vec![base.clone()];
    if !best.additions().is_empty() {
        starts.push(best.clone());
    }
    let mut wider = unlisted(search, base, &starts)?;
    wider.heldout_ll = Some(search.heldout(&wider.fit).ll);
    Some(wider)
}

fn error_table(
    search: &Search<'_>,
    model: &Model,
    base: &Judged,
    best: &Judged,
    options: &Options,
) -> ErrorTable {
    let test = &search.test;
    let plain = Hypothesis::new(model, test.data, &[]);
    let nominal = plain.theta_start(0.0);
    let declared = forecast::errors(test, &base.fit, &nominal);
    let calibrated = forecast::errors(test, &base.fit, &base.fit.theta);
    let augmented = forecast::errors(test, &best.fit, &best.fit.theta);
    let held = fit_nuisance(test, &best.fit.hypothesis, &best.fit.theta, &[]);
    let floor = forecast::floor(test, &best.fit, &held, options.seed);
    let row = |e: &forecast::Errors| Rmse {
        rmse: forecast::rmse(e),
        ci95: forecast::bootstrap(&[e], options.seed, |r| r[0]),
    };
    let squares = [&calibrated, &augmented, &floor].map(|e| forecast::rmse(e).powi(2));
    let removable = squares[0] - squares[2];
    ErrorTable {
        unit: "m".into(),
        heldout_trajectories: test.chosen.len(),
        declared: row(&declared),
        calibrated: row(&calibrated),
        augmented: row(&augmented),
        noise_floor: row(&floor),
        reduction: Rmse {
            rmse: squares[0].sqrt() - squares[1].sqrt(),
            ci95: forecast::bootstrap(&[&calibrated, &augmented], options.seed, |r| r[0] - r[1]),
        },
        explained_share: (removable > 0.02 * squares[2]).then(|| (squares[0] - squares[1]) / removable),
        heldout_gain: best.heldout_ll.unwrap_or(0.0) - base.heldout_ll.unwrap_or(0.0),
    }
}

/// Whether a free parameter has one value for each group.
pub(crate) fn per_group(h: &Hypothesis, i: usize) -> bool {
    h.free[i].per == Per::Group
}

/// Adequacy as the result has it.
pub(crate) fn passes(a: &Adequacy) -> crate::result::Tests {
    crate::result::Tests {
        lack_of_fit: a.lack_of_fit,
        library: a.library,
        laws: a.laws,
        heterogeneity: a.heterogeneity,
        periodicity: a.periodicity,
        pass: a.ok(),
    }
}
