//! Whether the centre of pressure is somewhere else in each push.
//!
//! Every push `i` gets a centre of its own, normal about the common one with standard deviation `sd`. At a fit, with the window
//! starts eliminated and linear about the push's most probable centre, `v` is the gradient of half the cost at the common
//! centre, `S` its curvature, in what all share (`d`) and, at the places `b`, the centre. The centre is integrated out (Laplace;
//! Pinheiro and Bates 1995), what all share is profiled:
//!
//! ```text
//! M = S_bb + phi / sd² I,   V = sum(v - S_.b M^-1 v_b),   T = sum(S - S_.b M^-1 S_b.)
//! -2 ln L = (sum(c - v_b' M^-1 v_b) - V' T^-1 V) / phi + sum(ln det(I + sd² S_bb / phi))
//! ```
//!
//! `sd` and its interval maximise and profile the restricted likelihood, which has `+ ln det T` as well (Harville 1977). The
//! mean of the centres belongs to what all share, whether or not the answer has it: a constant offset is no scatter. `phi` is
//! the level of what is no scatter: how far the windows of one push ask for different centres, or what is left when each push
//! has its own, whichever is more. A misfit that changes along the push, or that no centre removes, thus counts as noise.
//!
//! Not told apart: anything else that stays for one push and changes to the next with the same signature (a marker glued on
//! anew, the place of contact, dirt, wear), and a law not in the library that acts by start orientation or contact place alone.

use super::evaluate::Piece;
use super::fit::{BEND, Fit, Sample, fit, fit_starts};
use super::hypothesis::{Free, Hypothesis};
use super::search::Search;
use super::spread::{interval, most_likely};
use crate::confirmation::holds;
use crate::dispersion::Dispersion;
use crate::linear::Square;
use crate::result::Estimate;
use crate::statistics::median;
use augsim_physics::model::PushModel;
use augsim_physics::push::effects::{SCATTER_KIND, SCATTER_SPEC};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// The effect whose parameters the centre is.
const CENTRE_KIND: &str = "pressure-offset";
/// Steps of the pushes' centres.
const STEPS: usize = 4;
/// Fewest pushes for training: a few knocks by hand look like the spread of a few pushes.
const FEWEST: usize = 15;
/// Fewest windows of a push, on average: a push of one can be explained by a centre of its own whatever the model lacks.
const WINDOWS: usize = 2;

/// A scatter that the pushes confirm.
#[derive(Clone, Debug)]
pub(crate) struct Scatter {
    /// Gain on the training part in -2 ln likelihood.
    pub gain: f64,
    /// The model has it already.
    pub declared: bool,
    /// Windows at the centres of their pushes: training part, held-out part.
    pub pieces: [Vec<Piece>; 2],
}

/// What all pushes share, their mean centre among it.
struct Common {
    hypothesis: Hypothesis,
    theta: Vec<f64>,
    /// Where the centre stands in theta.
    at: usize,
    /// The mean of the centres is the centroid, not fitted.
    centred: bool,
}

/// Where the pushes are.
#[derive(Clone)]
struct State {
    /// What all share.
    theta: Vec<f64>,
    /// The centre of each push less the common one, m.
    centres: Vec<[f64; 2]>,
    starts: Vec<[f64; 3]>,
    pieces: Vec<Piece>,
}

/// One push, quadratic about its centre: constant, gradient at the common centre, curvature, and what its windows disagree by.
struct Normal {
    c: f64,
    v: Vec<f64>,
    s: Square,
    /// Sum of squares between windows and its degrees of freedom.
    within: [f64; 2],
    /// The same of the residuals at the push's own centre.
    left: [f64; 2],
}

/// -2 ln likelihood at the best of what all share, the restricted one, and the step there.
struct Profile {
    profiled: f64,
    restricted: f64,
    step: Vec<f64>,
}

/// An estimate from some pushes.
struct Found {
    sd: f64,
    phi: f64,
    /// Degrees of freedom that `phi` is estimated with.
    freedom: f64,
    /// -2 ln likelihood, and by how much it is less than without scatter.
    value: f64,
    gain: f64,
    ci95: [f64; 2],
    state: State,
    bend: f64,
}

/// The scatter at one of what a search tried, if it pays on the training part and holds on the other.
pub(crate) fn scatter(search: &Search<'_>, place: usize) -> Option<Scatter> {
    let common = Common::of(search.model, &search.train, &search.tried[place].fit)?;
    let found = common.estimate(&search.train, None)?;
    let (gain, penalty) = (found.gain, found.penalty(search, SCATTER_KIND));
    let declared = declared(search.model);
    if gain <= penalty && !declared {
        return None;
    }
    let test = Sample { bend: found.bend, ..search.test.clone() };
    let (held, gain_held) = common.judge(&test, &found);
    let confirmed = declared || holds(gain - penalty, 0.5 * gain_held);
    confirmed.then_some(Scatter { gain, declared, pieces: [found.state.pieces, held.pieces] })
}

fn declared(model: &PushModel) -> bool {
    model.effects.iter().any(|b| b.kind == SCATTER_KIND)
}

/// Gain in cost on the training part of who is told to look for scatter, and what it has to exceed.
pub(crate) fn promise(search: &Search<'_>, fit: &Fit) -> [f64; 2] {
    let found = Common::of(search.model, &search.train, fit).and_then(|c| c.estimate(&search.train, None));
    found.map_or([0.0, f64::INFINITY], |f| [f.gain, f.penalty(search, SCATTER_KIND)].map(|x| x * f.phi))
}

impl Found {
    /// What chance would gain by one kind.
    fn penalty(&self, search: &Search<'_>, kind: &str) -> f64 {
        let dispersion = Dispersion { factor: self.phi, clusters: self.freedom + 1.0 };
        search.resolution() / self.phi + dispersion.widened(search.quantile(kind), search.size(kind) as f64)
    }
}

/// Of the kinds at `place`, those that still pay when each push may have its own centre: under scatter, windows of one push are
/// no independent samples, and laws gain by chance. None where there is no scatter.
pub(crate) fn kept(search: &Search<'_>, place: usize) -> Option<Vec<&'static str>> {
    let from = &search.tried[place].fit;
    let mut kinds = from.hypothesis.kinds.clone();
    let without = |kinds: &[&'static str], k: &&'static str| -> Vec<&'static str> {
        kinds.iter().copied().filter(|other| other != k).collect()
    };
    let common = |kinds: &[&'static str]| Common::with(search.model, &search.train, from, kinds);
    if common(&kinds).is_none() {
        // No room for a centre beside so many: the least of them goes.
        let tried = kinds.par_iter().filter_map(|k| {
            let rest = without(&kinds, k);
            let found = common(&rest)?.estimate(&search.train, None)?;
            Some((found.value, rest))
        });
        let tried: Vec<_> = tried.collect();
        kinds = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    }
    let mut first = true;
    loop {
        let found = common(&kinds)?.estimate(&search.train, None);
        let Some(found) = found.filter(|f| !first || f.gain > f.penalty(search, SCATTER_KIND)) else {
            return if first { None } else { Some(kinds) };
        };
        first = false;
        let sample = Sample { bend: found.bend, ..search.train.clone() };
        let tried = kinds.par_iter().filter_map(|k| {
            let rest = without(&kinds, k);
            let mut without = common(&rest)?;
            if *k == CENTRE_KIND {
                without.centre(&sample, from);
            }
            let gain = without.value(&sample, found.phi) - found.value;
            Some((gain - found.penalty(search, k), rest))
        });
        let tried: Vec<_> = tried.collect();
        match tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((lead, rest)) if lead <= 0.0 => kinds = rest,
            _ => return Some(kinds),
        }
    }
}

/// Its size at a fit to `sample`.
pub(crate) fn size(model: &PushModel, sample: &Sample<'_>, fit: &Fit) -> Option<Estimate> {
    let found = Common::of(model, sample, fit)?.estimate(sample, None)?;
    let unit = SCATTER_SPEC.parameters[0].unit.to_string();
    Some(Estimate { value: found.sd, ci95: found.ci95, unit, groups: BTreeMap::new() })
}

impl Common {
    /// At the best fit with a common centre; none where the pushes are few or short.
    fn of(model: &PushModel, sample: &Sample<'_>, from: &Fit) -> Option<Self> {
        Self::with(model, sample, from, &from.hypothesis.kinds)
    }

    /// With only some of the kinds.
    fn with(model: &PushModel, sample: &Sample<'_>, from: &Fit, kinds: &[&'static str]) -> Option<Self> {
        let pushes = Self::pushes(sample).len();
        let enough = pushes >= FEWEST && sample.windows.len() >= WINDOWS * pushes;
        if !enough && !declared(model) {
            return None;
        }
        let mut model = model.clone();
        let mut kinds = kinds.to_vec();
        match model.effects.iter_mut().find(|b| b.kind == CENTRE_KIND) {
            Some(block) => block.parameters.iter_mut().for_each(|p| p.frozen = false),
            None if kinds.contains(&CENTRE_KIND) => {}
            None => kinds.push(CENTRE_KIND),
        }
        let hypothesis = Hypothesis::new(&model, &sample.data.groups, &kinds);
        let old = &from.hypothesis.free;
        let mut theta = hypothesis.start();
        for (f, value) in hypothesis.free.iter().zip(&mut theta) {
            let same = |o: &&Free| (o.kind, o.group, &o.name) == (f.kind, f.group, &f.name);
            let known = old.iter().position(|o| same(&o));
            if let Some(place) = known {
                *value = from.theta[place];
            }
        }
        let at = hypothesis.range_of(CENTRE_KIND).start;
        let theta = fit(sample, &hypothesis, &theta, &from.starts).theta;
        Some(Self { hypothesis, theta, at, centred: false })
    }

    /// With the mean of the centres at the centroid.
    fn centre(&mut self, sample: &Sample<'_>, from: &Fit) {
        let mut held = self.hypothesis.clone();
        held.free.drain(self.at..self.at + 2);
        for f in &self.hypothesis.free[self.at..self.at + 2] {
            held.values[f.index] = 0.0;
        }
        let mut theta = self.theta.clone();
        theta.drain(self.at..self.at + 2);
        let fitted = fit(sample, &held, &theta, &from.starts).theta;
        self.theta = [&fitted[..self.at], &[0.0; 2], &fitted[self.at..]].concat();
        self.centred = true;
    }

    /// The windows of each push.
    fn pushes(sample: &Sample<'_>) -> Vec<Range<usize>> {
        Sample { by_push: true, ..sample.clone() }.clusters()
    }

    /// All pushes about the common centre.
    fn together(&self, sample: &Sample<'_>, theta: &[f64]) -> State {
        let fitted = fit_starts(sample, &self.hypothesis, theta);
        State {
            theta: theta.to_vec(),
            centres: vec![[0.0; 2]; Self::pushes(sample).len()],
            starts: fitted.starts,
            pieces: fitted.pieces,
        }
    }

    /// At a level of what is no scatter, or at that of these pushes.
    fn estimate(&self, sample: &Sample<'_>, phi_given: Option<f64>) -> Option<Found> {
        let mut sample = sample.clone();
        let base = self.together(&sample, &self.theta);
        let mut state = base.clone();
        for _ in 0..STEPS {
            let normals = self.normals(&sample, &state);
            let phi = phi_given.unwrap_or(level(&normals, sample.data.noise.white_share()).0);
            let sd = most_likely(|sd| self.likelihood(&normals, sd, phi)[1])?;
            let shared = self.profile(&normals, sd, phi).step;
            state = self.step(&sample, &state, &normals, &shared, [sd, phi]);
            let mut squares: Vec<f64> = state.pieces.iter().map(|p| p.q / p.m.max(1) as f64).collect();
            if phi_given.is_none() {
                sample.bend = sample.bend.min(BEND * median(&mut squares).max(1.0));
            }
        }
        let normals = self.normals(&sample, &state);
        let (level, freedom) = level(&normals, sample.data.noise.white_share());
        let phi = phi_given.unwrap_or(level);
        let restricted = |sd: f64| self.likelihood(&normals, sd, phi)[1];
        let sd = most_likely(restricted)?;
        let none = self.likelihood(&self.normals(&sample, &base), 0.0, phi)[0];
        let value = self.likelihood(&normals, sd, phi)[0];
        Some(Found {
            sd,
            phi,
            freedom,
            value,
            gain: none - value,
            ci95: interval(restricted, sd),
            state,
            bend: sample.bend,
        })
    }

    /// -2 ln likelihood at a level of what is no scatter.
    fn value(&self, sample: &Sample<'_>, phi: f64) -> f64 {
        match self.estimate(sample, Some(phi)) {
            Some(found) => found.value,
            None => self.likelihood(&self.normals(sample, &self.together(sample, &self.theta)), 0.0, phi)[0],
        }
    }

    /// The pushes of another sample at their centres, and the gain there in -2 ln likelihood.
    fn judge(&self, sample: &Sample<'_>, found: &Found) -> (State, f64) {
        let none = sample.total(&self.together(sample, &self.theta).pieces) / found.phi;
        let mut state = self.together(sample, &found.state.theta);
        let still = vec![0.0; self.theta.len()];
        for _ in 0..STEPS {
            let normals = self.normals(sample, &state);
            state = self.step(sample, &state, &normals, &still, [found.sd, found.phi]);
        }
        let own: f64 = self.normals(sample, &state).iter().map(|n| self.own(n, found.sd, found.phi)).sum();
        (state, none - own)
    }

    fn normals(&self, sample: &Sample<'_>, state: &State) -> Vec<Normal> {
        let (p, b) = (self.theta.len(), [self.at, self.at + 1]);
        let of = |range: Range<usize>, centre: &[f64; 2]| {
            let (mut s, mut v, mut c) = (Square::zero(p), vec![0.0; p], 0.0);
            let (mut between, mut freedom, mut count) = (0.0, 0.0, 0.0);
            for piece in &state.pieces[range] {
                let (cost, weight) = sample.cost(piece.q, piece.m);
                let (mut sw, mut vw) = piece.reduced(p);
                sw.a.iter_mut().for_each(|x| *x *= weight);
                c += cost;
                for k in 0..2 {
                    c += 2.0 * weight * vw[b[k]] * centre[k];
                    c += (0..2).map(|l| centre[k] * sw.at(b[k], b[l]) * centre[l]).sum::<f64>();
                }
                for (i, x) in vw.iter_mut().enumerate() {
                    *x = *x * weight + (0..2).map(|k| sw.at(i, b[k]) * centre[k]).sum::<f64>();
                }
                let (square, rank) = form(&sw.sub(&b), [vw[b[0]], vw[b[1]]]);
                between += square;
                freedom += rank;
                count += piece.m as f64 - 3.0;
                s.a.iter_mut().zip(&sw.a).for_each(|(a, x)| *a += x);
                v.iter_mut().zip(&vw).for_each(|(a, x)| *a += x);
            }
            let (square, rank) = form(&s.sub(&b), [v[b[0]], v[b[1]]]);
            Normal { c, v, s, within: [between - square, freedom - rank], left: [c - square, count - rank] }
        };
        let all: Vec<_> = Self::pushes(sample).into_iter().zip(&state.centres).collect();
        all.into_par_iter().map(|(range, centre)| of(range, centre)).collect()
    }

    /// `M` of a push.
    fn precision(&self, n: &Normal, sd: f64, phi: f64) -> Square {
        let mut m = n.s.sub(&[self.at, self.at + 1]);
        (0..2).for_each(|k| *m.at_mut(k, k) += phi / (sd * sd));
        m
    }

    /// -2 ln likelihood of one push with what all share held.
    fn own(&self, n: &Normal, sd: f64, phi: f64) -> f64 {
        if sd == 0.0 {
            return n.c / phi;
        }
        let m = self.precision(n, sd, phi).cholesky();
        let mut x = [n.v[self.at], n.v[self.at + 1]];
        m.forward(&mut x);
        (n.c - x[0] * x[0] - x[1] * x[1]) / phi + m.log_det + 2.0 * (sd * sd / phi).ln()
    }

    /// -2 ln likelihood, and the restricted one.
    fn likelihood(&self, normals: &[Normal], sd: f64, phi: f64) -> [f64; 2] {
        let Profile { profiled, restricted, .. } = self.profile(normals, sd, phi);
        [profiled, restricted]
    }

    fn profile(&self, normals: &[Normal], sd: f64, phi: f64) -> Profile {
        let p = self.theta.len();
        let b = [self.at, self.at + 1];
        let (mut t, mut v, mut sum) = (Square::zero(p), vec![0.0; p], 0.0);
        for n in normals {
            sum += self.own(n, sd, phi);
            t.a.iter_mut().zip(&n.s.a).for_each(|(a, x)| *a += x);
            v.iter_mut().zip(&n.v).for_each(|(a, x)| *a += x);
            if sd > 0.0 {
                let m = self.precision(n, sd, phi).cholesky().inverse();
                for (i, v) in v.iter_mut().enumerate() {
                    let along = [0, 1].map(|k| (0..2).map(|l| n.s.at(i, b[l]) * m.at(l, k)).sum::<f64>());
                    *v -= (0..2).map(|k| along[k] * n.v[b[k]]).sum::<f64>();
                    for j in 0..p {
                        *t.at_mut(i, j) -= (0..2).map(|k| along[k] * n.s.at(b[k], j)).sum::<f64>();
                    }
                }
            }
        }
        if self.centred {
            for k in b {
                v[k] = 0.0;
                (0..p).for_each(|i| (*t.at_mut(i, k), *t.at_mut(k, i)) = (0.0, 0.0));
            }
        }
        let factor = t.cholesky();
        let mut step = v.clone();
        factor.solve(&mut step);
        factor.forward(&mut v);
        let profiled = sum - v.iter().map(|x| x * x).sum::<f64>() / phi;
        Profile { profiled, restricted: profiled + factor.log_det, step }
    }

    /// What all share a step on, and every push at its most probable centre there; without the step, where that costs more.
    fn step(
        &self,
        sample: &Sample<'_>,
        state: &State,
        normals: &[Normal],
        shared: &[f64],
        of: [f64; 2],
    ) -> State {
        let cost = |s: &State| {
            let squares = s.centres.iter().flatten().map(|c| c * c).sum::<f64>();
            sample.total(&s.pieces) + of[1] * squares / (of[0] * of[0])
        };
        let moved = self.centres(sample, state, normals, shared, of);
        if cost(&moved) <= cost(state) || shared.iter().all(|d| *d == 0.0) {
            return moved;
        }
        self.centres(sample, state, normals, &vec![0.0; shared.len()], of)
    }

    fn centres(
        &self,
        sample: &Sample<'_>,
        state: &State,
        normals: &[Normal],
        shared: &[f64],
        [sd, phi]: [f64; 2],
    ) -> State {
        let p = self.theta.len();
        let mut theta: Vec<f64> = state.theta.iter().zip(shared).map(|(a, b)| a + b).collect();
        self.hypothesis.admit(&mut theta);
        let shared: Vec<f64> = theta.iter().zip(&state.theta).map(|(a, b)| a - b).collect();
        // The windows of a push at a centre, their starts moved along.
        let at = |range: &Range<usize>, old: &[f64; 2], centre: [f64; 2]| -> (Vec<_>, Vec<_>) {
            let (mut step, mut own) = (shared.clone(), theta.clone());
            for k in 0..2 {
                step[self.at + k] += centre[k] - old[k];
                own[self.at + k] += centre[k];
            }
            let windows = range.clone().map(|w| {
                let d = state.pieces[w].start_step(&step);
                let start = [0, 1, 2].map(|c| state.starts[w][c] + d[c]);
                (start, sample.piece(&self.hypothesis, &own, start, &sample.windows[w]))
            });
            windows.unzip()
        };
        let still = shared.iter().all(|d| *d == 0.0);
        let each: Vec<_> = Self::pushes(sample).into_iter().zip(&state.centres).zip(normals).collect();
        let moved: Vec<_> = each
            .into_par_iter()
            .map(|((range, old), n)| {
                let mut new = [0, 1].map(|k| {
                    let row = self.at + k;
                    n.v[row] - (0..p).map(|j| n.s.at(row, j) * shared[j]).sum::<f64>()
                });
                self.precision(n, sd, phi).cholesky().solve(&mut new);
                let prior = |c: [f64; 2]| phi * (c[0] * c[0] + c[1] * c[1]) / (sd * sd);
                let stay = if still {
                    (state.starts[range.clone()].to_vec(), state.pieces[range.clone()].to_vec())
                } else {
                    at(&range, old, *old)
                };
                let before = sample.total(&stay.1) + prior(*old);
                for share in [1.0, 0.4, 0.16] {
                    let centre = [0, 1].map(|k| old[k] + share * (new[k] - old[k]));
                    let (starts, pieces) = at(&range, old, centre);
                    if sample.total(&pieces) + prior(centre) < before {
                        return (centre, starts, pieces);
                    }
                }
                (*old, stay.0, stay.1)
            })
            .collect();
        let mut out = State { theta, centres: Vec::new(), starts: Vec::new(), pieces: Vec::new() };
        for (centre, starts, pieces) in moved {
            out.centres.push(centre);
            out.starts.extend(starts);
            out.pieces.extend(pieces);
        }
        out
    }
}

/// `v' S^-1 v` and the rank of `S`.
fn form(s: &Square, mut v: [f64; 2]) -> (f64, f64) {
    let rank = if s.at(0, 0) * s.at(1, 1) - s.at(0, 1) * s.at(1, 0) > 1e-12 * s.at(0, 0) * s.at(1, 1) {
        2.0
    } else {
        f64::from(u8::from(s.at(0, 0) + s.at(1, 1) > 0.0))
    };
    s.cholesky().forward(&mut v);
    (v[0] * v[0] + v[1] * v[1], rank)
}

/// Level of what is no scatter, and the degrees of freedom that speak about it.
fn level(normals: &[Normal], least: f64) -> (f64, f64) {
    let [between, freedom] = [0, 1].map(|k| normals.iter().map(|n| n.within[k]).sum::<f64>());
    let mut left: Vec<f64> =
        normals.iter().filter(|n| n.left[1] > 0.0).map(|n| n.left[0] / n.left[1]).collect();
    let within = if freedom > 0.0 { between / freedom } else { 0.0 };
    (within.max(median(&mut left)).max(least), freedom)
}
