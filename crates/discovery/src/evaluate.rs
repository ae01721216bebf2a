//! Residuals of one window and their derivatives, as normal equations.
//!
//! The cost of a window with `m` degrees of freedom and whitened residuals of squared norm `q` is minus
//! twice the logarithm of a multivariate t density with 8 degrees of freedom (Lange, Little and Taylor
//! 1989): `(8 + m) ln(1 + q/8)`.

use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::record::{Record, RecordWindow};
use crate::statistics::median;
use augsim_linear::gram_of_rows;
use augsim_system::{
    Event, InitialValue, Offsets, Per, ScatterPer, Seed, Simulate, Simulated, SimulationError, Task,
};
use rayon::prelude::*;
use std::cell::RefCell;

/// Order of the derivatives of a window's residuals: shared parameters, extra parameters, then nuisances.
/// Nuisances are the initial state, parameters with one value per record, and offsets of the events'
/// parameter.
#[derive(Clone, Debug)]
pub(crate) struct Lanes {
    /// Variable of each derivative.
    pub seeds: Vec<Seed>,
    /// Index in theta (the vector of shared parameters) of each derivative with respect to a shared
    /// parameter.
    pub theta: Vec<usize>,
    pub extras: usize,
    /// Indices of the states whose initial values are estimated; those of effects come last.
    start: Vec<usize>,
    /// Number of states of effects in `start`.
    effect_starts: usize,
    /// Indices of the parameters with one value per record.
    local: Vec<usize>,
    /// Number of offsets of the events' parameter: one per event, one per record, or 0.
    pub offsets: usize,
}

impl Lanes {
    pub fn new(h: &Hypothesis, window: RecordWindow<'_>, extras: &[usize]) -> Self {
        let record = window.record;
        let (mut theta, mut local) = (Vec::new(), Vec::new());
        for (f, range) in h.entries() {
            match f.per {
                Per::Trajectory => local.push(f.index),
                Per::All => theta.push((f.index, range.start)),
                Per::Group => theta.push((f.index, range.start + record.data.group)),
            }
        }
        let states = &h.system.schema().states;
        let start: Vec<usize> = h.system.schema().free_states().collect();
        let is_of_effect = |i: &&usize| matches!(states[**i].initial, InitialValue::PriorAboutRecord(_));
        let effect_starts = start.iter().filter(is_of_effect).count();
        let offsets = match h.scatter.map(|s| s.per) {
            None => 0,
            Some(ScatterPer::Record) => usize::from(!record.data.events.is_empty()),
            Some(ScatterPer::Event) => record.data.events.len(),
        };
        let parameters = theta.iter().map(|(index, _)| index).chain(extras).map(|&i| Seed::Parameter(i));
        let nuisances =
            start.iter().map(|&i| Seed::Start(i)).chain(local.iter().map(|&i| Seed::Parameter(i)));
        let seeds = parameters.chain(nuisances).chain((0..offsets).map(Seed::Offset)).collect();
        Self {
            seeds,
            theta: theta.into_iter().map(|(_, t)| t).collect(),
            extras: extras.len(),
            start,
            effect_starts,
            local,
            offsets,
        }
    }

    /// Number of derivatives with respect to parameters, which come before those of the nuisances (initial
    /// state, record parameters, event offsets).
    pub fn common(&self) -> usize {
        self.theta.len() + self.extras
    }

    /// Number of nuisances: initial states, parameters of the record, and offsets of the events' parameter.
    pub fn nuisances(&self) -> usize {
        self.start.len() + self.local.len() + self.offsets
    }

    /// Initial values of a window's nuisances: rough initial state, nominal parameters of the record, zero
    /// offsets.
    pub fn initial_nuisance(&self, h: &Hypothesis, window: RecordWindow<'_>) -> Vec<f64> {
        let (record, rough) = (window.record, &window.window.start);
        let mut rough = rough.clone();
        if self.effect_starts > 0 {
            let of_effects = h.system.effect_starts(&record.data, window.window.samples.start, &rough);
            rough.resize(h.system.schema().states.len() - of_effects.len(), 0.0);
            rough.extend(of_effects);
        }
        let mut n: Vec<f64> = self.start.iter().map(|&i| rough.get(i).copied().unwrap_or(0.0)).collect();
        let event = h.system.schema().event.as_ref().map(|e| e.parameter);
        n.extend(self.local.iter().map(|&i| {
            let rough = rough_event_value(record);
            if event == Some(i) && rough > 0.0 { rough } else { h.values[i] }
        }));
        n.extend(std::iter::repeat_n(0.0, self.offsets));
        n
    }

    /// Number of initial values of effects' states among a window's nuisances. Each has a prior in every window.
    pub fn effect_starts(&self) -> usize {
        self.effect_starts
    }

    /// Number of estimated initial values of states, those of effects included.
    pub fn starts(&self) -> usize {
        self.start.len()
    }

    /// Number of a window's nuisances that reduce the degrees of freedom of its residuals: initial values of
    /// declared states and parameters of the record. Those of effects have priors, whose cost counts instead.
    pub fn unpenalised_nuisances(&self) -> usize {
        self.state_nuisances() - self.effect_starts
    }

    /// Number of a window's nuisances without the event offsets: initial states and parameters of the record.
    pub fn state_nuisances(&self) -> usize {
        self.start.len() + self.local.len()
    }
}

/// Median of the rough values of the events' parameter in a record; 0 for a record without events.
pub(crate) fn rough_event_value(record: &Record) -> f64 {
    median(&mut record.data.events.iter().map(|e| e.value).collect::<Vec<_>>())
}

/// Parameter values, initial state and nuisances with which a window is simulated.
pub(crate) struct Point<'a> {
    system: &'a dyn Simulate,
    /// Values of all parameters of the system, including those with one value per record.
    values: Vec<f64>,
    /// Initial state of the window.
    start: Vec<f64>,
    nuisance: &'a [f64],
    /// Prior precision 1/sd² of the offsets of the events' parameter; 0 without a random effect.
    prior: f64,
    /// Whether all events of a record share one offset of their parameter.
    shared: bool,
    /// Prior mean and precision of each parameter with one value per record; both 0 without a prior.
    local_priors: Vec<(f64, f64)>,
}

impl<'a> Point<'a> {
    /// Collects the parameter values of hypothesis `h` at `theta` (the shared parameters), and the initial
    /// state and offsets in `nuisance`. `system` is that of the hypothesis, or an extension of it by further
    /// effects, which start at their nominal values.
    pub fn new(
        h: &'a Hypothesis,
        system: &'a dyn Simulate,
        lanes: &Lanes,
        record: &Record,
        theta: &[f64],
        nuisance: &'a [f64],
    ) -> Self {
        let mut values = h.values_at(theta, record.data.group);
        values.extend(system.parameters().iter().skip(values.len()).map(|p| p.nominal));
        for (&index, &value) in lanes.local.iter().zip(&nuisance[lanes.start.len()..]) {
            values[index] = value;
        }
        let begins = system.schema().states.iter().map(|state| match state.initial {
            InitialValue::Fixed(value) => value,
            // The system computes these from the record where they are not estimated.
            InitialValue::FromRecord | InitialValue::PriorAboutRecord(_) => f64::NAN,
            _ => 0.0,
        });
        let mut start: Vec<f64> = begins.collect();
        lanes.start.iter().zip(nuisance).for_each(|(&i, &value)| start[i] = value);
        let local = h.free.iter().filter(|f| f.per == Per::Trajectory);
        Self {
            system,
            values,
            start,
            nuisance,
            prior: h.scatter.map_or(0.0, |s| s.sd.powi(-2)),
            shared: h.scatter.is_some_and(|s| s.per == ScatterPer::Record),
            local_priors: local
                .map(|f| f.prior.map_or((0.0, 0.0), |(mean, sd)| (mean, sd.powi(-2))))
                .collect(),
        }
    }

    /// Replaces the parameter values from index `first` on by `values`.
    pub fn with_values(mut self, first: usize, values: &[f64]) -> Self {
        self.values[first..][..values.len()].copy_from_slice(values);
        self
    }

    /// Adds `offsets` to the parameter values from index `first` on.
    pub fn with_offsets(mut self, first: usize, offsets: &[f64]) -> Self {
        self.values[first..].iter_mut().zip(offsets).for_each(|(value, offset)| *value += offset);
        self
    }

    /// Simulation task of a window, with derivatives with respect to `seeds`.
    fn task<'t>(&'t self, lanes: &Lanes, window: RecordWindow<'t>, seeds: &'t [Seed]) -> Task<'t> {
        let offsets = match self.nuisance.get(lanes.state_nuisances()..) {
            Some(&[xi, ..]) if self.shared && lanes.offsets > 0 => Offsets::Shared(xi),
            Some(list) if lanes.offsets > 0 => Offsets::PerEvent(&list[..lanes.offsets]),
            _ => Offsets::None,
        };
        let (record, samples) = (&window.record.data, window.window.samples.clone());
        let (parameters, start) = (&self.values, &self.start);
        Task { parameters, record, window: samples, start, offsets, seeds }
    }

    /// Simulates a window with derivatives with respect to `seeds` into `out`.
    fn simulate(&self, lanes: &Lanes, window: RecordWindow<'_>, seeds: &[Seed], out: &mut Simulated) {
        let done = self.system.simulate(&self.task(lanes, window, seeds), out);
        if done.is_err() {
            self.fail(window, seeds.len(), out);
        }
    }

    /// Fills a failed simulation with NaN values, so that its cost is infinite.
    fn fail(&self, window: RecordWindow<'_>, seeds: usize, out: &mut Simulated) {
        let schema = self.system.schema();
        let (samples, channels) = (window.window.samples.len(), schema.channels.len());
        out.reset(samples, channels, seeds, schema.features.len());
        (0..samples).for_each(|k| (0..channels).for_each(|c| out.set_row(k, c, f64::NAN, [])));
    }

    /// Simulates the samples of a window without derivatives.
    pub fn simulate_plain(&self, lanes: &Lanes, window: RecordWindow<'_>) -> Simulated {
        let mut out = Simulated::default();
        self.simulate(lanes, window, &[], &mut out);
        out
    }
}

/// Degrees of freedom of the t distribution of a window's residuals.
const STUDENT_FREEDOM: f64 = 8.0;

/// Second-order coefficient of a window's robust cost: 2 / (8 + m), with `freedom` the window's m.
pub(crate) fn softening(freedom: f64) -> f64 {
    2.0 / (STUDENT_FREEDOM + freedom)
}

/// Cost and weight of a window with squared residual norm `q` and `m` degrees of freedom. Where the noise is
/// a tolerance, residuals below it are not rewarded beyond the Gaussian cost.
pub(crate) fn cost_and_weight(q: f64, m: f64, is_tolerance: bool) -> (f64, f64) {
    if is_tolerance { tolerance_cost(q, m) } else { student_cost(q, m) }
}

/// Cost and weight of a window from the t density (Lange, Little and Taylor 1989), for squared residual norm
/// `q` and `m` degrees of freedom. Near `q = m` it equals the Gaussian cost; a window that no hypothesis fits
/// counts only with the logarithm of its squared residuals.
fn student_cost(q: f64, m: f64) -> (f64, f64) {
    let n = STUDENT_FREEDOM + m;
    (n * (q / STUDENT_FREEDOM).ln_1p(), n / (STUDENT_FREEDOM + q))
}

/// As [`student_cost`], but with the Gaussian cost where `q < m`.
fn tolerance_cost(q: f64, m: f64) -> (f64, f64) {
    if q < m { (q - m + student_cost(m, m).0, 1.0) } else { student_cost(q, m) }
}

/// Normal equations of one window in all its variables: `h = J'WJ`, `g = J'Wr`, and the cost `q`. J are the
/// derivatives of the residuals r, W is the weight of the window; `q` includes the priors of the nuisances
/// (initial state, record parameters, event offsets).
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations {
    pub h: Square,
    pub g: Vec<f64>,
    pub q: f64,
    /// Squared norm of the whitened residuals, in units of the noise.
    pub residual_norm_squared: f64,
    /// Degrees of freedom of the window's residuals.
    pub degrees_of_freedom: f64,
    /// Robust weight of the window in the fit, about 1 where the model fits.
    pub weight: f64,
    /// Twice the inverse of the degrees of freedom of the robust cost. Along a step `x` the weight falls by
    /// `softening (u'x) weight`, with `u` the gradient.
    pub softening: f64,
    /// Events that occurred in the simulation of the window.
    pub events: Vec<Event>,
}

impl NormalEquations {
    /// Predicts the window's cost after `change` of its variables, in the quadratic approximation.
    pub fn predicted_cost(&self, change: &[f64]) -> f64 {
        self.q - self.h.cost_decrease(&self.g, change)
    }
}

thread_local! {
    /// Simulation buffers of this thread, reused because allocation would take most of the time of a short
    /// simulation.
    static RUNS: RefCell<Vec<Simulated>> = const { RefCell::new(Vec::new()) };
}

/// Calls `work` with `count` simulation buffers of this thread.
fn with_buffers<T>(count: usize, work: impl FnOnce(&mut [Simulated]) -> T) -> T {
    let mut runs = RUNS.take();
    if runs.len() < count {
        runs.resize_with(count, Simulated::default);
    }
    let done = work(&mut runs[..count]);
    RUNS.set(runs);
    done
}

/// Simulates a window with all derivatives and computes its normal equations.
pub(crate) fn assemble_window(
    point: &Point<'_>,
    lanes: &Lanes,
    window: RecordWindow<'_>,
    correlation: f64,
) -> NormalEquations {
    with_buffers(1, |runs| {
        point.simulate(lanes, window, &lanes.seeds, &mut runs[0]);
        equations_of_run(point, lanes, window, correlation, &runs[0])
    })
}

/// As [`assemble_window`], for several windows, with as many in one SIMD pass as the system supports.
pub(crate) fn assemble_batch(
    points: &[Point<'_>],
    lanes: &[Lanes],
    windows: &[RecordWindow<'_>],
    correlation: f64,
) -> Vec<NormalEquations> {
    let seeds: Vec<&[Seed]> = lanes.iter().map(|l| &l.seeds[..]).collect();
    simulate_windows(points, lanes, windows, &seeds, |w, run| {
        equations_of_run(&points[w], &lanes[w], windows[w], correlation, run)
    })
}

/// Simulates windows with derivatives with respect to `seeds`, and maps each simulation by `take`. A SIMD
/// pass has as many windows as the system supports. Failed simulations have NaN values.
pub(crate) fn simulate_windows<T: Send>(
    points: &[Point<'_>],
    lanes: &[Lanes],
    windows: &[RecordWindow<'_>],
    seeds: &[&[Seed]],
    take: impl Fn(usize, &Simulated) -> T + Sync,
) -> Vec<T> {
    let simd_batch_size = points.first().map_or(1, |p| p.system.simd_batch_size().max(1));
    let blocks: Vec<usize> = (0..points.len()).step_by(simd_batch_size).collect();
    let results = blocks.into_par_iter().flat_map_iter(|first| {
        let block = first..(first + simd_batch_size).min(points.len());
        with_buffers(block.len(), |runs| {
            let task = |w: usize| points[w].task(&lanes[w], windows[w], seeds[w]);
            let tasks: Vec<Task<'_>> = block.clone().map(task).collect();
            let done = points[first].system.simulate_batch(&tasks, runs);
            let finish = |((w, run), done): ((usize, &mut Simulated), Result<(), SimulationError>)| {
                if done.is_err() {
                    points[w].fail(windows[w], seeds[w].len(), run);
                }
                take(w, run)
            };
            block.clone().zip(runs).zip(done).map(finish).collect::<Vec<_>>()
        })
    });
    results.collect()
}

/// Whitened derivatives and residual of every measured sample, channel by channel, in units of the noise.
/// Each row has the derivatives with respect to all variables, then the residual. Also returns channel and
/// sample of each row.
pub(crate) fn whitened_rows(
    run: &Simulated,
    window: RecordWindow<'_>,
    correlation: f64,
) -> (Vec<f64>, Vec<(usize, usize)>) {
    let (record, count) = (window.record, run.lanes());
    let (mut rows, mut places) = (Vec::new(), Vec::new());
    for c in 0..run.channels() {
        let residual = |k: usize, d: &mut Vec<f64>| weighted_residual(run, window, c, k, d);
        for_each_whitened(window, c, correlation, vec![0.0; count], residual, |r, d| {
            rows.extend_from_slice(d);
            rows.push(r);
        });
        places.extend(window.window.samples.clone().filter(|&k| record.weight[c][k] != 0.0).map(|k| (c, k)));
    }
    (rows, places)
}

/// Computes the normal equations of a window from its simulation.
fn equations_of_run(
    point: &Point<'_>,
    lanes: &Lanes,
    window: RecordWindow<'_>,
    correlation: f64,
    run: &Simulated,
) -> NormalEquations {
    // Rows of derivatives are padded to a multiple of four lanes; kernels of fixed width are twice as fast
    // as the general one.
    let sums = match run.width() {
        4 => sums::<4>(run, window, correlation),
        8 => sums::<8>(run, window, correlation),
        12 => sums::<12>(run, window, correlation),
        16 => sums::<16>(run, window, correlation),
        20 => sums::<20>(run, window, correlation),
        24 => sums::<24>(run, window, correlation),
        28 => sums::<28>(run, window, correlation),
        32 => sums::<32>(run, window, correlation),
        36 => sums::<36>(run, window, correlation),
        40 => sums::<40>(run, window, correlation),
        _ => sums_of_any_width(run, window, correlation),
    };
    weigh_and_add_priors(point, lanes, window, sums, run.events())
}

/// Sums over a window's whitened residuals r and their derivatives J: `J'J`, `J'r`, squared norm and number.
struct Sums {
    h: Square,
    g: Vec<f64>,
    squares: f64,
    terms: f64,
}

/// Sums residuals and derivatives over a window, for derivative rows of fixed length `N`.
fn sums<const N: usize>(run: &Simulated, window: RecordWindow<'_>, correlation: f64) -> Sums {
    let count = run.lanes();
    let (mut h, mut g, mut squares, mut terms) = (vec![[0.0; N]; N], [0.0; N], 0.0, 0.0);
    for c in 0..run.channels() {
        let residual = |k: usize, d: &mut [f64; N]| weighted_residual(run, window, c, k, d);
        for_each_whitened(window, c, correlation, [0.0; N], residual, |r, d| {
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

/// Sums residuals and derivatives over a window, for a number of derivatives without a kernel of fixed width.
fn sums_of_any_width(run: &Simulated, window: RecordWindow<'_>, correlation: f64) -> Sums {
    let (count, width) = (run.lanes(), run.lanes() + 1);
    let mut rows: Vec<f64> = Vec::new();
    for c in 0..run.channels() {
        let residual = |k: usize, d: &mut Vec<f64>| weighted_residual(run, window, c, k, d);
        for_each_whitened(window, c, correlation, vec![0.0; count], residual, |r, d| {
            rows.extend_from_slice(d);
            rows.push(r);
        });
    }
    let products = gram_of_rows(&rows, width);
    let mut h = Square::zero(count);
    (0..count).for_each(|i| h.a[i * count..][..count].copy_from_slice(&products[i * width..][..count]));
    let g = (0..count).map(|i| products[i * width + count]).collect();
    Sums { h, g, squares: products[count * width + count], terms: (rows.len() / width) as f64 }
}

/// Returns the residual of sample `k` of channel `c` and writes its derivatives, both in units of the noise.
#[inline]
fn weighted_residual(
    run: &Simulated,
    window: RecordWindow<'_>,
    c: usize,
    k: usize,
    derivatives: &mut [f64],
) -> f64 {
    let (w, simulated) = (window.record.weight[c][k], k - window.window.samples.start);
    derivatives.iter_mut().zip(run.slopes(simulated, c)).for_each(|(d, slope)| *d = w * slope);
    w * (window.record.data.values[c][k] - run.value(simulated, c))
}

/// Calls `each` with the whitened residual and derivatives of every measured sample of channel `c`.
/// Autocorrelated noise is a first-order autoregression: the part predicted from the preceding sample is
/// subtracted and the remainder is scaled to variance 1. `residual` writes the derivatives of a sample and
/// returns its residual; `blank` is a row of derivatives of the right length.
fn for_each_whitened<D: AsMut<[f64]> + Clone>(
    window: RecordWindow<'_>,
    c: usize,
    correlation: f64,
    blank: D,
    residual: impl Fn(usize, &mut D) -> f64,
    mut each: impl FnMut(f64, &D),
) {
    let record = window.record;
    let innovation = 1.0 / (1.0 - correlation * correlation).sqrt();
    // Rows are swapped instead of copied, because copying would cost as much as the arithmetic on them.
    let (mut row, mut row_before, mut white) = (&mut blank.clone(), &mut blank.clone(), blank);
    // The preceding measured sample: index and residual.
    let mut previous: Option<(usize, f64)> = None;
    for k in window.window.samples.clone().filter(|&k| record.weight[c][k] != 0.0) {
        let plain = residual(k, row);
        match previous.filter(|p| correlation != 0.0 && record.data.is_correlated_with(p.0, k)) {
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

/// Multiplies the sums of a window by its robust weight and adds the priors of its nuisances (initial state,
/// record parameters, event offsets).
fn weigh_and_add_priors(
    point: &Point<'_>,
    lanes: &Lanes,
    window: RecordWindow<'_>,
    sums: Sums,
    events: Vec<Event>,
) -> NormalEquations {
    let Sums { mut h, mut g, squares: residual_norm_squared, terms } = sums;
    let free: f64 = terms - lanes.unpenalised_nuisances() as f64;
    let freedom = free.max(1.0);
    let is_tolerance = window.record.is_tolerance;
    let (mut q, weight) = cost_and_weight(residual_norm_squared, freedom, is_tolerance);
    let softening = if is_tolerance && residual_norm_squared < freedom { 0.0 } else { softening(freedom) };
    h.a.iter_mut().chain(&mut g).for_each(|x| *x *= weight);
    for (i, (offset, precision)) in nuisance_priors(point, lanes, window).into_iter().enumerate() {
        let lane = lanes.common() + i;
        *h.at_mut(lane, lane) += precision;
        g[lane] -= precision * offset;
        q += precision * offset * offset;
    }
    let q = if q.is_finite() { q } else { f64::INFINITY };
    NormalEquations { h, g, q, residual_norm_squared, degrees_of_freedom: freedom, weight, softening, events }
}

#[cfg(test)]
impl Lanes {
    /// Order of derivatives that contains `count` initial states alone, for tests.
    pub fn of_starts(count: usize) -> Self {
        let (seeds, start) = ((0..count).map(Seed::Start).collect(), (0..count).collect());
        Self { seeds, theta: Vec::new(), extras: 0, start, effect_starts: 0, local: Vec::new(), offsets: 0 }
    }
}

/// For each nuisance of a window: its deviation from the prior mean, and the prior precision; both 0 without
/// a prior. Nuisances are the initial state, parameters of the record, and offsets of the events' parameter.
pub(crate) fn nuisance_priors(point: &Point<'_>, lanes: &Lanes, window: RecordWindow<'_>) -> Vec<(f64, f64)> {
    // A prior of the initial state applies only to the beginning of the motion.
    let begins = window.window.samples.start == 0 && !window.record.data.is_mid_motion;
    let states = &point.system.schema().states;
    let of_effects = match lanes.effect_starts {
        0 => Vec::new(),
        _ => point.system.effect_starts(&window.record.data, window.window.samples.start, &point.start),
    };
    let start = |&state: &usize| match states[state].initial {
        InitialValue::PriorAboutRecord(sd) => {
            // States of effects are the last of the system.
            let place = (state + of_effects.len()).checked_sub(states.len());
            let mean = place.and_then(|place| of_effects.get(place));
            mean.map_or((0.0, 0.0), |mean| (*mean, sd.powi(-2)))
        }
        InitialValue::Prior(mean, sd) if begins => (mean, sd.powi(-2)),
        InitialValue::PriorAboutExpression(sd) if begins => {
            // The rough initial state is the value of the expression at the declared parameters and the first
            // readings; a constant mean keeps the gradient of the cost exact.
            let rough = window.record.data.windows.first().and_then(|w| w.start.get(state));
            rough.map_or((0.0, 0.0), |mean| (*mean, sd.powi(-2)))
        }
        _ => (0.0, 0.0),
    };
    let starts = lanes.start.iter().map(start);
    let offsets = (0..lanes.offsets).map(|_| (0.0, point.prior));
    let known = starts.chain(point.local_priors.iter().copied()).chain(offsets);
    let off = |((mean, precision), value): ((f64, f64), &f64)| {
        if precision > 0.0 { (value - mean, precision) } else { (0.0, 0.0) }
    };
    known.zip(point.nuisance).map(off).collect()
}
