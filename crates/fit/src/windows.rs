//! Multiple-shooting windows of records, and the estimation problem that they belong to.

use augsim_system::{InitialValue, Record, Schema, Simulate, channel_sd};
use std::ops::Range;
use std::time::Instant;

/// RMSE, as a share of a channel's standard deviation, below which a fit counts as perfect.
pub(crate) const NEGLIGIBLE_RMSE: f64 = 1e-6;

/// A multiple-shooting window: consecutive samples of a record with an initial state of their own.
#[derive(Clone, Debug)]
pub(crate) struct ShootingWindow {
    pub record: usize,
    pub samples: Range<usize>,
    pub initial_state: Vec<f64>,
}

/// Relative step of the finite differences by which the mean of an initial-state prior is differentiated.
///
/// The cube root of the rounding error of `f64` minimises the error of a central difference.
const START_SLOPE_STEP: f64 = 6e-6;

/// An unknown with respect to which the mean of an initial-state prior is differentiated, by index.
#[derive(Clone, Copy)]
enum Unknown {
    Parameter(usize),
    State(usize),
}

/// Normal prior of an initial state: it adds the squared residual (deviation / sd)² to the cost.
#[derive(Clone, Debug)]
pub(crate) struct StartPrior {
    /// Prior mean minus initial state, in the unit of the state.
    pub deviation: f64,
    pub sd: f64,
    /// Derivatives of the initial state minus the prior mean: by the free parameters, then by the free
    /// states.
    pub row: Vec<f64>,
}

/// Estimation problem: the parameters and initial states to estimate, and the records that they are fitted
/// to.
#[derive(Debug)]
pub(crate) struct Problem<'a> {
    pub system: &'a dyn Simulate,
    pub records: &'a [Record],
    /// Indices of the estimated parameters.
    pub free_parameters: Vec<usize>,
    /// Indices of the states whose initial values are estimated.
    pub free_states: Vec<usize>,
    /// Deadline after which fits return the best point so far; `None` for no deadline.
    pub until: Option<Instant>,
}

impl<'a> Problem<'a> {
    pub fn new(system: &'a dyn Simulate, records: &'a [Record], fit_parameters: bool) -> Self {
        let parameters = system.parameters().iter().enumerate();
        let free_parameters =
            parameters.filter(|(_, p)| fit_parameters && !p.frozen).map(|(i, _)| i).collect();
        let free_states = system.schema().free_states().collect();
        Self { system, records, free_parameters, free_states, until: None }
    }

    /// Whether the deadline has passed.
    pub fn is_over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }

    /// Standard deviation of the measured values of each channel, in its unit.
    ///
    /// Fits begin with it as the residual scale of the channel.
    pub fn channel_sd(&self) -> Vec<f64> {
        (0..self.schema().channels.len()).map(|channel| channel_sd(self.records, channel)).collect()
    }

    pub fn schema(&self) -> &Schema {
        self.system.schema()
    }

    /// Prior of the initial state with index `state`, at the parameter values `values`; `None` if it has
    /// none.
    ///
    /// Only the first window of a record has priors of its initial state.
    pub fn prior(&self, values: &[f64], window: &ShootingWindow, state: usize) -> Option<StartPrior> {
        if window.samples.start != 0 {
            return None;
        }
        let unknowns = self.free_parameters.len() + self.free_states.len();
        let own = self.free_parameters.len() + self.free_states.iter().position(|s| *s == state)?;
        let mut row = vec![0.0; unknowns];
        row[own] = 1.0;
        match self.schema().states.get(state)?.initial {
            InitialValue::Prior(mean, sd) => {
                Some(StartPrior { deviation: mean - window.initial_state[state], sd, row })
            }
            InitialValue::PriorAboutExpression(sd) => {
                let record = &self.records[window.record];
                let (mut values, mut start) = (values.to_vec(), window.initial_state.clone());
                let mean = self.system.start_mean(record, state, &values, &start);
                let slope = |values: &mut [f64], start: &mut [f64], of: Unknown| {
                    let place = |values: &mut [f64], start: &mut [f64], x: f64| match of {
                        Unknown::Parameter(i) => std::mem::replace(&mut values[i], x),
                        Unknown::State(i) => std::mem::replace(&mut start[i], x),
                    };
                    let x = place(values, start, 0.0);
                    let step = START_SLOPE_STEP * x.abs().max(1.0);
                    let ends = [x + step, x - step].map(|x| {
                        place(values, start, x);
                        self.system.start_mean(record, state, values, start)
                    });
                    place(values, start, x);
                    (ends[0] - ends[1]) / (2.0 * step)
                };
                let parameters = self.free_parameters.iter().map(|i| Unknown::Parameter(*i));
                let unknowns = parameters.chain(self.free_states.iter().map(|i| Unknown::State(*i)));
                for (entry, of) in row.iter_mut().zip(unknowns) {
                    *entry -= slope(&mut values, &mut start, of);
                }
                Some(StartPrior { deviation: mean - window.initial_state[state], sd, row })
            }
            _ => None,
        }
    }

    /// The windows into which the records were divided when they were prepared.
    pub fn prepared_windows(&self) -> Vec<ShootingWindow> {
        let mut windows = Vec::new();
        for (record, prepared) in self.records.iter().enumerate() {
            windows.extend(prepared.windows.iter().map(|w| ShootingWindow {
                record,
                samples: w.samples.clone(),
                initial_state: w.start.clone(),
            }));
        }
        windows
    }
}

/// Merges neighbouring windows of a record in pairs.
///
/// A merged window starts from the initial state of the first of its two windows.
pub(crate) fn merge_pairs(windows: &[ShootingWindow]) -> Vec<ShootingWindow> {
    let mut merged: Vec<ShootingWindow> = Vec::new();
    let mut last_is_pair = false;
    for window in windows {
        match merged.last_mut() {
            Some(last) if last.record == window.record && !last_is_pair => {
                last.samples.end = window.samples.end;
                last_is_pair = true;
            }
            _ => {
                merged.push(window.clone());
                last_is_pair = false;
            }
        }
    }
    merged
}
