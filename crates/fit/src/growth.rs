//! Calibration by multiple shooting over growing windows.
//!
//! Over short windows the cost has few local minima, because every window starts close to the data; long
//! windows determine small parameters more precisely. The fit therefore begins with short windows and doubles
//! them for as long as the model follows the data.

use crate::identifiability::Information;
use crate::lengths::select_window_length;
use crate::minima::best_of_multistart;
use crate::outcome::{Calibration, CalibrationError, Stage};
use crate::steps::{COARSE_TOLERANCE, FINAL_TOLERANCE, Fit, ReducedEquations, StartingPoint};
use crate::windows::{NEGLIGIBLE_RMSE, Problem, ShootingWindow, merge_pairs};
use augsim_system::{Record, Simulate};
use std::time::Instant;

/// Growth of the RMSE on doubling the window length above which the model no longer follows the data.
///
/// White measurement noise does not grow; the effect of white process noise in a force on a position grows by
/// 2.8.
const MAX_RMSE_GROWTH: f64 = 4.0;
/// Number of windows below which simulations are inefficient, because few SIMD lanes are in use.
///
/// Before the number of windows falls below it, the fits to the lengths so far are compared, to decide whether
/// longer windows can improve the result.
const MIN_EFFICIENT_WINDOWS: usize = 64;
/// Number of successive window lengths with worse predictions than a shorter one after which growth stops.
const MAX_WORSE_LENGTHS: usize = 3;
/// Reason that is reported for shorter windows than the data allow if the deadline has passed.
const TIME_LIMIT: &str = "the time limit was reached";

/// Calibrates the free parameters of a system on prepared records.
///
/// `records` contain the shortest windows that are fitted. `longest_s` is the longest duration to which
/// windows may grow, in seconds; `None` chooses the length by comparing predictions. When the deadline
/// `until` passes, the fit to the longest windows so far is returned.
///
/// # Errors
/// [`CalibrationError`]: nothing was measured, or the declared model cannot be simulated over its shortest
/// windows.
pub fn calibrate(
    system: &dyn Simulate,
    records: &[Record],
    longest_s: Option<f64>,
    until: Option<Instant>,
) -> Result<Calibration, CalibrationError> {
    let is_measured = |r: &Record| r.values.iter().flatten().any(|v| v.is_finite());
    if !records.iter().any(is_measured) {
        return Err(CalibrationError::NothingMeasured);
    }
    let problem = Problem { until, ..Problem::new(system, records, true) };
    let channel_sd = problem.channel_sd();
    let nominal: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let mut windows = problem.prepared_windows();
    let start = StartingPoint { values: &nominal, windows: &windows, scales: &channel_sd };
    let declared_fit = problem.fit(&start, COARSE_TOLERANCE).map_err(CalibrationError::Simulation)?;
    let first = best_of_multistart(&problem, &windows, declared_fit);
    let mut stages = vec![stage(&problem, &first)];
    let mut fits = vec![first];
    let mut stopped = None;
    // With a given longest duration the caller has chosen the length.
    let compares_lengths = longest_s.is_none() && !problem.free_parameters.is_empty();
    let mut early_choice = None;
    loop {
        let current = &fits[fits.len() - 1];
        windows = merge_pairs(&current.windows);
        let duration_s = stages.last().map_or(0.0, |stage| stage.window_s);
        let is_too_long = longest_s.is_some_and(|longest| 2.0 * duration_s > longest);
        if windows.len() == current.windows.len() || is_too_long {
            break;
        }
        if problem.is_over() {
            stopped = Some(TIME_LIMIT);
            break;
        }
        let is_due = fits.len() > MAX_WORSE_LENGTHS && windows.len() < MIN_EFFICIENT_WINDOWS;
        if compares_lengths && early_choice.is_none() && is_due {
            let choice = select_window_length(&problem, &fits, &channel_sd);
            early_choice = Some(choice);
            if choice + MAX_WORSE_LENGTHS < fits.len() {
                break;
            }
        }
        let start = StartingPoint { values: &current.values, windows: &windows, scales: &channel_sd };
        let Ok(longer) = problem.fit(&start, COARSE_TOLERANCE) else {
            stopped = Some("longer windows cannot be simulated");
            break;
        };
        if problem.is_over() {
            // The fit was cut short, so it is no better than the one it started from.
            stopped = Some(TIME_LIMIT);
            break;
        }
        let longer_stage = stage(&problem, &longer);
        if rmse_growth(&longer_stage, &stages[stages.len() - 1], &channel_sd) > MAX_RMSE_GROWTH {
            stopped = Some("over longer windows the model no longer follows the data");
            break;
        }
        stages.push(longer_stage);
        fits.push(longer);
    }
    let last = fits.len() - 1;
    let chosen = match early_choice.filter(|choice| choice + MAX_WORSE_LENGTHS < fits.len()) {
        Some(choice) => choice,
        None if compares_lengths && !problem.is_over() => select_window_length(&problem, &fits, &channel_sd),
        None => last,
    };
    if chosen < last {
        stopped = Some("over longer windows the parameters compensate for what the model lacks");
    }
    stages.truncate(chosen + 1);
    let best = refined(&problem, fits.swap_remove(chosen), &mut stages[chosen]);
    Ok(calibration(&problem, best, stages, stopped))
}

/// Refits the parameters of the chosen window length, so far fitted to the coarse tolerance, to the final
/// tolerance.
fn refined(problem: &Problem<'_>, coarse: Fit, of: &mut Stage) -> Fit {
    let start = StartingPoint { values: &coarse.values, windows: &coarse.windows, scales: &coarse.scales };
    if problem.is_over() {
        return coarse;
    }
    let Ok(fit) = problem.fit(&start, FINAL_TOLERANCE) else { return coarse };
    *of = stage(problem, &fit);
    fit
}

/// Largest factor, over the channels, by which the RMSE grows from the shorter to the longer windows.
fn rmse_growth(longer: &Stage, shorter: &Stage, channel_sd: &[f64]) -> f64 {
    let channels = longer.rmse.iter().zip(&shorter.rmse).zip(channel_sd);
    channels.map(|((longer, shorter), sd)| longer / shorter.max(NEGLIGIBLE_RMSE * sd)).fold(0.0, f64::max)
}

/// Summarises the fit over windows of one length: durations, RMSE, residual noise and steps.
fn stage(problem: &Problem<'_>, fit: &Fit) -> Stage {
    let duration = |w: &ShootingWindow| {
        let times = &problem.records[w.record].times;
        times[w.samples.end - 1] - times[w.samples.start]
    };
    let mut durations: Vec<f64> = fit.windows.iter().map(duration).collect();
    durations.sort_by(f64::total_cmp);
    let rms = fit.normal.rmse(problem.schema().channels.len());
    let count = fit.normal.count() as f64;
    let unknowns = problem.free_parameters.len() + problem.free_states.len() * fit.windows.len();
    let degrees_of_freedom = (count - unknowns as f64).max(1.0);
    Stage {
        window_s: durations.get(durations.len() / 2).copied().unwrap_or(0.0),
        windows: fit.windows.len(),
        noise: rms.iter().map(|rms| rms * (count / degrees_of_freedom).sqrt()).collect(),
        rmse: rms,
        steps: fit.steps,
        converged: fit.converged,
    }
}

/// Assembles the result from the final fit: values, standard errors, initial states, and gauges (parameters
/// of which only combinations are identifiable).
///
/// The initial states have the covariance σ² C_i⁻¹ at fixed parameters, with C_i of formula (2) in
/// `normal.rs`.
fn calibration(
    problem: &Problem<'_>,
    fit: Fit,
    stages: Vec<Stage>,
    stopped: Option<&'static str>,
) -> Calibration {
    let (p, n) = (problem.free_parameters.len(), problem.free_states.len());
    let declared = problem.system.parameters();
    let count = fit.normal.count() as f64;
    let unknowns = (p + n * fit.windows.len()) as f64;
    // Correlated residuals carry less information: with a lag-one autocorrelation ρ the variance of a mean
    // grows by (1 + ρ) / (1 - ρ).
    let rho = fit.normal.autocorrelation();
    let variance = fit.normal.cost / (count - unknowns).max(1.0) * (1.0 + rho) / (1.0 - rho);
    let mut standard_errors = vec![None; declared.len()];
    let mut starts: Vec<(Vec<f64>, Vec<f64>)> = problem
        .records
        .iter()
        .map(|r| r.windows.first().map(|w| w.start.clone()).unwrap_or_default())
        .map(|start| (start.clone(), vec![0.0; start.len()]))
        .collect();
    let information = Information::of_fit(problem, &fit, variance);
    let mut covariance = vec![vec![0.0; declared.len()]; declared.len()];
    if let Some(information) = &information {
        for (i, row) in problem.free_parameters.iter().zip(&information.covariance) {
            problem.free_parameters.iter().zip(row).for_each(|(j, value)| covariance[*i][*j] = *value);
        }
        for (parameter, error) in problem.free_parameters.iter().zip(&information.standard_errors) {
            standard_errors[*parameter] = Some(*error);
        }
    }
    if let Some(reduced) = ReducedEquations::eliminate_states(problem, &fit.normal, 0.0) {
        for (window, inverse) in fit.windows.iter().zip(&reduced.state_inverses) {
            if window.samples.start == 0 {
                let (start, errors) = &mut starts[window.record];
                start.clone_from(&window.initial_state);
                for (k, state) in problem.free_states.iter().enumerate() {
                    errors[*state] = (variance * inverse[(k, k)]).sqrt();
                }
            }
        }
    }
    let gauges = information.and_then(|i| i.gauge(problem, &fit.values)).into_iter().collect();
    let at_bound = declared
        .iter()
        .zip(&fit.values)
        .map(|(p, value)| !p.frozen && (*value <= p.min || *value >= p.max))
        .collect();
    Calibration {
        values: fit.values,
        standard_errors,
        covariance,
        at_bound,
        initial_states: starts,
        stages,
        stopped,
        gauges,
        groups: Vec::new(),
    }
}
