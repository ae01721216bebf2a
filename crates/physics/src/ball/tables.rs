//! Candidate tables (functions of one feature) for a set of throws, with the range of the feature.

use super::Axes;
use super::covariates::{clock_s, has_spin, has_start_time};
use super::effects::{Feature, Target};
use crate::library::Location;
use augsim_system::statistics::quantile;
use augsim_system::{Event, Record, Table};

/// Number of knots of a candidate table.
const KNOTS: usize = 8;

/// Candidate tables over the features that vary in these records.
///
/// Knots span the 1 % to 99 % quantiles of the feature. Tables that act at impacts are included if the
/// restitution is calibrated and there are impacts.
pub(super) fn tables(
    axes: Axes,
    floor_m: f64,
    calibrates_restitution: bool,
    records: &[&Record],
    events: &[Vec<Event>],
) -> Vec<Table> {
    let is_horizontal = axes != Axes::Vertical;
    let (has_clock, spins) = (has_start_time(records), has_spin(records));
    let mut pairs: Vec<(Target, Feature)> = vec![
        (Target::AccelerationZ, Feature::Z),
        (Target::AccelerationZ, Feature::Time),
        (Target::SensorZ, Feature::Z),
        (Target::SensorZ, Feature::VelocityZ),
        (Target::Drag, Feature::Speed),
        (Target::Drag, Feature::Time),
    ];
    let has_impact_tables = calibrates_restitution && records.iter().any(|r| !r.events.is_empty());
    if has_impact_tables {
        for against in [Feature::NormalSpeed, Feature::Time, Feature::Bounce] {
            pairs.push((Target::Restitution, against));
        }
        if has_clock {
            pairs.push((Target::Restitution, Feature::Clock));
        }
    }
    if is_horizontal {
        use Feature::*;
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
        if has_clock {
            pairs.extend([(AccelerationX, Clock), (AccelerationZ, Clock)]);
        }
        if has_impact_tables {
            pairs.extend([
                (Restitution, X),
                (Restitution, TangentialSpeed),
                (Restitution, Slip),
                (TangentialJump, Slip),
                (TangentialJump, X),
                (TangentialJump, NormalSpeed),
            ]);
            if spins {
                pairs.push((Restitution, Spin));
            }
        }
        if spins {
            pairs.extend([(Magnus, Time), (Magnus, Speed)]);
        }
    }
    if axes == Axes::Space {
        pairs.extend([(Target::AccelerationY, Feature::Y), (Target::AccelerationY, Feature::Time)]);
    }
    pairs
        .into_iter()
        .filter_map(|(target, against)| {
            let (first, last) = feature_range(target, against, axes, floor_m, records, events)?;
            Some(Table {
                target: Target::ALL.iter().position(|t| *t == target)?,
                feature: Feature::ALL.iter().position(|a| *a == against)?,
                first,
                last,
                knots: KNOTS,
            })
        })
        .collect()
}

/// Range of a feature: its 1 % and 99 % quantiles; `None` if it does not vary or has too few values.
fn feature_range(
    target: Target,
    against: Feature,
    axes: Axes,
    floor_m: f64,
    records: &[&Record],
    events: &[Vec<Event>],
) -> Option<(f64, f64)> {
    let mut x: Vec<f64> = if target.location() == Location::Impact {
        let index = Feature::ALL.iter().position(|a| *a == against)?;
        events.iter().flatten().map(|event| event.feature(index)).collect()
    } else {
        records.iter().flat_map(|r| flight_values(against, axes, floor_m, r)).collect()
    };
    x.retain(|v| v.is_finite());
    if x.len() < 3 * KNOTS {
        return None;
    }
    x.sort_by(f64::total_cmp);
    let (first, last) = (quantile(&x, 0.01), quantile(&x, 0.99));
    (last - first > 1e-6 * (1.0 + first.abs())).then_some((first, last))
}

/// Values of a feature at the samples of a record's arcs; heights are relative to the floor.
fn flight_values(against: Feature, axes: Axes, floor_m: f64, r: &Record) -> Vec<f64> {
    let channel = |axis: usize| axes.indices().iter().position(|&a| a == axis);
    let mut out = Vec::new();
    for a in &r.smooth_segments {
        for k in a.clone().skip(1) {
            let y = |axis: usize, k: usize| channel(axis).map_or(0.0, |c| r.values[c][k]);
            let rate = |axis: usize| {
                // A difference over a few samples: those of adjacent samples are mostly noise.
                let (low, high) = (a.start.max(k.saturating_sub(4)), (k + 4).min(a.end - 1));
                (y(axis, high) - y(axis, low)) / (r.times[high] - r.times[low])
            };
            out.push(match against {
                Feature::Time => r.times[k],
                Feature::Clock => r.times[k] + clock_s(r),
                Feature::X => y(0, k),
                Feature::Y => y(1, k),
                Feature::Z => y(2, k) - floor_m,
                Feature::VelocityX => rate(0),
                Feature::VelocityZ => rate(2),
                _ => (0..3).map(|axis| rate(axis).powi(2)).sum::<f64>().sqrt(),
            });
        }
    }
    out
}
