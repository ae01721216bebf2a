//! The scene of throws, as it shows before any model is fitted.

use super::segment::{ballistic, segment};
use crate::statistics::median;
use crate::system::{Record, SeenEvent};
use augsim_data::Dataset;

/// Gravity by which a floor is looked for in data without a model, m/s².
const USUAL_GRAVITY: f64 = 9.81;
/// Median of the third differences of white noise, in units of its standard deviation.
const THIRD_DIFFERENCES: f64 = 0.6745 * 4.472_136;

/// Length of the fits on both sides of an impact, s.
const SIDE: f64 = 0.120;

/// Height at which the balls hit the ground, m: the median over the impacts that are seen; `None` without one.
pub(super) fn floor_height(records: &[&Record], g: f64) -> Option<f64> {
    let mut all: Vec<f64> = records.iter().flat_map(|r| impact_heights(r, g)).map(|(_, z)| z).collect();
    (!all.is_empty()).then(|| median(&mut all))
}

/// The impacts that a record shows with their heights, m: the mean of where the arcs before and after lead to. Impacts with too
/// few samples beside them are left out.
pub(crate) fn impact_heights(record: &Record, g: f64) -> Vec<(SeenEvent, f64)> {
    let Some(heights) = record.values.last() else { return Vec::new() };
    let beside = |event: &SeenEvent, before: bool| {
        let near = |k: &usize| {
            let ahead = event.time - record.times[*k];
            let ahead = if before { ahead } else { -ahead };
            (0.0..SIDE).contains(&ahead)
        };
        let mut arcs = record.pieces.iter().filter(|a| {
            let middle = 0.5 * (record.times[a.start] + record.times[a.end - 1]);
            (middle < event.time) == before
        });
        // The arc next to the impact is the last one before it, or the first one after it.
        let arc = if before { arcs.next_back() } else { arcs.next() }?;
        Some(ballistic(&record.times, heights, arc.clone().filter(near), event.time, g)?.0)
    };
    let seen = |event: &SeenEvent| {
        let sides = [beside(event, true), beside(event, false)];
        let known: Vec<f64> = sides.into_iter().flatten().collect();
        (!known.is_empty()).then(|| (*event, known.iter().sum::<f64>() / known.len() as f64))
    };
    record.events.iter().filter_map(seen).collect()
}

/// Height of the floor that data of a ball show, m, before there is a model: that of the impacts in `z_m` or `height_m`;
/// `None` where no impact is seen.
pub fn seen_floor_m(data: &Dataset) -> Option<f64> {
    let vertical = ["z_m", "height_m"].iter().find_map(|name| data.column_index(name).ok())?;
    let records: Vec<Record> = data
        .trajectories()
        .iter()
        .map(|t| {
            let heights = t.column(vertical).to_vec();
            let measured: Vec<f64> = heights.iter().copied().filter(|z| z.is_finite()).collect();
            let third = measured.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs());
            let sd = median(&mut third.collect::<Vec<_>>()) / THIRD_DIFFERENCES;
            let mut record =
                Record { times: t.time_s().to_vec(), values: vec![heights], ..Record::default() };
            if measured.len() > 1 {
                segment(&mut record, USUAL_GRAVITY, sd, true);
            }
            record
        })
        .collect();
    floor_height(&records.iter().collect::<Vec<_>>(), USUAL_GRAVITY)
}
