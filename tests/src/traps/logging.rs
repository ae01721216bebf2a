//! Logging faults: changes of a recording between the rig and the data file.

use super::kinds::Logging;
use super::simulate::{MARGIN_SAMPLES, Plan};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Number of samples between the measured values that a resampled column interpolates.
const RESAMPLING_INTERVAL: usize = 6;
/// Half width of the smoothing window, samples, without the middle sample.
const HALF_WINDOW: usize = 5;

/// Rows of one recording as they are logged in the data file.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Time stamps of the rows, s unless the clock is faulty.
    pub times: Vec<f64>,
    /// Logged input of each row.
    pub inputs: Vec<f64>,
    /// Measured values, column by column; NaN is an empty cell.
    pub outputs: Vec<Vec<f64>>,
}

/// Outputs of a sensor with a time constant of four samples, settled at the start.
///
/// The solution is exact for an input that is linear between rows.
pub fn settling_sensor(values: &[f64]) -> Vec<f64> {
    const SAMPLES: f64 = 4.0;
    let decay = (-1.0 / SAMPLES).exp();
    let mut shown = values[0];
    let step = |pair: &[f64]| {
        let slope = pair[1] - pair[0];
        // For a ramp the sensor lags by slope times time constant.
        shown = pair[1] - slope * SAMPLES + (shown - pair[0] + slope * SAMPLES) * decay;
        shown
    };
    std::iter::once(values[0]).chain(values.windows(2).map(step)).collect()
}

/// Logged inputs of a recording, `late` samples after they acted (before if negative).
pub fn late_inputs(plan: &Plan, late: isize) -> Vec<f64> {
    let level_at =
        |k: usize| (MARGIN_SAMPLES + k).checked_add_signed(-late).and_then(|row| plan.levels.get(row));
    (0..plan.times.len()).map(|k| level_at(k).copied().unwrap_or(f64::NAN)).collect()
}

/// Applies a logging fault to the recordings of a set.
pub fn apply_fault(recordings: &mut Vec<Recording>, fault: Logging, rng: &mut Xoshiro256PlusPlus) {
    let affected = rng.random_range(0..recordings.len());
    let scale = |values: &mut Vec<f64>, by: f64| values.iter_mut().for_each(|value| *value *= by);
    match fault {
        Logging::SignInOne => scale(&mut recordings[affected].inputs, -1.0),
        Logging::MillisecondsInOne => scale(&mut recordings[affected].times, 1e3),
        Logging::ThousandInOne => scale(&mut recordings[affected].outputs[0], 1e3),
        Logging::Concatenated => join_pairs(recordings),
        Logging::MissingDecimal => lose_decimals(recordings, rng),
        _ => recordings.iter_mut().for_each(|recording| match fault {
            Logging::Duplicate => recording.outputs[1] = recording.outputs[0].clone(),
            Logging::Swapped => recording.outputs.swap(0, 1),
            Logging::Kilo => scale(&mut recording.inputs, 1e-3),
            Logging::SignReversed => scale(&mut recording.inputs, -1.0),
            Logging::Minutes => scale(&mut recording.times, 1.0 / 60.0),
            Logging::Smoothed => recording.outputs.iter_mut().for_each(|y| *y = smoothed(y)),
            Logging::Resampled => recording.outputs.iter_mut().for_each(|y| *y = resampled(y)),
            _ => {}
        }),
    }
}

/// Joins recordings in pairs; the clock of the second continues by the sampling interval.
fn join_pairs(recordings: &mut Vec<Recording>) {
    let join = |pair: &[Recording]| {
        let mut joined = pair[0].clone();
        for next in &pair[1..] {
            let time_shift = joined.times[joined.times.len() - 1] + joined.times[1] - joined.times[0];
            joined.times.extend(next.times.iter().map(|time| time + time_shift));
            joined.inputs.extend(&next.inputs);
            joined.outputs.iter_mut().zip(&next.outputs).for_each(|(y, next)| y.extend(next));
        }
        joined
    };
    *recordings = recordings.chunks(2).map(join).collect();
}

/// Makes three values of the first output 1000 times too large, as if the decimal point were lost.
fn lose_decimals(recordings: &mut [Recording], rng: &mut Xoshiro256PlusPlus) {
    for _ in 0..3 {
        let affected = rng.random_range(0..recordings.len());
        let column = &mut recordings[affected].outputs[0];
        // The first rows determine the initial state; a wrong initial state would be another fault.
        let row = rng.random_range(10..column.len());
        column[row] *= 1e3;
    }
}

/// Applies a quadratic Savitzky-Golay filter; the window shrinks towards the ends.
fn smoothed(values: &[f64]) -> Vec<f64> {
    let smoothed_at = |k: usize| {
        let m = HALF_WINDOW.min(k).min(values.len() - 1 - k);
        let width = m as f64;
        let norm = (2.0 * width + 3.0) * (2.0 * width + 1.0) * (2.0 * width - 1.0) / 3.0;
        let weight = |i: f64| (3.0 * width * width + 3.0 * width - 1.0 - 5.0 * i * i) / norm;
        (k - m..=k + m).map(|row| weight(row as f64 - k as f64) * values[row]).sum()
    };
    (0..values.len()).map(smoothed_at).collect()
}

/// Keeps every [`RESAMPLING_INTERVAL`]-th value and interpolates linearly; constant after the last one.
fn resampled(values: &[f64]) -> Vec<f64> {
    let value_at = |k: usize| {
        let before = k / RESAMPLING_INTERVAL * RESAMPLING_INTERVAL;
        let after = values.get(before + RESAMPLING_INTERVAL).unwrap_or(&values[before]);
        values[before] + (after - values[before]) * (k - before) as f64 / RESAMPLING_INTERVAL as f64
    };
    (0..values.len()).map(value_at).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: each fault changes recordings as its name says, and nothing else.
    use super::*;
    use augsim_data::random_stream;

    fn plan() -> Plan {
        Plan {
            start: [0.0; 3],
            levels: (0..60).map(f64::from).collect(),
            times: (0..40).map(f64::from).collect(),
        }
    }

    fn recordings() -> Vec<Recording> {
        let ramp: Vec<f64> = (0..40).map(f64::from).collect();
        let parabola = ramp.iter().map(|x| 1.0 + x * x).collect();
        let recording =
            Recording { times: ramp.clone(), inputs: vec![2.0; 40], outputs: vec![parabola, ramp] };
        vec![recording; 4]
    }

    fn with_fault(fault: Logging) -> Vec<Recording> {
        let mut all = recordings();
        apply_fault(&mut all, fault, &mut random_stream(3, "trap logging test", 0));
        all
    }

    #[test]
    fn a_late_input_shows_earlier_levels() {
        let plan = plan();
        for late in [-4_isize, 0, 1, 4] {
            let logged = late_inputs(&plan, late);
            let expected = |k: usize| (MARGIN_SAMPLES + k) as f64 - late as f64;
            assert!(logged.iter().enumerate().all(|(k, u)| *u == expected(k)), "{late}");
        }
    }

    #[test]
    fn faults_of_one_recording_do_not_change_the_others() {
        let (right, faults) = (
            recordings(),
            [
                with_fault(Logging::SignInOne),
                with_fault(Logging::MillisecondsInOne),
                with_fault(Logging::ThousandInOne),
            ],
        );
        for all in faults {
            let differs = |(a, b): (&Recording, &Recording)| {
                a.times != b.times || a.inputs != b.inputs || a.outputs != b.outputs
            };
            assert_eq!(all.iter().zip(&right).filter(|pair| differs(*pair)).count(), 1);
        }
    }

    #[test]
    fn joined_recordings_have_a_continuous_clock() {
        let all = with_fault(Logging::Concatenated);
        assert_eq!(all.len(), 2);
        assert_eq!(all[0].times, (0..80).map(f64::from).collect::<Vec<_>>());
        assert_eq!((all[0].inputs.len(), all[0].outputs[1].len()), (80, 80));
    }

    #[test]
    fn three_values_lose_their_decimal_point() {
        let (right, all) = (recordings(), with_fault(Logging::MissingDecimal));
        let cells = right.iter().zip(&all).flat_map(|(a, b)| a.outputs[0].iter().zip(&b.outputs[0]));
        assert_eq!(cells.filter(|(a, b)| *b / *a > 900.0).count(), 3);
    }

    #[test]
    fn the_filter_keeps_a_parabola_and_reduces_noise() {
        let y = &recordings()[0].outputs[0];
        assert!(smoothed(y).iter().zip(y).all(|(a, b)| (a - b).abs() < 1e-9 * b));
        let jagged: Vec<f64> = (0..40).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!(smoothed(&jagged)[10..30].iter().all(|y| y.abs() < 0.4));
    }

    #[test]
    fn resampled_values_are_interpolated_linearly() {
        let y = &recordings()[0].outputs[0];
        let lines = resampled(y);
        assert_eq!((lines[0], lines[6], lines[12]), (y[0], y[6], y[12]));
        assert_eq!(lines[3], 0.5 * (y[0] + y[6]));
    }

    #[test]
    fn a_settling_sensor_lags_a_ramp_by_its_time_constant() {
        let shown = settling_sensor(&recordings()[0].outputs[1]);
        assert_eq!(shown[0], 0.0);
        assert!((shown[39] - (39.0 - 4.0)).abs() < 1e-3, "{}", shown[39]);
    }
}
