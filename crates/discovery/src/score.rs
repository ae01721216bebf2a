//! Score tests: what a candidate would gain, without fitting it (Rao 1948).

use crate::addition::Addition;
use crate::cluster::ranges;
use crate::dispersion::{Dispersion, Quadratic, dispersion};
use crate::evaluate::{Lanes, Point, normals};
use crate::fit::{ChosenRecords, Fit, assembled};
use crate::linear::{Square, eliminate};
use crate::scored::Score;
use crate::structural::structural_score;
use augsim_physics::model::Per;
use augsim_physics::system::{Effect, Law};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Parameters of one batch, where records are simulated one by one and where many are side by side.
const BATCH: usize = 16;
const WIDE_BATCH: usize = 32;
/// Eigenvalues of the scaled information below this are directions that the data do not see.
pub(crate) const RANK_CUT: f64 = 1e-4;
/// Information below this, in raw units of the parameter, is none.
pub(crate) const OBSERVABLE: f64 = 1e-7;

/// Score tests of candidates (no scatter) at a fit, in the order given.
pub(crate) fn scores(sample: &ChosenRecords<'_>, fit: &Fit, candidates: &[Addition]) -> Vec<Score> {
    let mut batches: Vec<Vec<usize>> = Vec::new();
    let (structural, others): (Vec<usize>, Vec<usize>) =
        (0..candidates.len()).partition(|&i| candidates[i].is_structural());
    // What makes every simulation dearer is tested apart from what does not.
    // One place for each null point: effects with a width or a threshold have several.
    let system = &fit.hypothesis.system;
    let most = if system.side_by_side() > 1 { WIDE_BATCH } else { BATCH };
    let tests: Vec<(usize, Vec<f64>)> = others
        .into_iter()
        .map(|i| (i, &candidates[i]))
        .flat_map(|(i, c)| {
            let points = match c {
                Addition::Effect(listed, _) => system.null_points(listed.index),
                _ => vec![vec![0.0; c.size()]],
            };
            points.into_iter().map(move |point| (i, point))
        })
        .collect();
    for costly in [false, true] {
        let mut batch: Vec<usize> = Vec::new();
        let mut width = 0;
        let some = tests.iter().map(|(i, _)| &candidates[*i]).enumerate();
        for (i, c) in some.filter(|(_, c)| c.is_costly() == costly) {
            if width + c.size() > most {
                batches.push(std::mem::take(&mut batch));
                width = 0;
            }
            batch.push(i);
            width += c.size();
        }
        batches.push(batch);
    }
    batches.retain(|b| !b.is_empty());
    let mut out: Vec<Option<Score>> = vec![None; candidates.len()];
    let done: Vec<Vec<(usize, Score)>> = batches
        .par_iter()
        .map(|b| {
            let batch: Vec<&(usize, Vec<f64>)> = b.iter().map(|&t| &tests[t]).collect();
            batch_scores(sample, fit, candidates, &batch)
        })
        .collect();
    let own = structural.par_iter().map(|&i| (i, structural_score(sample, fit, &candidates[i])));
    let own: Vec<(usize, Score)> = own.collect();
    for (i, s) in done.into_iter().flatten().chain(own) {
        if out[i].as_ref().is_none_or(|best| s.statistic > best.statistic) {
            out[i] = Some(s);
        }
    }
    out.into_iter().flatten().collect()
}

/// Information and gradient of theta and of candidates beside it, nuisances eliminated.
pub(crate) struct Joint<'b> {
    pub s: Square,
    pub u: Vec<f64>,
    /// Place in the list, point and entries of each candidate.
    pub owned: Vec<(usize, &'b [f64], std::ops::Range<usize>)>,
    /// Information and gradient of each window's entries, and which entries these are.
    parts: Vec<(Square, Vec<f64>, Vec<usize>)>,
}

/// The joint information of a fit and of the candidates of a batch, each at its point; `None` for candidates that cannot stand
/// in one system.
pub(crate) fn joint<'b>(
    sample: &ChosenRecords<'_>,
    fit: &Fit,
    candidates: &[Addition],
    batch: &[&'b (usize, Vec<f64>)],
) -> Option<Joint<'b>> {
    batch.iter().for_each(|_| sample.data.tally.score());
    let h = &fit.hypothesis;
    let mut laws: Vec<Law> = Vec::new();
    let mut parameters = h.system.parameters().len();
    let groups = sample.data.groups.len();
    let theta_len = h.theta_len();
    // Lane by lane: which parameter of the system, which columns of the common matrix.
    let mut extras: Vec<usize> = Vec::new();
    let mut columns: Vec<(usize, bool)> = Vec::new();
    let mut owned: Vec<(usize, &'b [f64], std::ops::Range<usize>)> = Vec::new();
    // Columns of values by group: the entry of theta whose lane they share, and the first of them.
    let mut shared: Vec<(usize, usize)> = Vec::new();
    let mut width = theta_len;
    let mut values: Vec<f64> = Vec::new();
    let first = parameters;
    for (i, point) in batch {
        let i = *i;
        if let Addition::Split(split) = &candidates[i] {
            if let Some(entry) = h.entries_of(split.index).filter(|entries| entries.len() == 1) {
                shared.push((entry.start, width));
                owned.push((i, point, width..width + groups));
                width += groups;
            }
            continue;
        }
        let Some(law) = candidates[i].law() else { continue };
        let grouped = matches!(candidates[i], Addition::Effect(_, Per::Group));
        let begin = width;
        values.extend(point);
        for _ in point {
            extras.push(parameters);
            parameters += 1;
            columns.push((width, grouped));
            width += if grouped { groups } else { 1 };
        }
        laws.push(law);
        owned.push((i, point, begin..width));
    }
    let system = h.system.augmented(&laws).ok()?;
    let windows = sample.excerpts();
    let lanes: Vec<Lanes> = windows.iter().map(|&at| Lanes::new(h, at, &extras)).collect();
    let each = windows.iter().zip(&lanes).zip(&fit.nuisance);
    let points: Vec<Point<'_>> = each
        .map(|((at, lanes), nuisance)| {
            sample.data.tally.simulation();
            Point::new(h, &*system, lanes, at.record, &fit.theta, nuisance).with_values(first, &values)
        })
        .collect();
    let parts = normals(&points, &lanes, &windows, sample.correlation).into_par_iter().zip(&lanes);
    let parts: Vec<_> = parts
        .zip(&windows)
        .map(|((n, lanes), at)| {
            let (s, u, _) = eliminate(&n.h, &n.g, lanes.common());
            let mut places = lanes.theta.clone();
            let group = at.record.seen.group;
            places.extend(columns.iter().map(|&(c, grouped)| if grouped { c + group } else { c }));
            if shared.is_empty() {
                return (s, u, places);
            }
            // Once more the lane of the declared parameter, as the group's own.
            let mut rows: Vec<usize> = (0..places.len()).collect();
            for (entry, first) in &shared {
                rows.extend(lanes.theta.iter().position(|t| t == entry));
                places.push(first + group);
            }
            (s.sub(&rows), rows.iter().map(|&i| u[i]).collect(), places)
        })
        .collect();
    let (mut s, mut u) = (Square::zero(width), vec![0.0; width]);
    for (sj, uj, places) in &parts {
        for (a, &pa) in places.iter().enumerate() {
            u[pa] += uj[a];
            for (b, &pb) in places.iter().enumerate() {
                *s.at_mut(pa, pb) += sj.at(a, b);
            }
        }
    }
    Some(Joint { s, u, owned, parts })
}

impl Joint<'_> {
    /// Curvature and gradient of some windows in the entries `order`.
    fn of_windows(&self, windows: std::ops::Range<usize>, order: &[usize]) -> Quadratic {
        let mut place_of = vec![None; self.s.n];
        order.iter().enumerate().for_each(|(i, &entry)| place_of[entry] = Some(i));
        let (mut sc, mut uc) = (Square::zero(order.len()), vec![0.0; order.len()]);
        for (sj, uj, places) in &self.parts[windows] {
            let known = places.iter().enumerate().filter_map(|(a, &p)| Some((a, place_of[p]?)));
            for (a, i) in known.clone() {
                uc[i] += uj[a];
                known.clone().for_each(|(b, j)| *sc.at_mut(i, j) += sj.at(a, b));
            }
        }
        (sc, uc)
    }

    /// Dispersion of the clusters in the direction of the entries `range` beside those of theta.
    fn dispersion(
        &self,
        range: std::ops::Range<usize>,
        theta_len: usize,
        clusters: &[std::ops::Range<usize>],
        least: f64,
    ) -> Dispersion {
        let keep = range.len();
        let order: Vec<usize> = range.chain(0..theta_len).collect();
        let gradient: Vec<f64> = order.iter().map(|&i| self.u[i]).collect();
        let each: Vec<Quadratic> =
            clusters.iter().map(|windows| self.of_windows(windows.clone(), &order)).collect();
        dispersion(&self.s.sub(&order), &gradient, &each, 0..keep, least)
    }
}

fn batch_scores(
    sample: &ChosenRecords<'_>,
    fit: &Fit,
    candidates: &[Addition],
    batch: &[&(usize, Vec<f64>)],
) -> Vec<(usize, Score)> {
    let theta_len = fit.hypothesis.theta_len();
    let Some(joint) = joint(sample, fit, candidates, batch) else { return Vec::new() };
    let clusters = if sample.data.is_idealised() { ranges(&sample.of_records()) } else { Vec::new() };
    joint
        .owned
        .iter()
        .map(|(i, point, range)| {
            let (i, range) = (*i, range.clone());
            let mut score = one_score(&candidates[i], &joint.s, &joint.u, range.clone(), theta_len);
            score.point = point.to_vec();
            if !clusters.is_empty() && score.rank > 0.0 {
                let least = sample.data.white_share;
                score.dispersion = Some(joint.dispersion(range, theta_len, &clusters, least));
            }
            // One with a value for each group begins at the same point in all.
            let per = score.estimate.len() / point.len().max(1);
            for (k, x) in score.estimate.iter_mut().enumerate() {
                let at = point.get(k / per.max(1)).copied().unwrap_or(0.0);
                if at != 0.0 {
                    *x += at;
                }
            }
            (i, score)
        })
        .collect()
}

fn one_score(
    addition: &Addition,
    s: &Square,
    u: &[f64],
    range: std::ops::Range<usize>,
    theta_len: usize,
) -> Score {
    let keep = range.len();
    let order: Vec<usize> = range.chain(0..theta_len).collect();
    let ordered: Vec<f64> = order.iter().map(|&i| u[i]).collect();
    let (c, v, _) = eliminate(&s.sub(&order), &ordered, keep);
    let raw: Vec<f64> = order[..keep].iter().map(|&i| s.at(i, i).max(0.0)).collect();
    let mut score = Score {
        addition: addition.clone(),
        statistic: 0.0,
        unsigned: 0.0,
        point: Vec::new(),
        rank: 0.0,
        estimate: vec![0.0; keep],
        sd: vec![f64::INFINITY; keep],
        dispersion: None,
    };
    // One-sided where the null is the lowest value; the opposite of an amount with a direction is another direction.
    let at_bound = |e: &Effect| e.parameters.iter().any(|p| p.null <= p.min) && e.polar.is_none();
    let positive = |e: &Effect| at_bound(e) && e.parameters.iter().all(|p| p.min >= 0.0);
    let positive = addition.listed().is_some_and(positive);
    if keep == 1 {
        let information = c.at(0, 0);
        if information * unit(addition, 0, keep) < OBSERVABLE
            || information < RANK_CUT * RANK_CUT * raw[0]
            || !information.is_finite()
        {
            return score;
        }
        score.rank = 1.0;
        score.estimate[0] = v[0] / information;
        score.sd[0] = information.sqrt().recip();
        score.unsigned = v[0] * v[0] / information;
        if !(positive && v[0] <= 0.0) {
            score.statistic = score.unsigned;
        }
        return score;
    }
    let seen = |(i, r): (usize, &f64)| r * unit(addition, i, keep) > OBSERVABLE;
    let scale: Vec<f64> =
        raw.iter().enumerate().map(|p| if seen(p) { p.1.sqrt().recip() } else { 0.0 }).collect();
    let mut scaled = Square::zero(keep);
    for i in 0..keep {
        for j in 0..keep {
            *scaled.at_mut(i, j) = c.at(i, j) * scale[i] * scale[j];
        }
    }
    let (values, vectors) = scaled.eigen();
    let mut variance = vec![0.0; keep];
    for (k, value) in values.iter().enumerate().filter(|(_, v)| **v > RANK_CUT) {
        let along: f64 = (0..keep).map(|i| vectors.at(i, k) * v[i] * scale[i]).sum();
        score.statistic += along * along / value;
        score.rank += 1.0;
        for i in 0..keep {
            let direction = vectors.at(i, k) * scale[i];
            score.estimate[i] += direction * along / value;
            variance[i] += direction * direction / value;
        }
    }
    score.unsigned = score.statistic;
    score.sd = variance.iter().map(|v| v.sqrt()).collect();
    score
}

/// Square of the size in which parameter `i` of `count` is observed: its usual one where that is large. A stiffness of a
/// thousand is not unobservable because a change by one cannot be seen.
pub(crate) fn unit(addition: &Addition, i: usize, count: usize) -> f64 {
    let parameters = addition.parameters();
    let per = count / parameters.len().max(1);
    let usual = match addition {
        Addition::Table(table) => table.target.usual,
        _ => parameters.get(i / per.max(1)).map_or(1.0, |p| p.typical.abs()),
    };
    usual.max(1.0).powi(2)
}

/// Heterogeneity of each entry of theta over trajectories: statistic and degrees of freedom
/// (Kristensen and Madsen 2004, pinpointing of model deficiencies).
pub(crate) fn heterogeneity(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<(f64, f64)> {
    let h = &fit.hypothesis;
    let lanes: Vec<Lanes> = sample.excerpts().into_iter().map(|at| Lanes::new(h, at, &[])).collect();
    let parts: Vec<Vec<(usize, f64, f64)>> = assembled(sample, h, &lanes, &fit.theta, &fit.nuisance)
        .into_par_iter()
        .zip(&lanes)
        .map(|(n, lanes)| {
            let (s, u, _) = eliminate(&n.h, &n.g, lanes.common());
            lanes.theta.iter().enumerate().map(|(a, &t)| (t, s.at(a, a), u[a])).collect()
        })
        .collect();
    differences(sample, &parts)
}

/// Statistic and degrees of freedom of the differences between records in each entry of theta, from what each window says of
/// it (entry, curvature, gradient).
pub(crate) fn differences(sample: &ChosenRecords<'_>, parts: &[Vec<(usize, f64, f64)>]) -> Vec<(f64, f64)> {
    let n = parts.iter().flatten().map(|(t, ..)| t + 1).max().unwrap_or(0);
    let (mut q, mut sum_u, mut sum_s, mut count) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for windows in sample.of_records() {
        // What the windows of a record say of each entry, together.
        let mut record: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for &(t, s, u) in parts[windows].iter().flatten() {
            let sums = record.entry(t).or_default();
            *sums = (sums.0 + s, sums.1 + u);
        }
        for (t, (s, u)) in record.into_iter().filter(|(_, (s, _))| *s > OBSERVABLE) {
            q[t] += u * u / s;
            sum_u[t] += u;
            sum_s[t] += s;
            count[t] += 1.0;
        }
    }
    (0..n)
        .map(|t| {
            let mean = if sum_s[t] > 0.0 { sum_u[t] * sum_u[t] / sum_s[t] } else { 0.0 };
            (q[t] - mean, count[t] - 1.0)
        })
        .collect()
}
