//! Windows that grow: short ones forgive a wrong parameter, long ones tell small ones.

use crate::lengths::longest_that_forecasts_all;
use crate::minima::deepest;
use crate::outcome::{Calibration, CalibrationError, Gauge, Stage};
use crate::steps::{Begin, Fit, ROUGHLY_SETTLED, Reduced, SETTLED};
use crate::windows::{NEGLIGIBLE, Problem, Shot, doubled};
use augsim_linear::{Mat, SymmetricEigen, symmetric_eigen};
use augsim_physics::system::{Record, System};

/// Growth of the misfit from one length to its double beyond which the model no longer follows: sensor noise does not grow,
/// white noise of a force grows by 2.8 in a position, a lost fit by much more.
const LOST: f64 = 4.0;
/// Windows below which growing on is dear: a pass over few long ones keeps few lanes busy. Whether it is of any use is asked once
/// before.
const DEAR: usize = 64;
/// Lengths in a row that lose against a shorter one before no longer one is tried.
const LOSING: usize = 3;
/// Eigenvalues below this share of the largest, after scaling, are those of combinations that data do not tell.
const UNTOLD: f64 = 1e-9;

/// Calibrates the free parameters of a system on prepared records, whose windows are the shortest that are fitted.
/// `longest_s` bounds the length that they grow to.
///
/// # Errors
/// [`CalibrationError`]: nothing was measured, or the declared model cannot be simulated over its shortest windows.
pub fn calibrate(
    system: &dyn System,
    records: &[Record],
    longest_s: Option<f64>,
) -> Result<Calibration, CalibrationError> {
    let measured = |r: &Record| r.values.iter().flatten().any(|v| v.is_finite());
    if !records.iter().any(measured) {
        return Err(CalibrationError::NothingMeasured);
    }
    let problem = Problem::new(system, records, true);
    let spread = problem.spread();
    let nominal: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let mut shots = problem.shots();
    let begin = Begin { values: &nominal, shots: &shots, sd: &spread };
    let mut best = problem.fit(&begin, ROUGHLY_SETTLED).map_err(CalibrationError::Simulation)?;
    best = deepest(&problem, &shots, best);
    let mut stages = vec![stage(&problem, &best)];
    let mut fits = vec![best];
    let mut stopped = None;
    // Holds are compared over windows of a length that is given.
    let is_compared = longest_s.is_none() && !problem.free.is_empty();
    let mut asked = None;
    loop {
        let best = &fits[fits.len() - 1];
        shots = doubled(&best.shots);
        let last = stages.last().map_or(0.0, |stage| stage.window_s);
        if shots.len() == best.shots.len() || longest_s.is_some_and(|longest| 2.0 * last > longest) {
            break;
        }
        if is_compared && asked.is_none() && fits.len() > LOSING && shots.len() < DEAR {
            let kept = longest_that_forecasts_all(&problem, &fits, &spread);
            asked = Some(kept);
            if kept + LOSING < fits.len() {
                break;
            }
        }
        let begin = Begin { values: &best.values, shots: &shots, sd: &spread };
        let Ok(grown) = problem.fit(&begin, ROUGHLY_SETTLED) else {
            stopped = Some("longer windows cannot be simulated");
            break;
        };
        let next = stage(&problem, &grown);
        let last = &stages[stages.len() - 1].rms;
        let growth = next
            .rms
            .iter()
            .zip(last)
            .zip(&spread)
            .map(|((now, then), spread)| now / then.max(NEGLIGIBLE * spread));
        if growth.fold(0.0, f64::max) > LOST {
            stopped = Some("over longer windows the model does not follow the data");
            break;
        }
        stages.push(next);
        fits.push(grown);
    }
    let last = fits.len() - 1;
    let kept = match asked.filter(|kept| kept + LOSING < fits.len()) {
        Some(kept) => kept,
        None if is_compared => longest_that_forecasts_all(&problem, &fits, &spread),
        None => last,
    };
    if kept < last {
        stopped = Some("over longer windows the parameters make up for what the model lacks");
    }
    stages.truncate(kept + 1);
    let mut best = fits.swap_remove(kept);
    // The lengths on the way were fitted roughly; the one that counts is fitted to its end.
    let begin = Begin { values: &best.values, shots: &best.shots, sd: &best.sd };
    if let Ok(fit) = problem.fit(&begin, SETTLED) {
        best = fit;
        stages[kept] = stage(&problem, &best);
    }
    Ok(outcome(&problem, best, stages, stopped))
}

fn stage(problem: &Problem<'_>, fit: &Fit) -> Stage {
    let duration = |s: &Shot| {
        let times = &problem.records[s.record].times;
        times[s.samples.end - 1] - times[s.samples.start]
    };
    let mut durations: Vec<f64> = fit.shots.iter().map(duration).collect();
    durations.sort_by(f64::total_cmp);
    let rms = fit.normal.rms(problem.schema().channels.len());
    let count = fit.normal.count() as f64;
    let unknowns = problem.free.len() + problem.states.len() * fit.shots.len();
    let freedom = (count - unknowns as f64).max(1.0);
    Stage {
        window_s: durations.get(durations.len() / 2).copied().unwrap_or(0.0),
        windows: fit.shots.len(),
        noise: rms.iter().map(|rms| rms * (count / freedom).sqrt()).collect(),
        rms,
        steps: fit.steps,
        converged: fit.converged,
    }
}

/// Parameters that data alone do not tell one by one: what is known of starts beforehand would hide that a scale is free.
fn gauge(problem: &Problem<'_>, fit: &Fit) -> Option<Gauge> {
    let (p, n) = (problem.free.len(), problem.states.len());
    let mut normal = fit.normal.clone();
    for (part, shot) in normal.parts.iter_mut().zip(&fit.shots) {
        for (index, state) in problem.states.iter().enumerate() {
            if let Some((_, sd)) = problem.prior(shot, *state) {
                part.c[index * n + index] -= 1.0 / (sd * sd);
            }
        }
    }
    if p == 0 {
        return None;
    }
    let reduced = Reduced::of(problem, &normal, 0.0)?;
    let size = |i: usize| reduced.s[(i, i)].max(f64::MIN_POSITIVE).sqrt();
    let scaled = Mat::from_fn(p, p, |i, j| reduced.s[(i, j)] / (size(i) * size(j)));
    let SymmetricEigen { values, vectors } = symmetric_eigen(&scaled)?;
    let largest = (0..p).map(|k| values[k]).fold(0.0, f64::max);
    let untold: Vec<usize> = (0..p).filter(|k| values[*k] <= UNTOLD * largest).collect();
    if untold.is_empty() {
        return None;
    }
    let weight = |i: usize| untold.iter().map(|k| vectors[(i, *k)].powi(2)).sum::<f64>();
    let parameters: Vec<usize> = (0..p).filter(|i| weight(*i) > 0.01).collect();
    let combinations = parameters.len().saturating_sub(untold.len());
    Some(Gauge { parameters: parameters.into_iter().map(|i| problem.free[i]).collect(), combinations })
}

fn outcome(
    problem: &Problem<'_>,
    fit: Fit,
    stages: Vec<Stage>,
    stopped: Option<&'static str>,
) -> Calibration {
    let (p, n) = (problem.free.len(), problem.states.len());
    let declared = problem.system.parameters();
    let count = fit.normal.count() as f64;
    let unknowns = (p + n * fit.shots.len()) as f64;
    // Neighbours that miss alike are not so many witnesses.
    let rho = fit.normal.correlation();
    let variance = fit.normal.cost / (count - unknowns).max(1.0) * (1.0 + rho) / (1.0 - rho);
    let mut standard_errors = vec![None; declared.len()];
    let mut starts: Vec<(Vec<f64>, Vec<f64>)> = problem
        .records
        .iter()
        .map(|r| r.windows.first().map(|w| w.start.clone()).unwrap_or_default())
        .map(|start| (start.clone(), vec![0.0; start.len()]))
        .collect();
    if let Some(reduced) = Reduced::of(problem, &fit.normal, 0.0) {
        let size = |i: usize| reduced.s[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        let scaled = Mat::from_fn(p, p, |i, j| reduced.s[(i, j)] / (size(i) * size(j)));
        if p > 0
            && let Some(SymmetricEigen { values, vectors }) = symmetric_eigen(&scaled)
        {
            let largest = (0..p).map(|k| values[k]).fold(0.0, f64::max);
            let told: Vec<usize> = (0..p).filter(|k| values[*k] > UNTOLD * largest).collect();
            for i in 0..p {
                let sum: f64 = told.iter().map(|k| vectors[(i, *k)].powi(2) / values[*k]).sum();
                standard_errors[problem.free[i]] = Some((variance * sum).sqrt() / size(i));
            }
        }
        for (shot, inverse) in fit.shots.iter().zip(&reduced.windows) {
            if shot.samples.start == 0 {
                let (start, errors) = &mut starts[shot.record];
                start.clone_from(&shot.start);
                for (k, state) in problem.states.iter().enumerate() {
                    errors[*state] = (variance * inverse[(k, k)]).sqrt();
                }
            }
        }
    }
    let gauges = gauge(problem, &fit).into_iter().collect();
    let at_bound = declared
        .iter()
        .zip(&fit.values)
        .map(|(p, value)| !p.frozen && (*value <= p.min || *value >= p.max))
        .collect();
    Calibration { values: fit.values, standard_errors, at_bound, starts, stages, stopped, gauges }
}
