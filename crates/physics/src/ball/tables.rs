//! Which laws of one feature throws can speak about, and over which range of the feature.

use super::Axes;
use super::covariates::{clock_s, has_spin, has_start_time};
use crate::effects::{Against, Location, Target};
use crate::statistics::quantile;
use crate::system::{Event, Record, Table};

/// Knots of a law of one feature.
const KNOTS: usize = 8;

/// Laws over the features that vary in these records; knots between the 1 % and 99 % quantiles. Laws of the impact are among
/// them if the restitution is calibrated.
pub(super) fn tables(
    axes: Axes,
    floor_m: f64,
    calibrates_restitution: bool,
    records: &[&Record],
    events: &[Vec<Event>],
) -> Vec<Table> {
    let horizontal = axes != Axes::Vertical;
    let (start_time, spin) = (has_start_time(records), has_spin(records));
    let mut pairs: Vec<(Target, Against)> = vec![
        (Target::AccelerationZ, Against::Z),
        (Target::AccelerationZ, Against::Time),
        (Target::SensorZ, Against::Z),
        (Target::SensorZ, Against::VelocityZ),
        (Target::Drag, Against::Speed),
        (Target::Drag, Against::Time),
    ];
    let impact_laws = calibrates_restitution && records.iter().any(|r| !r.events.is_empty());
    if impact_laws {
        for against in [Against::NormalSpeed, Against::Time, Against::Bounce] {
            pairs.push((Target::Restitution, against));
        }
        if start_time {
            pairs.push((Target::Restitution, Against::Clock));
        }
    }
    if horizontal {
        use Against::*;
        use Target::*;
        pairs.extend([
            (AccelerationZ, X),
            (AccelerationX, X),
            (AccelerationX, Time),
            (AccelerationX, Z),
            (AccelerationX, VelocityX),
            (SensorZ, X),
            (SensorX, X),
            (SensorX, Z),
            (SensorX, VelocityX),
        ]);
        if start_time {
            pairs.extend([(AccelerationX, Clock), (AccelerationZ, Clock)]);
        }
        if impact_laws {
            pairs.extend([
                (Restitution, X),
                (Restitution, TangentialSpeed),
                (Restitution, Slip),
                (TangentialJump, Slip),
                (TangentialJump, X),
                (TangentialJump, NormalSpeed),
            ]);
            if spin {
                pairs.push((Restitution, Spin));
            }
        }
        if spin {
            pairs.extend([(Magnus, Time), (Magnus, Speed)]);
        }
    }
    if axes == Axes::Space {
        pairs.extend([(Target::AccelerationY, Against::Y), (Target::AccelerationY, Against::Time)]);
    }
    pairs
        .into_iter()
        .filter_map(|(target, against)| {
            let (first, last) = span(target, against, axes, floor_m, records, events)?;
            Some(Table {
                target: Target::ALL.iter().position(|t| *t == target)?,
                against: Against::ALL.iter().position(|a| *a == against)?,
                first,
                last,
                knots: KNOTS,
            })
        })
        .collect()
}

/// 1 % and 99 % quantiles of a feature; `None` if it hardly varies.
fn span(
    target: Target,
    against: Against,
    axes: Axes,
    floor_m: f64,
    records: &[&Record],
    events: &[Vec<Event>],
) -> Option<(f64, f64)> {
    let mut x: Vec<f64> = if target.location() == Location::Impact {
        let place = Against::ALL.iter().position(|a| *a == against)?;
        events.iter().flatten().map(|event| event.feature(place)).collect()
    } else {
        records.iter().flat_map(|r| in_flight(against, axes, floor_m, r)).collect()
    };
    x.retain(|v| v.is_finite());
    if x.len() < 3 * KNOTS {
        return None;
    }
    x.sort_by(f64::total_cmp);
    let (first, last) = (quantile(&x, 0.01), quantile(&x, 0.99));
    (last - first > 1e-6 * (1.0 + first.abs())).then_some((first, last))
}

/// Values of a feature at the samples of a record's arcs; heights count from the floor.
fn in_flight(against: Against, axes: Axes, floor_m: f64, r: &Record) -> Vec<f64> {
    let channel = |axis: usize| axes.indices().iter().position(|&a| a == axis);
    let mut out = Vec::new();
    for a in &r.pieces {
        for k in a.clone().skip(1) {
            let y = |axis: usize, k: usize| channel(axis).map_or(0.0, |c| r.values[c][k]);
            let rate = |axis: usize| {
                // Over a few samples: single differences are all noise.
                let (low, high) = (a.start.max(k.saturating_sub(4)), (k + 4).min(a.end - 1));
                (y(axis, high) - y(axis, low)) / (r.times[high] - r.times[low])
            };
            out.push(match against {
                Against::Time => r.times[k],
                Against::Clock => r.times[k] + clock_s(r),
                Against::X => y(0, k),
                Against::Y => y(1, k),
                Against::Z => y(2, k) - floor_m,
                Against::VelocityX => rate(0),
                Against::VelocityZ => rate(2),
                _ => (0..3).map(|axis| rate(axis).powi(2)).sum::<f64>().sqrt(),
            });
        }
    }
    out
}
