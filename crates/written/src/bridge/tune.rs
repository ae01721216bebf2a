//! Settings of a simulation that data decide: steps, widths of jumps, the time constant, sizes.

use super::WrittenSystem;
use super::records::Scene;
use crate::engine::{Method, Options, Point, SimulationError as EngineError, Window, fastest};
use crate::library::Scales;
use augsim_physics::system::{Offsets, Record, SimulationError, Task, spread};
use std::sync::Arc;

/// Windows that steps and widths are chosen on, spread over the records.
const LOOKED_AT: usize = 64;
/// Samples of a window that are looked at where there are so many windows; of fewer windows more, as many samples in all. A
/// record that is one window may begin at rest, which tells neither steps nor widths.
const SAMPLES: usize = 400;
/// Steps are judged against this share of what an output does where its noise is not declared.
const USUAL_NOISE: f64 = 0.01;

impl WrittenSystem {
    /// Sets widths of jumps and steps that suit the records, which were prepared by this system.
    ///
    /// # Errors
    /// Rates that are too fast for any number of steps, or a window that cannot be simulated.
    pub fn tuned(mut self, records: &[Record]) -> Result<Self, EngineError> {
        let scenes = self.scenes(records);
        let windows = windows(&scenes);
        let fine = Options { substeps: self.options.substeps.max(8), ..self.options.clone() };
        let mut compiled = (*self.compiled).clone();
        compiled.fit_widths(&windows, &fine)?;
        self.options = compiled.choose_steps(&windows, &self.noise(records))?.options;
        self.compiled = Arc::new(compiled);
        self.complete = Arc::default();
        Ok(self)
    }

    /// Sizes of all quantities over the records, which were prepared by this system.
    pub fn scales(&self, records: &[Record]) -> Scales {
        Scales::of(&self.compiled, &windows(&self.scenes(records)), &self.options)
    }

    /// Time constant of the fastest mode at the starts of windows, s: one over its rate. Nothing where no rate moves.
    pub fn fastest_s(&self, records: &[Record]) -> Option<f64> {
        let n = self.model().states.len();
        let rate = |scene: &Scene| {
            let time = scene.record.times().first().copied().unwrap_or(0.0);
            let inputs: Vec<f64> = scene.record.inputs().iter().map(|signal| signal.at(time)).collect();
            let (state, parameters) = (&scene.start[..], &scene.parameters[..]);
            let found = self.compiled.linearise(&Point { state, inputs: &inputs, parameters, time });
            fastest(&found.by_state, n).0
        };
        let mut rates: Vec<f64> =
            self.scenes(records).iter().map(rate).filter(|r| r.is_finite() && *r > 0.0).collect();
        rates.sort_by(f64::total_cmp);
        rates.get(rates.len() / 2).map(|rate| 1.0 / rate)
    }

    /// All outputs of a record from a start at its first sample, `[sample][output]`, by the adaptive reference.
    ///
    /// # Errors
    /// The window cannot be simulated.
    pub fn reference(&self, task: &Task<'_>) -> Result<Vec<f64>, SimulationError> {
        let scene = self.scene(task)?;
        let all = windows(std::slice::from_ref(&scene));
        let options = Options { method: Method::Reference { tolerance: 1e-9 }, substeps: 1 };
        let result = self.compiled.simulate(&all, &[], &options).pop();
        match result {
            Some(Ok(simulated)) => Ok(simulated.values),
            Some(Err(error)) => Err(SimulationError::Engine(Box::new(error))),
            None => Ok(Vec::new()),
        }
    }

    /// Standard deviation of the sensor of each output: declared, or a usual share of what the output does.
    pub(super) fn noise(&self, records: &[Record]) -> Vec<f64> {
        let outputs = self.model().outputs.iter().enumerate();
        outputs
            .map(|(channel, output)| output.sd.unwrap_or_else(|| USUAL_NOISE * spread(records, channel)))
            .collect()
    }

    /// Beginnings of windows, spread over the records, at nominal values.
    pub(super) fn scenes(&self, records: &[Record]) -> Vec<Scene> {
        let total: usize = records.iter().map(|r| r.windows.len()).sum();
        let stride = total.div_ceil(LOOKED_AT).max(1);
        let parameters: Vec<f64> = self.parameters.iter().map(|p| p.nominal).collect();
        let all = records.iter().flat_map(|r| r.windows.iter().map(move |w| (r, w)));
        let looked_at = total.div_ceil(stride).max(1);
        let most = LOOKED_AT * SAMPLES / looked_at;
        let scene = |(record, window): (&Record, &augsim_physics::system::Window)| {
            let samples = window.samples.clone();
            let end = samples.end.min(samples.start + most);
            let window_samples = samples.start..end;
            let task = Task {
                parameters: &parameters,
                record,
                window: window_samples,
                start: &window.start,
                offsets: Offsets::None,
                seeds: &[],
            };
            self.scene(&task).ok()
        };
        all.step_by(stride).filter_map(scene).collect()
    }
}

/// The window of each scene, from its first sample to its last.
pub(super) fn windows(scenes: &[Scene]) -> Vec<Window<'_>> {
    let window = |scene: &'_ Scene| -> (usize, usize) { (0, scene.record.times().len() - 1) };
    scenes
        .iter()
        .map(|scene| {
            let (first, last) = window(scene);
            let (start, parameters) = (&scene.start[..], &scene.parameters[..]);
            Window { record: &scene.record, first, last, start, parameters }
        })
        .collect()
}
