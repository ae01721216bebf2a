//! Which experiment tells two explanations apart: the T-criterion (Atkinson and Fedorov 1975) over a list of throws.

use crate::evaluate::{Lanes, Point, normal};
use crate::fit::{Fit, Sample};
use crate::linear::Square;
use crate::record::Record;
use crate::statistics::median;
use augsim_physics::ball::{Axes, Covariates};
use augsim_physics::model::Release;

/// Twice the logarithm of odds of 1000 to 1.
const ODDS: f64 = 13.8;
/// Longest record of a throw, s.
const LONGEST_S: f64 = 2.5;
/// Impacts after which a record ends: later ones are too uncertain to plan with.
const MOST_IMPACTS: usize = 6;
/// Heights that are tried, as shares of the highest start in the data.
const HEIGHTS: [f64; 5] = [0.05, 0.2, 0.5, 1.0, 2.0];
/// Gauss-Newton steps of the other explanation towards what the first one predicts.
const STEPS: usize = 8;

/// A throw that could be recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Design {
    height_m: f64,
    speed_m_s: f64,
    spin_rad_s: f64,
}

impl Design {
    fn text(&self) -> String {
        let from = format!("from {:.2} m", self.height_m);
        let way = if self.speed_m_s == 0.0 {
            format!("drop {from}")
        } else {
            format!("throw {from} at {} m/s along x", self.speed_m_s)
        };
        if self.spin_rad_s == 0.0 { way } else { format!("{way} with a spin of {} rad/s", self.spin_rad_s) }
    }
}

/// How well a throw separates two explanations.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Separation {
    /// The best throw in words.
    pub design: String,
    /// How many of them make odds of 1000 to 1; infinite if none does.
    pub trajectories: f64,
}

/// The throw that separates two fitted explanations best, with the noise and the frame rate of `sample`.
pub(crate) fn separation(sample: &Sample<'_>, noise_m: &[f64], a: &Fit, b: &Fit) -> Separation {
    let mut steps: Vec<f64> =
        sample.records().flat_map(|r| r.times.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>()).collect();
    let step = median(&mut steps).max(1e-4);
    let mut best = Separation { design: String::new(), trajectories: f64::INFINITY };
    for design in designs(sample, a) {
        let distance = |truth, other| distance(sample, noise_m, step, &design, truth, other);
        let (Some(forth), Some(back)) = (distance(a, b), distance(b, a)) else { continue };
        let trajectories = ODDS / forth.min(back).max(1e-12);
        if trajectories < best.trajectories {
            best = Separation { design: design.text(), trajectories };
        }
    }
    best
}

fn designs(sample: &Sample<'_>, fit: &Fit) -> Vec<Design> {
    let thrown = sample.data.axes != Axes::Vertical && fit.hypothesis.release == Release::Free;
    let speeds: &[f64] = if thrown { &[0.0, 2.0, 5.0] } else { &[0.0] };
    let spins: &[f64] = if thrown && sample.data.has_spin { &[0.0, -100.0, 100.0] } else { &[0.0] };
    let highest = sample.records().map(|r| r.start.0[2]).fold(0.1, f64::max);
    // Two digits are enough for a plan.
    let unit = 10f64.powf(highest.log10().floor() - 1.0);
    let highest = (highest / unit).round() * unit;
    let mut out = Vec::new();
    for height_m in HEIGHTS.into_iter().map(|share| share * highest) {
        for &speed_m_s in speeds {
            out.extend(spins.iter().map(|&spin_rad_s| Design { height_m, speed_m_s, spin_rad_s }));
        }
    }
    out
}

/// What remains of the misfit of `other` to a throw that `truth` predicts, once its start and its parameters (within what the
/// data so far allow) have moved as near as they can.
fn distance(
    sample: &Sample<'_>,
    noise_m: &[f64],
    step: f64,
    design: &Design,
    truth: &Fit,
    other: &Fit,
) -> Option<f64> {
    let mut record = blank(sample, design, step)?;
    let lanes = Lanes::new(&truth.hypothesis, &record, &[]);
    let start = lanes.nuisance_start(&truth.hypothesis, &record);
    let h = &truth.hypothesis;
    let point = Point::new(h, &*h.system, &lanes, &record, &truth.theta, &start);
    let run = point.plain(&lanes, &record);
    let end = run.event_times().get(MOST_IMPACTS).copied().unwrap_or(f64::INFINITY);
    let n = record.times.iter().take_while(|t| **t < end).count();
    record.times.truncate(n);
    for (c, noise_m) in noise_m.iter().enumerate().take(run.channels()) {
        record.y.push((0..n).map(|k| run.value(k, c)).collect());
        record.weight.push(vec![1.0 / noise_m; n]);
    }
    nearest(sample, &record, other)
}

/// The record of a throw without measurements.
fn blank(sample: &Sample<'_>, design: &Design, step: f64) -> Option<Record> {
    let first = sample.records().next()?;
    let n = (LONGEST_S / step).floor().clamp(8.0, 2_000.0) as usize;
    Some(Record {
        times: (0..n).map(|k| k as f64 * step).collect(),
        y: Vec::new(),
        weight: Vec::new(),
        memory_s: f64::INFINITY,
        covariates: Covariates {
            clock_s: 0.0,
            spin_rad_s: [0.0, design.spin_rad_s, 0.0],
            ..first.covariates
        },
        radius_m: first.radius_m,
        group: first.group,
        impacts: Vec::new(),
        arcs: Vec::new(),
        ratios: Vec::new(),
        start: ([0.0, 0.0, design.height_m], [design.speed_m_s, 0.0, 0.0]),
    })
}

/// Least misfit of a fitted explanation to one more record, its parameters held by their information so far.
fn nearest(sample: &Sample<'_>, record: &Record, fit: &Fit) -> Option<f64> {
    let h = &fit.hypothesis;
    let lanes = Lanes::new(h, record, &[]);
    let common = lanes.common();
    let prior = fit.information.sub(&lanes.theta);
    let at = |theta: &[f64], nuisance: &[f64]| {
        sample.data.tally.simulation();
        let point = Point::new(h, &*h.system, &lanes, record, theta, nuisance);
        let normal = normal(&point, &lanes, record, sample.correlation);
        let moved: Vec<f64> = lanes.theta.iter().map(|&t| theta[t] - fit.theta[t]).collect();
        let held: Vec<f64> =
            (0..common).map(|i| (0..common).map(|k| prior.at(i, k) * moved[k]).sum()).collect();
        let cost = normal.misfit + moved.iter().zip(&held).map(|(a, b)| a * b).sum::<f64>();
        (normal, held, cost)
    };
    let (mut theta, mut nuisance) = (fit.theta.clone(), lanes.nuisance_start(h, record));
    let mut now = at(&theta, &nuisance);
    for _ in 0..STEPS {
        let (normal, held, cost) = &now;
        let n = normal.h.n;
        let mut hessian = Square::zero(n);
        let mut step: Vec<f64> =
            (0..n).map(|i| normal.g[i] / normal.weight - held.get(i).copied().unwrap_or(0.0)).collect();
        for i in 0..n {
            for k in 0..n {
                let known = if i < common && k < common { prior.at(i, k) } else { 0.0 };
                *hessian.at_mut(i, k) = normal.h.at(i, k) / normal.weight + known;
            }
            *hessian.at_mut(i, i) *= 1.0 + 1e-9;
        }
        hessian.cholesky().solve(&mut step);
        let trials = [1.0, 0.3, 0.1].into_iter().map(|share| {
            let (mut t, mut m) = (theta.clone(), nuisance.clone());
            lanes.theta.iter().zip(&step).for_each(|(&place, d)| t[place] += share * d);
            m.iter_mut().zip(&step[common..]).for_each(|(x, d)| *x += share * d);
            let value = at(&t, &m);
            (t, m, value)
        });
        let Some(better) = trials.into_iter().find(|(_, _, v)| v.2 < *cost) else { break };
        let gain = cost - better.2.2;
        (theta, nuisance, now) = better;
        if gain < 1e-3 {
            break;
        }
    }
    now.2.is_finite().then_some(now.2)
}
