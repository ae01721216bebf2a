//! Merges streams with separate clocks on the union of their sample times.
//!
//! Every sample of every stream is kept exactly and marked as fresh in the flag of the stream. Between its
//! samples a stream is interpolated linearly, for angles along the shorter arc. Nothing is extrapolated: the
//! union covers only the time that all streams share.

use std::f64::consts::TAU;

/// Sensor stream: columns that are measured at the same times.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    /// Sample times of the stream, s, strictly increasing.
    pub(crate) time_s: Vec<f64>,
    /// Values of the stream, column by column.
    pub(crate) columns: Vec<Vec<f64>>,
    /// For each column, whether it is an angle.
    pub(crate) angular: Vec<bool>,
    /// Maximum interval between samples that is interpolated, s; values within longer intervals are gaps.
    pub(crate) max_interpolated_s: f64,
}

/// Several streams, all given at the union of their sample times.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Union {
    /// Union of the sample times, s.
    pub(crate) time_s: Vec<f64>,
    /// Columns of all streams, in order, interpolated at the union of the times.
    pub(crate) columns: Vec<Vec<f64>>,
    /// One flag column per stream: 1 at its measured samples, 0 where it is interpolated.
    pub(crate) fresh: Vec<Vec<f64>>,
}

/// Merges streams on the union of their sample times; `None` where fewer than two lie in their common time.
pub(crate) fn union(sources: &[Source]) -> Option<Union> {
    let begin = sources.iter().filter_map(|s| s.time_s.first()).copied().fold(f64::NEG_INFINITY, f64::max);
    let end = sources.iter().filter_map(|s| s.time_s.last()).copied().fold(f64::INFINITY, f64::min);
    let mut time_s: Vec<f64> = sources.iter().flat_map(|s| &s.time_s).copied().collect();
    time_s.retain(|t| (begin..=end).contains(t));
    time_s.sort_unstable_by(f64::total_cmp);
    time_s.dedup();
    if time_s.len() < 2 {
        return None;
    }
    let mut joined = Union { columns: Vec::new(), fresh: Vec::new(), time_s };
    for source in sources {
        let (columns, fresh) = on_clock(source, &joined.time_s);
        joined.columns.extend(columns);
        joined.fresh.push(fresh);
    }
    Some(joined)
}

/// Columns of `source` interpolated at the times `clock`, and flags of its measured samples.
///
/// The times `clock` must be within those of the stream.
fn on_clock(source: &Source, clock: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut columns = vec![Vec::with_capacity(clock.len()); source.columns.len()];
    let mut fresh = Vec::with_capacity(clock.len());
    for &t in clock {
        // Index of the last sample at or before t.
        let k = source.time_s.partition_point(|&time| time <= t).saturating_sub(1);
        let is_fresh = source.time_s[k] == t;
        fresh.push(if is_fresh { 1.0 } else { 0.0 });
        for ((samples, &is_angle), out) in source.columns.iter().zip(&source.angular).zip(&mut columns) {
            out.push(if is_fresh {
                samples[k]
            } else {
                let interval = source.time_s[k + 1] - source.time_s[k];
                let fraction = (t - source.time_s[k]) / interval;
                if interval > source.max_interpolated_s {
                    f64::NAN
                } else {
                    interpolate(samples[k], samples[k + 1], fraction, is_angle)
                }
            });
        }
    }
    (columns, fresh)
}

/// Interpolated value at `fraction` of the way from `a` to `b`, for an angle along the shorter arc.
pub(crate) fn interpolate(a: f64, b: f64, fraction: f64, is_angle: bool) -> f64 {
    let step = b - a;
    a + fraction * if is_angle { step - (step / TAU).round() * TAU } else { step }
}

#[cfg(test)]
mod tests {
    //! Contract: fresh samples are exact, and nothing is extrapolated.
    //!
    //! Interpolation is linear, for angles along the shorter arc, and long intervals are gaps.
    use super::*;

    fn source(time_s: &[f64], values: &[f64], angle: bool) -> Source {
        let (columns, angular) = (vec![values.to_vec()], vec![angle]);
        Source { time_s: time_s.to_vec(), columns, angular, max_interpolated_s: f64::INFINITY }
    }

    #[test]
    fn two_clocks_are_merged_within_their_shared_time() {
        let slow = source(&[0.0, 1.0, 2.0, 3.0], &[0.0, 10.0, 40.0, 90.0], false);
        let fast = source(&[0.5, 1.0, 1.5, 2.25], &[3.0, -3.0, -3.2, 3.0], true);
        let joined = union(&[slow, fast]).unwrap();
        assert_eq!(joined.time_s, [0.5, 1.0, 1.5, 2.0, 2.25]);
        assert_eq!(joined.columns[0], [5.0, 10.0, 25.0, 40.0, 52.5]);
        assert_eq!(joined.fresh, [[0.0, 1.0, 0.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.0, 1.0]]);
        let angle = joined.columns[1][3];
        // The shorter arc from -3.2 to 3.0 is -0.083 rad; two thirds of it.
        let expected = -3.2 + 2.0 / 3.0 * (6.2 - TAU);
        assert!((angle - expected).abs() < 1e-12, "{angle}");
    }

    #[test]
    fn clocks_without_overlap_give_none_and_long_intervals_are_gaps() {
        let early = source(&[0.0, 1.0], &[0.0, 1.0], false);
        assert!(union(&[early.clone(), source(&[2.0, 3.0], &[0.0, 1.0], false)]).is_none());
        let ends = Source { max_interpolated_s: 0.5, ..early };
        let joined = union(&[ends, source(&[0.0, 0.5, 1.0], &[0.0; 3], false)]).unwrap();
        assert_eq!((joined.columns[0][0], joined.columns[0][2]), (0.0, 1.0));
        assert!(joined.columns[0][1].is_nan());
    }
}
