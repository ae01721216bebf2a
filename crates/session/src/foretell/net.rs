//! Forecasts of nets on what the equations of a system leave, from starts that the first samples tell.

use super::drawn::{Drawn, foretelling};
use super::scored::{ScoredRow, scored};
use super::written::{Beginning, free_run, known_noise, run_all, sd_of};
use crate::DataFrom;
use crate::usage::{Inapplicable, Usage};
use crate::written::fit::prepared;
use crate::written::forecast::read_by_sensor;
use crate::written::{records, states};
use anyhow::Context;
use augsim_calibrate::fit_start;
use augsim_data::random_stream;
use augsim_discovery::{ForetellOptions, Foretelling};
use augsim_physics::system::{Record, System};
use augsim_trainer::{Forecaster, NetModel, Task, WrittenEngine, in_order};
use augsim_written::{Model, WrittenSystem};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Rounds in which the start is fitted to the net's own motion.
const ROUNDS: usize = 3;
/// Draws whose mean is that motion.
const MEAN_OF: usize = 32;

/// Draws of one data set by a net, and by the physics that it corrects alone.
#[derive(Debug)]
pub struct Beside {
    /// By the physics.
    pub physics: Vec<Drawn>,
    /// By the net.
    pub net: Vec<Drawn>,
}

/// Forecasts of all records of a file by a net, from starts that are fitted to the first `burn_in` samples.
///
/// # Errors
/// The net corrects no system of equations, a column is missing, the clock is another, or a record cannot be simulated.
pub fn foretell_net(
    net: &NetModel,
    data: &DataFrom,
    burn_in: usize,
    options: &ForetellOptions,
) -> anyhow::Result<Foretelling> {
    let run = Run::new(net, data, burn_in, options)?;
    Ok(foretelling(run.model, &run.all()?, options.seed))
}

/// Draws of all records by a net and by the physics alone.
///
/// # Errors
/// As [`foretell_net`].
pub fn beside(
    net: &NetModel,
    data: &DataFrom,
    burn_in: usize,
    options: &ForetellOptions,
) -> anyhow::Result<Beside> {
    let run = Run::new(net, data, burn_in, options)?;
    let physics = run_all(run.model, &run.system, &run.prepared, burn_in, options)?;
    Ok(Beside { physics, net: run.all()? })
}

/// Scores of a net on all records of a file, output by output.
///
/// # Errors
/// As [`foretell_net`].
pub fn net_scores(
    net: &NetModel,
    data: &DataFrom,
    burn_in: usize,
    options: &ForetellOptions,
) -> anyhow::Result<Vec<ScoredRow>> {
    let run = Run::new(net, data, burn_in, options)?;
    Ok(scored(net.name(), run.model, &run.all()?))
}

/// A net and records that it forecasts.
struct Run<'a> {
    net: &'a NetModel,
    engine: &'a WrittenEngine,
    model: &'a Model,
    system: WrittenSystem,
    /// The records as they were read, and prepared.
    read: Vec<Record>,
    prepared: Vec<Record>,
    burn_in: usize,
    options: &'a ForetellOptions,
}

impl<'a> Run<'a> {
    fn new(
        net: &'a NetModel,
        data: &DataFrom,
        burn_in: usize,
        options: &'a ForetellOptions,
    ) -> anyhow::Result<Self> {
        let Some(engine) = net.state().settings.engine.written() else {
            return Err(Usage::Inapplicable(Inapplicable::NoEquations).into());
        };
        let model = engine.equations();
        let measured = records::read(data.clone(), model)?;
        let mut read = records::records(&measured.data, model, false)?;
        read.retain(|record| options.asks_for(&record.id));
        states::check_clock_of(engine, &read).with_context(|| data.to_string())?;
        let system = WrittenSystem::declared_only(model)?;
        let prepared = prepared(&system, &read)?;
        Ok(Run { net, engine, model, system, read, prepared, burn_in: burn_in.max(1), options })
    }

    fn all(&self) -> anyhow::Result<Vec<Drawn>> {
        let pairs = self.read.par_iter().zip(&self.prepared).enumerate();
        in_order(pairs.map(|(i, (read, prepared))| {
            self.one(read, prepared, i as u64).with_context(|| format!("trajectory `{}`", read.id))
        }))
    }

    /// Starts are fitted by the physics to the first samples less what the net's motion differs by there from that of the physics: so
    /// the start is one from which the net follows them.
    fn one(&self, read: &Record, record: &Record, stream: u64) -> anyhow::Result<Drawn> {
        let (outputs, samples) = (self.model.outputs.len(), record.times.len());
        let values: Vec<f64> = self.system.parameters().iter().map(|p| p.nominal).collect();
        let Beginning { known, mut early, mut begun, .. } =
            Beginning::of(self.model, &self.system, record, self.burn_in, &values)?;
        let (declared, measured) = (sd_of(&known_noise(self.model)), early.values.clone());
        let actions = states::actions(self.model, read);
        let a = actions.len() / samples.max(1);
        for _ in 0..ROUNDS {
            let start = self.system.full_start(record, &begun.state);
            let task = Task { start: &start, actions: &actions[..known * a], time: known, index: stream };
            let mean = self.mean_of(self.outputs(task, MEAN_OF)?);
            let physics = free_run(&self.system, record, known, &values, &begun.state)?;
            let mut is_finite = true;
            for o in 0..outputs {
                for k in 0..known {
                    let differs = mean[o][k] - physics[o][k];
                    is_finite &= differs.is_finite();
                    early.values[o][k] = measured[o][k] - differs;
                }
            }
            if !is_finite {
                early.values.clone_from(&measured);
                break;
            }
            begun = fit_start(&self.system, &early, known, &values, &begun.state, &declared)?;
        }
        let noise = self.engine.sensor_sd().to_vec();
        let mut rng = random_stream(self.options.seed, "foretell net", stream);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut starts = Vec::new();
        for _ in 0..self.options.draws {
            let mut noisy = early.clone();
            for (values, sd) in noisy.values.iter_mut().zip(&noise) {
                values.iter_mut().for_each(|v| *v += sd * normal());
            }
            // A start that cannot be fitted to other noise stays where it is.
            let drawn = fit_start(&self.system, &noisy, known, &values, &begun.state, &declared);
            let drawn = drawn.map_or_else(|_| begun.state.clone(), |drawn| drawn.state);
            starts.extend(self.system.full_start(record, &drawn));
        }
        let task = Task { start: &starts, actions: &actions, time: samples, index: stream };
        let paths = self.outputs(task, self.options.draws)?;
        let forecast = self.mean_of(paths.clone());
        let mut draws = paths;
        for (o, lists) in draws.iter_mut().enumerate() {
            for list in lists {
                list.retain(|v| v.is_finite());
                list.iter_mut()
                    .for_each(|v| *v = read_by_sensor(&self.model.outputs[o], *v + noise[o] * normal()));
            }
        }
        if let Some(k) = draws.iter().flat_map(|lists| lists.iter().position(Vec::is_empty)).min() {
            anyhow::bail!(RunsAway { time_s: record.times[k] });
        }
        Ok(Drawn::new(record, known, forecast, draws, noise))
    }

    /// Outputs without noise of draws of the net, `[output][sample][draw]`.
    fn outputs(&self, task: Task<'_>, draws: usize) -> anyhow::Result<Vec<Vec<Vec<f64>>>> {
        let samples = self.net.forecast(task, draws)?;
        let (s, outputs) = (self.model.states.len(), self.model.outputs.len());
        let (n, time) = (samples.count, task.time);
        let mut all = vec![vec![Vec::with_capacity(n); time]; outputs];
        let mut states = vec![0.0; time * s];
        for draw in 0..n {
            states.iter_mut().enumerate().for_each(|(i, x)| *x = f64::from(samples.values[i * n + draw]));
            let read = self.engine.outputs(&states, task.actions);
            for (i, v) in read.into_iter().enumerate() {
                all[i % outputs][i / outputs].push(v);
            }
        }
        Ok(all)
    }

    /// Means of the draws, as the sensor reads them.
    fn mean_of(&self, all: Vec<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
        let mean = |list: &Vec<f64>| {
            let (sum, n) =
                list.iter().filter(|v| v.is_finite()).fold((0.0, 0.0), |a, v| (a.0 + v, a.1 + 1.0));
            sum / n
        };
        let read = |(o, lists): (usize, Vec<Vec<f64>>)| -> Vec<f64> {
            lists.iter().map(|list| read_by_sensor(&self.model.outputs[o], mean(list))).collect()
        };
        all.into_iter().enumerate().map(read).collect()
    }
}

/// No draw stays finite.
#[derive(Debug, thiserror::Error)]
#[error(
    "no draw of the forecast is a number from {time_s} s on; train longer, on data that go as far, or use the physics alone"
)]
struct RunsAway {
    time_s: f64,
}
