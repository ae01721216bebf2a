//! Residuals of one trajectory and their derivatives, as normal equations.

use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::record::Record;
use augsim_physics::ball::{ImpactRecord, Offsets, RADIUS, RESTITUTION, Run, State, Throw, World, simulate};
use augsim_physics::effects::ScatterPer;
use augsim_physics::model::{Per, Release};
use augsim_physics::{Dual, Scalar};

/// Where the derivatives of one trajectory go. The lanes are: globals, extras, then nuisances.
#[derive(Clone, Debug)]
pub(crate) struct Lanes {
    /// World parameter of each lane, where it is one.
    parameters: Vec<(usize, usize)>,
    /// Entry of theta of each global lane.
    pub theta: Vec<usize>,
    pub extras: usize,
    /// Coordinates of the start position, then velocity, that are fitted.
    start: Vec<usize>,
    /// Parameters of this trajectory alone.
    own: Vec<usize>,
    /// Number of offsets of restitution.
    pub offsets: usize,
}

impl Lanes {
    pub fn new(h: &Hypothesis, record: &Record, extras: &[usize]) -> Self {
        let (mut parameters, mut theta, mut own) = (Vec::new(), Vec::new(), Vec::new());
        let mut at = 0;
        for f in &h.free {
            match f.per {
                Per::Trajectory => own.push(f.index),
                Per::All => theta.push((f.index, at)),
                Per::Group => theta.push((f.index, at + record.group)),
            }
            at += h.width(f);
        }
        for (lane, (index, _)) in theta.iter().enumerate() {
            parameters.push((*index, lane));
        }
        for (i, index) in extras.iter().enumerate() {
            parameters.push((*index, theta.len() + i));
        }
        let axes = h.world.axes.indices();
        let mut start: Vec<usize> = axes.to_vec();
        if h.release == Release::Free {
            start.extend(axes.iter().map(|a| a + 3));
        }
        let first_own = theta.len() + extras.len() + start.len();
        parameters.extend(own.iter().enumerate().map(|(i, &index)| (index, first_own + i)));
        let offsets = match h.scatter.map(|s| s.per) {
            None => 0,
            Some(ScatterPer::Trajectory) => usize::from(!record.impacts.is_empty()),
            Some(ScatterPer::Impact) => record.impacts.len(),
        };
        Self {
            parameters,
            theta: theta.into_iter().map(|(_, t)| t).collect(),
            extras: extras.len(),
            start,
            own,
            offsets,
        }
    }

    /// Lanes before the nuisances.
    pub fn common(&self) -> usize {
        self.theta.len() + self.extras
    }

    pub fn nuisances(&self) -> usize {
        self.start.len() + self.own.len() + self.offsets
    }

    /// Nuisance values to begin with: the rough start, nominal own parameters, no offsets.
    pub fn nuisance_start(&self, h: &Hypothesis, record: &Record) -> Vec<f64> {
        let (p, v) = record.start;
        let mut n: Vec<f64> = self.start.iter().map(|&i| if i < 3 { p[i] } else { v[i - 3] }).collect();
        n.extend(self.own.iter().map(|&i| {
            let rough = crate::statistics::median(&mut record.ratios.clone());
            if i == RESTITUTION && rough > 0.0 { rough } else { h.values[i] }
        }));
        n.extend(std::iter::repeat_n(0.0, self.offsets));
        n
    }

    /// Number of nuisances that are no offsets.
    pub fn fixed_nuisances(&self) -> usize {
        self.start.len() + self.own.len()
    }
}

/// The point at which a trajectory is simulated.
pub(crate) struct Point<'a> {
    pub world: &'a World,
    /// World parameters with theta in them; own parameters are overwritten by the nuisances.
    pub values: Vec<f64>,
    pub nuisance: &'a [f64],
    /// 1/sd² of the offsets.
    pub prior: f64,
    pub shared: bool,
    pub held: bool,
    /// Mean and 1/sd² of each of the trajectory's own parameters; 1/sd² is 0 where nothing is known.
    own_prior: Vec<(f64, f64)>,
}

impl<'a> Point<'a> {
    pub fn new(
        h: &'a Hypothesis,
        world: &'a World,
        record: &Record,
        theta: &[f64],
        nuisance: &'a [f64],
    ) -> Self {
        let mut values = h.values_of(record.group);
        values.resize(world.parameter_count(), 0.0);
        let mut at = 0;
        for f in &h.free {
            match f.per {
                Per::All => values[f.index] = theta[at],
                Per::Group => values[f.index] = theta[at + record.group],
                Per::Trajectory => {}
            }
            at += h.width(f);
        }
        if let Some(r) = record.radius_m {
            values[RADIUS] = r;
        }
        Self {
            world,
            values,
            nuisance,
            prior: h.scatter.map_or(0.0, |s| s.sd.powi(-2)),
            shared: h.scatter.is_some_and(|s| s.per == ScatterPer::Trajectory),
            held: h.release == Release::Rest,
            own_prior: h
                .free
                .iter()
                .filter(|f| f.per == Per::Trajectory)
                .map(|f| f.prior.map_or((0.0, 0.0), |(mean, sd)| (mean, sd.powi(-2))))
                .collect(),
        }
    }

    /// Simulates in the scalar whose independent variables `seed(value, lane)` makes.
    pub fn simulate<S: Scalar>(
        &self,
        lanes: &Lanes,
        record: &Record,
        times: &[f64],
        seed: impl Fn(f64, usize) -> S,
    ) -> Run<S> {
        let mut parameters: Vec<S> = self.values.iter().map(|&v| S::constant(v)).collect();
        let common = lanes.common();
        let first_own = common + lanes.start.len();
        for &(index, lane) in &lanes.parameters {
            let value = if lane >= first_own { self.nuisance[lane - common] } else { self.values[index] };
            parameters[index] = seed(value, lane);
        }
        let zero = S::zero();
        let t0 = if self.held { 0.0 } else { record.times.first().copied().unwrap_or(0.0) };
        let mut start = State {
            time: S::constant(t0),
            position: [zero; 3],
            velocity: [zero; 3],
            spin: record.covariates.spin_rad_s.map(S::constant),
        };
        for (i, &component) in lanes.start.iter().enumerate() {
            let value = seed(self.nuisance[i], common + i);
            if component < 3 {
                start.position[component] = value
            } else {
                start.velocity[component - 3] = value
            }
        }
        let first = lanes.fixed_nuisances();
        let xi: Vec<S> =
            (0..lanes.offsets).map(|i| seed(self.nuisance[first + i], common + first + i)).collect();
        let offsets = match xi.first() {
            None => Offsets::None,
            Some(&x) if self.shared => Offsets::Shared(x),
            Some(_) => Offsets::PerImpact(&xi),
        };
        let mut run = Run {
            positions: Vec::with_capacity(times.len()),
            velocities: Vec::new(),
            impacts: Vec::new(),
            rest_time: None,
        };
        let throw = Throw {
            world: self.world,
            parameters: &parameters,
            start,
            covariates: &record.covariates,
            offsets,
            velocities: false,
        };
        simulate(&throw, times, &mut run);
        run
    }

    /// The plain simulation at the record's times.
    pub fn plain(&self, lanes: &Lanes, record: &Record) -> Run<f64> {
        self.simulate(lanes, record, &record.times, |v, _| v)
    }
}

/// Degrees of freedom of the scale that each trajectory's misfit has of its own.
const SCALE_FREEDOM: f64 = 8.0;

/// Cost and weight of a trajectory whose whitened residuals have the sum of squares `q` with `m` degrees of freedom: minus
/// twice the logarithm of a multivariate t density (Lange, Little and Taylor 1989). Near `q = m` it is the Gaussian cost; a
/// trajectory that no hypothesis follows (a hand in the way, a wrong covariate) counts with the logarithm of its misfit.
fn robust(q: f64, m: f64) -> (f64, f64) {
    let n = SCALE_FREEDOM + m;
    (n * (q / SCALE_FREEDOM).ln_1p(), n / (SCALE_FREEDOM + q))
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
    /// Weight of the trajectory in the fit, about 1 where the model follows it.
    pub weight: f64,
    pub impacts: Vec<ImpactRecord<f64>>,
}

/// Simulates a trajectory with derivatives in all lanes and forms its normal equations.
pub(crate) fn normal(point: &Point<'_>, lanes: &Lanes, record: &Record, correlation: f64) -> Normal {
    let count = lanes.common() + lanes.nuisances();
    // The smallest width that fits: a wider one computes zeros.
    match count {
        0..=4 => normal_wide::<4>(point, lanes, record, correlation),
        5..=8 => normal_wide::<8>(point, lanes, record, correlation),
        9..=12 => normal_wide::<12>(point, lanes, record, correlation),
        13..=16 => normal_wide::<16>(point, lanes, record, correlation),
        17..=24 => normal_wide::<24>(point, lanes, record, correlation),
        25..=40 => normal_wide::<40>(point, lanes, record, correlation),
        41..=80 => normal_wide::<80>(point, lanes, record, correlation),
        _ => normal_in_blocks::<40>(point, lanes, record, correlation),
    }
}

/// All derivatives in one simulation of `N` lanes, as many as there are or more.
fn normal_wide<const N: usize>(
    point: &Point<'_>,
    lanes: &Lanes,
    record: &Record,
    correlation: f64,
) -> Normal {
    let count = lanes.common() + lanes.nuisances();
    let run = point.simulate(lanes, record, &record.times, Dual::<N>::variable);
    let (mut h, mut g, mut sum) = (vec![[0.0; N]; N], [0.0; N], Misfit::default());
    for (c, &axis) in point.world.axes.indices().iter().enumerate() {
        let residual = |k: usize| {
            let (x, w) = (&run.positions[k][axis], record.weight[c][k]);
            (w * (record.y[c][k] - x.value), x.d.map(|d| w * d))
        };
        whitened(record, c, correlation, residual, |r, d| {
            sum.add(r);
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
    finish(point, lanes, out, g[..count].to_vec(), sum, impacts_of(&run))
}

/// More derivatives than the widest dual number has lanes: one simulation for every `N` of them. A simulation's course does not
/// depend on which derivatives it carries.
fn normal_in_blocks<const N: usize>(
    point: &Point<'_>,
    lanes: &Lanes,
    record: &Record,
    correlation: f64,
) -> Normal {
    let count = lanes.common() + lanes.nuisances();
    let runs: Vec<Run<Dual<N>>> = (0..count)
        .step_by(N)
        .map(|first| {
            // Lanes before the block wrap around to numbers that no dual has: they stay constant, as those after it do.
            point
                .simulate(lanes, record, &record.times, |v, lane| Dual::variable(v, lane.wrapping_sub(first)))
        })
        .collect();
    let (mut h, mut g, mut sum) = (Square::zero(count), vec![0.0; count], Misfit::default());
    for (c, &axis) in point.world.axes.indices().iter().enumerate() {
        let residual = |k: usize| {
            let w = record.weight[c][k];
            let d = runs.iter().flat_map(|run| run.positions[k][axis].d).take(count).map(|d| w * d);
            (w * (record.y[c][k] - runs[0].positions[k][axis].value), d.collect::<Vec<f64>>())
        };
        whitened(record, c, correlation, residual, |r, d| {
            sum.add(r);
            for (i, di) in d.iter().enumerate() {
                g[i] += di * r;
                if *di != 0.0 {
                    h.a[i * count..][..count].iter_mut().zip(d).for_each(|(h, dj)| *h += di * dj);
                }
            }
        });
    }
    finish(point, lanes, h, g, sum, impacts_of(&runs[0]))
}

/// Sum of squares of whitened residuals, and how many there are.
#[derive(Clone, Copy, Default)]
struct Misfit {
    squares: f64,
    terms: f64,
}

impl Misfit {
    fn add(&mut self, residual: f64) {
        self.squares += residual * residual;
        self.terms += 1.0;
    }
}

/// Gives every measured sample of channel `c` to `each` with its derivatives, both in units of the noise and free of the part
/// that the sample before foretells: noise that is correlated from sample to sample is that of an autoregression.
fn whitened<D: AsMut<[f64]> + Clone>(
    record: &Record,
    c: usize,
    correlation: f64,
    residual: impl Fn(usize) -> (f64, D),
    mut each: impl FnMut(f64, &D),
) {
    let innovation = 1.0 / (1.0 - correlation * correlation).sqrt();
    // The measured sample before: its place, residual and derivatives.
    let mut previous: Option<(usize, f64, D)> = None;
    for k in (0..record.times.len()).filter(|&k| record.weight[c][k] != 0.0) {
        let (mut r, mut d) = residual(k);
        if correlation == 0.0 {
            each(r, &d);
            continue;
        }
        let plain = (k, r, d.clone());
        if let Some((_, rp, dp)) = previous.as_mut().filter(|p| record.follows(p.0, k)) {
            r = (r - correlation * *rp) * innovation;
            for (d, dp) in d.as_mut().iter_mut().zip(dp.as_mut()) {
                *d = (*d - correlation * *dp) * innovation;
            }
        }
        previous = Some(plain);
        each(r, &d);
    }
}

/// Impacts of a run without their derivatives.
fn impacts_of<const N: usize>(run: &Run<Dual<N>>) -> Vec<ImpactRecord<f64>> {
    run.impacts
        .iter()
        .map(|i| ImpactRecord {
            time: i.time.value,
            position: i.position.map(|x| x.value),
            speed_in: i.speed_in.value,
            speed_out: i.speed_out.value,
            tangential: i.tangential.map(|x| x.value),
            slip: i.slip.map(|x| x.value),
            spin: i.spin.map(|x| x.value),
        })
        .collect()
}

/// Weighs the normal equations of a trajectory by its misfit and adds the priors.
fn finish(
    point: &Point<'_>,
    lanes: &Lanes,
    mut h: Square,
    mut g: Vec<f64>,
    sum: Misfit,
    impacts: Vec<ImpactRecord<f64>>,
) -> Normal {
    let free: f64 = sum.terms - lanes.fixed_nuisances() as f64;
    let misfit = sum.squares;
    let (mut q, weight) = robust(misfit, free.max(1.0));
    h.a.iter_mut().chain(&mut g).for_each(|x| *x *= weight);
    let first = lanes.fixed_nuisances();
    let own = point.own_prior.iter().enumerate().map(|(i, p)| (lanes.start.len() + i, *p));
    let offsets = (first..first + lanes.offsets).map(|i| (i, (0.0, point.prior)));
    for (i, (mean, precision)) in own.chain(offsets) {
        let lane = lanes.common() + i;
        *h.at_mut(lane, lane) += precision;
        g[lane] -= precision * (point.nuisance[i] - mean);
        q += precision * (point.nuisance[i] - mean).powi(2);
    }
    Normal { h, g, q: if q.is_finite() { q } else { f64::INFINITY }, misfit, weight, impacts }
}

#[cfg(test)]
mod tests {
    //! Contract: derivatives computed in blocks are those of one wide simulation. The scene is a drop with two impacts, so that
    //! derivatives pass through events; three lanes at a time cut the six of the model and the start in two.
    use super::*;
    use crate::prepare::prepare;
    use crate::{Options, hypothesis::Hypothesis};
    use augsim_data::{Dataset, Trajectory};
    use augsim_physics::ball::{Axes, Covariates};
    use augsim_physics::model::Model;

    #[test]
    fn blocks_of_derivatives_equal_one_wide_simulation() {
        let mut model = Model::plain(9.81, 0.7);
        model.parameters[0].frozen = false;
        let (world, parameters) = model.world(Axes::Vertical);
        let times: Vec<f64> = (0..130).map(|k| f64::from(k) / 100.0).collect();
        let drops = (0..4).map(|j| {
            let mut run = Run::default();
            let (start, covariates) = (State::at_rest(1.0 + 0.1 * f64::from(j)), Covariates::default());
            let throw = Throw {
                world: &world,
                parameters: &parameters,
                start,
                covariates: &covariates,
                offsets: Offsets::None,
                velocities: false,
            };
            simulate(&throw, &times, &mut run);
            // A millimetre of ripple stands for noise.
            let ripple = |k: usize| 1e-3 * ((k * k * 7) as f64 + f64::from(j)).sin();
            let z = run.positions.iter().enumerate().map(|(k, p)| p[2] + ripple(k)).collect();
            Trajectory::new(format!("{j}"), times.clone(), vec![z]).expect("well formed")
        });
        let data = Dataset::from_names(&["height_m"], drops.collect()).expect("well formed");
        let prepared = prepare(&model, &data, &Options::default()).expect("usable");
        let h = Hypothesis::new(&model, &prepared.data, &[]);
        let record = &prepared.data.records[0];
        let lanes = Lanes::new(&h, record, &[]);
        let nuisance = lanes.nuisance_start(&h, record);
        let theta = h.theta_start(0.0);
        let point = Point::new(&h, &h.world, record, &theta, &nuisance);
        assert!(lanes.common() + lanes.nuisances() > 3, "more than a block");
        let wide = normal_wide::<8>(&point, &lanes, record, 0.3);
        let blocks = normal_in_blocks::<3>(&point, &lanes, record, 0.3);
        assert!((wide.q - blocks.q).abs() <= 1e-12 * wide.q, "{} {}", wide.q, blocks.q);
        let scale = wide.h.a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(wide.h.a.iter().zip(&blocks.h.a).all(|(a, b)| (a - b).abs() < 1e-12 * scale));
        assert!(wide.g.iter().zip(&blocks.g).all(|(a, b)| (a - b).abs() < 1e-12 * scale));
    }
}
