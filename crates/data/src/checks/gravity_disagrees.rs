//! Free fall other than the model's: heights in another unit, upside down, or in another column.

use super::measured::Series;
use super::{Expected, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;

/// Ratio to the model's gravity, either way, from which it is another unit: inches are a factor of 39, while drag near the
/// terminal velocity takes all but a fifth away, and lift of a table-tennis ball adds two gravities.
const OTHER: f64 = 6.0;
/// Ratio of one trajectory's acceleration to that of the rest: its spin and drag are its own, and centimetres are a factor of 100.
const OTHER_THAN_REST: f64 = 15.0;
/// Ratio, below zero, from which a trajectory falls upwards: backspin holds a table-tennis ball up, and throws it no higher.
const UPWARD: f64 = -0.5;
/// Pieces that a trajectory is cut into, from coarse to fine: a window without an impact is among them.
const PIECES: [usize; 5] = [1, 2, 4, 8, 16];
/// Fewest samples of a window: a parabola has three parameters.
const WINDOW: usize = 7;
/// Residual of a parabola, in units of its own height over the window, above which the window is no free fall: the corner of
/// an impact in the middle of a window alone leaves 0.077.
const FITS: f64 = 0.05;
/// Fewest trajectories in free fall of which something is said.
const FEWEST: usize = 2;

/// The height, and the other coordinates where it shows no fall.
pub(super) fn look(data: &Dataset, expected: &Expected) -> Vec<Finding> {
    let Some(expected_m_s2) = expected.gravity_m_s2.filter(|g| *g > 0.0) else { return Vec::new() };
    let vertical = ["z_m", "height_m"].iter().find_map(|name| Series::named(data, name));
    vertical.map_or_else(Vec::new, |z| compare(data, z, expected_m_s2))
}

fn compare(data: &Dataset, z: Series<'_>, expected_m_s2: f64) -> Vec<Finding> {
    let column = z.name().to_owned();
    let falls = falls(data, z);
    let typical = typical(&falls);
    let other = |found: f64, than: f64, factor: f64| found / than > factor || found / than < 1.0 / factor;
    let wrong = typical.is_none_or(|found| other(found, expected_m_s2, OTHER));
    if wrong {
        let swapped = ["x_m", "y_m"].iter().find_map(|name| {
            let series = Series::named(data, name)?;
            let found_m_s2 = self::typical(&self::falls(data, series))?;
            (!other(found_m_s2, expected_m_s2, OTHER)).then(|| (series.name().to_owned(), found_m_s2))
        });
        if let Some((falling, found_m_s2)) = swapped {
            return vec![Finding::SwappedColumns { column, falling, found_m_s2 }];
        }
    }
    let Some(found_m_s2) = typical else { return Vec::new() };
    if wrong {
        return vec![Finding::GravityDisagrees { column, found_m_s2, expected_m_s2 }];
    }
    let differs = |g: f64| g / found_m_s2 > OTHER_THAN_REST || g / found_m_s2 < UPWARD;
    let unlike: Vec<&(usize, f64)> = falls.iter().filter(|(_, g)| differs(*g)).collect();
    unlike
        .first()
        .map(|(j, g)| Finding::GravityDiffers {
            trajectory: data.trajectories()[*j].id().to_owned(),
            column,
            found_m_s2: *g,
            others_m_s2: found_m_s2,
            alike: unlike.len(),
        })
        .into_iter()
        .collect()
}

/// Median over the trajectories, where there are enough.
fn typical(falls: &[(usize, f64)]) -> Option<f64> {
    let mut all: Vec<f64> = falls.iter().map(|(_, g)| *g).collect();
    (all.len() >= FEWEST).then(|| median(&mut all)).flatten()
}

/// Number and downward acceleration, m/s², of each trajectory that is seen in free motion along `series`.
fn falls(data: &Dataset, series: Series<'_>) -> Vec<(usize, f64)> {
    let one = |(j, t): (usize, &crate::Trajectory)| {
        let (times, values) = series.samples(t);
        let mut seen = Vec::new();
        for pieces in PIECES {
            let size = times.len() / pieces;
            if size < WINDOW {
                break;
            }
            let starts = (0..=2 * (pieces - 1)).map(|half| half * size / 2);
            seen.extend(starts.filter_map(|a| curvature(&times[a..a + size], &values[a..a + size])));
        }
        Some((j, -median(&mut seen)?))
    };
    data.trajectories().iter().enumerate().filter_map(one).collect()
}

/// Second derivative of the parabola through the samples, where they lie on one.
pub(crate) fn curvature(times: &[f64], values: &[f64]) -> Option<f64> {
    let n = times.len() as f64;
    let (middle, half) =
        (0.5 * (times[0] + times[times.len() - 1]), 0.5 * (times[times.len() - 1] - times[0]));
    let u: Vec<f64> = times.iter().map(|t| (t - middle) / half).collect();
    let mean = |f: &dyn Fn(usize) -> f64| (0..times.len()).map(f).sum::<f64>() / n;
    // Orthogonal polynomials on these times: 1, p = u - a, q = u² - b - c p.
    let a = mean(&|k| u[k]);
    let p: Vec<f64> = u.iter().map(|u| u - a).collect();
    let (b, pp) = (mean(&|k| u[k] * u[k]), mean(&|k| p[k] * p[k]));
    let c = mean(&|k| u[k] * u[k] * p[k]) / pp;
    let q: Vec<f64> = u.iter().zip(&p).map(|(u, p)| u * u - b - c * p).collect();
    let qq = mean(&|k| q[k] * q[k]);
    let (level, slope) = (mean(&|k| values[k]), mean(&|k| values[k] * p[k]) / pp);
    let bend = mean(&|k| values[k] * q[k]) / qq;
    let residual = mean(&|k| (values[k] - level - slope * p[k] - bend * q[k]).powi(2)).sqrt();
    (bend.abs() > 0.0 && residual < FITS * bend.abs()).then(|| 2.0 * bend / (half * half))
}
