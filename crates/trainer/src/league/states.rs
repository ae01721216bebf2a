//! Whole trajectories in standard units, for nets that give states outright: those of a ball, or the displacement of a pushed object in
//! the frame of its first pose. The condition is the first state (of a push the rod's path), with physics also its roll-out.

use super::trained::Trained;
use crate::prepared::Prepared;
use crate::push::features::{self, Condition};
use crate::recipe::Recipe;
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::Settings;
use crate::{Samples, Task, steps};

/// The paper's recipe that reads the same of a push.
fn like(physics: bool) -> Recipe {
    if physics { Recipe::Hybrid } else { Recipe::Neural }
}

/// Width of a condition row.
pub(super) fn width(settings: &Settings, physics: bool) -> usize {
    match settings.engine.pushing() {
        Some(_) => features::width(like(physics)),
        None => settings.engine.columns().len() * if physics { 2 } else { 1 },
    }
}

/// Sizes of the scales: means, deviations, steps, corrections.
pub(super) fn scale_sizes(settings: &Settings, physics: bool, state: usize) -> [usize; 4] {
    match settings.engine.pushing() {
        Some(_) => [width(settings, physics), width(settings, physics), 0, state],
        None => [state; 4],
    }
}

/// Fits the scales on a training set.
pub(super) fn fit(settings: &Settings, physics: bool, train: &Sequences) -> Scales {
    match settings.engine.pushing() {
        Some(push) => features::fit(like(physics), push, train),
        None => steps::fit(&settings.engine, train),
    }
}

/// Targets and conditions of a whole trajectory.
pub(super) fn prepare(settings: &Settings, physics: bool, scales: &Scales, q: &Sequence) -> Prepared {
    if let Some(push) = settings.engine.pushing() {
        return features::prepare(like(physics), push, scales, q);
    }
    let u = ball_conditions(settings, physics, scales, q.state(0), &q.actions, q.time);
    let mut x: Vec<f32> = q.states.iter().map(|v| *v as f32).collect();
    scales.standardise(&mut x);
    Prepared { time: q.time, x_width: x.len() / q.time, u_width: u.len() / q.time, x, u }
}

fn ball_conditions(
    settings: &Settings,
    physics: bool,
    scales: &Scales,
    start: &[f64],
    actions: &[f64],
    time: usize,
) -> Vec<f32> {
    let mut u = steps::conditions(like(physics), &settings.engine, scales, start, actions, time);
    scales.standardise(&mut u);
    u
}

/// Conditions `[time, U]` and the first state `[S]` of a task, both in standard units, and the way back.
pub(super) struct Given {
    pub u: Vec<f32>,
    pub first: Vec<f32>,
    push: Option<Condition>,
}

impl Given {
    pub fn of(Trained { settings, scales, .. }: Trained<'_>, physics: bool, task: Task<'_>) -> Self {
        if let Some(push) = settings.engine.pushing() {
            let condition = Condition::new(like(physics), push, task.start, task.actions);
            // Targets are displacements from the first pose.
            return Given {
                u: features::standard(scales, &condition),
                first: vec![0.0; 3],
                push: Some(condition),
            };
        }
        let mut first: Vec<f32> = task.start.iter().map(|v| *v as f32).collect();
        scales.standardise(&mut first);
        let u = ball_conditions(settings, physics, scales, task.start, task.actions, task.time);
        Given { u, first, push: None }
    }

    /// Trajectories `[time, S, sample]` in standard units, in units of the data; the first state is the one that is known.
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
