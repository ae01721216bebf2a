//! Simulated recordings of an explanation: drawn parameters, process noise and measurement noise.

use crate::candidate::Experiment;
use crate::error::DesignError;
use crate::explanation::{Explanation, decay};
use augsim_system::{Offsets, Record, Simulated, Stream, Task};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Draws parameter values of an explanation from their distribution.
pub fn draw_values(explanation: &Explanation, rng: &mut impl Rng) -> Vec<f64> {
    let xi: Vec<f64> = explanation.uncertain.iter().map(|_| StandardNormal.sample(rng)).collect();
    explanation.values_at(&xi)
}

/// Draws an Ornstein-Uhlenbeck process at `times`.
fn draw_process(sd: f64, correlation_time_s: f64, times: &[f64], rng: &mut impl Rng) -> Vec<f64> {
    let mut normal = || -> f64 { StandardNormal.sample(&mut *rng) };
    let mut current = sd * normal();
    let mut values = Vec::with_capacity(times.len());
    for (k, t) in times.iter().enumerate() {
        values.push(current);
        let keep = decay(correlation_time_s, times.get(k + 1).map_or(0.0, |next| next - t));
        current = keep * current + sd * (1.0 - keep * keep).sqrt() * normal();
    }
    values
}

/// Simulates a noise-free run with drawn process noise; channels are the outputs, then the states.
pub(crate) fn draw_run(
    truth: &Explanation,
    values: &[f64],
    experiment: &Experiment,
    rng: &mut impl Rng,
) -> Result<Simulated, DesignError> {
    let record = experiment.record("draw");
    let prepared = truth.prepare(&record)?;
    let rough = prepared.windows.first().map_or(&[][..], |w| &w.start);
    let start = experiment.start_of(truth, rough);
    let Some(driven) = &truth.driven else { return truth.simulate(&prepared, values, &start, &[]) };
    let noise: Vec<Stream> = truth
        .noise
        .process
        .iter()
        .map(|p| Stream {
            times: record.times.clone(),
            values: vec![draw_process(p.sd, p.correlation_time_s, &record.times, rng)],
        })
        .collect();
    let pushed = Record { inputs: prepared.inputs.iter().cloned().chain(noise).collect(), ..prepared };
    let window = 0..pushed.times.len();
    let task = Task {
        parameters: values,
        record: &pushed,
        window,
        start: &start,
        offsets: Offsets::None,
        seeds: &[],
    };
    let mut out = Simulated::default();
    driven.simulate(&task, &mut out).map_err(|cause| truth.failed(cause))?;
    Ok(out)
}

/// Simulates the outputs of an experiment at the fitted values, without noise, `[output][sample]`.
///
/// # Errors
/// The explanation cannot be simulated.
pub fn nominal_run(explanation: &Explanation, experiment: &Experiment) -> Result<Vec<Vec<f64>>, DesignError> {
    noise_free_run(explanation, &explanation.values, experiment)
}

/// Simulates the outputs of an experiment at these parameter values, without noise, `[output][sample]`.
pub(crate) fn noise_free_run(
    explanation: &Explanation,
    values: &[f64],
    experiment: &Experiment,
) -> Result<Vec<Vec<f64>>, DesignError> {
    let prepared = explanation.prepare(&experiment.record("without noise"))?;
    let rough = prepared.windows.first().map_or(&[][..], |w| &w.start);
    let start = experiment.start_of(explanation, rough);
    let out = explanation.simulate(&prepared, values, &start, &[])?;
    Ok((0..explanation.outputs).map(|o| (0..out.samples()).map(|k| out.value(k, o)).collect()).collect())
}

/// Simulates a recording of an experiment by an explanation with these parameter values.
///
/// # Errors
/// The explanation cannot be simulated.
pub fn draw_recording(
    truth: &Explanation,
    values: &[f64],
    experiment: &Experiment,
    id: &str,
    rng: &mut impl Rng,
) -> Result<Record, DesignError> {
    let out = draw_run(truth, values, experiment, rng)?;
    let mut record = experiment.record(id);
    for (output, sensor) in truth.noise.sensors.iter().enumerate() {
        let errors = draw_process(sensor.autocorrelated_sd, sensor.correlation_time_s, &record.times, rng);
        let reading = |(k, error): (usize, f64)| {
            let white: f64 = StandardNormal.sample(&mut *rng);
            out.value(k, output) + error + sensor.white_sd * white
        };
        record.values.push(errors.into_iter().enumerate().map(reading).collect());
    }
    Ok(record)
}
