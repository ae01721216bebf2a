//! Check for the same recording under two names, which would leak training data into the test.
//!
//! Two trajectories are copies where they agree at every sample up to rounding and at least one of these
//! holds:
//!
//! 1. At least `MIN_SAMPLES` agreeing samples have a resolution that is finer than any two motions agree.
//! 2. The probability that the noise of all samples agrees by chance is below `exp(MAX_LOG_PROBABILITY)`. Two
//!    values with noise of standard deviation s differ by less than d with a probability below d / (s
//!    sqrt(pi)).

use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use crate::trajectory::Trajectory;
use crate::unit::Unit;

/// Log probability of agreement by chance below which a trajectory counts as a copy.
///
/// The probability is 1 in 1e9 for one pair, and 1 in 2000 for all pairs of 1000 trajectories.
const MAX_LOG_PROBABILITY: f64 = -20.7;
/// Rounding error of single precision relative to the largest value.
const SINGLE_PRECISION: f64 = 2e-7;
/// Smallest difference of two separate motions sample by sample, relative to the span of the column.
///
/// A robot repeats a motion of 0.3 m to 2e-5 m at best, and a sensor has more noise than that.
const MIN_MOTION_DIFFERENCE: f64 = 1e-5;
/// Minimum number of samples of a trajectory that is compared with others.
const MIN_SAMPLES: usize = 4;
/// Largest number of decimals for which rounded values are recognised.
const MAX_DECIMALS: i32 = 12;

/// Finds the first trajectory that copies another one, with the number of copies in the set.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
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

/// Returns the data set with only the first one of each set of equal trajectories.
pub(super) fn without_copies(data: &Dataset) -> Dataset {
    let copies: Vec<usize> = copies(data).into_iter().map(|(copy, _)| copy).collect();
    let kept: Vec<usize> = (0..data.trajectories().len()).filter(|j| !copies.contains(j)).collect();
    data.select(&kept)
}

/// Finds copied trajectories: pairs (index of copy, index of original), sorted by the index of the copy.
fn copies(data: &Dataset) -> Vec<(usize, usize)> {
    let covariates: Vec<&str> = data.covariates().map(|c| c.name()).collect();
    // Columns that are constant in each trajectory may be equal in all and are no evidence.
    let moving: Vec<usize> =
        (0..data.columns().len()).filter(|&i| !covariates.contains(&data.columns()[i].name())).collect();
    let Some(&key) = moving.first() else { return Vec::new() };
    let precision = |t: &Trajectory| moving.iter().map(|&i| Precision::from_values(t.column(i))).collect();
    let precisions: Vec<Vec<Precision>> = data.trajectories().iter().map(precision).collect();
    // Only trajectories of the same length with nearly equal first values are compared.
    let mut order: Vec<usize> = (0..precisions.len()).collect();
    let first = |j: usize| data.trajectories()[j].column(key).iter().copied().find(|v| v.is_finite());
    let sort_key = |j: usize| (data.trajectories()[j].len(), first(j).unwrap_or(f64::NEG_INFINITY));
    order.sort_by(|&a, &b| {
        let (a, b) = (sort_key(a), sort_key(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut found: Vec<(usize, usize)> = Vec::new();
    // The coarsest rounding in the set limits the difference of the first values of two copies.
    let max_tolerance = precisions.iter().map(|p| p[0].tolerance).fold(0.0, f64::max);
    for (place, &a) in order.iter().enumerate() {
        let later = order[place + 1..].iter().take_while(|&&b| {
            let ((n, from), (m, to)) = (sort_key(a), sort_key(b));
            n == m && (from == to || to - from <= 2.0 * max_tolerance)
        });
        for &b in later {
            let (copy, original) = (a.max(b), a.min(b));
            if is_copy(data, &moving, &precisions, original, copy) {
                found.push((copy, original));
            }
        }
    }
    found.sort_unstable();
    found.dedup_by_key(|(copy, _)| *copy);
    found
}

/// Resolution and noise of one column of a trajectory.
struct Precision {
    /// Maximum difference of two values that rounding explains.
    tolerance: f64,
    /// Largest minus smallest value of the column.
    span: f64,
    /// Standard deviation of the column's noise, from third differences; 0 for a smooth curve.
    noise: f64,
}

impl Precision {
    fn from_values(values: &[f64]) -> Self {
        let measured = || values.iter().copied().filter(|v| v.is_finite());
        let [low, high] =
            measured().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [v.min(low), v.max(high)]);
        let largest = low.abs().max(high.abs());
        let is_rounded_to = |decimals: i32| {
            let scaled = |v: f64| v * 10f64.powi(decimals);
            measured().all(|v| (scaled(v) - scaled(v).round()).abs() < 1e-6)
        };
        let step = (0..MAX_DECIMALS).find(|d| is_rounded_to(*d)).map_or(0.0, |d| 10f64.powi(-d));
        // Half a unit of the last decimal, or the rounding of single precision.
        let tolerance = (0.5 * step).max(SINGLE_PRECISION * largest) * (1.0 + 1e-6);
        let third: Vec<f64> = values.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).collect();
        let mut sizes: Vec<f64> = third.iter().map(|d| d.abs()).filter(|d| d.is_finite()).collect();
        let sign_changes = third.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
        // As in `Series::noise`: the third differences of a smooth curve hardly ever change sign.
        let is_noisy = 5 * sign_changes >= 3 * third.len().saturating_sub(1) && third.len() >= MIN_SAMPLES;
        let sd = crate::statistics::median(&mut sizes).unwrap_or(0.0) / 3.0;
        // Rounding adds to the noise, but equally in two recordings of one motion.
        let noise = if is_noisy { (sd * sd - step * step / 6.0).max(0.0).sqrt() } else { 0.0 };
        Precision { tolerance, span: (high - low).max(0.0), noise }
    }
}

/// Whether trajectories `a` and `b` agree at every sample up to rounding, and not by chance.
fn is_copy(data: &Dataset, moving: &[usize], precisions: &[Vec<Precision>], a: usize, b: usize) -> bool {
    let (ta, tb) = (&data.trajectories()[a], &data.trajectories()[b]);
    let clock = |t: &Trajectory, k: usize| t.time_s()[k] - t.time_s()[0];
    let interval = clock(ta, ta.len() - 1) / (ta.len() as f64 - 1.0).max(1.0);
    if ta.len() < MIN_SAMPLES {
        return false;
    }
    let (mut log_probability, mut exact) = (0.0, 0);
    for ((&i, pa), pb) in moving.iter().zip(&precisions[a]).zip(&precisions[b]) {
        let tolerance = pa.tolerance.max(pb.tolerance);
        let mut agree = 0;
        for (x, y) in ta.column(i).iter().zip(tb.column(i)) {
            if x.is_nan() && y.is_nan() {
                continue;
            }
            // Gaps at other samples mean another recording.
            if x.is_nan() || y.is_nan() || (x - y).abs() > tolerance {
                return false;
            }
            agree += 1;
        }
        let span = pa.span.max(pb.span);
        if tolerance < MIN_MOTION_DIFFERENCE * span {
            exact += agree;
        }
        // Rule (2) of the file head. Flags of streams alternate equally in every recording and are no
        // evidence.
        let is_evidence = data.columns()[i].unit() != Unit::DIMENSIONLESS;
        let noise = if is_evidence { pa.noise.min(pb.noise) } else { 0.0 };
        if noise > 0.0 {
            let probability = (tolerance / (noise * std::f64::consts::PI.sqrt())).min(1.0);
            log_probability += agree as f64 * probability.ln();
        }
    }
    let has_same_clock = (0..ta.len()).all(|k| (clock(ta, k) - clock(tb, k)).abs() <= 0.01 * interval);
    (exact >= MIN_SAMPLES || log_probability < MAX_LOG_PROBABILITY) && has_same_clock
}
