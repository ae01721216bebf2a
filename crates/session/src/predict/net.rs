//! Predictions of nets that correct an equation model, from initial states fitted to the first samples.
//!
//! A net's mean prediction m(x0) differs from the free run p(x0) of the equations. The initial state is found
//! by the fixed-point iteration
//!
//! 1. x0 = argmin ‖y - p(x0)‖ over the first samples,
//! 2. y' = y - (m(x0) - p(x0)),
//! 3. x0 = argmin ‖y' - p(x0)‖; repeat from 2.
//!
//! At its fixed point m(x0) fits the measured samples y.

use super::check_draws;
use super::draws::{RecordDraws, prediction_set};
use super::equations::{FittedInitialState, free_run, run_all};
use super::scores::{OutputScores, scores};
use crate::DataFrom;
use crate::equations::fit::prepare_records;
use crate::equations::forecast::clip_to_sensor_range;
use crate::equations::{records, states};
use crate::usage::{Inapplicable, Usage};
use anyhow::Context;
use augsim_data::random_stream;
use augsim_discovery::{PredictOptions, PredictionSet};
use augsim_equations::{EquationSystem, Model};
use augsim_fit::estimate_initial_state;
use augsim_system::{Record, Simulate};
use augsim_trainer::{EquationEngine, Forecaster, NetModel, Task, collect_in_order};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Number of iterations that fit the initial state to the net's mean predictions.
const START_ITERATIONS: usize = 3;
/// Number of draws from which the net's mean prediction is computed.
const MEAN_DRAWS: usize = 32;

/// Predictive draws of one data set by a net, and by its physics model without the net.
#[derive(Debug)]
pub struct NetAndPhysics {
    /// Draws of each record by the physics model without the net.
    pub physics: Vec<RecordDraws>,
    /// Draws of each record by the net.
    pub net: Vec<RecordDraws>,
}

/// Predicts all records by a net, from initial states fitted to the first `burn_in` samples.
///
/// # Errors
/// The net was not trained on an equation model, a column is missing, the sampling step differs from that of
/// the training data, or a record cannot be simulated.
pub fn predict_with_net(
    net: &NetModel,
    data: &DataFrom,
    burn_in: usize,
    options: &PredictOptions,
) -> anyhow::Result<PredictionSet> {
    let run = NetPrediction::new(net, data, burn_in, options)?;
    check_draws(options.draws)?;
    let pairs = run.read.par_iter().zip(&run.prepared).enumerate();
    let bands = pairs.map(|(i, (read, prepared))| {
        let drawn = run.predict_named(read, prepared, i as u64)?;
        anyhow::Ok((drawn.predicted(run.model), drawn.noise))
    });
    let (predicted, noise) = collect_in_order(bands)?.into_iter().unzip();
    Ok(prediction_set(run.model, predicted, noise, options.seed))
}

/// Predicts all records by a net and by its physics model without the net.
///
/// # Errors
/// As [`predict_with_net`].
pub fn net_and_physics(
    net: &NetModel,
    data: &DataFrom,
    burn_in: usize,
    options: &PredictOptions,
) -> anyhow::Result<NetAndPhysics> {
    let run = NetPrediction::new(net, data, burn_in, options)?;
    let physics = run_all(run.model, &run.system, &run.prepared, burn_in, options)?;
    Ok(NetAndPhysics { physics, net: run.predict_all()? })
}

/// Scores the predictions of a net on all records, one row per output.
///
/// # Errors
/// As [`predict_with_net`].
pub fn net_scores(
    net: &NetModel,
    data: &DataFrom,
    burn_in: usize,
    options: &PredictOptions,
) -> anyhow::Result<Vec<OutputScores>> {
    let run = NetPrediction::new(net, data, burn_in, options)?;
    Ok(scores(net.name(), run.model, &run.predict_all()?))
}

/// A net with the records that it predicts.
struct NetPrediction<'a> {
    net: &'a NetModel,
    engine: &'a EquationEngine,
    model: &'a Model,
    system: EquationSystem,
    /// The records as read; `prepared` holds the same records prepared by the system.
    read: Vec<Record>,
    prepared: Vec<Record>,
    burn_in: usize,
    options: &'a PredictOptions,
}

impl<'a> NetPrediction<'a> {
    fn new(
        net: &'a NetModel,
        data: &DataFrom,
        burn_in: usize,
        options: &'a PredictOptions,
    ) -> anyhow::Result<Self> {
        let Some(engine) = net.state().settings.engine.equation_engine() else {
            return Err(Usage::Inapplicable(Inapplicable::NoEquations).into());
        };
        let model = engine.equations();
        let measured = records::read(data.clone(), model)?;
        let mut read = records::records(&measured.data, model, false)?;
        read.retain(|record| options.is_requested(&record.id));
        states::check_step_of_engine(engine, &read).with_context(|| data.to_string())?;
        let system = EquationSystem::declared_only(model)?;
        let prepared = prepare_records(&system, &read)?;
        Ok(NetPrediction { net, engine, model, system, read, prepared, burn_in: burn_in.max(1), options })
    }

    fn predict_all(&self) -> anyhow::Result<Vec<RecordDraws>> {
        let pairs = self.read.par_iter().zip(&self.prepared).enumerate();
        collect_in_order(pairs.map(|(i, (read, prepared))| self.predict_named(read, prepared, i as u64)))
    }

    /// Predicts one record as [`predict`](Self::predict) does, with errors that name the record.
    fn predict_named(&self, read: &Record, prepared: &Record, stream: u64) -> anyhow::Result<RecordDraws> {
        self.predict(read, prepared, stream).with_context(|| format!("trajectory `{}`", read.id))
    }

    /// Predicts one record; finds the initial state by the iteration at the head of this file.
    fn predict(&self, read: &Record, record: &Record, stream: u64) -> anyhow::Result<RecordDraws> {
        let (outputs, samples) = (self.model.outputs.len(), record.times.len());
        let values: Vec<f64> = self.system.parameters().iter().map(|p| p.nominal).collect();
        let FittedInitialState { known, early_part: mut early, initial_state: mut begun, known_sd, .. } =
            FittedInitialState::fit(self.model, &self.system, record, self.burn_in, &values)?;
        let measured = early.values.clone();
        let actions = states::actions(self.model, read);
        let action_count = actions.len() / samples.max(1);
        for _ in 0..START_ITERATIONS {
            let start = self.system.complete_start(record, &begun.state);
            let task =
                Task { start: &start, actions: &actions[..known * action_count], time: known, index: stream };
            let mean = self.mean_of(self.outputs(task, MEAN_DRAWS)?);
            let physics = free_run(&self.system, record, known, &values, &begun.state)?;
            let mut is_finite = true;
            for o in 0..outputs {
                for k in 0..known {
                    let correction = mean[o][k] - physics[o][k];
                    is_finite &= correction.is_finite();
                    early.values[o][k] = measured[o][k] - correction;
                }
            }
            if !is_finite {
                early.values.clone_from(&measured);
                break;
            }
            begun = estimate_initial_state(&self.system, &early, known, &values, &begun.state, &known_sd)?;
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
            // An initial state that cannot be fitted to the perturbed samples is left unchanged.
            let start = estimate_initial_state(&self.system, &noisy, known, &values, &begun.state, &known_sd);
            let start = start.map_or_else(|_| begun.state.clone(), |start| start.state);
            starts.extend(self.system.complete_start(record, &start));
        }
        let task = Task { start: &starts, actions: &actions, time: samples, index: stream };
        let paths = self.outputs(task, self.options.draws)?;
        let forecast = self.mean_of(paths.clone());
        let mut draws = paths;
        for (o, lists) in draws.iter_mut().enumerate() {
            for list in lists {
                list.retain(|v| v.is_finite());
                list.iter_mut().for_each(|v| {
                    *v = clip_to_sensor_range(&self.model.outputs[o], *v + noise[o] * normal())
                });
            }
        }
        if let Some(k) = draws.iter().flat_map(|lists| lists.iter().position(Vec::is_empty)).min() {
            anyhow::bail!(Diverged { time_s: record.times[k] });
        }
        Ok(RecordDraws::new(record, known, forecast, draws, noise))
    }

    /// Simulates draws of the net; returns their outputs without measurement noise, `[output][sample][draw]`.
    fn outputs(&self, task: Task<'_>, draws: usize) -> anyhow::Result<Vec<Vec<Vec<f64>>>> {
        let samples = self.net.forecast(task, draws)?;
        let (state_count, outputs) = (self.model.states.len(), self.model.outputs.len());
        let (count, time) = (samples.count, task.time);
        let mut paths = vec![vec![Vec::with_capacity(count); time]; outputs];
        let mut states = vec![0.0; time * state_count];
        for draw in 0..count {
            states.iter_mut().enumerate().for_each(|(i, x)| *x = f64::from(samples.values[i * count + draw]));
            let output_values = self.engine.outputs(&states, task.actions);
            for (i, v) in output_values.into_iter().enumerate() {
                paths[i % outputs][i / outputs].push(v);
            }
        }
        Ok(paths)
    }

    /// Mean of the draws of each output at each sample, clipped to the range of the sensor.
    fn mean_of(&self, paths: Vec<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
        let mean = |list: &Vec<f64>| {
            let (sum, n) =
                list.iter().filter(|v| v.is_finite()).fold((0.0, 0.0), |a, v| (a.0 + v, a.1 + 1.0));
            sum / n
        };
        let read = |(o, lists): (usize, Vec<Vec<f64>>)| -> Vec<f64> {
            lists.iter().map(|list| clip_to_sensor_range(&self.model.outputs[o], mean(list))).collect()
        };
        paths.into_iter().enumerate().map(read).collect()
    }
}

/// Error: all draws of a net diverged.
#[derive(Debug, thiserror::Error)]
#[error(
    "all draws of the net diverge from {time_s} s on (non-finite values); train longer, on data that cover this range, or use the physics \
     model without the net"
)]
struct Diverged {
    time_s: f64,
}
