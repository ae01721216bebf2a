//! Chooses simulation settings from data: steps, widths of smoothed discontinuities, and scales.

use super::EquationSystem;
use super::records::EngineTask;
use crate::engine::{
    Method, Options, Point, SimulationError as EngineError, TRIAL_SUBSTEPS, Window, fastest_mode,
};
use crate::library::Scales;
use augsim_system::{Offsets, Record, SimulationError, Task, channel_sd};
use std::sync::Arc;

/// Maximum number of windows, spread over the records, from which simulation settings are chosen.
const MAX_WINDOWS: usize = 64;
/// Number of samples per window from which settings are chosen, if there are [`MAX_WINDOWS`] windows.
///
/// Fewer windows use more samples each, so that the total is the same. A record that is a single window may
/// begin at rest, where neither steps nor widths could be chosen.
const SAMPLES_PER_WINDOW: usize = 400;
/// Assumed noise of an output without a declared one, as a share of the output's spread, for choosing steps.
const DEFAULT_NOISE_RATIO: f64 = 0.01;

impl EquationSystem {
    /// Chooses widths of smoothed discontinuities and steps for records that this system has prepared.
    ///
    /// # Errors
    /// A system whose rates are too fast for any number of steps, or a window that cannot be simulated.
    pub fn tuned(mut self, records: &[Record]) -> Result<Self, EngineError> {
        let engine_tasks = self.engine_tasks(records);
        let windows = windows(&engine_tasks);
        let mut compiled = (*self.compiled).clone();
        let substeps = self.options.substeps.max(TRIAL_SUBSTEPS);
        let method = compiled.method_for(&windows);
        compiled.fit_widths(&windows, &Options { method, substeps })?;
        let noise = self.noise(records);
        self.options = compiled.choose_steps(&windows, &noise)?.options;
        self.options = compiled.narrow_widths(&windows, &noise, self.options);
        self.compiled = Arc::new(compiled);
        self.complete = Arc::default();
        Ok(self)
    }

    /// Samples the scales of all quantities over records that this system has prepared.
    pub fn scales(&self, records: &[Record]) -> Scales {
        Scales::sample(&self.compiled, &windows(&self.engine_tasks(records)), &self.options)
    }

    /// Time constant of the fastest mode of the linearised rates at the starts of windows (median), s.
    ///
    /// `None` if no rate depends on a state.
    pub fn fastest_time_constant_s(&self, records: &[Record]) -> Option<f64> {
        let n = self.model().states.len();
        let fastest_rate = |engine_task: &EngineTask| {
            let time = engine_task.record.times().first().copied().unwrap_or(0.0);
            let inputs: Vec<f64> = engine_task.record.inputs().iter().map(|signal| signal.at(time)).collect();
            let (state, parameters) = (&engine_task.start[..], &engine_task.parameters[..]);
            let linearisation = self.compiled.linearise(&Point { state, inputs: &inputs, parameters, time });
            fastest_mode(&linearisation.by_state, n).0
        };
        let mut rates: Vec<f64> = self
            .engine_tasks(records)
            .iter()
            .map(fastest_rate)
            .filter(|r| r.is_finite() && *r > 0.0)
            .collect();
        rates.sort_by(f64::total_cmp);
        rates.get(rates.len() / 2).map(|rate| 1.0 / rate)
    }

    /// Simulates all outputs of a task, `[sample][output]`, with the adaptive reference integrator.
    ///
    /// # Errors
    /// A window that cannot be simulated.
    pub fn reference(&self, task: &Task<'_>) -> Result<Vec<f64>, SimulationError> {
        let engine_task = self.engine_task(task)?;
        let task_windows = windows(std::slice::from_ref(&engine_task));
        let options = Options { method: Method::Reference { tolerance: 1e-9 }, substeps: 1 };
        let result = self.compiled.simulate(&task_windows, &[], &options).pop();
        match result {
            Some(Ok(simulated)) => Ok(simulated.values),
            Some(Err(error)) => Err(SimulationError::Engine(Box::new(error))),
            None => Ok(Vec::new()),
        }
    }

    /// Noise standard deviation of each output, in its unit: as declared, or a share of the output's spread.
    pub(super) fn noise(&self, records: &[Record]) -> Vec<f64> {
        let outputs = self.model().outputs.iter().enumerate();
        outputs
            .map(|(channel, output)| {
                output.sd.unwrap_or_else(|| DEFAULT_NOISE_RATIO * channel_sd(records, channel))
            })
            .collect()
    }

    /// Builds tasks at nominal parameters over the first samples of windows spread over the records.
    pub(super) fn engine_tasks(&self, records: &[Record]) -> Vec<EngineTask> {
        let total: usize = records.iter().map(|r| r.windows.len()).sum();
        let stride = total.div_ceil(MAX_WINDOWS).max(1);
        let parameters: Vec<f64> = self.parameters.iter().map(|p| p.nominal).collect();
        let record_windows = records.iter().flat_map(|r| r.windows.iter().map(move |w| (r, w)));
        let window_count = total.div_ceil(stride).max(1);
        let samples = MAX_WINDOWS * SAMPLES_PER_WINDOW / window_count;
        let to_engine_task = |(record, window): (&Record, &augsim_system::Window)| {
            let window_samples = window.samples.clone();
            let end = window_samples.end.min(window_samples.start + samples);
            let task = Task {
                parameters: &parameters,
                record,
                window: window_samples.start..end,
                start: &window.start,
                offsets: Offsets::None,
                seeds: &[],
            };
            self.engine_task(&task).ok()
        };
        record_windows.step_by(stride).filter_map(to_engine_task).collect()
    }
}

/// Makes one engine window of each task, from its first sample to its last.
pub(super) fn windows(engine_tasks: &[EngineTask]) -> Vec<Window<'_>> {
    let window =
        |engine_task: &'_ EngineTask| -> (usize, usize) { (0, engine_task.record.times().len() - 1) };
    engine_tasks
        .iter()
        .map(|engine_task| {
            let (first, last) = window(engine_task);
            let (start, parameters) = (&engine_task.start[..], &engine_task.parameters[..]);
            Window { record: &engine_task.record, first, last, start, parameters }
        })
        .collect()
}
