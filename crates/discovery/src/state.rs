//! A place of a fit: values that all windows share, each window's own, and the normal equations there.

use crate::chosen_records::ChosenRecords;
use crate::evaluate::{Lanes, Normal};
use crate::follow::{Follower, assembled_at, followed, nuisance_step};
use crate::hypothesis::Hypothesis;

/// Values, and what the data say there.
pub(crate) struct State {
    pub theta: Vec<f64>,
    /// Nuisances of each window.
    pub nuisance: Vec<Vec<f64>>,
    pub normals: Vec<Normal>,
    /// The cost: that of all windows.
    pub q: f64,
}

impl State {
    /// The state at `theta` and the nuisances of all windows.
    pub fn at(
        sample: &ChosenRecords<'_>,
        h: &Hypothesis,
        lanes: &[Lanes],
        theta: Vec<f64>,
        nuisance: Vec<Vec<f64>>,
    ) -> Self {
        let normals = assembled(sample, h, lanes, &theta, &nuisance);
        let q = normals.iter().map(|n| n.q).sum();
        Self { theta, nuisance, normals, q }
    }

    /// The state after a step of theta, each window's nuisances having followed it.
    ///
    /// A window whose cost rises is judged only after its nuisances have followed: without this, strongly coupled nuisances make
    /// the path a curved valley that is crawled along.
    pub fn advanced(
        &self,
        sample: &ChosenRecords<'_>,
        h: &Hypothesis,
        lanes: &[Lanes],
        step: &[f64],
        damping: f64,
    ) -> Self {
        let theta: Vec<f64> = self.theta.iter().zip(step).map(|(t, d)| t + d).collect();
        let each = lanes.iter().zip(&self.normals).zip(&self.nuisance);
        let full: Vec<Vec<f64>> =
            each.map(|((lanes, before), now)| nuisance_step(lanes, before, now, step, damping)).collect();
        let goes_far = h.system.begins_from_first_samples();
        let windows = sample.excerpts();
        let trials = assembled_at(sample, h, &windows, lanes, &theta, &full);
        let all = windows.iter().zip(lanes).zip(&self.normals).zip(&self.nuisance);
        let followers = all.zip(trials.into_iter().zip(full)).map(|((((at, lanes), before), now), trial)| {
            let common = lanes.theta.iter().map(|&t| step[t]);
            let change = common.chain(trial.1.iter().zip(now).map(|(to, from)| to - from));
            // Where laws are missing steps trade windows for one another; near the noise those that rise pass an event.
            let expected =
                if goes_far { before.q.max(before.foretold(&change.collect::<Vec<_>>())) } else { before.q };
            Follower::after_a_step(*at, lanes, trial, now, expected)
        });
        let (normals, nuisance): (Vec<Normal>, Vec<Vec<f64>>) =
            followed(sample, h, &theta, followers.collect()).into_iter().unzip();
        let q = normals.iter().map(|n| n.q).sum();
        Self { theta, nuisance, normals, q }
    }
}

/// The normal equations of all windows at a point.
pub(crate) fn assembled(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    lanes: &[Lanes],
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Vec<Normal> {
    assembled_at(sample, h, &sample.excerpts(), lanes, theta, nuisance)
}
