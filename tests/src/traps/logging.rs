//! Faults of logging: what becomes of a recording between the rig and the file.

use super::kinds::Logging;
use super::simulate::{LEAD, Plan};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Samples between the readings that a resampled column is interpolated from.
const RESAMPLED: usize = 6;
/// Half the number of samples that a smoothed reading is fitted to, without the middle one.
const HALF_WINDOW: usize = 5;

/// Rows of one recording as they are written.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Stamps, in s if the log is right.
    pub times: Vec<f64>,
    /// Logged inputs.
    pub inputs: Vec<f64>,
    /// Readings, column by column; NaN is an empty cell.
    pub outputs: Vec<Vec<f64>>,
}

/// Outputs of a sensor that settles with a time constant of four samples and begins settled. Between rows its input is taken as
/// straight, for which the answer is exact.
pub fn settling(values: &[f64]) -> Vec<f64> {
    const SAMPLES: f64 = 4.0;
    let forgets = (-1.0 / SAMPLES).exp();
    let mut shown = values[0];
    let step = |pair: &[f64]| {
        let slope = pair[1] - pair[0];
        // Behind a ramp the sensor lags by its slope times the time constant.
        shown = pair[1] - slope * SAMPLES + (shown - pair[0] + slope * SAMPLES) * forgets;
        shown
    };
    std::iter::once(values[0]).chain(values.windows(2).map(step)).collect()
}

/// Inputs as they are logged `late` samples late.
pub fn late_inputs(plan: &Plan, late: isize) -> Vec<f64> {
    let at = |k: usize| (LEAD + k).checked_add_signed(-late).and_then(|row| plan.levels.get(row));
    (0..plan.times.len()).map(|k| at(k).copied().unwrap_or(f64::NAN)).collect()
}

/// Applies a fault to the recordings of a set.
pub fn spoil(recordings: &mut Vec<Recording>, fault: Logging, rng: &mut Xoshiro256PlusPlus) {
    let one = rng.random_range(0..recordings.len());
    let scale = |values: &mut Vec<f64>, by: f64| values.iter_mut().for_each(|value| *value *= by);
    match fault {
        Logging::SignInOne => scale(&mut recordings[one].inputs, -1.0),
        Logging::MillisecondsInOne => scale(&mut recordings[one].times, 1e3),
        Logging::ThousandInOne => scale(&mut recordings[one].outputs[0], 1e3),
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

/// Joins every two recordings to one whose clock runs on by the step between its first rows.
fn join_pairs(recordings: &mut Vec<Recording>) {
    let join = |pair: &[Recording]| {
        let mut joined = pair[0].clone();
        for next in &pair[1..] {
            let by = joined.times[joined.times.len() - 1] + joined.times[1] - joined.times[0];
            joined.times.extend(next.times.iter().map(|time| time + by));
            joined.inputs.extend(&next.inputs);
            joined.outputs.iter_mut().zip(&next.outputs).for_each(|(y, next)| y.extend(next));
        }
        joined
    };
    *recordings = recordings.chunks(2).map(join).collect();
}

/// Makes three readings of the first output 1000 times too large, as if each had lost its point before three decimals.
fn lose_decimals(recordings: &mut [Recording], rng: &mut Xoshiro256PlusPlus) {
    for _ in 0..3 {
        let one = rng.random_range(0..recordings.len());
        let column = &mut recordings[one].outputs[0];
        // The first rows hold the initial state, and a recording that begins wrongly is another fault.
        let row = rng.random_range(10..column.len());
        column[row] *= 1e3;
    }
}

/// Quadratic Savitzky-Golay filter; the window shrinks towards the ends.
fn smoothed(values: &[f64]) -> Vec<f64> {
    let at = |k: usize| {
        let m = HALF_WINDOW.min(k).min(values.len() - 1 - k);
        let width = m as f64;
        let norm = (2.0 * width + 3.0) * (2.0 * width + 1.0) * (2.0 * width - 1.0) / 3.0;
        let weight = |i: f64| (3.0 * width * width + 3.0 * width - 1.0 - 5.0 * i * i) / norm;
        (k - m..=k + m).map(|row| weight(row as f64 - k as f64) * values[row]).sum()
    };
    (0..values.len()).map(at).collect()
}

/// Every [`RESAMPLED`]-th reading and straight lines between these; behind the last one its value.
fn resampled(values: &[f64]) -> Vec<f64> {
    let at = |k: usize| {
        let before = k / RESAMPLED * RESAMPLED;
        let after = values.get(before + RESAMPLED).unwrap_or(&values[before]);
        values[before] + (after - values[before]) * (k - before) as f64 / RESAMPLED as f64
    };
    (0..values.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: each fault changes the recordings as its name says, and nothing else of them.
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
        let bent = ramp.iter().map(|x| 1.0 + x * x).collect();
        let one = Recording { times: ramp.clone(), inputs: vec![2.0; 40], outputs: vec![bent, ramp] };
        vec![one; 4]
    }

    fn spoilt(fault: Logging) -> Vec<Recording> {
        let mut all = recordings();
        spoil(&mut all, fault, &mut random_stream(3, "trap logging test", 0));
        all
    }

    #[test]
    fn a_late_input_shows_earlier_levels() {
        let plan = plan();
        for late in [-4_isize, 0, 1, 4] {
            let logged = late_inputs(&plan, late);
            let expected = |k: usize| (LEAD + k) as f64 - late as f64;
            assert!(logged.iter().enumerate().all(|(k, u)| *u == expected(k)), "{late}");
        }
    }

    #[test]
    fn faults_of_one_recording_leave_the_others() {
        let (right, faults) = (
            recordings(),
            [spoilt(Logging::SignInOne), spoilt(Logging::MillisecondsInOne), spoilt(Logging::ThousandInOne)],
        );
        for all in faults {
            let differs = |(a, b): (&Recording, &Recording)| {
                a.times != b.times || a.inputs != b.inputs || a.outputs != b.outputs
            };
            assert_eq!(all.iter().zip(&right).filter(|pair| differs(*pair)).count(), 1);
        }
    }

    #[test]
    fn joined_recordings_have_a_clock_that_runs_on() {
        let all = spoilt(Logging::Concatenated);
        assert_eq!(all.len(), 2);
        assert_eq!(all[0].times, (0..80).map(f64::from).collect::<Vec<_>>());
        assert_eq!((all[0].inputs.len(), all[0].outputs[1].len()), (80, 80));
    }

    #[test]
    fn three_readings_lose_their_point() {
        let (right, all) = (recordings(), spoilt(Logging::MissingDecimal));
        let cells = right.iter().zip(&all).flat_map(|(a, b)| a.outputs[0].iter().zip(&b.outputs[0]));
        assert_eq!(cells.filter(|(a, b)| *b / *a > 900.0).count(), 3);
    }

    #[test]
    fn a_filter_keeps_a_parabola_and_quietens_noise() {
        let y = &recordings()[0].outputs[0];
        assert!(smoothed(y).iter().zip(y).all(|(a, b)| (a - b).abs() < 1e-9 * b));
        let jagged: Vec<f64> = (0..40).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!(smoothed(&jagged)[10..30].iter().all(|y| y.abs() < 0.4));
    }

    #[test]
    fn resampled_readings_lie_on_lines() {
        let y = &recordings()[0].outputs[0];
        let lines = resampled(y);
        assert_eq!((lines[0], lines[6], lines[12]), (y[0], y[6], y[12]));
        assert_eq!(lines[3], 0.5 * (y[0] + y[6]));
    }

    #[test]
    fn a_settling_sensor_lags_a_ramp_by_its_time_constant() {
        let shown = settling(&recordings()[0].outputs[1]);
        assert_eq!(shown[0], 0.0);
        assert!((shown[39] - (39.0 - 4.0)).abs() < 1e-3, "{}", shown[39]);
    }
}
