//! Hidden states of added effects in the report: over a recording, and after a step of an input.

use super::fit::prepare_records;
use super::forecast::initial_state;
use crate::discovery_page::{HiddenState, StepResponse};
use augsim_equations::{EquationSystem, Model};
use augsim_system::{Offsets, Record, Simulate, Simulated, Stream, Task};
use std::sync::Arc;

/// Shares of the sorted samples of an input between which it steps: the quartiles.
const STEP_QUANTILES: [f64; 2] = [0.25, 0.75];

/// Computes the hidden states of all effects of a model over the first record.
///
/// Empty if no effect has a state.
///
/// # Errors
/// The record cannot be simulated.
pub fn hidden_states(augmented: &Model, list: &[Record], burn_in: usize) -> anyhow::Result<Vec<HiddenState>> {
    let first_hidden = augmented.declared_states();
    let Some(record) = list.first().filter(|_| first_hidden < augmented.states.len()) else {
        return Ok(Vec::new());
    };
    let states = states_along(augmented, record, burn_in)?;
    let input = widest_input(record);
    let step = match &input {
        Some((index, levels)) => {
            let stepped = with_step(record, *index, *levels);
            states_along(augmented, &stepped, burn_in).ok().map(|states| (*index, *levels, states))
        }
        None => None,
    };
    let middle = record.times.len() / 2;
    let mut out = Vec::new();
    for addition in &augmented.additions {
        for state in addition.states.clone() {
            let response = |(index, levels, along): &(usize, [f64; 2], Vec<Vec<f64>>)| StepResponse {
                input: augmented.inputs[*index].name.clone(),
                levels: *levels,
                t_s: record.times[middle..].iter().map(|t| t - record.times[middle]).collect(),
                values: along[state][middle..].to_vec(),
            };
            out.push(HiddenState {
                effect: addition.kind.clone(),
                name: addition.local_name(&augmented.states[state].name).to_owned(),
                trajectory: record.id.clone(),
                t_s: record.times.clone(),
                values: states[state].clone(),
                step: step.as_ref().map(response),
            });
        }
    }
    Ok(out)
}

/// Simulates all states of a model over a record, `[state][sample]`, from an initial state fitted to its first samples.
fn states_along(model: &Model, record: &Record, burn_in: usize) -> anyhow::Result<Vec<Vec<f64>>> {
    let system = EquationSystem::declared_only(model)?;
    let prepared = prepare_records(&system, std::slice::from_ref(record))?;
    let system = system.tuned(&prepared)?;
    let Some(record) = prepared.first() else { return Ok(vec![Vec::new(); model.states.len()]) };
    let values: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let start = system.complete_start(record, &initial_state(&system, model, record, &values, burn_in)?);
    let shown = system.with_states_as_channels()?;
    let window = 0..record.times.len();
    let task =
        Task { parameters: &values, record, window, start: &start, offsets: Offsets::None, seeds: &[] };
    let mut out = Simulated::default();
    shown.simulate(&task, &mut out)?;
    let first = model.outputs.len();
    let along = |state: usize| (0..out.samples()).map(|k| out.value(k, first + state)).collect();
    Ok((0..model.states.len()).map(along).collect())
}

/// Index of the input with the widest interquartile range relative to its largest value, and its quartiles.
fn widest_input(record: &Record) -> Option<(usize, [f64; 2])> {
    let quartiles = |stream: &Stream| {
        let mut values: Vec<f64> = stream.values.first()?.iter().copied().filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        Some(STEP_QUANTILES.map(|share| values[(share * last as f64).round() as usize]))
    };
    let width = |[low, high]: [f64; 2]| (high - low) / low.abs().max(high.abs()).max(f64::MIN_POSITIVE);
    let inputs = record.inputs.iter().enumerate().filter_map(|(i, stream)| Some((i, quartiles(stream)?)));
    inputs.filter(|(_, levels)| levels[1] > levels[0]).max_by(|a, b| width(a.1).total_cmp(&width(b.1)))
}

/// A record in which the input `stepped` steps in the middle, and all others keep their first value.
fn with_step(record: &Record, stepped: usize, levels: [f64; 2]) -> Record {
    let at = record.times[record.times.len() / 2];
    let mut out = record.clone();
    for (index, stream) in Arc::make_mut(&mut out.inputs).iter_mut().enumerate() {
        let times = stream.times.clone();
        for values in &mut stream.values {
            let first = values.first().copied().unwrap_or(0.0);
            for (value, time) in values.iter_mut().zip(&times) {
                *value = if index == stepped { levels[usize::from(*time >= at)] } else { first };
            }
        }
    }
    out
}
