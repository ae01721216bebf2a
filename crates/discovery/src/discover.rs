//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::adequacy::Adequacy;
use crate::anatomy::anatomy;
use crate::crossed::{crossed, worth_crossing};
use crate::decide::{Decided, decide, heldout_gain};
use crate::error_table::Lists;
use crate::fit::{Fit, Sample, fit};
use crate::hypothesis::Hypothesis;
use crate::prepare::{Prepared, prepare};
use crate::report::{Parts, report};
use crate::result::{Discovery, ErrorTable};
use crate::search::{Judged, Search};
use crate::statistics::median;
use crate::{DiscoveryError, Options, Progress};
use augsim_data::Dataset;
use augsim_physics::ball::{GRAVITY, RESTITUTION};
use augsim_physics::model::{Model, Per};

/// Share of the spread of the first flight that gravity with a free start may leave: twice that of a ball at half its
/// terminal speed, below the quarter that wrong units leave.
const HOPELESS: f64 = 0.2;

/// Finds what `model` lacks to explain `data`.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads. Source of the method: see the
/// crate's documentation.
///
/// # Errors
/// [`DiscoveryError`], when the data or the model do not allow an answer.
pub fn discover(
    model: &Model,
    data: &Dataset,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Discovery, DiscoveryError> {
    progress(Progress::Noise);
    let prepared = prepare(model, data, options)?;
    let Prepared { data: measured, noise, train, test } = &prepared;
    let mut search = Search::new(model, prepared.sample(train), prepared.sample(test));

    progress(Progress::Calibration);
    check_calibration(model, &search.train)?;
    let base = calibrate(model, &search.train);
    let Decided { found, base, best, tests, verdict, severe } = decide(&mut search, base, true, progress)
        .ok_or_else(|| DiscoveryError::TooFew { data: measured.name.clone(), found: 0 })?;

    progress(Progress::Errors);
    let gain = heldout_gain(&best, &base).unwrap_or(0.0);
    let mut error =
        Lists::of(model, &search.test, [&base.fit, &best.fit], options.seed).table(options.seed, gain);
    let crossed = if worth_crossing(&best, &error) {
        progress(Progress::Folds);
        crossed(model, &prepared, options)
    } else {
        None
    };
    if let Some(c) = &crossed {
        error = ErrorTable { folds: Some(c.found.len()), ..c.lists.table(options.seed, gain) };
    }
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = prepared.sample(&everything);
    let full = |j: &Judged| {
        let held = search.heldout(&j.fit);
        let mut nuisance = vec![Vec::new(); everything.len()];
        let parts = train.iter().zip(&j.fit.nuisance).chain(test.iter().zip(&held.nuisance));
        parts.for_each(|(&record, n)| nuisance[record] = n.clone());
        fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance)
    };
    let (calibrated, last) = (full(&base), full(&best));
    let residual_anatomy = anatomy(&all, &calibrated, &last);
    report(Parts {
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
        folds: crossed.map_or_else(Vec::new, |c| c.found),
        anatomy: residual_anatomy,
    })
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

/// Whether a free parameter has one value for each group.
pub(crate) fn per_group(h: &Hypothesis, i: usize) -> bool {
    h.free[i].per == Per::Group
}

/// Adequacy as the result has it.
pub(crate) fn passes(a: &Adequacy) -> crate::result::Tests {
    crate::result::Tests {
        lack_of_fit: a.lack_of_fit,
        library: a.library,
        laws: Some(a.laws),
        heterogeneity: a.heterogeneity,
        periodicity: Some(a.periodicity),
        pass: a.ok(),
    }
}
