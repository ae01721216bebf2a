//! Residuals of one trajectory and their derivatives, as normal equations.

use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::record::{Excerpt, Record};
use crate::statistics::median;
use augsim_physics::model::Per;
use augsim_physics::system::{
    Begin, Event, Offsets, ScatterPer, Seed, Simulated, SimulationError, System, Task,
};
use rayon::prelude::*;
use std::cell::RefCell;

/// Where the derivatives of one trajectory go. The lanes are: globals, extras, then nuisances.
#[derive(Clone, Debug)]
pub(crate) struct Lanes {
    /// The number that each lane is the derivative with respect to.
    seeds: Vec<Seed>,
    /// Entry of theta of each global lane.
    pub theta: Vec<usize>,
    pub extras: usize,
    /// States of the start that are fitted.
    start: Vec<usize>,
    /// Parameters of this trajectory alone.
    own: Vec<usize>,
    /// Number of offsets of the event's parameter.
    pub offsets: usize,
}

impl Lanes {
    pub fn new(h: &Hypothesis, at: Excerpt<'_>, extras: &[usize]) -> Self {
        let record = at.record;
        let (mut theta, mut own) = (Vec::new(), Vec::new());
        let mut at = 0;
        for f in &h.free {
            match f.per {
                Per::Trajectory => own.push(f.index),
                Per::All => theta.push((f.index, at)),
                Per::Group => theta.push((f.index, at + record.seen.group)),
            }
            at += h.width(f);
        }
        let start: Vec<usize> = h.system.schema().free_states().collect();
        let offsets = match h.scatter.map(|s| s.per) {
            None => 0,
            Some(ScatterPer::Record) => usize::from(!record.seen.events.is_empty()),
            Some(ScatterPer::Event) => record.seen.events.len(),
        };
        let parameters = theta.iter().map(|(index, _)| index).chain(extras).map(|&i| Seed::Parameter(i));
        let nuisances = start.iter().map(|&i| Seed::Start(i)).chain(own.iter().map(|&i| Seed::Parameter(i)));
        let seeds = parameters.chain(nuisances).chain((0..offsets).map(Seed::Offset)).collect();
        Self {
            seeds,
            theta: theta.into_iter().map(|(_, t)| t).collect(),
            extras: extras.len(),
            start,
            own,
            offsets,
        }
    }

    /// Variable that each lane is the derivative with respect to.
    pub fn seeds(&self) -> &[Seed] {
        &self.seeds
    }

    /// Lanes before the nuisances.
    pub fn common(&self) -> usize {
        self.theta.len() + self.extras
    }

    pub fn nuisances(&self) -> usize {
        self.start.len() + self.own.len() + self.offsets
    }

    /// Nuisance values to begin with: the rough start, nominal own parameters, no offsets.
    pub fn nuisance_start(&self, h: &Hypothesis, at: Excerpt<'_>) -> Vec<f64> {
        let (record, rough) = (at.record, &at.window.start);
        let mut n: Vec<f64> = self.start.iter().map(|&i| rough.get(i).copied().unwrap_or(0.0)).collect();
        let event = h.system.schema().event.as_ref().map(|e| e.parameter);
        n.extend(self.own.iter().map(|&i| {
            let rough = rough_event_value(record);
            if event == Some(i) && rough > 0.0 { rough } else { h.values[i] }
        }));
        n.extend(std::iter::repeat_n(0.0, self.offsets));
        n
    }

    /// Number of nuisances that are no offsets.
    pub fn fixed_nuisances(&self) -> usize {
        self.start.len() + self.own.len()
    }
}

/// Median of the rough values of the events' parameter in a record; 0 without events.
pub(crate) fn rough_event_value(record: &Record) -> f64 {
    median(&mut record.seen.events.iter().map(|e| e.value).collect::<Vec<_>>())
}

/// The point at which a trajectory is simulated.
pub(crate) struct Point<'a> {
    system: &'a dyn System,
    /// The system's parameters with theta and the trajectory's own in them.
    values: Vec<f64>,
    /// States at the beginning.
    start: Vec<f64>,
    nuisance: &'a [f64],
    /// 1/sd² of the offsets.
    prior: f64,
    shared: bool,
    /// Mean and 1/sd² of each of the trajectory's own parameters; 1/sd² is 0 where nothing is known.
    own_prior: Vec<(f64, f64)>,
}

impl<'a> Point<'a> {
    /// The point of a hypothesis at `theta` and the nuisances of a record; `system` is the hypothesis's, or that with more laws
    /// at their nulls.
    pub fn new(
        h: &'a Hypothesis,
        system: &'a dyn System,
        lanes: &Lanes,
        record: &Record,
        theta: &[f64],
        nuisance: &'a [f64],
    ) -> Self {
        let mut values = h.values_at(theta, record.seen.group);
        values.extend(system.parameters().iter().skip(values.len()).map(|p| p.nominal));
        for (&index, &value) in lanes.own.iter().zip(&nuisance[lanes.start.len()..]) {
            values[index] = value;
        }
        let begins = system.schema().states.iter().map(|state| match state.begin {
            Begin::Fixed(value) => value,
            _ => 0.0,
        });
        let mut start: Vec<f64> = begins.collect();
        lanes.start.iter().zip(nuisance).for_each(|(&i, &value)| start[i] = value);
        let own = h.free.iter().filter(|f| f.per == Per::Trajectory);
        Self {
            system,
            values,
            start,
            nuisance,
            prior: h.scatter.map_or(0.0, |s| s.sd.powi(-2)),
            shared: h.scatter.is_some_and(|s| s.per == ScatterPer::Record),
            own_prior: own.map(|f| f.prior.map_or((0.0, 0.0), |(mean, sd)| (mean, sd.powi(-2)))).collect(),
        }
    }

    /// Replaces the parameters from place `first` on by `values`.
    pub fn with_values(mut self, first: usize, values: &[f64]) -> Self {
        self.values[first..][..values.len()].copy_from_slice(values);
        self
    }

    /// Moves the parameters from place `first` on by `offsets`.
    pub fn moved(mut self, first: usize, offsets: &[f64]) -> Self {
        self.values[first..].iter_mut().zip(offsets).for_each(|(value, offset)| *value += offset);
        self
    }

    /// The simulation of a window with the derivatives of `seeds`.
    fn task<'t>(&'t self, lanes: &Lanes, at: Excerpt<'t>, seeds: &'t [Seed]) -> Task<'t> {
        let offsets = match self.nuisance.get(lanes.fixed_nuisances()..) {
            Some(&[xi, ..]) if self.shared && lanes.offsets > 0 => Offsets::Shared(xi),
            Some(list) if lanes.offsets > 0 => Offsets::Each(&list[..lanes.offsets]),
            _ => Offsets::None,
        };
        let (record, window) = (&at.record.seen, at.window.samples.clone());
        let (parameters, start) = (&self.values, &self.start);
        Task { parameters, record, window, start, offsets, seeds }
    }

    /// Simulates a window with the derivatives of `seeds` into `out`.
    fn simulate(&self, lanes: &Lanes, at: Excerpt<'_>, seeds: &[Seed], out: &mut Simulated) {
        let done = self.system.simulate(&self.task(lanes, at, seeds), out);
        if done.is_err() {
            self.fail(at, seeds.len(), out);
        }
    }

    /// A window that cannot be simulated has values that are no numbers: no fit goes there.
    fn fail(&self, at: Excerpt<'_>, seeds: usize, out: &mut Simulated) {
        let schema = self.system.schema();
        let (samples, channels) = (at.window.samples.len(), schema.channels.len());
        out.reset(samples, channels, seeds, schema.features.len());
        (0..samples).for_each(|k| (0..channels).for_each(|c| out.set(k, c, f64::NAN)));
    }

    /// The plain simulation at the times of a window.
    pub fn plain(&self, lanes: &Lanes, at: Excerpt<'_>) -> Simulated {
        let mut out = Simulated::default();
        self.simulate(lanes, at, &[], &mut out);
        out
    }
}

/// Degrees of freedom of the scale that each trajectory's misfit has of its own.
const SCALE_FREEDOM: f64 = 8.0;

/// Weight of a window whose whitened residuals have the sum of squares `q` with `m` degrees of freedom.
pub(crate) fn weight(q: f64, m: f64, tolerated: bool) -> f64 {
    cost_and_weight(q, m, tolerated).1
}

/// Twice the inverse of the degrees of freedom of a window's cost, which bends less than its misfit.
pub(crate) fn softening(freedom: f64) -> f64 {
    2.0 / (SCALE_FREEDOM + freedom)
}

/// Cost and weight of a window; where the noise is a tolerance, a misfit below it costs no less than the Gaussian law gives.
pub(crate) fn cost_and_weight(q: f64, m: f64, tolerated: bool) -> (f64, f64) {
    if tolerated { tolerant(q, m) } else { robust(q, m) }
}

/// Cost and weight of a trajectory whose whitened residuals have the sum of squares `q` with `m` degrees of freedom: minus
/// twice the logarithm of a multivariate t density (Lange, Little and Taylor 1989). Near `q = m` it is the Gaussian cost; a
/// trajectory that no hypothesis follows (a hand in the way, a wrong covariate) counts with the logarithm of its misfit.
fn robust(q: f64, m: f64) -> (f64, f64) {
    let n = SCALE_FREEDOM + m;
    (n * (q / SCALE_FREEDOM).ln_1p(), n / (SCALE_FREEDOM + q))
}

/// Cost and weight as of [`robust`] where the noise is a tolerance: to agree better counts no more than the Gaussian cost gives.
fn tolerant(q: f64, m: f64) -> (f64, f64) {
    if q < m { (q - m + robust(m, m).0, 1.0) } else { robust(q, m) }
}

/// Normal equations of one trajectory: `h = J'WJ`, `g = J'Wr`, `q` the cost, priors of the offsets included; W is the weight
/// of the trajectory.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub h: Square,
    pub g: Vec<f64>,
    pub q: f64,
    /// Sum of squares of the whitened residuals.
    pub misfit: f64,
    /// Degrees of freedom of it.
    pub freedom: f64,
    /// Weight of the trajectory in the fit, about 1 where the model follows it.
    pub weight: f64,
    /// Twice the inverse of the degrees of freedom of the cost: the weight falls along a step `x` by `softening (u'x) weight`,
    /// with `u` the gradient.
    pub softening: f64,
    /// Events that the simulation passed.
    pub events: Vec<Event>,
}

impl Normal {
    /// The cost after a change of what the lanes are of, in the quadratic approximation.
    pub fn foretold(&self, change: &[f64]) -> f64 {
        self.q - self.h.fall(&self.g, change)
    }
}

thread_local! {
    /// Simulations of this thread, which are used again: their memory is the better part of a short one's time.
    static RUNS: RefCell<Vec<Simulated>> = const { RefCell::new(Vec::new()) };
}

/// Gives `count` simulations of this thread to `work`.
fn with_runs<T>(count: usize, work: impl FnOnce(&mut [Simulated]) -> T) -> T {
    let mut runs = RUNS.take();
    if runs.len() < count {
        runs.resize_with(count, Simulated::default);
    }
    let done = work(&mut runs[..count]);
    RUNS.set(runs);
    done
}

/// Simulates a window with derivatives in all lanes and forms its normal equations.
pub(crate) fn normal(point: &Point<'_>, lanes: &Lanes, at: Excerpt<'_>, correlation: f64) -> Normal {
    with_runs(1, |runs| {
        point.simulate(lanes, at, &lanes.seeds, &mut runs[0]);
        summed(point, lanes, at, correlation, &runs[0])
    })
}

/// Simulates windows with derivatives in all lanes, as many in one pass as the system can, and forms the normal equations of
/// each.
pub(crate) fn normals(
    points: &[Point<'_>],
    lanes: &[Lanes],
    windows: &[Excerpt<'_>],
    correlation: f64,
) -> Vec<Normal> {
    let seeds: Vec<&[Seed]> = lanes.iter().map(|l| &l.seeds[..]).collect();
    simulated(points, lanes, windows, &seeds, |w, run| {
        summed(&points[w], &lanes[w], windows[w], correlation, run)
    })
}

/// Simulates windows with the derivatives of `seeds`, as many in one pass as the system can, and gives each run to `take`. A window that
/// cannot be simulated has values that are no numbers.
pub(crate) fn simulated<T: Send>(
    points: &[Point<'_>],
    lanes: &[Lanes],
    windows: &[Excerpt<'_>],
    seeds: &[&[Seed]],
    take: impl Fn(usize, &Simulated) -> T + Sync,
) -> Vec<T> {
    let side_by_side = points.first().map_or(1, |p| p.system.side_by_side().max(1));
    let blocks: Vec<usize> = (0..points.len()).step_by(side_by_side).collect();
    let each = blocks.into_par_iter().flat_map_iter(|first| {
        let block = first..(first + side_by_side).min(points.len());
        with_runs(block.len(), |runs| {
            let task = |w: usize| points[w].task(&lanes[w], windows[w], seeds[w]);
            let tasks: Vec<Task<'_>> = block.clone().map(task).collect();
            let done = points[first].system.simulate_all(&tasks, runs);
            let finish = |((w, run), done): ((usize, &mut Simulated), Result<(), SimulationError>)| {
                if done.is_err() {
                    points[w].fail(windows[w], seeds[w].len(), run);
                }
                take(w, run)
            };
            block.clone().zip(runs).zip(done).map(finish).collect::<Vec<_>>()
        })
    });
    each.collect()
}

/// Rows of a simulation, channel by channel: of every measured sample the derivatives in all lanes and then the residual, whitened and
/// in units of the noise; and the channel and sample of each row.
pub(crate) fn whitened_rows(
    run: &Simulated,
    at: Excerpt<'_>,
    correlation: f64,
) -> (Vec<f64>, Vec<(usize, usize)>) {
    let (record, count) = (at.record, run.lanes());
    let (mut rows, mut places) = (Vec::new(), Vec::new());
    for c in 0..run.channels() {
        let residual = |k: usize, d: &mut Vec<f64>| weighted(run, at, c, k, d);
        whitened(at, c, correlation, vec![0.0; count], residual, |r, d| {
            rows.extend_from_slice(d);
            rows.push(r);
        });
        places.extend(at.window.samples.clone().filter(|&k| record.weight[c][k] != 0.0).map(|k| (c, k)));
    }
    (rows, places)
}

/// The normal equations of a window from its simulation.
fn summed(point: &Point<'_>, lanes: &Lanes, at: Excerpt<'_>, correlation: f64, run: &Simulated) -> Normal {
    // Rows of derivatives are as long as the next multiple of four lanes: a kernel for each length is twice as fast as one
    // for any.
    let sums = match run.width() {
        4 => sums::<4>(run, at, correlation),
        8 => sums::<8>(run, at, correlation),
        12 => sums::<12>(run, at, correlation),
        16 => sums::<16>(run, at, correlation),
        20 => sums::<20>(run, at, correlation),
        24 => sums::<24>(run, at, correlation),
        28 => sums::<28>(run, at, correlation),
        32 => sums::<32>(run, at, correlation),
        36 => sums::<36>(run, at, correlation),
        40 => sums::<40>(run, at, correlation),
        _ => sums_of_any_width(run, at, correlation),
    };
    finish(point, lanes, at, sums, run.events())
}

/// `J'J` and `J'r` of whitened residuals r and their derivatives J, their sum of squares and how many there are.
struct Sums {
    h: Square,
    g: Vec<f64>,
    squares: f64,
    terms: f64,
}

/// The sums of a simulation whose rows of derivatives have the length `N`.
fn sums<const N: usize>(run: &Simulated, at: Excerpt<'_>, correlation: f64) -> Sums {
    let count = run.lanes();
    let (mut h, mut g, mut squares, mut terms) = (vec![[0.0; N]; N], [0.0; N], 0.0, 0.0);
    for c in 0..run.channels() {
        let residual = |k: usize, d: &mut [f64; N]| weighted(run, at, c, k, d);
        whitened(at, c, correlation, [0.0; N], residual, |r, d| {
            squares += r * r;
            terms += 1.0;
            for i in 0..count {
                g[i] += d[i] * r;
                let (row, di) = (&mut h[i], d[i]);
                if di != 0.0 {
                    for j in 0..N {
                        row[j] += di * d[j];
                    }
                }
            }
        });
    }
    let mut out = Square::zero(count);
    for (to, from) in out.a.chunks_exact_mut(count.max(1)).zip(&h) {
        to.copy_from_slice(&from[..count]);
    }
    Sums { h: out, g: g[..count].to_vec(), squares, terms }
}

/// The sums of a simulation with so many derivatives that no kernel is made for their number.
fn sums_of_any_width(run: &Simulated, at: Excerpt<'_>, correlation: f64) -> Sums {
    let count = run.lanes();
    let (mut h, mut g, mut squares, mut terms) = (Square::zero(count), vec![0.0; count], 0.0, 0.0);
    for c in 0..run.channels() {
        let residual = |k: usize, d: &mut Vec<f64>| weighted(run, at, c, k, d);
        whitened(at, c, correlation, vec![0.0; count], residual, |r, d| {
            squares += r * r;
            terms += 1.0;
            for (i, di) in d.iter().enumerate() {
                g[i] += di * r;
                if *di != 0.0 {
                    h.a[i * count..][..count].iter_mut().zip(d).for_each(|(h, dj)| *h += di * dj);
                }
            }
        });
    }
    Sums { h, g, squares, terms }
}

/// Writes the derivatives of sample `k` of channel `c` and gives its residual, both in units of the noise.
#[inline]
fn weighted(run: &Simulated, at: Excerpt<'_>, c: usize, k: usize, derivatives: &mut [f64]) -> f64 {
    let (w, simulated) = (at.record.weight[c][k], k - at.window.samples.start);
    derivatives.iter_mut().zip(run.slopes(simulated, c)).for_each(|(d, slope)| *d = w * slope);
    w * (at.record.seen.values[c][k] - run.value(simulated, c))
}

/// Gives every measured sample of channel `c` to `each` with its derivatives, both in units of the noise and free of the part
/// that the sample before foretells: noise that is correlated from sample to sample is that of an autoregression. `residual`
/// writes a sample's derivatives and gives its residual; `blank` is a row of derivatives of the right length.
fn whitened<D: AsMut<[f64]> + Clone>(
    at: Excerpt<'_>,
    c: usize,
    correlation: f64,
    blank: D,
    residual: impl Fn(usize, &mut D) -> f64,
    mut each: impl FnMut(f64, &D),
) {
    let record = at.record;
    let innovation = 1.0 / (1.0 - correlation * correlation).sqrt();
    // Rows change places instead of being copied: they are long beside the arithmetic on them.
    let (mut row, mut row_before, mut white) = (&mut blank.clone(), &mut blank.clone(), blank);
    // The measured sample before: its place and residual.
    let mut previous: Option<(usize, f64)> = None;
    for k in at.window.samples.clone().filter(|&k| record.weight[c][k] != 0.0) {
        let plain = residual(k, row);
        match previous.filter(|p| correlation != 0.0 && record.seen.follows(p.0, k)) {
            None => each(plain, row),
            Some((_, before)) => {
                let rows = row.as_mut().iter().zip(row_before.as_mut().iter());
                for (w, (d, before)) in white.as_mut().iter_mut().zip(rows) {
                    *w = (*d - correlation * before) * innovation;
                }
                each((plain - correlation * before) * innovation, &white);
            }
        }
        previous = Some((k, plain));
        std::mem::swap(&mut row, &mut row_before);
    }
}

/// Weighs the normal equations of a trajectory by its misfit and adds the priors.
fn finish(point: &Point<'_>, lanes: &Lanes, at: Excerpt<'_>, sums: Sums, events: Vec<Event>) -> Normal {
    let Sums { mut h, mut g, squares: misfit, terms } = sums;
    let free: f64 = terms - lanes.fixed_nuisances() as f64;
    let freedom = free.max(1.0);
    let tolerated = at.record.tolerated;
    let (mut q, weight) = cost_and_weight(misfit, freedom, tolerated);
    let softening = if tolerated && misfit < freedom { 0.0 } else { softening(freedom) };
    h.a.iter_mut().chain(&mut g).for_each(|x| *x *= weight);
    for (i, (offset, precision)) in own_priors(point, lanes, at).into_iter().enumerate() {
        let lane = lanes.common() + i;
        *h.at_mut(lane, lane) += precision;
        g[lane] -= precision * offset;
        q += precision * offset * offset;
    }
    let q = if q.is_finite() { q } else { f64::INFINITY };
    Normal { h, g, q, misfit, freedom, weight, softening, events }
}

#[cfg(test)]
impl Lanes {
    /// Lanes of so many start states alone.
    pub fn of_starts(count: usize) -> Self {
        let (seeds, start) = ((0..count).map(Seed::Start).collect(), (0..count).collect());
        Self { seeds, theta: Vec::new(), extras: 0, start, own: Vec::new(), offsets: 0 }
    }
}

/// Of each of a window's own unknowns how far it stands off the mean of its prior, and the prior's precision; 0 where nothing is known.
pub(crate) fn own_priors(point: &Point<'_>, lanes: &Lanes, at: Excerpt<'_>) -> Vec<(f64, f64)> {
    // What is known of a start is known of the beginning of the motion.
    let begins = at.window.samples.start == 0 && !at.record.seen.under_way;
    let states = &point.system.schema().states;
    let start = |&state: &usize| match states[state].begin {
        Begin::Prior(mean, sd) if begins => (mean, sd.powi(-2)),
        _ => (0.0, 0.0),
    };
    let starts = lanes.start.iter().map(start);
    let offsets = (0..lanes.offsets).map(|_| (0.0, point.prior));
    let known = starts.chain(point.own_prior.iter().copied()).chain(offsets);
    let off = |((mean, precision), value): ((f64, f64), &f64)| {
        if precision > 0.0 { (value - mean, precision) } else { (0.0, 0.0) }
    };
    known.zip(point.nuisance).map(off).collect()
}
