//! Multiple-shooting windows of records, and the estimation problem that they belong to.

use augsim_physics::system::{InitialValue, Record, Schema, System, channel_sd};
use std::ops::Range;
use std::time::Instant;

/// RMSE below this share of a channel's standard deviation counts as a perfect fit.
pub(crate) const NEGLIGIBLE_RMSE: f64 = 1e-6;

/// A multiple-shooting window: consecutive samples of a record with an initial state of their own.
#[derive(Clone, Debug)]
pub(crate) struct ShootingWindow {
    pub record: usize,
    pub samples: Range<usize>,
    pub initial_state: Vec<f64>,
}

/// The parameters and initial states to estimate, and the records that they are fitted to.
#[derive(Debug)]
pub(crate) struct Problem<'a> {
    pub system: &'a dyn System,
    pub records: &'a [Record],
    /// Indices of the estimated parameters.
    pub free_parameters: Vec<usize>,
    /// Indices of the states whose initial values are estimated.
    pub free_states: Vec<usize>,
    /// Deadline after which fits return the best point so far; `None` for no deadline.
    pub until: Option<Instant>,
}

impl<'a> Problem<'a> {
    pub fn new(system: &'a dyn System, records: &'a [Record], fit_parameters: bool) -> Self {
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

    /// Standard deviation of the data of each channel, in its unit.
    ///
    /// Fits begin with it as the scale of the residuals.
    pub fn channel_sd(&self) -> Vec<f64> {
        (0..self.schema().channels.len()).map(|channel| channel_sd(self.records, channel)).collect()
    }

    pub fn schema(&self) -> &Schema {
        self.system.schema()
    }

    /// Mean and standard deviation of the prior of an initial state; `None` if it has no prior.
    ///
    /// Only a window at the start of a record has priors.
    pub fn prior(&self, window: &ShootingWindow, state: usize) -> Option<(f64, f64)> {
        match self.schema().states.get(state)?.initial {
            InitialValue::Prior(mean, sd) if window.samples.start == 0 => Some((mean, sd)),
            _ => None,
        }
    }

    /// The windows into which the records were cut when they were prepared.
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
