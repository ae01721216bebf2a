//! Contract: a calibration finds what the data say, window by window with starts of their own, whatever the threads; it says
//! which parameters cannot be told apart, which stand at a bound, and where longer windows are beyond the model. The scene is
//! a drift `y = x0 + a t`: with one start for each window the least-squares slope has a closed form, and so has its error.

use augsim_calibrate::{Calibration, calibrate, fit_start};
use augsim_physics::system::{Record, System};
use augsim_written::{WrittenSystem, model};

fn drift(rate: &str, parameters: &str) -> String {
    format!(
        "scenario = \"system\"\n[states]\nx_m = {{ start = \"y_m\" }}\n[parameters]\n{parameters}\n[rates]\nx_m = \"{rate}\"\n\
         [outputs]\ny_m = {{ value = \"x_m\", sd = \"estimate\" }}\n"
    )
}

const SLOPE: &str = "a_m_s = { nominal = 0.0, min = -10.0, max = 10.0 }";

/// A small number without a pattern.
fn noise(k: usize) -> f64 {
    let x = (k as f64 * 12.9898 + 4.1).sin() * 43758.5453;
    x - x.floor() - 0.5
}

fn record(y: impl Fn(f64, usize) -> f64) -> Record {
    let times: Vec<f64> = (0..160).map(|k| 0.1 * k as f64).collect();
    // Windows share the sample at 7.9 s between them: what jumps there has no measured sample on both sides.
    let values = times.iter().enumerate().map(|(k, t)| if k == 79 { f64::NAN } else { y(*t, k) }).collect();
    Record { id: "1".into(), times, values: vec![values], ..Record::default() }
}

/// Calibrates on windows of two seconds, or on those that they grow to.
fn fitted(text: &str, record: &Record, longest_s: Option<f64>) -> Calibration {
    let model = model::parse(text, "drift.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = WrittenSystem::declared_only(&model).expect("a system").with_windows(Some(2.0));
    let mut record = record.clone();
    system.prepare(&mut record, &[]).expect("a record");
    calibrate(&system, &[record], longest_s).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_slope_with_a_start_for_each_window_is_that_of_least_squares() {
    let record = record(|t, k| 0.7 * t + 0.2 * noise(k) + f64::from(u8::from(t > 7.9)));
    let found = fitted(&drift("a_m_s", SLOPE), &record, Some(3.0));
    let count = found.stages[0].windows;
    assert_eq!((count, found.stages.len()), (8, 1));
    // Windows share the sample between them, as those of the fit do.
    let (mut above, mut below) = (0.0, 0.0);
    for window in 0..count {
        let first = 159 * window / count;
        let samples = first..=(159 * (window + 1) / count);
        let ends: Vec<usize> = samples.filter(|k| *k != 79).collect();
        let n = ends.len() as f64;
        let t = ends.iter().map(|k| record.times[*k]).sum::<f64>() / n;
        let y = ends.iter().map(|k| record.values[0][*k]).sum::<f64>() / n;
        above += ends.iter().map(|k| (record.times[*k] - t) * (record.values[0][*k] - y)).sum::<f64>();
        below += ends.iter().map(|k| (record.times[*k] - t).powi(2)).sum::<f64>();
    }
    let slope = above / below;
    assert!((found.values[0] - slope).abs() < 2e-3, "{} and {slope}", found.values[0]);
    let error = found.standard_errors[0].expect("fitted");
    let expected = found.rms()[0] / below.sqrt();
    assert!((0.7..1.6).contains(&(error / expected)), "{error} and {expected}");
}

#[test]
fn one_wild_sample_moves_little() {
    let [clean, wild] =
        [0.0, 40.0].map(|by| record(move |t, k| 0.7 * t + 0.2 * noise(k) + if k == 76 { by } else { 0.0 }));
    let [clean, wild] = [clean, wild].map(|r| fitted(&drift("a_m_s", SLOPE), &r, None).values[0]);
    // Least squares would move by 40 (7.6 - 6.9) / (160 * 21.3) = 3e-3, and by a hundred times that at an end.
    assert!((clean - wild).abs() < 1e-3, "{clean} and {wild}");
}

#[test]
fn parameters_that_only_act_together_are_named() {
    let two =
        "a = { nominal = 1.0, min = -10.0, max = 10.0 }\nb_m_s = { nominal = 0.5, min = -10.0, max = 10.0 }";
    let found = fitted(&drift("a * b_m_s", two), &record(|t, k| 0.7 * t + 0.01 * noise(k)), None);
    assert_eq!(found.gauges.len(), 1);
    assert_eq!((&found.gauges[0].parameters[..], found.gauges[0].combinations), (&[0, 1][..], 1));
    assert!((found.values[0] * found.values[1] - 0.7).abs() < 1e-3);
    assert!(fitted(&drift("a_m_s", SLOPE), &record(|t, _| t), None).gauges.is_empty());
}

#[test]
fn a_parameter_stays_within_its_bounds() {
    let bounded = "a_m_s = { nominal = 0.1, min = 0.0, max = 0.5 }";
    let found = fitted(&drift("a_m_s", bounded), &record(|t, k| 0.7 * t + 0.01 * noise(k)), None);
    assert_eq!((found.values[0], found.at_bound[0]), (0.5, true));
}

#[test]
fn windows_stop_growing_where_the_model_does_not_follow() {
    // A jump of the level, which only the window across it sees: the others have starts of their own.
    let bent = record(|t, k| 0.7 * t + if t > 7.9 { 5.0 } else { 0.0 } + 1e-3 * noise(k));
    let found = fitted(&drift("a_m_s", SLOPE), &bent, None);
    assert_eq!(found.stages.last().map(|s| s.windows), Some(2), "{:?}", found.stages);
    assert!(found.stopped.is_some() && (found.values[0] - 0.7).abs() < 1e-3);
    let straight = record(|t, k| 0.7 * t + 1e-3 * noise(k));
    let found = fitted(&drift("a_m_s", SLOPE), &straight, None);
    assert_eq!((found.stopped, found.stages.last().map(|s| s.windows)), (None, Some(1)));
}

#[test]
fn threads_change_no_bit() {
    let record = record(|t, k| 0.7 * t + 0.2 * noise(k));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| fitted(&drift("a_m_s", SLOPE), &record, None))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_start_is_found_from_the_first_samples_alone() {
    let text = drift("a_m_s", SLOPE);
    let model = model::parse(&text, "drift.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = WrittenSystem::declared_only(&model).expect("a system");
    let mut seen = record(|t, k| if k < 6 { 2.0 + 0.5 * t + [0.1, -0.1][k % 2] } else { 1e3 });
    system.prepare(&mut seen, &[]).expect("a record");
    let begun = fit_start(&system, &seen, 6, &[0.5], &[0.0], &[]).unwrap_or_else(|e| panic!("{e}"));
    assert!((begun.state[0] - 2.0).abs() < 1e-9, "{:?}", begun.state);
    assert!((begun.rms[0] - 0.1).abs() < 1e-9, "{:?}", begun.rms);
}
