//! Explanations from fitted model files, and fitted model files from explanations.

use super::fault::NextFault;
use super::source::Source;
use crate::Usage;
use crate::equations::fit::prepare_records;
use augsim_design::{Explanation, Noise, RateNoise, SensorNoise};
use augsim_equations::model::{Covariance, Hold};
use augsim_equations::{EquationSystem, Model};
use augsim_system::{NORMAL_95, Record, Simulate};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Records and start values by the name of the state, on which integration steps are chosen.
pub(super) type Tuning = (Vec<Record>, BTreeMap<String, f64>);

/// A compiled explanation, and the widths of its smoothed jumps.
pub(super) type Compiled = (Explanation, BTreeMap<String, f64>);

/// Builds the explanation of a fitted model, with steps and widths chosen on records with these start values.
///
/// # Errors
/// The model has no fitted uncertainty or no noise, cannot be compiled, or cannot be simulated over the records.
pub(super) fn compile(source: &Source, (records, starts): &Tuning) -> anyhow::Result<Compiled> {
    let (name, mut model) = (source.name.as_str(), source.model.clone());
    model.inputs.iter_mut().for_each(|input| input.hold = input.hold.or(Some(Hold::Linear)));
    model.numerics.widths.extend(source.widths.clone());
    let (uncertain, covariance) = uncertainty(&model);
    if uncertain.is_empty() && model.parameters.iter().any(|p| !p.frozen) {
        return Err(Usage::model(name, crate::usage::ModelFault::Next(NextFault::NotFitted)).into());
    }
    let noise = noise(name, &model)?;
    let system = EquationSystem::declared_only(&model)?;
    let mut prepared = prepare_records(&system, records)?;
    for window in prepared.iter_mut().flat_map(|r| &mut r.windows) {
        for (value, state) in window.start.iter_mut().zip(&model.states) {
            *value = starts.get(&state.name).copied().unwrap_or(*value);
        }
    }
    let system = system.tuned(&prepared)?.with_states_as_channels()?;
    let widths = system.compiled().named_widths();
    let driven = match noise.process.is_empty() {
        true => None,
        false => Some(Arc::new(system.with_process_noise_inputs()?) as Arc<dyn augsim_system::System>),
    };
    let values = system.parameters().iter().map(|p| p.nominal).collect();
    let outputs = model.outputs.len();
    let explanation = Explanation {
        name: name.to_owned(),
        system: Arc::new(system),
        driven,
        outputs,
        values,
        uncertain,
        factor: Vec::new(),
        noise,
        log_weight: source.log_weight,
    };
    Ok((explanation.with_covariance(&covariance), widths))
}

/// Indices of the uncertain parameters of a model, and their covariance.
///
/// Parameters that have a 95 % interval and are not in the `[covariance]` of the model are independent. A free parameter
/// with neither, such as one at a bound of its fit, may have any value within finite bounds: it gets the standard
/// deviation of a uniform distribution. Without finite bounds it is fixed.
fn uncertainty(model: &Model) -> (Vec<usize>, Vec<Vec<f64>>) {
    let joint = model.covariance.clone().unwrap_or_default();
    let place = |i: usize| joint.parameters.iter().position(|p| *p == i);
    let sd = |i: usize| {
        let p = &model.parameters[i];
        let of_interval = p.ci95.map(|[low, high]| (high - low) / (2.0 * NORMAL_95));
        of_interval.or(Some((p.max - p.min) / 12.0_f64.sqrt())).filter(|sd| *sd > 0.0 && sd.is_finite())
    };
    let is_free = |i: &usize| !model.parameters[*i].frozen && (place(*i).is_some() || sd(*i).is_some());
    let uncertain: Vec<usize> = (0..model.parameters.len()).filter(is_free).collect();
    let entry = |i: usize, j: usize| match (place(i), place(j)) {
        (Some(a), Some(b)) => joint.rows[a][b],
        (None, None) if i == j => sd(i).unwrap_or(0.0).powi(2),
        _ => 0.0,
    };
    let row = |i: &usize| uncertain.iter().map(|j| entry(*i, *j)).collect();
    let covariance = uncertain.iter().map(row).collect();
    (uncertain, covariance)
}

/// Noise of a model: as a fit has estimated it, or else as declared.
fn noise(name: &str, model: &Model) -> Result<Noise, Usage> {
    let sensor = |output: &augsim_equations::model::Output| {
        let noise = match (output.noise, output.sd) {
            (Some(n), _) if n.sd() > 0.0 => Some(SensorNoise {
                white_sd: n.white_sd,
                autocorrelated_sd: n.autocorrelated_sd,
                correlation_time_s: n.correlation_time_s,
            }),
            (_, Some(sd)) if sd > 0.0 => Some(SensorNoise { white_sd: sd, ..SensorNoise::default() }),
            _ => None,
        };
        let fault = || NextFault::NoNoise { output: output.name.clone() };
        noise.ok_or_else(|| Usage::model(name, crate::usage::ModelFault::Next(fault())))
    };
    let process = model.states.iter().enumerate().filter_map(|(state, s)| {
        let noise = s.process_noise.filter(|n| n.sd > 0.0)?;
        Some(RateNoise { state, sd: noise.sd, correlation_time_s: noise.correlation_time_s })
    });
    Ok(Noise {
        sensors: model.outputs.iter().map(sensor).collect::<Result<_, _>>()?,
        process: process.collect(),
    })
}

/// Writes the values and the covariance of an explanation into its model.
pub(super) fn write_back(model: &mut Model, explanation: &Explanation) {
    let sds = explanation.standard_deviations();
    for (index, sd) in explanation.uncertain.iter().zip(sds) {
        model.parameters[*index].set_estimate(explanation.values[*index], sd);
    }
    model.covariance =
        Some(Covariance { parameters: explanation.uncertain.clone(), rows: explanation.covariance() });
}
