//! Free runs of a system of equations with bands.

use crate::DataFrom;
use crate::written::fit::prepared;
use crate::written::forecast::read_by_sensor;
use crate::written::records;
use augsim_calibrate::fit_start;
use augsim_data::random_stream;
use augsim_discovery::{
    FORETOLD_LEVELS, ForetellOptions, Foretelling, Foretold, ForetoldChannel, ForetoldError,
};
use augsim_physics::system::{Offsets, Record, Simulated, System, Task};
use augsim_trainer::in_order;
use augsim_written::{Model, WrittenSystem};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Free runs of all records of a file, from starts that are fitted to the first `burn_in` samples.
///
/// Bands are those of draws: parameters from their 95 % intervals, the start fitted anew at them to the first samples with
/// other noise, and the sensor's noise on top, as the model declares it or else as the first samples scatter.
///
/// # Errors
/// A column is missing, or a record cannot be simulated.
pub(super) fn foretell(
    model: &Model,
    data: &DataFrom,
    burn_in: usize,
    options: &ForetellOptions,
) -> anyhow::Result<Foretelling> {
    let measured = records::read(data, model)?;
    let mut list = records::records(&measured.data, model, false)?;
    list.retain(|record| options.asks_for(&record.id));
    let system = WrittenSystem::declared_only(model)?;
    let list = prepared(&system, &list)?;
    let system = system.tuned(&list)?;
    let run = Run { model, system: &system, burn_in: burn_in.max(1), options };
    let done = in_order(list.par_iter().enumerate().map(|(i, record)| run.one(record, i as u64)))?;
    let (records, noise): (Vec<Foretold>, Vec<Vec<f64>>) = done.into_iter().unzip();
    let outputs = model.outputs.iter().enumerate();
    let (errors, mut squares): (Vec<_>, Vec<_>) =
        outputs.map(|(o, output)| run.error(o, &output.name, &records)).unzip();
    let squares = if squares.is_empty() { Vec::new() } else { squares.swap_remove(0) };
    let mean = |o: usize| noise.iter().map(|sd| sd[o]).sum::<f64>() / noise.len().max(1) as f64;
    let noise_sd = (0..model.outputs.len()).map(mean).collect();
    let start = "the first samples of each trajectory (--burn-in)".to_owned();
    Ok(Foretelling { records, errors, squares, noise_sd, start })
}

/// Model and options that the forecasts of all records share.
struct Run<'a> {
    model: &'a Model,
    system: &'a WrittenSystem,
    burn_in: usize,
    options: &'a ForetellOptions,
}

impl Run<'_> {
    /// One record, and the noise that was put on top of it by output.
    fn one(&self, record: &Record, stream: u64) -> anyhow::Result<(Foretold, Vec<f64>)> {
        let outputs = self.model.outputs.len();
        let known = self.burn_in.min(record.times.len());
        let values: Vec<f64> = self.system.parameters().iter().map(|p| p.nominal).collect();
        let declared: Vec<Option<f64>> = self.model.outputs.iter().map(|o| o.sd).collect();
        let mut early = record.clone();
        // Nothing behind the burn-in may reach the start, not even its rough guess.
        early.values.iter_mut().for_each(|v| v.iter_mut().skip(known).for_each(|x| *x = f64::NAN));
        self.system.prepare(&mut early, &[])?;
        let from = early.windows.first().map(|w| w.start.clone()).unwrap_or_default();
        let begun = fit_start(self.system, &early, known, &values, &from, &declared)?;
        // A start takes one degree of freedom for each of its states.
        let freedom = (known * outputs).saturating_sub(begun.state.len()).max(1) as f64;
        let widen = ((known * outputs) as f64 / freedom).sqrt();
        let noise: Vec<f64> = (0..outputs).map(|o| declared[o].unwrap_or(widen * begun.rms[o])).collect();
        let forecast = self.run(record, &values, &begun.state)?;
        let mut rng = random_stream(self.options.seed, "foretell written", stream);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let samples = record.times.len();
        let mut draws = vec![vec![Vec::with_capacity(self.options.draws); samples]; outputs];
        for _ in 0..self.options.draws {
            let drawn: Vec<f64> = (self.system.parameters().iter().zip(&values))
                .map(|(p, v)| {
                    let sd = p.standard_deviation().unwrap_or(0.0);
                    (v + sd * normal()).clamp(p.min.min(*v), p.max.max(*v))
                })
                .collect();
            let mut noisy = early.clone();
            for (values, sd) in noisy.values.iter_mut().zip(&noise) {
                values.iter_mut().for_each(|v| *v += sd * normal());
            }
            // What cannot be simulated at values this far off says nothing.
            let Ok(start) = fit_start(self.system, &noisy, known, &drawn, &begun.state, &declared) else {
                continue;
            };
            let Ok(path) = self.run(record, &drawn, &start.state) else { continue };
            for (o, (values, list)) in path.iter().zip(&mut draws).enumerate() {
                for (v, list) in values.iter().zip(list) {
                    let value = read_by_sensor(&self.model.outputs[o], v + noise[o] * normal());
                    list.extend(Some(value).filter(|v| v.is_finite()));
                }
            }
        }
        let channels =
            (0..outputs).map(|o| channel(&self.model.outputs[o].name, o, record, &forecast, &mut draws));
        let channels = channels.collect();
        let foretold = Foretold { id: record.id.clone(), times: record.times.clone(), known, channels };
        Ok((foretold, noise))
    }

    /// A free run of a record, `[output][sample]`.
    fn run(&self, record: &Record, parameters: &[f64], start: &[f64]) -> anyhow::Result<Vec<Vec<f64>>> {
        let window = 0..record.times.len();
        let task = Task { parameters, record, window, start, offsets: Offsets::None, seeds: &[] };
        let mut out = Simulated::default();
        self.system.simulate(&task, &mut out)?;
        let outputs = self.model.outputs.iter().enumerate();
        let path = outputs
            .map(|(o, output)| (0..out.samples()).map(|k| read_by_sensor(output, out.value(k, o))).collect());
        Ok(path.collect())
    }

    /// Root mean square error of an output behind the burn-in, and the sum and number of squares of each record.
    fn error(&self, o: usize, name: &str, records: &[Foretold]) -> (ForetoldError, Vec<(f64, f64)>) {
        let output = &self.model.outputs[o];
        let mut squares = Vec::new();
        for r in records {
            let c = &r.channels[o];
            let (mut sum, mut count) = (0.0, 0.0);
            for k in (r.known..r.times.len()).filter(|&k| c.measured[k].is_finite()) {
                let mut error = c.measured[k] - c.forecast[k];
                if let Some(period) = output.period {
                    error -= period * (error / period).round();
                }
                sum += error * error;
                count += 1.0;
            }
            squares.push((sum, count));
        }
        let ci95 = augsim_discovery::interval_of_rmse(&squares, self.options.seed);
        let (sum, count) = squares.iter().fold((0.0, 0.0), |a, s| (a.0 + s.0, a.1 + s.1));
        let unit = output.unit.map_or_else(String::new, |u| u.symbol());
        let rmse = (sum / f64::max(count, 1.0)).sqrt();
        (ForetoldError { measure: name.to_owned(), unit, rmse, ci95 }, squares)
    }
}

/// The bands of an output.
fn channel(
    name: &str,
    o: usize,
    record: &Record,
    forecast: &[Vec<f64>],
    draws: &mut [Vec<Vec<f64>>],
) -> ForetoldChannel {
    let mut mean = Vec::new();
    let mut quantiles: [Vec<f64>; FORETOLD_LEVELS.len()] = Default::default();
    for list in &mut draws[o] {
        list.sort_by(f64::total_cmp);
        mean.push(list.iter().sum::<f64>() / list.len() as f64);
        for (quantile, level) in quantiles.iter_mut().zip(FORETOLD_LEVELS) {
            quantile.push(augsim_discovery::quantile_of_draws(list, level));
        }
    }
    ForetoldChannel {
        column: name.to_owned(),
        measured: record.values[o].clone(),
        forecast: forecast[o].clone(),
        mean,
        quantiles,
    }
}
