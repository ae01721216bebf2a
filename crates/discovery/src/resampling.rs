//! Resampling: values and rates of the channels at regular times, from samples without rates or regular
//! times.
//!
//! Between events the motion is smooth: over each segment that the system names, a polynomial is fitted to
//! every channel. Its values and slopes at regular times are the states that a stepwise model is trained on.
//! The known samples of a record, from which predictions start, have their own polynomials, so that no later
//! sample influences the initial state.

use crate::DiscoveryError;
use crate::linear::Square;
use crate::prepare::{PreparedRecords, load_records};
use crate::record::Record;
use augsim_data::Dataset;
use augsim_system::Declaration;
use std::ops::Range;

/// Number of samples for each coefficient of a polynomial that is fitted to a segment.
const SAMPLES_PER_COEFFICIENT: usize = 5;
/// Minimum and maximum number of coefficients of the polynomial fitted to a segment: from a parabola (3) to
/// degree 4 (5) for long segments.
const COEFFICIENTS: (usize, usize) = (3, 5);

/// A record resampled at regular times, with the rates of change of its channels.
#[derive(Clone, Debug, PartialEq)]
pub struct UniformRecord {
    /// Name of the record in the data.
    pub id: String,
    /// Name of the record's group; `None` without groups.
    pub group: Option<String>,
    /// Times of the resampled values, s, in equal steps from the first sample.
    pub times: Vec<f64>,
    /// Resampled values, `[channel][sample]`, in the unit of the channel.
    pub values: Vec<Vec<f64>>,
    /// Rates of change, `[channel][sample]`, in the unit of the channel per second.
    pub rates: Vec<Vec<f64>>,
}

/// Resamples the records of `data` that the system of `model` can use, in steps of `step_s` seconds.
///
/// # Errors
/// [`DiscoveryError`], if the model and the data are incompatible.
pub fn resample_uniformly(
    model: &dyn Declaration,
    data: &Dataset,
    step_s: f64,
) -> Result<Vec<UniformRecord>, DiscoveryError> {
    let PreparedRecords { data, .. } = load_records(model, data, 1, false)?;
    let group = |r: &Record| data.groups.get(r.data.group).filter(|name| !name.is_empty()).cloned();
    Ok(data.records.iter().filter_map(|r| clocked(r, group(r), step_s)).collect())
}

/// Resamples a record from its first smooth segment up to the first one that has too few samples. `None`
/// if the first segment has too few, or if fewer than two times result.
fn clocked(record: &Record, group: Option<String>, step_s: f64) -> Option<UniformRecord> {
    let data = &record.data;
    let channels = data.values.len();
    let mut curves: Vec<(f64, Vec<Curve>)> = Vec::new();
    let mut ends: Option<[f64; 2]> = None;
    for (until, samples) in stretches(record) {
        let segment_curves: Option<Vec<Curve>> =
            (0..channels).map(|c| Curve::through(record, c, samples.clone())).collect();
        let Some(segment_curves) = segment_curves else { break };
        let [begin, end] = [samples.start, samples.end - 1].map(|k| data.times[k]);
        ends = Some([ends.map_or(begin, |e| e[0]), end]);
        curves.push((until, segment_curves));
    }
    let [first, last] = ends?;
    // The tolerance of a millionth of a step includes the last sample.
    let count = ((last - first) / step_s + 1e-6).floor() as usize + 1;
    // Rounding to 1e-9 s gives decimal times for a decimal step.
    let times: Vec<f64> = (0..count).map(|k| ((first + k as f64 * step_s) * 1e9).round() / 1e9).collect();
    let value_and_rate = |c: usize, t: f64| {
        let place = curves.iter().position(|(until, _)| t < *until).unwrap_or(curves.len() - 1);
        curves[place].1[c].at(t)
    };
    let (mut values, mut rates) = (Vec::new(), Vec::new());
    for c in 0..channels {
        let (value, rate): (Vec<f64>, Vec<f64>) = times.iter().map(|&t| value_and_rate(c, t)).unzip();
        values.push(value);
        rates.push(rate);
    }
    (count >= 2).then(|| UniformRecord { id: data.id.clone(), group, times, values, rates })
}

/// Sample ranges of smooth motion, each with the time, s, at which it ends: at an event, or after the known
/// samples.
fn stretches(record: &Record) -> Vec<(f64, Range<usize>)> {
    let data = &record.data;
    let mut out = Vec::new();
    for (i, piece) in data.smooth_segments.iter().enumerate().filter(|(_, piece)| !piece.is_empty()) {
        let ends = data.times[piece.end - 1];
        let until = data.events.iter().map(|e| e.time).find(|&e| e >= ends).unwrap_or(f64::INFINITY);
        let cut = data.initial_sample_count;
        let far = piece.end.saturating_sub(cut) >= COEFFICIENTS.0 + 2;
        if i == 0 && piece.start < cut && cut < piece.end && far && cut - piece.start >= COEFFICIENTS.0 + 2 {
            out.push((data.times[cut], piece.start..cut));
            out.push((until, cut..piece.end));
        } else {
            out.push((until, piece.clone()));
        }
    }
    out
}

/// A polynomial in time that approximates one channel.
struct Curve {
    middle: f64,
    half: f64,
    coefficients: Vec<f64>,
}

impl Curve {
    /// Fits a polynomial through the measured samples of a channel by weighted least squares; `None` if they
    /// are too few.
    fn through(record: &Record, channel: usize, samples: Range<usize>) -> Option<Self> {
        let times = &record.data.times;
        let chosen: Vec<usize> = samples.filter(|&k| record.weight[channel][k] > 0.0).collect();
        let (&a, &b) = (chosen.first()?, chosen.last()?);
        let most = chosen.len().checked_sub(1)?.min(COEFFICIENTS.1);
        let n = (chosen.len() / SAMPLES_PER_COEFFICIENT).clamp(COEFFICIENTS.0.min(most), most);
        let (middle, half) = (0.5 * (times[a] + times[b]), (0.5 * (times[b] - times[a])).max(1e-9));
        let (mut h, mut g) = (Square::zero(n), vec![0.0; n]);
        for &k in &chosen {
            let u = (times[k] - middle) / half;
            let row: Vec<f64> = (0..n).map(|p| u.powi(p as i32)).collect();
            let weight = record.weight[channel][k].powi(2);
            for i in 0..n {
                g[i] += weight * row[i] * record.data.values[channel][k];
                (0..n).for_each(|j| *h.at_mut(i, j) += weight * row[i] * row[j]);
            }
        }
        h.cholesky().solve(&mut g);
        (n > 1).then_some(Curve { middle, half, coefficients: g })
    }

    /// Value and slope of the polynomial at time `t`, s.
    fn at(&self, t: f64) -> (f64, f64) {
        let u = (t - self.middle) / self.half;
        let rows = self.coefficients.iter().enumerate();
        rows.fold((0.0, 0.0), |(value, slope), (p, c)| {
            let below = if p == 0 { 0.0 } else { p as f64 * u.powi(p as i32 - 1) / self.half };
            (value + c * u.powi(p as i32), slope + c * below)
        })
    }
}

#[cfg(test)]
mod tests {
    //! Contract: between events values and rates are those of the motion; nothing is extrapolated where
    //! nothing was measured.
    use super::*;
    use augsim_system::{DetectedEvent, Record as SystemRecord};

    /// Record of a body that falls from 1 m and rebounds at 0.4 s, sampled every 9 to 13 ms. The samples `missing`
    /// have no measurement.
    fn record(missing: Range<usize>) -> Record {
        let turn = 0.4;
        let place = |t: f64| {
            if t < turn { 1.0 - 5.0 * t * t } else { 0.2 + 3.0 * (t - turn) - 5.0 * (t - turn).powi(2) }
        };
        let times: Vec<f64> = (0..70).map(|k| 0.011 * f64::from(k) + 0.002 * f64::from(k % 2)).collect();
        let split = times.iter().position(|&t| t > turn).expect("it is seen after the turn");
        let weight = (0..70).map(|k| if missing.contains(&k) { 0.0 } else { 1e3 }).collect();
        let data = SystemRecord {
            values: vec![times.iter().map(|&t| place(t)).collect()],
            smooth_segments: vec![0..split, split..70],
            events: vec![DetectedEvent { time: turn, value: 1.0 }],
            initial_sample_count: split,
            times,
            ..SystemRecord::default()
        };
        Record { weight: vec![weight], ..Record::unweighted(data) }
    }

    #[test]
    fn rates_are_correct_on_both_sides_of_an_event() {
        let made = clocked(&record(0..0), None, 0.01).expect("states");
        for (k, t) in made.times.iter().enumerate() {
            let want = if *t < 0.4 { -10.0 * t } else { 3.0 - 10.0 * (t - 0.4) };
            assert!((made.rates[0][k] - want).abs() < 1e-6, "at {t} s: {} and {want}", made.rates[0][k]);
        }
        assert!(made.times.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-9));
    }

    #[test]
    fn a_record_ends_before_a_segment_without_measurements() {
        let made = clocked(&record(38..70), None, 0.01).expect("states");
        assert!(made.times.last().is_some_and(|t| *t <= 0.4), "{:?}", made.times.last());
        assert!(clocked(&record(0..70), None, 0.01).is_none());
    }
}
