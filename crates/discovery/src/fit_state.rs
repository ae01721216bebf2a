//! State of a fit: shared parameters, nuisances of each window, and the normal equations there.

use crate::evaluate::{Lanes, NormalEquations};
use crate::hypothesis::Hypothesis;
use crate::nuisance_fit::{NuisanceFit, assemble_windows, finish_nuisance_fits, nuisance_step};
use crate::record::ChosenRecords;

/// Point in a fit: parameters, nuisances (initial state, record parameters, event offsets) of the windows,
/// and the normal equations there.
pub(crate) struct State {
    pub theta: Vec<f64>,
    /// Initial state, record parameters and event offsets (together the nuisances) of each window.
    pub nuisance: Vec<Vec<f64>>,
    pub normals: Vec<NormalEquations>,
    /// Sum of the costs of all windows.
    pub q: f64,
}

impl State {
    /// Evaluates the normal equations at `theta` (the shared parameters) and the nuisances (initial state,
    /// record parameters, event offsets) of all windows.
    pub fn evaluate(
        sample: &ChosenRecords<'_>,
        h: &Hypothesis,
        lanes: &[Lanes],
        theta: Vec<f64>,
        nuisance: Vec<Vec<f64>>,
    ) -> Self {
        let normals = assemble_all(sample, h, lanes, &theta, &nuisance);
        let q = normals.iter().map(|n| n.q).sum();
        Self { theta, nuisance, normals, q }
    }

    /// Moves theta (the shared parameters) by `step` and refits the nuisances (initial state, record
    /// parameters, event offsets) of each window.
    ///
    /// The costs of windows are compared only after their nuisances were refitted. Otherwise strongly coupled
    /// nuisances make the path a curved valley that allows only small steps.
    pub fn after_step(
        &self,
        sample: &ChosenRecords<'_>,
        h: &Hypothesis,
        lanes: &[Lanes],
        step: &[f64],
        damping: f64,
    ) -> Self {
        let theta: Vec<f64> = self.theta.iter().zip(step).map(|(t, d)| t + d).collect();
        let windows_before = lanes.iter().zip(&self.normals).zip(&self.nuisance);
        let full: Vec<Vec<f64>> = windows_before
            .map(|((lanes, before), now)| nuisance_step(lanes, before, now, step, damping))
            .collect();
        let has_rough_starts = h.system.starts_from_first_samples();
        let windows = sample.windows();
        let trials = assemble_windows(sample, h, &windows, lanes, &theta, &full);
        let with_states = windows.iter().zip(lanes).zip(&self.normals).zip(&self.nuisance);
        let followers =
            with_states.zip(trials.into_iter().zip(full)).map(|((((window, lanes), before), now), trial)| {
                let of_theta = lanes.theta.iter().map(|&t| step[t]);
                let change = of_theta.chain(trial.1.iter().zip(now).map(|(to, from)| to - from));
                // With missing effects a step improves some windows at the cost of others, so a predicted
                // rise is accepted; near the noise a rise means a passed event.
                let expected = if has_rough_starts {
                    before.q.max(before.predicted_cost(&change.collect::<Vec<_>>()))
                } else {
                    before.q
                };
                NuisanceFit::after_theta_step(*window, lanes, trial, now, expected)
            });
        let (normals, nuisance): (Vec<NormalEquations>, Vec<Vec<f64>>) =
            finish_nuisance_fits(sample, h, &theta, followers.collect()).into_iter().unzip();
        let q = normals.iter().map(|n| n.q).sum();
        Self { theta, nuisance, normals, q }
    }
}

/// Computes the normal equations of all windows at given parameters and nuisances (initial state, record
/// parameters, event offsets).
pub(crate) fn assemble_all(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    lanes: &[Lanes],
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Vec<NormalEquations> {
    assemble_windows(sample, h, &sample.windows(), lanes, theta, nuisance)
}
