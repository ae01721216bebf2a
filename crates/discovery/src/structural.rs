//! The test of an addition that changes the simulation by its presence: one simulation of its own, and one step.

use crate::addition::Addition;
use crate::cluster::clusters;
use crate::dispersion::{Quadratic, dispersion};
use crate::evaluate::Lanes;
use crate::fit::{ChosenRecords, Fit, assembled, reduce};
use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::scored::Score;
use augsim_physics::system::Effect;

/// Values at which an effect is first simulated: its nulls, or near them for a law that is singular there.
pub(crate) fn probe(effect: &Effect) -> Vec<f64> {
    if effect.probe.is_empty() {
        effect.parameters.iter().map(|p| p.null).collect()
    } else {
        effect.probe.clone()
    }
}

/// Score of an addition by one Gauss-Newton step of all parameters from its probe.
pub(crate) fn structural_score(sample: &ChosenRecords<'_>, fit: &Fit, addition: &Addition) -> Score {
    sample.data.tally.score();
    let additions = [&fit.hypothesis.additions[..], std::slice::from_ref(addition)].concat();
    let mut h = Hypothesis::new(sample.data, &additions);
    h.scatter = fit.hypothesis.scatter;
    let probe = addition.listed().map_or_else(Vec::new, probe);
    let theta = [&fit.theta[..], &probe].concat();
    let p = theta.len();
    let excerpts = sample.excerpts();
    let lanes: Vec<Lanes> = excerpts.iter().map(|&at| Lanes::new(&h, at, &[])).collect();
    let normals = assembled(sample, &h, &lanes, &theta, &fit.nuisance);
    let cost: f64 = normals.iter().map(|n| n.q).sum();
    let mut score = Score {
        addition: addition.clone(),
        statistic: 0.0,
        unsigned: 0.0,
        point: probe.clone(),
        rank: 0.0,
        estimate: probe.clone(),
        sd: vec![f64::INFINITY; probe.len()],
        dispersion: None,
    };
    if !cost.is_finite() {
        return score;
    }
    let (s, u, starts) = reduce(&h, &lanes, &normals, 0.0);
    let mut step = u.clone();
    s.cholesky().solve(&mut step);
    let next: Vec<f64> = theta
        .iter()
        .zip(&step)
        .zip(h.bounds())
        .map(|((t, d), (low, high))| (t + d).clamp(low, high))
        .collect();
    // A step that the bounds stop gains less.
    let step: Vec<f64> = next.iter().zip(&theta).map(|(a, b)| a - b).collect();
    // Corners of the cost promise what no step keeps, to the fit itself as well.
    let gain = fit.cost - cost + starts + fall(&s, &u, &step) - fit.promise;
    score.statistic = gain.max(0.0);
    score.unsigned = score.statistic;
    score.rank = probe.len().max(1) as f64;
    score.estimate = next[p - probe.len()..].to_vec();
    if sample.data.is_idealised() {
        let each: Vec<Quadratic> =
            clusters(&sample.of_records(), &lanes, &normals).iter().map(|c| c.quadratic(p)).collect();
        let range = if probe.is_empty() { 0..p } else { p - probe.len()..p };
        score.dispersion = Some(dispersion(&s, &u, &each, range, sample.data.white_share));
    }
    score
}

/// Fall of the cost along a step, by gradient and curvature.
fn fall(s: &Square, u: &[f64], step: &[f64]) -> f64 {
    let along = |i: usize| 2.0 * u[i] - (0..step.len()).map(|j| s.at(i, j) * step[j]).sum::<f64>();
    (0..step.len()).map(|i| step[i] * along(i)).sum()
}
