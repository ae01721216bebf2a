//! Calibration of an equation model: input interpolation (hold), parameters, initial states.

use augsim_data::digits;
use augsim_equations::model::{Covariance, Hold};
use augsim_equations::{EquationSystem, Model};
use augsim_fit::{Calibration, Gauge, PerGroup, calibrate};
use augsim_system::{NORMAL_95, Prepare, Record, Simulate};
use std::path::PathBuf;
use std::time::Instant;
use thiserror::Error;

/// Length of the shortest windows of a fit, in time constants of the fastest mode.
const MIN_WINDOW_TIME_CONSTANTS: f64 = 2.0;
/// Number of windows of a fit of a model without states: enough to fill the lanes of a few threads.
const STATELESS_WINDOWS: f64 = 128.0;
/// Minimum number of samples of the shortest windows of a fit.
///
/// From fewer samples the initial states could not be estimated against the noise.
const MIN_WINDOW_SAMPLES: f64 = 10.0;
/// Number of times the shortest windows are at most doubled when input interpolations are compared.
const HOLD_WINDOW_DOUBLINGS: i32 = 4;
/// Maximum number of fits of a model, each with finer integration steps than the one before.
const MAX_STEP_ROUNDS: usize = 4;
/// Reason that is reported if the time limit passed before a fit could be repeated with the finer steps that it needs.
const TIME_WITHOUT_FINER_STEPS: &str = "the time limit was reached before the fit was repeated with finer integration steps, so its values can be off";
/// Relative difference of residual norms above which a better-fitting input interpolation is reported.
pub const MIN_REPORTED_DIFFERENCE: f64 = 0.05;

/// Error: the time limit passed before the model was calibrated, so that there is no result.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "--time-limit: the time passed before {}; allow more time, or use fewer samples or records",
    match calibrated {
        Some(file) => format!("there was a result; the calibrated model was written to {}", file.display()),
        None => "the model was calibrated, so nothing was written".to_owned(),
    }
)]
pub struct OutOfTime {
    /// Path of the calibrated model file; `None` if it was not written.
    pub calibrated: Option<PathBuf>,
}

/// An equation model calibrated on records, with the details of the fit.
#[derive(Debug)]
pub struct Fitted {
    /// The model with the calibrated values and the chosen input interpolation.
    pub model: Model,
    /// Parameter values, standard errors and windows of the fit.
    pub calibration: Calibration,
    /// Residual norm with each input interpolation that was tried, relative to the best.
    pub holds: Vec<(Hold, f64)>,
    /// Number of integration steps per sample interval.
    pub substeps: usize,
}

/// Calibrates an equation model on records: input interpolation, parameters and initial states.
///
/// If the model does not declare the interpolation of its inputs, each is tried, and the one with the
/// smallest residual over equal windows is chosen. After `until` the best values so far are returned.
///
/// # Errors
/// The declared model cannot be compiled, or cannot be simulated over the shortest windows.
pub fn fit(model: &Model, records: &[Record], until: Option<Instant>) -> anyhow::Result<Fitted> {
    fit_with_holds(model, records, until).map_err(|error| match slow_clock(model, records) {
        Some(cause) if !names_clock(&error) => error.context(cause),
        _ => error,
    })
}

/// Whether an error message names the unit of time already.
fn names_clock(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| cause.to_string().contains("unit of time"))
}

/// Sentence on a probable cause of a failed fit: samples further apart than the fastest time constant.
fn slow_clock(model: &Model, records: &[Record]) -> Option<String> {
    let (constant_s, step_s) = (fastest_time_constant_s(model, records)?, shortest_step_s(records));
    (constant_s < step_s).then(|| {
        format!(
            "the samples are {} s apart, but the fastest time constant of the declared model is {} s: check the unit of time, which --time COLUMN:UNIT \
             names, and the nominal values",
            digits(step_s),
            digits(constant_s)
        )
    })
}

fn fit_with_holds(model: &Model, records: &[Record], until: Option<Instant>) -> anyhow::Result<Fitted> {
    let ChosenHold { mut model, holds, calibration } = choose_hold(model, records, until)?;
    let (calibration, substeps) = match calibration {
        // There is no time left for another fit.
        Some(calibrated) if is_past(until) => calibrated,
        _ => with_hold(&model, records, None, until)?,
    };
    write_values(&mut model, &calibration);
    Ok(Fitted { model, calibration, holds, substeps })
}

/// Chooses the input interpolation (zero, linear or spline hold) with the smallest residual norm.
///
/// Residuals are compared over the longest windows that all candidates reached.
///
/// The residual norm is the geometric mean of the RMS residuals of the outputs.
fn choose_hold(model: &Model, records: &[Record], until: Option<Instant>) -> anyhow::Result<ChosenHold> {
    if model.inputs.iter().all(|input| input.hold.is_some()) {
        return Ok(ChosenHold { model: model.clone(), holds: Vec::new(), calibration: None });
    }
    let mut tried: Vec<(Hold, Model, Calibration, usize)> = Vec::new();
    for hold in [Hold::Zero, Hold::Linear, Hold::Spline] {
        if is_past(until) && !tried.is_empty() {
            break;
        }
        let mut model = model.clone();
        model.inputs.iter_mut().for_each(|input| input.hold = input.hold.or(Some(hold)));
        let (calibration, substeps) = with_hold(&model, records, Some(HOLD_WINDOW_DOUBLINGS), until)?;
        tried.push((hold, model, calibration, substeps));
    }
    let stage = tried.iter().map(|(_, _, c, _)| c.stages.len()).min().unwrap_or(1).saturating_sub(1);
    let outputs = model.outputs.len().max(1) as f64;
    let log_residual = |c: &Calibration| c.stages[stage].rmse.iter().map(|r| r.ln()).sum::<f64>() / outputs;
    let smallest = tried.iter().map(|(_, _, c, _)| log_residual(c)).fold(f64::INFINITY, f64::min);
    let holds = tried.iter().map(|(hold, _, c, _)| (*hold, (log_residual(c) - smallest).exp())).collect();
    let best = tried.into_iter().min_by(|a, b| log_residual(&a.2).total_cmp(&log_residual(&b.2)));
    Ok(match best {
        Some((_, model, calibration, substeps)) => {
            ChosenHold { model, holds, calibration: Some((calibration, substeps)) }
        }
        None => ChosenHold { model: model.clone(), holds, calibration: None },
    })
}

/// The model with the chosen input interpolation, and its fit.
struct ChosenHold {
    model: Model,
    /// Residual norm with each input interpolation that was tried, relative to the best.
    holds: Vec<(Hold, f64)>,
    /// Fit with the chosen interpolation, and its integration steps per sample interval; `None` if no other was tried.
    calibration: Option<(Calibration, usize)>,
}

/// Fits a model to the shortest windows; returns the RMS residual of each output.
///
/// Inputs are linear between samples unless the model declares otherwise.
///
/// # Errors
/// As [`fit`].
pub(super) fn short_fit(model: &Model, records: &[Record]) -> anyhow::Result<Vec<f64>> {
    let mut model = model.clone();
    model.inputs.iter_mut().for_each(|input| input.hold = input.hold.or(Some(Hold::Linear)));
    let (tuned, short_windows) = tuned_on_short_windows(&model, records)?;
    Ok(calibrate_tuned(tuned, &short_windows, records, Some(0), None)?.rmse().to_vec())
}

/// Whether the deadline `until` has passed; false without one.
fn is_past(until: Option<Instant>) -> bool {
    until.is_some_and(|until| Instant::now() >= until)
}

/// Calibrates a model whose input interpolation is chosen.
///
/// Also returns the integration steps per sample interval.
///
/// Steps are chosen at the declared values. If the calibrated values need finer steps or another method, the fit is
/// repeated with them, so that the result does not depend on the step, unless the deadline `until` has passed. `doublings`
/// bounds the length of the windows.
///
/// # Errors
/// The model cannot be simulated, or the calibrated values need finer steps after each of [`MAX_STEP_ROUNDS`] fits.
fn with_hold(
    model: &Model,
    records: &[Record],
    doublings: Option<i32>,
    until: Option<Instant>,
) -> anyhow::Result<(Calibration, usize)> {
    let (mut tuned, short_windows) = tuned_on_short_windows(model, records)?;
    for _ in 0..MAX_STEP_ROUNDS {
        let calibration = calibrate_tuned(tuned.clone(), &short_windows, records, doublings, until)?;
        let mut found = model.clone();
        found.parameters.iter_mut().zip(&calibration.values).for_each(|(p, value)| p.nominal = *value);
        write_group_values(&mut found, &calibration);
        let (checked, _) = tuned_on_short_windows(&found, records)?;
        let (used, needed) = (tuned.options(), checked.options());
        if needed.method == used.method && needed.substeps <= used.substeps {
            return Ok((calibration, used.substeps));
        }
        if is_past(until) {
            // The best so far, which the report says to be unfinished.
            return Ok((
                Calibration { stopped: Some(TIME_WITHOUT_FINER_STEPS), ..calibration },
                used.substeps,
            ));
        }
        tuned = tuned.with_options(needed.clone());
    }
    Err(TooFast { step_s: shortest_step_s(records) }.into())
}

/// Error: after each of [`MAX_STEP_ROUNDS`] fits the calibrated values needed finer integration steps.
#[derive(Debug, Error)]
#[error(
    "the fitted values make the model ever faster than the data, whose samples are {} s apart: each fit needs finer integration steps than the one \
     before; check the unit of time, which --time COLUMN:UNIT names, and whether the bounds of the parameters in the model file contain the true values; \
     if both are right, declare integrator = \"implicit\" under [numerics]",
    digits(*step_s)
)]
struct TooFast {
    step_s: f64,
}

/// Chooses integration steps and smoothing widths on short windows all over the records.
///
/// Returns the system with these settings, and the windows.
fn tuned_on_short_windows(
    model: &Model,
    records: &[Record],
) -> anyhow::Result<(EquationSystem, Vec<Record>)> {
    let window_s = 10.0 * MIN_WINDOW_SAMPLES * shortest_step_s(records);
    let system = EquationSystem::declared_only(model)?.with_group_values().with_windows(Some(window_s));
    let short_windows = prepare_records(&system, records)?;
    Ok((system.tuned(&short_windows)?, short_windows))
}

/// Calibrates a system with chosen integration steps, from windows of a few time constants to longer ones.
fn calibrate_tuned(
    system: EquationSystem,
    short_windows: &[Record],
    records: &[Record],
    doublings: Option<i32>,
    until: Option<Instant>,
) -> anyhow::Result<Calibration> {
    let time_constant_s = system.fastest_time_constant_s(short_windows).unwrap_or(0.0);
    let shortest_s = MIN_WINDOW_SAMPLES * shortest_step_s(records);
    let mut window_s = (MIN_WINDOW_TIME_CONSTANTS * time_constant_s).max(shortest_s);
    let mut longest_s = doublings.map(|n| window_s * 2.0_f64.powi(n));
    if system.model().states.is_empty() {
        // Without states nothing grows along a window: windows only share the work.
        let whole_s: f64 = records.iter().filter_map(|r| Some(r.times.last()? - r.times.first()?)).sum();
        window_s = (whole_s / STATELESS_WINDOWS).max(shortest_s);
        longest_s = Some(window_s);
    }
    let system = system.with_windows(Some(window_s)).without_group_values();
    let records = prepare_records(&system, records)?;
    let parameters = system.model().parameters.iter().enumerate();
    let by_group: Vec<usize> = parameters.filter(|(_, p)| p.by_group.is_some()).map(|(i, _)| i).collect();
    if by_group.is_empty() {
        return Ok(calibrate(&system, &records, longest_s, until)?);
    }
    let per_group = PerGroup::new(&system, &by_group, &system.model().group_names(), &records);
    Ok(per_group.collected(calibrate(&per_group, &records, longest_s, until)?))
}

/// Writes the calibrated values of parameters with values by group into the model.
fn write_group_values(model: &mut Model, calibration: &Calibration) {
    let names = model.group_names();
    for found in &calibration.groups {
        if let Some(by_group) = &mut model.parameters[found.parameter].by_group {
            by_group.values = names.iter().cloned().zip(found.values.iter().copied()).collect();
        }
    }
}

/// Time constant of the fastest mode of a model over these records, s; `None` if it cannot be computed.
pub(super) fn fastest_time_constant_s(model: &Model, records: &[Record]) -> Option<f64> {
    let system = EquationSystem::declared_only(model).ok()?;
    let records = prepare_records(&system, records).ok()?;
    system.fastest_time_constant_s(&records)
}

/// The shortest typical sample interval of the records, s.
pub(super) fn shortest_step_s(records: &[Record]) -> f64 {
    records.iter().map(Record::typical_step).fold(f64::INFINITY, f64::min)
}

/// Copies records and prepares the copies by a system: cuts them into windows, with initial guesses.
///
/// # Errors
/// A record cannot be prepared, e.g. because it has no samples.
pub fn prepare_records(system: &EquationSystem, records: &[Record]) -> anyhow::Result<Vec<Record>> {
    let mut records = records.to_vec();
    let noise = vec![1.0; system.schema().channels.len()];
    for record in &mut records {
        system.prepare(record, &noise)?;
    }
    Ok(records)
}

/// Writes calibrated values, intervals and shared initial states into the model.
fn write_values(model: &mut Model, calibration: &Calibration) {
    let found = calibration.values.iter().zip(&calibration.standard_errors);
    for (index, (p, (value, error))) in model.parameters.iter_mut().zip(found).enumerate() {
        if p.frozen {
            continue;
        }
        let in_gauge = calibration.gauges.iter().any(|g| g.parameters.contains(&index));
        p.nominal = *value;
        p.ci95 = error
            .filter(|e| e.is_finite() && *e > 0.0 && !in_gauge && !calibration.at_bound[index])
            .map(|error| [value - NORMAL_95 * error, value + NORMAL_95 * error])
            // Values beyond the bounds are excluded by the model file; an interval that fills them says nothing.
            .map(|[low, high]| [low.max(p.min), high.min(p.max)])
            .filter(|[low, high]| *low > p.min || *high < p.max)
            // With noise-free data the interval may have zero width, which a model file cannot state.
            .filter(|[low, high]| low < high);
    }
    write_group_values(model, calibration);
    let known: Vec<usize> = (0..model.parameters.len()).filter(|i| has_fitted_interval(model, *i)).collect();
    let row = |i: &usize| known.iter().map(|j| calibration.covariance[*i][*j]).collect();
    let rows: Vec<Vec<f64>> = known.iter().map(row).collect();
    model.covariance = (!known.is_empty()).then_some(Covariance { parameters: known, rows });
    write_shared_starts(model, calibration);
}

/// Whether the parameter with this index is estimated and has a confidence interval.
fn has_fitted_interval(model: &Model, index: usize) -> bool {
    !model.parameters[index].frozen && model.parameters[index].ci95.is_some()
}

/// Writes the initial states shared by all trajectories into the model.
///
/// They are estimated with fixed parameters.
///
/// # Errors
/// The model cannot be compiled, or cannot be simulated over the shortest windows.
pub fn estimate_shared_starts(model: &mut Model, records: &[Record]) -> anyhow::Result<()> {
    if model.states.iter().any(|s| s.shared) {
        let mut frozen = model.clone();
        frozen.parameters.iter_mut().for_each(|p| p.frozen = true);
        write_shared_starts(model, &with_hold(&frozen, records, None, None)?.0);
    }
    Ok(())
}

fn write_shared_starts(model: &mut Model, calibration: &Calibration) {
    for (index, state) in model.states.iter_mut().enumerate().filter(|(_, s)| s.shared) {
        // Mean weighted by the inverse variance of each record's estimate.
        let starts =
            calibration.initial_states.iter().filter_map(|(x, e)| Some((*x.get(index)?, *e.get(index)?)));
        let known: Vec<(f64, f64)> = starts.filter(|(_, e)| *e > 0.0 && e.is_finite()).collect();
        let weight: f64 = known.iter().map(|(_, e)| 1.0 / (e * e)).sum();
        if weight > 0.0 {
            let mean = known.iter().map(|(x, e)| x / (e * e)).sum::<f64>() / weight;
            state.set_start(mean, (1.0 / weight).sqrt());
        }
    }
}

/// Sentence on a gauge (parameters that cannot be identified individually), with the remedy.
pub fn gauge_sentence(model: &Model, gauge: &Gauge) -> String {
    let remedy = if gauge.parameters.len() == 1 { "freeze it" } else { "freeze one" };
    format!("{}; {remedy}", gauge_finding(model, gauge))
}

/// Sentence that names the parameters of a gauge and says how many combinations of them are identifiable.
pub(super) fn gauge_finding(model: &Model, gauge: &Gauge) -> String {
    let names: Vec<String> = gauge
        .parameters
        .iter()
        .filter_map(|p| model.parameters.get(*p))
        .map(|p| format!("`{}`", p.name))
        .collect();
    let combinations = match gauge.combinations {
        0 => "no combination".to_owned(),
        1 => "only one combination".to_owned(),
        2 => "only two combinations".to_owned(),
        n => format!("only {n} combinations"),
    };
    let unmeasured: Vec<String> = model
        .states
        .iter()
        .filter(|s| !s.start.tree.symbols().any(|x| matches!(x, augsim_equations::text::Symbol::Output(_))))
        .map(|s| format!("`{}`", s.name))
        .collect();
    let scale = match &unmeasured[..] {
        [] => String::new(),
        [one] => format!(" (scale of the unmeasured state {one})"),
        many => format!(" (scale of the unmeasured states {})", many.join(", ")),
    };
    let parameters = if names.len() == 1 { "parameter" } else { "parameters" };
    format!("{parameters} {}: {combinations} can be identified{scale}", names.join(", "))
}
