//! Calibration of a written system: the hold of its inputs, its parameters and its starts.

use augsim_calibrate::{Calibration, Gauge, calibrate};
use augsim_physics::model::NORMAL_95;
use augsim_physics::system::{Record, System};
use augsim_written::model::Hold;
use augsim_written::{Model, WrittenSystem};

/// Shortest windows, in time constants of the fastest mode.
const SHORTEST: f64 = 2.0;
/// Samples that the shortest windows have at least: fewer could not tell the states of their start from noise.
const FEWEST_SAMPLES: f64 = 10.0;
/// Doublings of the shortest windows over which holds are compared.
const HOLD_WINDOWS: i32 = 4;
/// Share of the misfit by which another hold has to be better to be worth telling.
pub const TELLING: f64 = 0.05;

/// A calibrated model.
#[derive(Debug)]
pub struct Fitted {
    /// The model with the values that were found, and the hold of its inputs.
    pub model: Model,
    /// Values, errors and windows of the fit.
    pub calibration: Calibration,
    /// Misfit of every hold that was tried, in that of the best.
    pub holds: Vec<(Hold, f64)>,
    /// Steps of a sample interval.
    pub substeps: usize,
}

/// Calibrates a model. Where the model leaves the hold of inputs open, each is tried and the one with the smallest misfit
/// over equal windows is kept.
///
/// # Errors
/// The declared model cannot be compiled, or cannot be simulated over the shortest windows.
pub fn fit(model: &Model, records: &[Record]) -> anyhow::Result<Fitted> {
    let (mut model, holds) = choose_hold(model, records)?;
    let (calibration, substeps) = with_hold(&model, records, None)?;
    write_values(&mut model, &calibration);
    Ok(Fitted { model, calibration, holds, substeps })
}

/// The model with the hold of its inputs, and the misfit of each that was tried in that of the best: windows as long as
/// these tell one from another.
fn choose_hold(model: &Model, records: &[Record]) -> anyhow::Result<(Model, Vec<(Hold, f64)>)> {
    if model.inputs.iter().all(|input| input.hold.is_some()) {
        return Ok((model.clone(), Vec::new()));
    }
    let mut tried: Vec<(Hold, Model, Calibration)> = Vec::new();
    for hold in [Hold::Zero, Hold::Linear, Hold::Spline] {
        let mut model = model.clone();
        model.inputs.iter_mut().for_each(|input| input.hold = input.hold.or(Some(hold)));
        let (calibration, _) = with_hold(&model, records, Some(HOLD_WINDOWS))?;
        tried.push((hold, model, calibration));
    }
    let stage = tried.iter().map(|(_, _, c)| c.stages.len()).min().unwrap_or(1).saturating_sub(1);
    let outputs = model.outputs.len().max(1) as f64;
    let misfit = |c: &Calibration| c.stages[stage].rms.iter().map(|r| r.ln()).sum::<f64>() / outputs;
    let least = tried.iter().map(|(_, _, c)| misfit(c)).fold(f64::INFINITY, f64::min);
    let holds = tried.iter().map(|(hold, _, c)| (*hold, (misfit(c) - least).exp())).collect();
    let best = tried.into_iter().min_by(|a, b| misfit(&a.2).total_cmp(&misfit(&b.2)));
    Ok((best.map_or_else(|| model.clone(), |(_, model, _)| model), holds))
}

/// Calibration and steps of a model whose inputs have their holds; `doublings` bound the length of windows.
fn with_hold(
    model: &Model,
    records: &[Record],
    doublings: Option<i32>,
) -> anyhow::Result<(Calibration, usize)> {
    let system = WrittenSystem::declared_only(model)?;
    // Steps, widths and the time constant are looked at over windows of some samples at many places.
    let step = records.iter().map(Record::typical_step).fold(f64::INFINITY, f64::min);
    let system = system.with_windows(Some(10.0 * FEWEST_SAMPLES * step));
    let looked_at = prepared(&system, records)?;
    let system = system.tuned(&looked_at)?;
    let constant = system.fastest_s(&looked_at).unwrap_or(0.0);
    let window_s = (SHORTEST * constant).max(FEWEST_SAMPLES * step);
    let system = system.with_windows(Some(window_s));
    let records = prepared(&system, records)?;
    let longest_s = doublings.map(|n| window_s * 2.0_f64.powi(n));
    Ok((calibrate(&system, &records, longest_s)?, system.options().substeps))
}

/// Records prepared by a system.
///
/// # Errors
/// Nothing can be made of one of them.
pub fn prepared(system: &WrittenSystem, records: &[Record]) -> anyhow::Result<Vec<Record>> {
    let mut records = records.to_vec();
    let noise = vec![1.0; system.schema().channels.len()];
    for record in &mut records {
        system.prepare(record, &noise)?;
    }
    Ok(records)
}

/// Puts what was found into the model: values, intervals, and the start that all trajectories share.
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
            // Data without noise leave no interval that could be written.
            .filter(|[low, high]| low < high);
    }
    write_shared_starts(model, calibration);
}

/// Puts the start that all trajectories share into a model, from the starts of the records at the values of the model.
///
/// # Errors
/// The model cannot be compiled, or cannot be simulated over the shortest windows.
pub fn share_starts(model: &mut Model, records: &[Record]) -> anyhow::Result<()> {
    if model.states.iter().any(|s| s.shared) {
        let mut frozen = model.clone();
        frozen.parameters.iter_mut().for_each(|p| p.frozen = true);
        write_shared_starts(model, &with_hold(&frozen, records, None)?.0);
    }
    Ok(())
}

fn write_shared_starts(model: &mut Model, calibration: &Calibration) {
    for (index, state) in model.states.iter_mut().enumerate().filter(|(_, s)| s.shared) {
        // Weighted by what each record says of it.
        let starts = calibration.starts.iter().filter_map(|(x, e)| Some((*x.get(index)?, *e.get(index)?)));
        let known: Vec<(f64, f64)> = starts.filter(|(_, e)| *e > 0.0 && e.is_finite()).collect();
        let weight: f64 = known.iter().map(|(_, e)| 1.0 / (e * e)).sum();
        if weight > 0.0 {
            let mean = known.iter().map(|(x, e)| x / (e * e)).sum::<f64>() / weight;
            state.set_start(mean, (1.0 / weight).sqrt());
        }
    }
}

/// The sentence for parameters that cannot be found one by one, with the remedy.
pub fn gauge_sentence(model: &Model, gauge: &Gauge) -> String {
    let remedy = if gauge.parameters.len() == 1 { "freeze it" } else { "freeze one" };
    format!("{}; {remedy}", gauge_untold(model, gauge))
}

/// How many combinations can be found of parameters that cannot be found one by one, in words.
pub fn gauge_untold(model: &Model, gauge: &Gauge) -> String {
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
    let unseen: Vec<String> = model
        .states
        .iter()
        .filter(|s| !s.start.tree.symbols().any(|x| matches!(x, augsim_written::text::Symbol::Output(_))))
        .map(|s| format!("`{}`", s.name))
        .collect();
    let scale = match &unseen[..] {
        [] => String::new(),
        [one] => format!(" (scale of the unseen state {one})"),
        many => format!(" (scale of the unseen states {})", many.join(", ")),
    };
    let parameters = if names.len() == 1 { "parameter" } else { "parameters" };
    format!("{parameters} {}: {combinations} can be found{scale}", names.join(", "))
}
