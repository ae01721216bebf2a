//! Check for a free fall other than that of the model: another unit, upside down, or swapped columns.

use super::measured::Series;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;

/// Maximum ratio of the measured acceleration to the model's gravity, and of gravity to the acceleration.
///
/// Inches are a factor of 39, while drag near the terminal velocity leaves a fifth of the acceleration, and
/// the lift of a table-tennis ball adds two gravities.
const MAX_GRAVITY_RATIO: f64 = 6.0;
/// Maximum ratio of one trajectory's acceleration to the median over all trajectories.
///
/// It leaves room for different spin and drag; centimetres are a factor of 100.
const MAX_TRAJECTORY_RATIO: f64 = 15.0;
/// Minimum ratio of one trajectory's acceleration to the median; with less, the trajectory falls upwards.
///
/// Backspin can hold a table-tennis ball up, but does not accelerate it upwards.
const MIN_TRAJECTORY_RATIO: f64 = -0.5;
/// Numbers of windows into which a trajectory is divided in turn, so that some windows have no impact.
const WINDOW_COUNTS: [usize; 5] = [1, 2, 4, 8, 16];
/// Minimum number of samples of a window to which a parabola with three parameters is fitted.
const MIN_WINDOW_SAMPLES: usize = 7;
/// Maximum RMS residual of a parabola relative to its curvature term, for a window in free motion.
///
/// An impact in the middle of a window leaves 0.077.
const MAX_PARABOLA_RESIDUAL: f64 = 0.05;
/// Minimum number of trajectories in free fall for a median acceleration.
const MIN_TRAJECTORIES: usize = 2;

/// Compares the free fall of the height, or of another coordinate instead, with the model's gravity.
pub(super) fn run(data: &Dataset, expected: &ExpectedData) -> Vec<Finding> {
    let Some(expected_m_s2) = expected.gravity_m_s2.filter(|g| *g > 0.0) else { return Vec::new() };
    let vertical = ["z_m", "height_m"].iter().find_map(|name| Series::named(data, name));
    vertical.map_or_else(Vec::new, |z| compare(data, z, expected_m_s2))
}

fn compare(data: &Dataset, z: Series<'_>, expected_m_s2: f64) -> Vec<Finding> {
    let column = z.name().to_owned();
    let falls = falls(data, z);
    let typical = median_acceleration(&falls);
    let is_other =
        |found: f64| !(1.0 / MAX_GRAVITY_RATIO..=MAX_GRAVITY_RATIO).contains(&(found / expected_m_s2));
    let is_wrong = typical.is_none_or(is_other);
    if is_wrong {
        let swapped = ["x_m", "y_m"].iter().find_map(|name| {
            let series = Series::named(data, name)?;
            let found_m_s2 = median_acceleration(&self::falls(data, series))?;
            (!is_other(found_m_s2)).then(|| (series.name().to_owned(), found_m_s2))
        });
        if let Some((falling, found_m_s2)) = swapped {
            return vec![Finding::SwappedColumns { column, falling, found_m_s2 }];
        }
    }
    let Some(found_m_s2) = typical else { return Vec::new() };
    if is_wrong {
        return vec![Finding::GravityDisagrees { column, found_m_s2, expected_m_s2 }];
    }
    let differs = |g: f64| g / found_m_s2 > MAX_TRAJECTORY_RATIO || g / found_m_s2 < MIN_TRAJECTORY_RATIO;
    let different: Vec<&(usize, f64)> = falls.iter().filter(|(_, g)| differs(*g)).collect();
    different
        .first()
        .map(|(j, g)| Finding::GravityDiffers {
            trajectory: data.trajectories()[*j].id().to_owned(),
            column,
            found_m_s2: *g,
            others_m_s2: found_m_s2,
            alike: different.len(),
        })
        .into_iter()
        .collect()
}

/// Median acceleration over the trajectories in `falls`; `None` for fewer than `MIN_TRAJECTORIES`.
fn median_acceleration(falls: &[(usize, f64)]) -> Option<f64> {
    let mut accelerations: Vec<f64> = falls.iter().map(|(_, g)| *g).collect();
    (accelerations.len() >= MIN_TRAJECTORIES).then(|| median(&mut accelerations)).flatten()
}

/// Index and downward acceleration, m/s², of each trajectory with free motion along `series`.
fn falls(data: &Dataset, series: Series<'_>) -> Vec<(usize, f64)> {
    let fall = |(j, t): (usize, &crate::Trajectory)| {
        let (times, values) = series.samples(t);
        Some((j, -free_motion_acceleration(&times, &values)?))
    };
    data.trajectories().iter().enumerate().filter_map(fall).collect()
}

/// Median acceleration over the windows whose samples are on a parabola; `None` if there is no such window.
///
/// Windows of several sizes overlap by half. The sign is that of the second derivative.
pub(crate) fn free_motion_acceleration(times: &[f64], values: &[f64]) -> Option<f64> {
    let mut accelerations = Vec::new();
    for count in WINDOW_COUNTS {
        let size = times.len() / count;
        if size < MIN_WINDOW_SAMPLES {
            break;
        }
        let starts = (0..=2 * (count - 1)).map(|half| half * size / 2);
        accelerations.extend(starts.filter_map(|a| curvature(&times[a..a + size], &values[a..a + size])));
    }
    median(&mut accelerations)
}

/// Second derivative of the least-squares parabola through the samples; `None` if they are not on a parabola.
fn curvature(times: &[f64], values: &[f64]) -> Option<f64> {
    let n = times.len() as f64;
    let (middle, half) =
        (0.5 * (times[0] + times[times.len() - 1]), 0.5 * (times[times.len() - 1] - times[0]));
    let u: Vec<f64> = times.iter().map(|t| (t - middle) / half).collect();
    let mean = |f: &dyn Fn(usize) -> f64| (0..times.len()).map(f).sum::<f64>() / n;
    // Orthogonal polynomials on the times u scaled to [-1, 1]: 1, p = u - a, q = u² - b - c p.
    let a = mean(&|k| u[k]);
    let p: Vec<f64> = u.iter().map(|u| u - a).collect();
    let (b, pp) = (mean(&|k| u[k] * u[k]), mean(&|k| p[k] * p[k]));
    let c = mean(&|k| u[k] * u[k] * p[k]) / pp;
    let q: Vec<f64> = u.iter().zip(&p).map(|(u, p)| u * u - b - c * p).collect();
    let qq = mean(&|k| q[k] * q[k]);
    let (level, slope) = (mean(&|k| values[k]), mean(&|k| values[k] * p[k]) / pp);
    let bend = mean(&|k| values[k] * q[k]) / qq;
    let residual = mean(&|k| (values[k] - level - slope * p[k] - bend * q[k]).powi(2)).sqrt();
    (bend.abs() > 0.0 && residual < MAX_PARABOLA_RESIDUAL * bend.abs()).then(|| 2.0 * bend / (half * half))
}
