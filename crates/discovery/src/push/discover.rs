//! The loop: noise, calibration, search, adequacy, errors.

use super::adequacy;
use super::anatomy::anatomy;
use super::fit::{Fit, Sample, fit, fit_starts};
use super::forecast::{self, Counted, Squares};
use super::hypothesis::Hypothesis;
use super::measured::{Measured, Window, measure};
use super::report::{Parts, Ranking, report};
use super::search::{Judged, Search};
use crate::assess::Assessment;
use crate::result::{Discovery, ErrorTable, Horizon, Rmse, Verdict};
use crate::{DiscoveryError, Options, Progress};
use augsim_data::Dataset;
use augsim_physics::model::PushModel;
use augsim_physics::push::effects::spec_of;
use std::time::Instant;

/// Pushes of a first search, at least.
const FEW: usize = 30;
/// Longest push that is forecast as a whole, m of travel; longer ones are cut by time.
const WHOLE_M: f64 = 0.2;
/// Horizons of forecasts, s; the middle one cuts long runs in the table of errors.
const HORIZONS_S: [f64; 3] = [0.5, 1.0, 2.0];

/// Finds what `model` lacks to explain pushes.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads, but for
/// [`Discovery::seconds`].
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
    let measured = measure(model, data, options)?;
    progress(Progress::Calibration);
    let few = few(model, &measured, &mut || progress(Progress::Search));
    let mut search = start(model, &measured, few.as_ref());
    progress(Progress::Search);
    search.run(&mut || progress(Progress::Search));
    let best = search.best();
    let ranking = Ranking::of(&search, best);
    let rejected = search.rejected(best);

    // Windows that neither the calibrated nor the best model follows are left out, and both are fitted again.
    let outliers = [
        outliers(&search.train, [&search.base().fit, &search.tried[best].fit]),
        outliers(
            &search.test,
            [&search.tried[0], &search.tried[best]].map(|j| j.held.as_ref().unwrap_or(&j.fit)),
        ),
    ];
    search.train = without(&search.train, &outliers[0]);
    search.test = without(&search.test, &outliers[1]);
    for i in [0, best] {
        let old = &search.tried[i].fit;
        let again = fit(&search.train, &old.hypothesis, &old.theta, &[]);
        let held = fit_starts(&search.test, &again.hypothesis, &again.theta);
        search.tried[i] = Judged { fit: again, held: Some(held) };
    }

    progress(Progress::Adequacy);
    let tests = adequacy::tests(&search, &search.tried[best].fit, &rejected);
    let named = !search.tried[best].kinds().is_empty();
    let verdict = match (named, tests.pass) {
        (false, true) => Verdict::NothingToAdd,
        (true, true) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
        (false, false) => Verdict::Unknown,
    };

    progress(Progress::Errors);
    let plain = Hypothesis::new(model, &[]);
    let nominal = plain.start();
    let fits = [&search.tried[0].fit, &search.tried[best].fit];
    let models =
        [(&plain, &nominal), (&fits[0].hypothesis, &fits[0].theta), (&fits[1].hypothesis, &fits[1].theta)];
    let (windows, horizons) = forecast_windows(&measured, &search.test, &outliers[1]);
    let lists = models.map(|(h, theta)| forecast::errors(&measured, &windows, h, theta, Counted::All));
    let floor = forecast::floor(&measured, &windows, models[2].0, models[2].1, options.seed);
    let heldout_gain = {
        let cost = |i: usize| search.tried[i].held.as_ref().map_or(0.0, |f| f.cost(&search.test));
        0.5 * (cost(0) - cost(best)) / search.dispersion
    };
    let table = |of: fn(&Squares) -> f64, scale: f64, unit: &str| {
        error_table(
            &windows,
            &lists,
            &floor,
            of,
            scale,
            unit,
            options.seed,
            measured.test.len(),
            heldout_gain,
        )
    };
    let error = table(|s| s.position, 1.0, "m");
    let rotation = table(|s| s.rotation, 1f64.to_degrees(), "deg");
    let horizons = horizons
        .into_iter()
        .map(|(horizon_s, windows)| {
            let ends = models.map(|(h, t)| forecast::errors(&measured, &windows, h, t, Counted::Last));
            let rows = |of: fn(&Squares) -> f64, scale: f64| {
                [0, 1, 2].map(|i| forecast::row(&windows, &ends[i], of, scale, options.seed))
            };
            let position = |s: &Squares| s.position;
            Horizon {
                horizon_s,
                windows: windows.len(),
                position_m: rows(|s| s.position, 1.0),
                reduction_m: Rmse {
                    rmse: forecast::rmse(&ends[1], position) - forecast::rmse(&ends[2], position),
                    ci95: forecast::bootstrap(&windows, &[&ends[1], &ends[2]], position, options.seed, |r| {
                        r[0] - r[1]
                    }),
                },
                rotation_deg: rows(|s| s.rotation, 1f64.to_degrees()),
            }
        })
        .collect();

    // The answer's numbers come from all windows.
    let everything = Sample {
        windows: [&search.train.windows[..], &search.test.windows[..]].concat(),
        ..search.train.clone()
    };
    let again = |f: &Fit| fit(&everything, &f.hypothesis, &f.theta, &[]);
    let (calibrated, last) = (again(fits[0]), again(fits[1]));
    let residual_anatomy = anatomy(&everything, &calibrated, &last);
    Ok(report(Parts {
        model,
        search: &search,
        ranking,
        everything: &everything,
        full: &last,
        tests,
        verdict,
        error,
        rotation,
        horizons,
        outliers: outliers.map(|o| o.iter().filter(|x| **x).count()),
        anatomy: residual_anatomy,
        seconds: begun.elapsed().as_secs_f64(),
    }))
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
    let search = start(model, &measured, None);
    let kinds: Vec<&'static str> = kinds.iter().filter_map(|k| Some(spec_of(k)?.kind)).collect();
    let mut now = search.base().fit.clone();
    for (i, _) in kinds.iter().enumerate() {
        let scored = search.scores(&now).into_iter().find(|s| s.kind == kinds[i]);
        now = search.refit(&now, &kinds[..=i], scored.as_ref().map(|s| &s.theta[..])).fit;
    }
    let nothing = vec![false; search.test.windows.len()];
    let (windows, _) = forecast_windows(&measured, &search.test, &nothing);
    let errors = forecast::errors(&measured, &windows, &now.hypothesis, &now.theta, Counted::All);
    let gain = search.base().fit.cost(&search.train) - now.cost(&search.train);
    Ok(Assessment { gain, penalty: search.penalty(&kinds), rmse_m: forecast::rmse(&errors, |s| s.position) })
}

/// Windows of some pushes.
fn sample<'a>(measured: &'a Measured, chosen: &[usize]) -> Sample<'a> {
    let windows = chosen.iter().flat_map(|&i| measured.records[i].windows(i)).collect();
    Sample { data: measured, windows, bend: f64::INFINITY }
}

fn start<'a>(model: &'a PushModel, measured: &'a Measured, from: Option<&Search<'_>>) -> Search<'a> {
    Search::new(model, sample(measured, &measured.train), sample(measured, &measured.test), from)
}

/// A search on a part of the pushes for training, which finds what is large; none where there are not many.
fn few<'a>(model: &'a PushModel, measured: &'a Measured, told: &mut dyn FnMut()) -> Option<Search<'a>> {
    let stride = measured.train.len() / FEW;
    if stride < 2 {
        return None;
    }
    let chosen: Vec<usize> = measured.train.iter().copied().step_by(stride).collect();
    let mut search = Search::new(model, sample(measured, &chosen), sample(measured, &[]), None);
    search.explore(told);
    Some(search)
}

/// A sample without the windows marked.
fn without<'a>(sample: &Sample<'a>, out: &[bool]) -> Sample<'a> {
    let windows = sample.windows.iter().zip(out).filter(|(_, o)| !**o).map(|(w, _)| *w).collect();
    Sample { windows, ..sample.clone() }
}

/// Windows that both fits leave beyond the bend.
fn outliers(sample: &Sample<'_>, fits: [&Fit; 2]) -> Vec<bool> {
    let beyond = |f: &Fit, i: usize| f.pieces[i].q > sample.bend * f.pieces[i].m as f64;
    (0..sample.windows.len()).map(|i| fits.iter().all(|f| beyond(f, i))).collect()
}

/// Held-out windows of forecasts, and those of each horizon that is shorter than the pushes; none that overlap a window left
/// out.
fn forecast_windows(
    data: &Measured,
    test: &Sample<'_>,
    out: &[bool],
) -> (Vec<Window>, Vec<(f64, Vec<Window>)>) {
    // After outliers are removed the lists differ in length: then nothing is flagged that is still there.
    let used = |w: &Window| {
        let r = &data.records[w.record];
        let covered: usize = test
            .windows
            .iter()
            .zip(out.iter().chain(std::iter::repeat(&false)))
            .filter(|(v, o)| (test.windows.len() != out.len() || !**o) && v.record == w.record)
            .map(|(v, _)| {
                let (a, b) = (v.first.max(w.first), v.last.min(w.last));
                (b + 1).saturating_sub(a)
            })
            .sum();
        let n = w.last - w.first + 1;
        // Windows of fits leave out nothing but outliers and remainders of a sample or two.
        r.time.len() >= 2 && covered + 3 >= n
    };
    let cut = |horizon: f64| -> Vec<Window> {
        let all = data.test.iter().flat_map(|&i| data.records[i].horizons(i, horizon));
        all.filter(|w| used(w)).collect()
    };
    let mut windows = Vec::new();
    for &i in &data.test {
        let r = &data.records[i];
        if r.length() <= WHOLE_M {
            windows.push(Window { record: i, first: 0, last: r.time.len() - 1 });
        } else {
            windows.extend(r.horizons(i, HORIZONS_S[1]));
        }
    }
    windows.retain(|w| used(w));
    let horizons = HORIZONS_S.map(|h| (h, cut(h))).into_iter().filter(|(_, w)| w.len() >= 3).collect();
    (windows, horizons)
}

#[expect(clippy::too_many_arguments, reason = "one table, made twice")]
fn error_table(
    windows: &[Window],
    lists: &[Vec<Squares>; 3],
    floor: &[Squares],
    of: fn(&Squares) -> f64,
    scale: f64,
    unit: &str,
    seed: u64,
    heldout_trajectories: usize,
    heldout_gain: f64,
) -> ErrorTable {
    let row = |list: &[Squares]| forecast::row(windows, list, of, scale, seed);
    let squares = [&lists[1][..], &lists[2][..], floor].map(|l| forecast::rmse(l, of).powi(2));
    let removable = squares[0] - squares[2];
    ErrorTable {
        unit: unit.into(),
        heldout_trajectories,
        folds: None,
        declared: row(&lists[0]),
        calibrated: row(&lists[1]),
        augmented: row(&lists[2]),
        noise_floor: row(floor),
        reduction: Rmse {
            rmse: scale * (squares[0].sqrt() - squares[1].sqrt()),
            ci95: forecast::bootstrap(windows, &[&lists[1], &lists[2]], of, seed, |r| r[0] - r[1])
                .map(|v| scale * v),
        },
        explained_share: (removable > 0.02 * squares[2]).then(|| (squares[0] - squares[1]) / removable),
        heldout_gain,
    }
}
