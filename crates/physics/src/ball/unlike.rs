//! Why some records are not those of a ball: a fall that is none, rebounds that scatter, impacts at different heights.

use super::scene::impact_heights;
use super::{GRAVITY, RESTITUTION};
use crate::model::Parameter;
use crate::statistics::median;
use crate::system::{Objection, Record};
use thiserror::Error;

/// Gravity on the ground, m/s².
const ON_EARTH: f64 = 9.81;
/// Ratio of a calibrated gravity to the declared one and to that on the ground, either way, from which scale or clock of the
/// data are wrong: a tape measure and a camera's clock are good to a few per cent.
const ALIKE: f64 = 1.25;
/// Ratio of gravities as [`ALIKE`], before anything was added: drag takes away half of a fall near the terminal speed.
const ALIKE_AT_FIRST: f64 = 3.0;
/// Standard deviation of the rebound, as a share of the speed of impact, from which it is no ball's: restitution scatters by
/// 0.1 where it was drawn at random to be hard to foretell, bodies that tumble reach 0.2 to 0.3.
const ERRATIC: f64 = 0.15;
/// Scatter of the rebound as [`ERRATIC`], over all records where the heights of impacts differ by more than any floor does:
/// a body that tumbles a little is no ball either. Of 106 simulated squares and cubes some scatter by 0.10 to 0.15 (a robust estimate of a law with long tails), at
/// heights that differ by 0.015 of the fall and more.
const ERRATIC_IF_UNEVEN: f64 = 0.08;
/// Share of the fall by which the heights of impacts differ more than contacts and floors make them: a corner strikes a floor at
/// any height between half a side and half a diagonal.
const FAR_UNEVEN_SHARE: f64 = 0.01;
/// Standard deviation of the heights of impacts, in units of the noise, from which they differ.
const UNEVEN: f64 = 4.0;
/// Scatter of impacts' heights as [`UNEVEN`], where the rebounds of one and the same body are erratic. Heights of a ball's
/// impacts are known to half of the noise;
/// those of the squares that this is for (7 of 99) scatter by 2.9 to 4.0 times the noise.
const UNEVEN_IF_ERRATIC: f64 = 2.5;
/// Scatter of impacts' heights as a share of the fall before them: contacts that last and floors that dent keep it below a
/// hundredth.
const UNEVEN_SHARE: f64 = 0.004;
/// Fewest impacts by which rebounds are judged.
const FEWEST: usize = 8;
/// Fewest impacts of a record, and fewest such records, by which the scatter within records is judged.
const SEVERAL: usize = 3;
/// Speed of impact from which noise is no part of the scatter, in units of the noise over a hundredth of a second.
const CLEAR: f64 = 5.0;
/// Median absolute deviation of a normal law.
const MEDIAN_NORMAL: f64 = 0.6745;

#[derive(Debug, Error)]
enum Reason {
    #[error(
        "gravity fits {found:.4} m/s² where {declared} was declared{}: {remedy}",
        if *at_bound { ", at its bound" } else { "" }
    )]
    Gravity { found: f64, declared: f64, at_bound: bool, remedy: String },
    #[error(
        "it does not bounce as a ball does: {impacts} rebounds scatter by {scatter:.2} of the speed of impact, at heights that \
         scatter by {:.1} mm, {:.0} times the noise; a body that tumbles cannot be followed by its centre alone, so write \
         equations of your own (augsim model new), or give the part before the first impact",
        1e3 * spread_m,
        spread_m / sd_m
    )]
    Tumbles { impacts: usize, scatter: f64, spread_m: f64, sd_m: f64 },
}

fn alike(a: f64, b: f64, factor: f64) -> bool {
    (1.0 / factor..=factor).contains(&(a / b))
}

/// Advice where things fall `ratio` times as fast as they should.
fn remedy(ratio: f64) -> String {
    let units = [(100.0, "centimetres"), (1000.0, "millimetres"), (39.37, "inches"), (3.281, "feet")];
    let unit = units.into_iter().find(|(factor, _)| alike(ratio, *factor, 1.3));
    match unit {
        _ if ratio <= 0.0 => "does the height count downwards? Turn its sign (augsim start --up)".into(),
        Some((_, unit)) => format!("are these {unit}? Give the unit (augsim start --columns)"),
        None => format!(
            "check the unit of the height and the frame rate (a clock that is wrong by a factor of {:.2} would do it), or freeze gravity",
            ratio.max(1e-6).sqrt()
        ),
    }
}

/// Why a calibrated gravity cannot be one; frozen values are taken as they are.
pub(super) fn implausible(parameters: &[Parameter], values: &[f64]) -> Option<Objection> {
    let (p, found) = (parameters.get(GRAVITY)?, *values.get(GRAVITY)?);
    gravity(p, found, ALIKE)
}

fn gravity(p: &Parameter, found: f64, factor: f64) -> Option<Objection> {
    let fine = alike(found, p.nominal, factor) || alike(found, ON_EARTH, factor);
    if p.frozen || fine {
        return None;
    }
    let at_bound = found <= p.min || found >= p.max;
    let declared = p.nominal;
    Some(Objection::new(Reason::Gravity { found, declared, at_bound, remedy: remedy(found / ON_EARTH) }))
}

/// Why these records are not a ball's: `sd_m` is the noise of the height.
pub(super) fn unlike(parameters: &[Parameter], records: &[&Record], sd_m: f64) -> Option<Objection> {
    let g = &parameters[GRAVITY];
    if let Some(found) = seen_gravity(records)
        && let Some(objection) = gravity(g, found, ALIKE_AT_FIRST)
    {
        return Some(objection);
    }
    if parameters[RESTITUTION].frozen {
        return None;
    }
    tumbles(records, g.nominal.max(0.1), sd_m)
}

/// Median downward acceleration of the arcs, m/s².
fn seen_gravity(records: &[&Record]) -> Option<f64> {
    let arcs = records.iter().flat_map(|r| r.pieces.iter().map(move |a| (r, a)));
    let mut all: Vec<f64> = arcs
        .filter_map(|(r, a)| {
            let heights = r.values.last()?;
            let seen: Vec<usize> = a.clone().filter(|&k| heights[k].is_finite()).collect();
            let (first, last) = (*seen.first()?, *seen.last()?);
            let (middle, half) =
                (0.5 * (r.times[first] + r.times[last]), 0.5 * (r.times[last] - r.times[first]));
            if seen.len() < 6 || half <= 0.0 {
                return None;
            }
            // Least squares of a parabola by orthogonal polynomials on these times.
            let u: Vec<f64> = seen.iter().map(|&k| (r.times[k] - middle) / half).collect();
            let n = u.len() as f64;
            let mean = |f: &dyn Fn(usize) -> f64| (0..u.len()).map(f).sum::<f64>() / n;
            let a = mean(&|k| u[k]);
            let b = mean(&|k| u[k] * u[k]);
            let c = mean(&|k| u[k] * u[k] * (u[k] - a)) / mean(&|k| (u[k] - a).powi(2));
            let q: Vec<f64> = u.iter().map(|u| u * u - b - c * (u - a)).collect();
            let bend = mean(&|k| heights[seen[k]] * q[k]) / mean(&|k| q[k] * q[k]);
            Some(-2.0 * bend / (half * half))
        })
        .collect();
    (!all.is_empty()).then(|| median(&mut all))
}

/// An impact that is well seen.
struct Hit {
    record: usize,
    group: usize,
    /// Share of the speed that it leaves.
    rebound: f64,
    /// Height of the fall before it, m.
    fall_m: f64,
    /// 1, then the horizontal coordinates, m.
    place: [f64; 3],
    height_m: f64,
}

fn hits(records: &[&Record], g: f64, sd_m: f64) -> Vec<Hit> {
    let mut out = Vec::new();
    for (record, r) in records.iter().enumerate() {
        let vertical = r.values.len().saturating_sub(1);
        let mut begins = r.times.first().copied().unwrap_or(0.0);
        for (event, height_m) in impact_heights(r, g) {
            let before = |k: &usize| (begins..event.time).contains(&r.times[*k]);
            let within: Vec<usize> = (0..r.times.len()).filter(before).collect();
            begins = event.time;
            let coordinate = |c: usize| match r.values.get(c).filter(|_| c < vertical) {
                Some(values) => {
                    within.iter().rev().map(|&k| values[k]).find(|v| v.is_finite()).unwrap_or(0.0)
                }
                None => 0.0,
            };
            let heights = within.iter().map(|&k| r.values[vertical][k]).filter(|z| z.is_finite());
            let fall_m = heights.fold(height_m, f64::max) - height_m;
            if (2.0 * g * fall_m).sqrt() > CLEAR * sd_m / 0.01 {
                let place = [1.0, coordinate(0), coordinate(1)];
                out.push(Hit { record, group: r.group, rebound: event.value, fall_m, place, height_m });
            }
        }
    }
    out
}

/// Rebounds that scatter as no ball's do, at impacts whose heights differ. Balls and floors may differ from group to group.
fn tumbles(records: &[&Record], g: f64, sd_m: f64) -> Option<Objection> {
    let hits = hits(records, g, sd_m);
    if hits.len() < FEWEST {
        return None;
    }
    let scatter = deviation(centred(&hits, |h| h.group, |h| h.rebound));
    // A tilted floor or camera is none of this: heights are compared with a plane.
    let heights = centred(&hits, |h| h.group, |h| h.height_m);
    let places = hits.iter().map(|h| h.place);
    let spread_m = deviation(without_plane(&places.zip(heights).collect::<Vec<_>>()));
    let fall = median(&mut hits.iter().map(|h| h.fall_m).collect::<Vec<_>>());
    let own = within_records(&hits);
    let is_wild = own.is_some_and(|own| own > ERRATIC);
    let least = if is_wild { UNEVEN_IF_ERRATIC } else { UNEVEN };
    let uneven = spread_m > least * sd_m && spread_m > UNEVEN_SHARE * fall;
    let limit = if spread_m > FAR_UNEVEN_SHARE * fall { ERRATIC_IF_UNEVEN } else { ERRATIC };
    let erratic = is_wild || (scatter > limit && own.is_none_or(|own| own > limit));
    let impacts = hits.len();
    (erratic && uneven).then(|| Objection::new(Reason::Tumbles { impacts, scatter, spread_m, sd_m }))
}

/// Values less the median of their own kind.
fn centred(hits: &[Hit], kind: impl Fn(&Hit) -> usize, value: impl Fn(&Hit) -> f64) -> Vec<f64> {
    let middle = |k: usize| median(&mut hits.iter().filter(|h| kind(h) == k).map(&value).collect::<Vec<_>>());
    let mut middles = std::collections::BTreeMap::new();
    hits.iter().map(|h| value(h) - *middles.entry(kind(h)).or_insert_with(|| middle(kind(h)))).collect()
}

/// Standard deviation of the rebounds of one record, where enough records have several: objects may differ from record to
/// record without a word in the data.
fn within_records(hits: &[Hit]) -> Option<f64> {
    let mut variances: Vec<f64> = hits
        .chunk_by(|a, b| a.record == b.record)
        .filter(|own| own.len() >= SEVERAL)
        .map(|own| {
            let mean = own.iter().map(|h| h.rebound).sum::<f64>() / own.len() as f64;
            own.iter().map(|h| (h.rebound - mean).powi(2)).sum::<f64>() / (own.len() - 1) as f64
        })
        .collect();
    // The median of a variance of two degrees of freedom is 0.69 of its mean.
    (variances.len() >= SEVERAL).then(|| (median(&mut variances) / std::f64::consts::LN_2).sqrt())
}

/// Standard deviation of values that are normal but for a few.
fn deviation(mut values: Vec<f64>) -> f64 {
    let middle = median(&mut values);
    median(&mut values.iter().map(|v| (v - middle).abs()).collect::<Vec<_>>()) / MEDIAN_NORMAL
}

/// Heights less their least-squares plane over the places.
fn without_plane(all: &[([f64; 3], f64)]) -> Vec<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut rest: Vec<f64> = all.iter().map(|(_, z)| *z).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    for axis in 0..3 {
        let mut column: Vec<f64> = all.iter().map(|(place, _)| place[axis]).collect();
        let size = dot(&column, &column);
        for b in &basis {
            let share = dot(&column, b);
            column.iter_mut().zip(b).for_each(|(c, b)| *c -= share * b);
        }
        let left = dot(&column, &column);
        if left > 1e-9 * size && left > 0.0 {
            let norm = left.sqrt();
            column.iter_mut().for_each(|c| *c /= norm);
            let share = dot(&rest, &column);
            rest.iter_mut().zip(&column).for_each(|(r, c)| *r -= share * c);
            basis.push(column);
        }
    }
    rest
}
