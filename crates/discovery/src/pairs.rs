//! Score tests of pairs: two effects that are both needed may each be useless, or have the wrong sign, alone.
//!
//! Dry friction and a drag that grows with speed are one example: beside a viscous term each alone makes forecasts worse. The
//! gain of a pair follows from the same normal equations as those of single effects, and costs one simulation for all of them.

use crate::addition::Addition;
use crate::fit::{ChosenRecords, Fit};
use crate::linear::{Square, eliminate};
use crate::score::{Joint, OBSERVABLE, RANK_CUT, joint, unit};
use crate::scored::Score;

/// Parameters of all candidates whose pairs are looked at.
const WIDTH: usize = 32;

/// Two candidates and what they would gain together.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    /// Each with its one-step estimate.
    pub members: Vec<(Addition, Vec<f64>)>,
    /// Chi-squared statistic of both.
    pub statistic: f64,
    /// The larger statistic of one of them alone.
    pub alone: f64,
}

/// Pairs of the candidates whose scores are highest whatever their sign, best first. Amounts that have a sign have it in the
/// estimate of a pair.
pub(crate) fn pairs(sample: &ChosenRecords<'_>, fit: &Fit, scores: &[Score]) -> Vec<Pair> {
    let mut list: Vec<&Score> = scores.iter().filter(|s| s.rank > 0.0).collect();
    list.sort_by(|a, b| b.unsigned.total_cmp(&a.unsigned));
    let mut width = 0;
    list.retain(|s| {
        width += s.addition.size();
        width <= WIDTH
    });
    let candidates: Vec<Addition> = list.iter().map(|s| s.addition.clone()).collect();
    let tests: Vec<(usize, Vec<f64>)> = list.iter().map(|s| s.point.clone()).enumerate().collect();
    let batch: Vec<&(usize, Vec<f64>)> = tests.iter().collect();
    let Some(together) = joint(sample, fit, &candidates, &batch) else { return Vec::new() };
    let theta = fit.hypothesis.theta_len();
    let mut out = Vec::new();
    for a in 0..together.owned.len() {
        for b in a + 1..together.owned.len() {
            let (i, j) = (together.owned[a].0, together.owned[b].0);
            if candidates[i].excludes(&candidates[j]) || candidates[j].excludes(&candidates[i]) {
                continue;
            }
            if let Some((statistic, members)) = pair(&together, &candidates, [a, b], theta) {
                let alone = list[i].statistic.max(list[j].statistic);
                out.push(Pair { members, statistic, alone });
            }
        }
    }
    out.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
    out
}

type Members = Vec<(Addition, Vec<f64>)>;

/// Statistic and estimates of two candidates; `None` where an amount would have a sign that it cannot have, or where the two are
/// one in these data.
fn pair(
    together: &Joint<'_>,
    candidates: &[Addition],
    two: [usize; 2],
    theta: usize,
) -> Option<(f64, Members)> {
    let owned = two.map(|k| &together.owned[k]);
    let entries: Vec<usize> = owned.iter().flat_map(|(_, _, range)| range.clone()).collect();
    let keep = entries.len();
    let order: Vec<usize> = entries.into_iter().chain(0..theta).collect();
    let gradient: Vec<f64> = order.iter().map(|&i| together.u[i]).collect();
    let (c, v, _) = eliminate(&together.s.sub(&order), &gradient, keep);
    let sizes = owned.iter().flat_map(|(i, point, _)| {
        (0..point.len()).map(|k| unit(&candidates[*i], k, point.len())).collect::<Vec<_>>()
    });
    let raw: Vec<f64> = order[..keep].iter().map(|&i| together.s.at(i, i).max(0.0)).collect();
    let scale: Vec<f64> = raw
        .iter()
        .zip(sizes)
        .map(|(r, size)| if r * size > OBSERVABLE { r.sqrt().recip() } else { 0.0 })
        .collect();
    let mut scaled = Square::zero(keep);
    for i in 0..keep {
        for j in 0..keep {
            *scaled.at_mut(i, j) = c.at(i, j) * scale[i] * scale[j];
        }
    }
    let (values, vectors) = scaled.eigen();
    let (mut statistic, mut rank, mut step) = (0.0, 0, vec![0.0; keep]);
    for (k, value) in values.iter().enumerate().filter(|(_, v)| **v > RANK_CUT) {
        let along: f64 = (0..keep).map(|i| vectors.at(i, k) * v[i] * scale[i]).sum();
        statistic += along * along / value;
        rank += 1;
        (0..keep).for_each(|i| step[i] += vectors.at(i, k) * scale[i] * along / value);
    }
    if rank < 2 || !f64::is_finite(statistic) {
        return None;
    }
    let mut members = Vec::new();
    let mut at = 0;
    for (i, point, range) in owned {
        let values: Vec<f64> = point.iter().zip(&step[at..at + range.len()]).map(|(p, d)| p + d).collect();
        at += range.len();
        let bounded = candidates[*i].parameters();
        if values.iter().zip(bounded).any(|(value, p)| p.null == 0.0 && p.min >= 0.0 && *value < 0.0) {
            return None;
        }
        members.push((candidates[*i].clone(), values));
    }
    Some((statistic, members))
}
