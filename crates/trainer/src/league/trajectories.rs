//! Whole trajectories in standard units, for nets that predict states directly.
//!
//! The states are those of a ball, or the displacement of a pushed object in the frame of its initial pose.
//! The condition is the initial state (for a push, the rod's path), with physics also the physics roll-out.

use super::trained::Trained;
use crate::prepared::Prepared;
use crate::push::features::{self, Condition};
use crate::recipe::Recipe;
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::Settings;
use crate::{Samples, Task, steps};

/// The recipe of the paper whose nets read the same conditions.
fn equivalent_recipe(physics: bool) -> Recipe {
    if physics { Recipe::Hybrid } else { Recipe::Neural }
}

/// Returns the number of conditions (net inputs) per row.
pub(super) fn width(settings: &Settings, physics: bool) -> usize {
    match settings.engine.push_model() {
        Some(_) => features::width(equivalent_recipe(physics)),
        None => settings.engine.columns().len() * if physics { 2 } else { 1 },
    }
}

/// Number of values of each normalisation scale: mean, sd, step, correction.
pub(super) fn scale_sizes(settings: &Settings, physics: bool, state: usize) -> [usize; 4] {
    match settings.engine.push_model() {
        Some(_) => [width(settings, physics), width(settings, physics), 0, state],
        None => [state; 4],
    }
}

/// Fits the normalisation scales on a training set.
pub(super) fn fit(settings: &Settings, physics: bool, train: &Sequences) -> Scales {
    match settings.engine.push_model() {
        Some(push) => features::fit(equivalent_recipe(physics), push, train),
        None => steps::fit(&settings.engine, train),
    }
}

/// Computes targets and conditions (net inputs) of a whole trajectory.
pub(super) fn prepare(settings: &Settings, physics: bool, scales: &Scales, q: &Sequence) -> Prepared {
    if let Some(push) = settings.engine.push_model() {
        return features::prepare(equivalent_recipe(physics), push, scales, q);
    }
    let u = ball_conditions(settings, physics, scales, q.state(0), &q.actions, q.time);
    let mut x: Vec<f32> = q.states.iter().map(|v| *v as f32).collect();
    scales.standardise(&mut x);
    Prepared { time: q.time, x_width: x.len() / q.time, u_width: u.len() / q.time, x, u }
}

/// Computes the conditions (net inputs) `[time, U]` of a ball in standard units.
fn ball_conditions(
    settings: &Settings,
    physics: bool,
    scales: &Scales,
    start: &[f64],
    actions: &[f64],
    time: usize,
) -> Vec<f32> {
    let mut u = steps::conditions(equivalent_recipe(physics), &settings.engine, scales, start, actions, time);
    scales.standardise(&mut u);
    u
}

/// A forecast task in standard units, and the conversion of forecasts back to units of the data.
pub(super) struct StandardTask {
    /// Conditions (net inputs) `[time, U]`, in standard units.
    pub u: Vec<f32>,
    /// Initial state `[S]`, in standard units.
    pub initial_state: Vec<f32>,
    /// Features of a push, whose frame restores the poses; `None` for a ball.
    push: Option<Condition>,
}

impl StandardTask {
    /// Converts a task to standard units; `physics` adds the physics roll-out to the conditions.
    pub fn new(Trained { settings, scales, .. }: Trained<'_>, physics: bool, task: Task<'_>) -> Self {
        if let Some(push) = settings.engine.push_model() {
            let condition = Condition::new(equivalent_recipe(physics), push, task.start, task.actions);
            // Targets are displacements from the initial pose, so the initial state is 0.
            return StandardTask {
                u: features::standard(scales, &condition),
                initial_state: vec![0.0; 3],
                push: Some(condition),
            };
        }
        let mut initial_state: Vec<f32> = task.start.iter().map(|v| *v as f32).collect();
        scales.standardise(&mut initial_state);
        let u = ball_conditions(settings, physics, scales, task.start, task.actions, task.time);
        StandardTask { u, initial_state, push: None }
    }

    /// Converts trajectories `[time, S, sample]` to units of the data, and fixes their first state.
    pub fn restore(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        mut values: Vec<f32>,
        samples: usize,
    ) -> Samples {
        match &self.push {
            Some(condition) => features::restore(trained.scales, condition, &mut values, samples),
            None => trained.scales.restore(&mut values, samples),
        }
        for (row, start) in values.chunks_exact_mut(samples).zip(task.start) {
            row.fill(*start as f32);
        }
        Samples { count: samples, values }
    }
}
