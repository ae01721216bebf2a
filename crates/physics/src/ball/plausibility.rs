//! Checks that calibrated values and recordings are those of a bouncing ball.
//!
//! Two cases are detected: a downward acceleration that is not gravity (wrong units or clock), and rebounds
//! that scatter so much, at impacts of different heights, that the body must be tumbling.

use super::scene::impact_heights;
use super::{GRAVITY, RESTITUTION};
use augsim_system::statistics::median;
use augsim_system::{Objection, Parameter, Record};
use thiserror::Error;

/// Gravitational acceleration on Earth, m/s².
const EARTH_GRAVITY: f64 = 9.81;
/// Largest accepted ratio (or its inverse) of calibrated gravity to declared or Earth's gravity.
///
/// Lengths and camera clocks are accurate to a few per cent; a larger difference means a wrong scale or frame
/// rate.
const MAX_GRAVITY_RATIO: f64 = 1.25;
/// Largest accepted ratio of gravities, as [`MAX_GRAVITY_RATIO`], before effects are in the model.
///
/// Drag can halve the acceleration.
const MAX_INITIAL_GRAVITY_RATIO: f64 = 3.0;
/// Standard deviation of the restitution above which the body is not a ball.
///
/// Synthetic data that are hard to predict have 0.1; tumbling bodies reach 0.2 to 0.3.
const MAX_SCATTER: f64 = 0.15;
/// Standard deviation of the restitution from which a body is no ball if impact heights differ.
///
/// It replaces [`MAX_SCATTER`] if they differ by more than [`FAR_UNEVEN_RATIO`] of the fall.
///
/// Of 106 simulated squares and cubes some scatter by only 0.10 to 0.15 (robust estimate of a long-tailed
/// distribution), at heights that differ by 0.015 of the fall and more.
const MAX_SCATTER_IF_UNEVEN: f64 = 0.08;
/// Standard deviation of impact heights, relative to the fall, that invokes [`MAX_SCATTER_IF_UNEVEN`].
///
/// Contacts and floors cause less; a corner hits the floor at any centre height between half a side and half
/// a diagonal.
const FAR_UNEVEN_RATIO: f64 = 0.01;
/// Standard deviation of impact heights, in units of the noise, above which they count as different.
const MIN_UNEVEN_SD: f64 = 4.0;
/// Threshold as [`MIN_UNEVEN_SD`], for bodies whose rebounds scatter within single records.
///
/// Impact heights of a ball have an error of about half of the noise; those of 7 of 99 simulated squares
/// scatter by only 2.9 to 4.0 times the noise.
const MIN_UNEVEN_SD_IF_ERRATIC: f64 = 2.5;
/// Standard deviation of impact heights, relative to the fall, above which they count as different.
///
/// Contacts of finite duration and dents in the floor keep it below 0.01.
const MIN_UNEVEN_RATIO: f64 = 0.004;
/// Minimum number of impacts for which rebounds are judged.
const MIN_IMPACTS: usize = 8;
/// Minimum number of impacts per record, and of such records, to judge the scatter within records.
const MIN_PER_RECORD: usize = 3;
/// Minimum usable impact speed, in units of the height noise per 0.01 s; slower ones are too noisy.
const MIN_SPEED_SD: f64 = 5.0;
/// Median absolute deviation of the standard normal distribution.
const NORMAL_MAD: f64 = 0.6745;

/// Reason why calibrated values or recordings are not those of a ball.
#[derive(Debug, Error)]
enum Reason {
    #[error(
        "gravity fits {found:.4} m/s²{}, but the model declares {declared} m/s²: {remedy}",
        if *at_bound { " (at its bound)" } else { "" }
    )]
    Gravity { found: f64, declared: f64, at_bound: bool, remedy: String },
    #[error(
        "the object does not bounce as a ball: over {impacts} impacts the restitution has a standard deviation of {scatter:.2} \
         and the impact height one of {:.1} mm, {:.0} times the noise; the motion of a tumbling body does not follow from \
         that of its centre, so write your own equations (augsim model new), or use only the part before the first impact",
        1e3 * spread_m,
        spread_m / sd_m
    )]
    Tumbles { impacts: usize, scatter: f64, spread_m: f64, sd_m: f64 },
}

/// Whether the ratios `a / b` and `b / a` are both at most `factor`.
fn is_within_factor(a: f64, b: f64, factor: f64) -> bool {
    (1.0 / factor..=factor).contains(&(a / b))
}

/// Advice for a calibrated acceleration that is `ratio` times Earth's gravity.
fn remedy(ratio: f64) -> String {
    let units = [(100.0, "centimetres"), (1000.0, "millimetres"), (39.37, "inches"), (3.281, "feet")];
    let unit = units.into_iter().find(|(factor, _)| is_within_factor(ratio, *factor, 1.3));
    match unit {
        _ if ratio <= 0.0 => "is the height positive downwards? Invert its sign (augsim start --up)".into(),
        Some((_, unit)) => format!("are these {unit}? Give the unit (augsim start --columns)"),
        None => format!(
            "check the unit of the height and the frame rate (a clock that is wrong by a factor of {:.2} would explain it), or freeze gravity",
            ratio.max(1e-6).sqrt()
        ),
    }
}

/// Reason why the calibrated gravity is implausible; a frozen gravity is not checked.
pub(super) fn implausible(parameters: &[Parameter], values: &[f64]) -> Option<Objection> {
    let (p, found) = (parameters.get(GRAVITY)?, *values.get(GRAVITY)?);
    check_gravity(p, found, MAX_GRAVITY_RATIO)
}

/// Objection if gravity `found` differs by more than `factor` from the declared and from Earth's gravity.
fn check_gravity(p: &Parameter, found: f64, factor: f64) -> Option<Objection> {
    let is_plausible =
        is_within_factor(found, p.nominal, factor) || is_within_factor(found, EARTH_GRAVITY, factor);
    if p.frozen || is_plausible {
        return None;
    }
    let at_bound = found <= p.min || found >= p.max;
    let declared = p.nominal;
    Some(Objection::new(Reason::Gravity { found, declared, at_bound, remedy: remedy(found / EARTH_GRAVITY) }))
}

/// Reason why these records are not those of a ball; `sd_m` is the noise of the height, m.
pub(super) fn foreign_records_objection(
    parameters: &[Parameter],
    records: &[&Record],
    sd_m: f64,
) -> Option<Objection> {
    let g = &parameters[GRAVITY];
    if let Some(found) = observed_gravity(records)
        && let Some(objection) = check_gravity(g, found, MAX_INITIAL_GRAVITY_RATIO)
    {
        return Some(objection);
    }
    if parameters[RESTITUTION].frozen {
        return None;
    }
    check_rebounds(records, g.nominal.max(0.1), sd_m)
}

/// Median downward acceleration of the arcs between impacts, m/s².
fn observed_gravity(records: &[&Record]) -> Option<f64> {
    let arcs = records.iter().flat_map(|r| r.smooth_segments.iter().map(move |a| (r, a)));
    let mut accelerations: Vec<f64> = arcs
        .filter_map(|(r, a)| {
            let heights = r.values.last()?;
            let samples: Vec<usize> = a.clone().filter(|&k| heights[k].is_finite()).collect();
            let (first, last) = (*samples.first()?, *samples.last()?);
            let (middle, half) =
                (0.5 * (r.times[first] + r.times[last]), 0.5 * (r.times[last] - r.times[first]));
            if samples.len() < 6 || half <= 0.0 {
                return None;
            }
            // Least-squares parabola by orthogonal polynomials on the scaled times u in [-1, 1]: q is the
            // quadratic one.
            let u: Vec<f64> = samples.iter().map(|&k| (r.times[k] - middle) / half).collect();
            let n = u.len() as f64;
            let mean = |f: &dyn Fn(usize) -> f64| (0..u.len()).map(f).sum::<f64>() / n;
            let a = mean(&|k| u[k]);
            let b = mean(&|k| u[k] * u[k]);
            let c = mean(&|k| u[k] * u[k] * (u[k] - a)) / mean(&|k| (u[k] - a).powi(2));
            let q: Vec<f64> = u.iter().map(|u| u * u - b - c * (u - a)).collect();
            let curvature = mean(&|k| heights[samples[k]] * q[k]) / mean(&|k| q[k] * q[k]);
            Some(-2.0 * curvature / (half * half))
        })
        .collect();
    (!accelerations.is_empty()).then(|| median(&mut accelerations))
}

/// An impact fast enough for a good estimate of the restitution, with its regressors.
struct Hit {
    /// Index of the record of the impact.
    record: usize,
    /// Index of the group of the record.
    group: usize,
    /// Restitution estimated for the impact.
    restitution: f64,
    /// Height of the fall before the impact, m.
    fall_m: f64,
    /// Regressors of a plane at the impact: 1, then the horizontal coordinates, m.
    place: [f64; 3],
    /// Height at which the impact was detected, m.
    height_m: f64,
}

/// The impacts of all records that are faster than [`MIN_SPEED_SD`] requires.
fn hits(records: &[&Record], g: f64, sd_m: f64) -> Vec<Hit> {
    let mut out = Vec::new();
    for (record, r) in records.iter().enumerate() {
        let vertical = r.values.len().saturating_sub(1);
        let mut hop_start = r.times.first().copied().unwrap_or(0.0);
        for (event, height_m) in impact_heights(r, g) {
            let before = |k: &usize| (hop_start..event.time).contains(&r.times[*k]);
            let within: Vec<usize> = (0..r.times.len()).filter(before).collect();
            hop_start = event.time;
            let coordinate = |c: usize| match r.values.get(c).filter(|_| c < vertical) {
                Some(values) => {
                    within.iter().rev().map(|&k| values[k]).find(|v| v.is_finite()).unwrap_or(0.0)
                }
                None => 0.0,
            };
            let heights = within.iter().map(|&k| r.values[vertical][k]).filter(|z| z.is_finite());
            let fall_m = heights.fold(height_m, f64::max) - height_m;
            if (2.0 * g * fall_m).sqrt() > MIN_SPEED_SD * sd_m / 0.01 {
                let place = [1.0, coordinate(0), coordinate(1)];
                out.push(Hit { record, group: r.group, restitution: event.value, fall_m, place, height_m });
            }
        }
    }
    out
}

/// Objection if rebounds scatter more than those of a ball, at impacts of different heights.
///
/// Restitution and floor height may differ between groups.
fn check_rebounds(records: &[&Record], g: f64, sd_m: f64) -> Option<Objection> {
    let hits = hits(records, g, sd_m);
    if hits.len() < MIN_IMPACTS {
        return None;
    }
    let scatter = robust_sd(centred(&hits, |h| h.group, |h| h.restitution));
    // A tilted floor or camera is allowed: heights are taken relative to a fitted plane.
    let heights = centred(&hits, |h| h.group, |h| h.height_m);
    let places = hits.iter().map(|h| h.place);
    let spread_m = robust_sd(without_plane(&places.zip(heights).collect::<Vec<_>>()));
    let fall = median(&mut hits.iter().map(|h| h.fall_m).collect::<Vec<_>>());
    let scatter_within = scatter_within_records(&hits);
    let is_erratic_within = scatter_within.is_some_and(|sd| sd > MAX_SCATTER);
    let min_sd = if is_erratic_within { MIN_UNEVEN_SD_IF_ERRATIC } else { MIN_UNEVEN_SD };
    let is_uneven = spread_m > min_sd * sd_m && spread_m > MIN_UNEVEN_RATIO * fall;
    let max_scatter = if spread_m > FAR_UNEVEN_RATIO * fall { MAX_SCATTER_IF_UNEVEN } else { MAX_SCATTER };
    let is_erratic =
        is_erratic_within || (scatter > max_scatter && scatter_within.is_none_or(|sd| sd > max_scatter));
    let impacts = hits.len();
    (is_erratic && is_uneven).then(|| Objection::new(Reason::Tumbles { impacts, scatter, spread_m, sd_m }))
}

/// Values of the impacts, each minus the median of its class.
fn centred(hits: &[Hit], class: impl Fn(&Hit) -> usize, value: impl Fn(&Hit) -> f64) -> Vec<f64> {
    let class_median =
        |k: usize| median(&mut hits.iter().filter(|h| class(h) == k).map(&value).collect::<Vec<_>>());
    let mut medians = std::collections::BTreeMap::new();
    hits.iter()
        .map(|h| value(h) - *medians.entry(class(h)).or_insert_with(|| class_median(class(h))))
        .collect()
}

/// Standard deviation of the restitution within records; `None` with too few impacts.
///
/// It is the root of the median variance of the records.
///
/// Variation between records is excluded, because objects may differ between records without a group column.
fn scatter_within_records(hits: &[Hit]) -> Option<f64> {
    let mut variances: Vec<f64> = hits
        .chunk_by(|a, b| a.record == b.record)
        .filter(|hits| hits.len() >= MIN_PER_RECORD)
        .map(|hits| {
            let mean = hits.iter().map(|h| h.restitution).sum::<f64>() / hits.len() as f64;
            hits.iter().map(|h| (h.restitution - mean).powi(2)).sum::<f64>() / (hits.len() - 1) as f64
        })
        .collect();
    // The median of a sample variance with two degrees of freedom is ln 2 = 0.69 times its mean.
    (variances.len() >= MIN_PER_RECORD).then(|| (median(&mut variances) / std::f64::consts::LN_2).sqrt())
}

/// Robust standard deviation of `values`, from the median absolute deviation.
fn robust_sd(mut values: Vec<f64>) -> f64 {
    let centre = median(&mut values);
    median(&mut values.iter().map(|v| (v - centre).abs()).collect::<Vec<_>>()) / NORMAL_MAD
}

/// Impact heights minus their least-squares plane over the places, by Gram-Schmidt orthogonalisation.
fn without_plane(points: &[([f64; 3], f64)]) -> Vec<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut residual: Vec<f64> = points.iter().map(|(_, z)| *z).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    for axis in 0..3 {
        let mut column: Vec<f64> = points.iter().map(|(place, _)| place[axis]).collect();
        let size = dot(&column, &column);
        for b in &basis {
            let projection = dot(&column, b);
            column.iter_mut().zip(b).for_each(|(c, b)| *c -= projection * b);
        }
        // A column that depends on the others, such as a coordinate that does not vary, is skipped.
        let square = dot(&column, &column);
        if square > 1e-9 * size && square > 0.0 {
            let norm = square.sqrt();
            column.iter_mut().for_each(|c| *c /= norm);
            let projection = dot(&residual, &column);
            residual.iter_mut().zip(&column).for_each(|(r, c)| *r -= projection * c);
            basis.push(column);
        }
    }
    residual
}
