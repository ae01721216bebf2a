//! The same recording under two names: what fits have seen would judge them.

use super::{Expected, Finding};
use crate::dataset::Dataset;
use crate::trajectory::Trajectory;

/// Logarithm of the probability that two recordings agree by chance, below which they are one: one in 1e9, for all pairs of a
/// thousand trajectories one in 2000.
const CHANCE: f64 = -20.7;
/// Difference that single precision leaves, relative to the largest value.
const SINGLE: f64 = 2e-7;
/// Agreement, relative to the span of the motion, that no two real motions reach sample by sample: a robot repeats itself to
/// 2e-5 m over 0.3 m at best, a sensor scatters more.
const EXACT: f64 = 1e-5;
/// Fewest samples that are a recording.
const FEWEST: usize = 4;
/// Decimals that are looked for in numbers as they were written.
const DECIMALS: i32 = 12;

/// The first copy, with the number of copies.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    let copies = copies(data);
    copies
        .first()
        .map(|&(copy, original)| Finding::RepeatedTrajectory {
            trajectory: data.trajectories()[copy].id().to_owned(),
            original: data.trajectories()[original].id().to_owned(),
            copies: copies.len(),
        })
        .into_iter()
        .collect()
}

/// `data` without the later ones of equal trajectories, and whether there were any.
pub(super) fn without_copies(data: &Dataset) -> Dataset {
    let copies: Vec<usize> = copies(data).into_iter().map(|(copy, _)| copy).collect();
    let kept: Vec<usize> = (0..data.trajectories().len()).filter(|j| !copies.contains(j)).collect();
    data.select(&kept)
}

/// Copy and original, by number, in the order of the copies.
fn copies(data: &Dataset) -> Vec<(usize, usize)> {
    let covariates: Vec<&str> = data.covariates().map(|c| c.name()).collect();
    // What describes a whole trajectory may be the same in all; it proves nothing.
    let moving: Vec<usize> =
        (0..data.columns().len()).filter(|&i| !covariates.contains(&data.columns()[i].name())).collect();
    let Some(&key) = moving.first() else { return Vec::new() };
    let all: Vec<Recording> = data.trajectories().iter().map(|t| Recording::of(t, &moving)).collect();
    // Only recordings of one length whose first values nearly agree are compared.
    let mut order: Vec<usize> = (0..all.len()).collect();
    let first = |j: usize| data.trajectories()[j].column(key).iter().copied().find(|v| v.is_finite());
    let sort_key = |j: usize| (data.trajectories()[j].len(), first(j).unwrap_or(f64::NEG_INFINITY));
    order.sort_by(|&a, &b| {
        let (a, b) = (sort_key(a), sort_key(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut found: Vec<(usize, usize)> = Vec::new();
    // The coarsest rounding in the set bounds how far apart the first values of one recording can be.
    let widest = all.iter().map(|r| r.columns[0].tolerance).fold(0.0, f64::max);
    for (place, &a) in order.iter().enumerate() {
        let later = order[place + 1..].iter().take_while(|&&b| {
            let ((n, from), (m, to)) = (sort_key(a), sort_key(b));
            n == m && (from == to || to - from <= 2.0 * widest)
        });
        let (originals, copies) = (|b: usize| a.min(b), |b: usize| a.max(b));
        found.extend(
            later
                .filter(|&&b| same(data, &moving, &all, originals(b), copies(b)))
                .map(|&b| (copies(b), originals(b))),
        );
    }
    found.sort_unstable();
    found.dedup_by_key(|(copy, _)| *copy);
    found
}

/// How finely one column of a recording is written, and how it scatters.
struct Written {
    /// Difference that rounding explains.
    tolerance: f64,
    /// Largest minus smallest value.
    span: f64,
    /// Standard deviation of its noise: of second differences that change their sign.
    noise: f64,
}

struct Recording {
    columns: Vec<Written>,
}

impl Recording {
    fn of(t: &Trajectory, moving: &[usize]) -> Self {
        Recording { columns: moving.iter().map(|&i| Written::of(t.column(i))).collect() }
    }
}

impl Written {
    fn of(values: &[f64]) -> Self {
        let measured = || values.iter().copied().filter(|v| v.is_finite());
        let [low, high] =
            measured().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [v.min(low), v.max(high)]);
        let largest = low.abs().max(high.abs());
        let written = |decimals: i32| {
            let scaled = |v: f64| v * 10f64.powi(decimals);
            measured().all(|v| (scaled(v) - scaled(v).round()).abs() < 1e-6)
        };
        let step = (0..DECIMALS).find(|d| written(*d)).map_or(0.0, |d| 10f64.powi(-d));
        // Binary and decimal digits of single precision.
        let tolerance = (0.5 * step).max(SINGLE * largest) * (1.0 + 1e-6);
        let third: Vec<f64> = values.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).collect();
        let mut sizes: Vec<f64> = third.iter().map(|d| d.abs()).filter(|d| d.is_finite()).collect();
        let flips = third.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
        // As in the noise of a column: a smooth curve does not change the sign of its third differences.
        let noisy = 5 * flips >= 3 * third.len().saturating_sub(1) && third.len() >= FEWEST;
        let sd = crate::statistics::median(&mut sizes).unwrap_or(0.0) / 3.0;
        // Rounding scatters too, and the same in two recordings of one motion.
        let noise = if noisy { (sd * sd - step * step / 6.0).max(0.0).sqrt() } else { 0.0 };
        Written { tolerance, span: (high - low).max(0.0), noise }
    }
}

/// Whether `a` and `b` agree at every sample to rounding, and such an agreement is no chance.
fn same(data: &Dataset, moving: &[usize], all: &[Recording], a: usize, b: usize) -> bool {
    let (ta, tb) = (&data.trajectories()[a], &data.trajectories()[b]);
    let clock = |t: &Trajectory, k: usize| t.time_s()[k] - t.time_s()[0];
    let interval = clock(ta, ta.len() - 1) / (ta.len() as f64 - 1.0).max(1.0);
    if ta.len() < FEWEST {
        return false;
    }
    let (mut chance, mut exact) = (0.0, 0);
    for ((&i, wa), wb) in moving.iter().zip(&all[a].columns).zip(&all[b].columns) {
        let tolerance = wa.tolerance.max(wb.tolerance);
        let mut agree = 0;
        for (x, y) in ta.column(i).iter().zip(tb.column(i)) {
            if x.is_nan() && y.is_nan() {
                continue;
            }
            // Gaps in other places are another recording.
            if !((x - y).abs() <= tolerance) {
                return false;
            }
            agree += 1;
        }
        let span = wa.span.max(wb.span);
        if tolerance < EXACT * span {
            exact += agree;
        }
        // Two numbers around one value with noise s each differ by less than d with probability below d/(s sqrt(pi)).
        let noise = wa.noise.min(wb.noise);
        if noise > 0.0 {
            let probability = (tolerance / (noise * std::f64::consts::PI.sqrt())).min(1.0);
            chance += agree as f64 * probability.ln();
        }
    }
    let in_step = (0..ta.len()).all(|k| (clock(ta, k) - clock(tb, k)).abs() <= 0.01 * interval);
    (exact >= FEWEST || chance < CHANCE) && in_step
}
