//! Height of the floor, estimated from the data before any model is fitted.

use super::segmentation::{fit_free_fall, segment};
use augsim_data::Dataset;
use augsim_system::statistics::median;
use augsim_system::{DetectedEvent, Record};

/// Gravitational acceleration that is assumed for data without a model, m/s².
const ASSUMED_GRAVITY: f64 = 9.81;
/// Median magnitude of third differences of unit white noise: 0.6745 sqrt(1 + 9 + 9 + 1).
const MEDIAN_THIRD_DIFFERENCE: f64 = 0.6745 * 4.472_136;

/// Duration of the free-fall fits before and after an impact, s.
const SIDE_DURATION: f64 = 0.120;

/// Height of the floor, m: the median height of the detected impacts; `None` if there are none.
pub(super) fn floor_height(records: &[&Record], g: f64) -> Option<f64> {
    let mut heights: Vec<f64> = records.iter().flat_map(|r| impact_heights(r, g)).map(|(_, z)| z).collect();
    (!heights.is_empty()).then(|| median(&mut heights))
}

/// Detected impacts of a record, each with its height, m.
///
/// The height is the mean of the extrapolations of the arcs before and after the impact; impacts with too few
/// samples on both sides are omitted.
pub(crate) fn impact_heights(record: &Record, g: f64) -> Vec<(DetectedEvent, f64)> {
    let Some(heights) = record.values.last() else { return Vec::new() };
    let extrapolated = |event: &DetectedEvent, before: bool| {
        let near = |k: &usize| {
            let distance = event.time - record.times[*k];
            let distance = if before { distance } else { -distance };
            (0.0..SIDE_DURATION).contains(&distance)
        };
        let mut arcs = record.smooth_segments.iter().filter(|a| {
            let middle = 0.5 * (record.times[a.start] + record.times[a.end - 1]);
            (middle < event.time) == before
        });
        // The arc next to the impact is the last one before it, or the first one after it.
        let arc = if before { arcs.next_back() } else { arcs.next() }?;
        Some(fit_free_fall(&record.times, heights, arc.clone().filter(near), event.time, g)?.0)
    };
    let with_height = |event: &DetectedEvent| {
        let sides = [extrapolated(event, true), extrapolated(event, false)];
        let known: Vec<f64> = sides.into_iter().flatten().collect();
        (!known.is_empty()).then(|| (*event, known.iter().sum::<f64>() / known.len() as f64))
    };
    record.events.iter().filter_map(with_height).collect()
}

/// Height of the floor, m, from the column `z_m` or `height_m` of a data set, without a model.
///
/// `None` if no impact is detected.
pub fn detected_floor_m(data: &Dataset) -> Option<f64> {
    let vertical = ["z_m", "height_m"].iter().find_map(|name| data.column_index(name).ok())?;
    let records: Vec<Record> = data
        .trajectories()
        .iter()
        .map(|t| {
            let heights = t.column(vertical).to_vec();
            let measured: Vec<f64> = heights.iter().copied().filter(|z| z.is_finite()).collect();
            let differences = measured.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs());
            let sd = median(&mut differences.collect::<Vec<_>>()) / MEDIAN_THIRD_DIFFERENCE;
            let mut record =
                Record { times: t.time_s().to_vec(), values: vec![heights], ..Record::default() };
            if measured.len() > 1 {
                segment(&mut record, ASSUMED_GRAVITY, sd, true);
            }
            record
        })
        .collect();
    floor_height(&records.iter().collect::<Vec<_>>(), ASSUMED_GRAVITY)
}
