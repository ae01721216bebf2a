//! Contract: a calibration equals the least-squares solution over windows with initial states of their own,
//! for any number of threads; it reports gauges, parameters at a bound, and why windows did not grow. The
//! system is a drift `y = x0 + a t`: with one x0 per window the least-squares slope and its standard error
//! have closed forms.

use augsim_equations::{EquationSystem, model};
use augsim_fit::{Calibration, PerGroup, calibrate, estimate_initial_state};
use augsim_system::{Prepare, Record};

fn drift_model(rate: &str, parameters: &str) -> String {
    format!(
        "scenario = \"system\"\n[states]\nx_m = {{ start = \"y_m\" }}\n[parameters]\n{parameters}\n[rates]\nx_m = \"{rate}\"\n\
         [outputs]\ny_m = {{ value = \"x_m\", sd = \"estimate\" }}\n"
    )
}

const SLOPE: &str = "a_m_s = { nominal = 0.0, min = -10.0, max = 10.0 }";

/// Returns a pseudo-random number in [-0.5, 0.5) that depends only on `k`.
fn pseudo_random(k: usize) -> f64 {
    let x = (k as f64 * 12.9898 + 4.1).sin() * 43758.5453;
    x - x.floor() - 0.5
}

fn record(y: impl Fn(f64, usize) -> f64) -> Record {
    let times: Vec<f64> = (0..160).map(|k| 0.1 * k as f64).collect();
    // Two windows share the sample at 7.9 s. Some tests let the data jump there, so it is not measured.
    let values = times.iter().enumerate().map(|(k, t)| if k == 79 { f64::NAN } else { y(*t, k) }).collect();
    Record { id: "1".into(), times, values: vec![values], ..Record::default() }
}

/// Calibrates a model on windows of 2 s, which grow to at most `longest_s` seconds.
fn calibrate_drift(text: &str, record: &Record, longest_s: Option<f64>) -> Calibration {
    let model = model::parse(text, "drift.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = EquationSystem::declared_only(&model).expect("a system").with_windows(Some(2.0));
    let mut record = record.clone();
    system.prepare(&mut record, &[]).expect("a record");
    calibrate(&system, &[record], longest_s, None).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn slope_and_standard_error_equal_least_squares_with_one_intercept_per_window() {
    let record = record(|t, k| 0.7 * t + 0.2 * pseudo_random(k) + f64::from(u8::from(t > 7.9)));
    let found = calibrate_drift(&drift_model("a_m_s", SLOPE), &record, Some(3.0));
    let count = found.stages[0].windows;
    assert_eq!((count, found.stages.len()), (8, 1));
    // Neighbouring windows share one sample, as those of the calibration do.
    let (mut covariance, mut variance) = (0.0, 0.0);
    for window in 0..count {
        let first = 159 * window / count;
        let samples = first..=(159 * (window + 1) / count);
        let measured: Vec<usize> = samples.filter(|k| *k != 79).collect();
        let n = measured.len() as f64;
        let t = measured.iter().map(|k| record.times[*k]).sum::<f64>() / n;
        let y = measured.iter().map(|k| record.values[0][*k]).sum::<f64>() / n;
        covariance +=
            measured.iter().map(|k| (record.times[*k] - t) * (record.values[0][*k] - y)).sum::<f64>();
        variance += measured.iter().map(|k| (record.times[*k] - t).powi(2)).sum::<f64>();
    }
    let slope = covariance / variance;
    assert!((found.values[0] - slope).abs() < 2e-3, "{} and {slope}", found.values[0]);
    let error = found.standard_errors[0].expect("fitted");
    let expected = found.rmse()[0] / variance.sqrt();
    assert!((0.7..1.6).contains(&(error / expected)), "{error} and {expected}");
}

#[test]
fn one_outlier_hardly_changes_the_estimate() {
    let [clean, outlier] = [0.0, 40.0].map(|error| {
        record(move |t, k| 0.7 * t + 0.2 * pseudo_random(k) + if k == 76 { error } else { 0.0 })
    });
    let [clean, outlier] =
        [clean, outlier].map(|r| calibrate_drift(&drift_model("a_m_s", SLOPE), &r, None).values[0]);
    // Without the robust cost the slope would change by 40 (7.6 - 6.9) / (160 * 21.3) = 8e-3.
    assert!((clean - outlier).abs() < 1e-3, "{clean} and {outlier}");
}

#[test]
fn parameters_that_act_only_as_a_product_are_a_gauge() {
    let two =
        "a = { nominal = 1.0, min = -10.0, max = 10.0 }\nb_m_s = { nominal = 0.5, min = -10.0, max = 10.0 }";
    let found = calibrate_drift(
        &drift_model("a * b_m_s", two),
        &record(|t, k| 0.7 * t + 0.01 * pseudo_random(k)),
        None,
    );
    assert_eq!(found.gauges.len(), 1);
    assert_eq!((&found.gauges[0].parameters[..], found.gauges[0].combinations), (&[0, 1][..], 1));
    assert!((found.values[0] * found.values[1] - 0.7).abs() < 1e-3);
    assert!(calibrate_drift(&drift_model("a_m_s", SLOPE), &record(|t, _| t), None).gauges.is_empty());
}

/// Record of a free oscillation, computed from its closed form, with noise of 2 mm.
fn free_oscillation() -> Record {
    let times: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
    let exact = |t: f64| 0.2 * (-0.45 * t).exp() * (8.5 * t).cos();
    let values = times.iter().enumerate().map(|(k, t)| exact(*t) + 0.002 * pseudo_random(k)).collect();
    Record { id: "1".into(), times, values: vec![values], ..Record::default() }
}

#[test]
fn a_gauge_names_every_parameter_that_it_moves() {
    // Mass, stiffness and damping scale together; the data depend on the damping much less than on the others.
    let text = "scenario = \"system\"\n[states]\nx_m = { start = \"position_m\" }\n\
                v_m_s = { start = \"slope(position_m)\" }\n[parameters]\n\
                mass_kg = { nominal = 1.0, min = 0.1, max = 10.0 }\n\
                stiffness_N_per_m = { nominal = 80.0, min = 0.0, max = 1e4 }\n\
                damping_N_s_per_m = { nominal = 1.0, min = 0.0, max = 100.0 }\n[rates]\nx_m = \"v_m_s\"\n\
                v_m_s = \"-(stiffness_N_per_m * x_m + damping_N_s_per_m * v_m_s) / mass_kg\"\n\
                [outputs]\nposition_m = { value = \"x_m\", sd = \"estimate\" }\n";
    let found = calibrate_drift(text, &free_oscillation(), None);
    assert_eq!(found.gauges.len(), 1);
    assert_eq!((&found.gauges[0].parameters[..], found.gauges[0].combinations), (&[0, 1, 2][..], 2));
    let frozen = text.replace("min = 0.1, max = 10.0 }", "frozen = true }");
    let found = calibrate_drift(&frozen, &free_oscillation(), None);
    assert!(found.gauges.is_empty(), "{:?}", found.gauges);
    let [value, error] = [found.values[2], found.standard_errors[2].expect("an error")];
    assert!((value - 0.9).abs() < 3.0 * error && error < 0.05, "{value} +- {error}");
}

/// Record of a bead's temperature between a block and a room, simulated with small Euler steps. Bead and
/// block begin at the same temperature.
fn bead() -> Record {
    let (mut bead, mut block, mut values) = (2.0, 2.0, Vec::new());
    for k in 0..160 {
        values.push(bead + 0.01 * pseudo_random(k));
        for _ in 0..2000 {
            let (a, b) = ((24.0 - bead) / 4.5 + (block - bead) / 6.0, (24.0 - block) / 26.0);
            (bead, block) = (bead + 0.1 / 2000.0 * a, block + 0.1 / 2000.0 * b);
        }
    }
    let times = (0..160).map(|k| 0.1 * f64::from(k)).collect();
    Record { id: "1".into(), times, values: vec![values], ..Record::default() }
}

fn calibrate_bead(start_of_block: &str) -> Calibration {
    let text = format!(
        "scenario = \"system\"\n[states]\ntemp_K = {{ start = \"temp_K\" }}\nblock_K = {{ {start_of_block} }}\n\
         [parameters]\nta_s = {{ nominal = 5.0, min = 0.1, max = 300.0 }}\n\
         tb_s = {{ nominal = 5.0, min = 0.1, max = 300.0 }}\ntc_s = {{ nominal = 30.0, min = 0.1, max = 300.0 }}\n\
         room_K = {{ nominal = 22.0, min = 0.0, max = 60.0 }}\n[rates]\n\
         temp_K = \"(room_K - temp_K) / tb_s + (block_K - temp_K) / ta_s\"\n\
         block_K = \"(room_K - block_K) / tc_s\"\n\
         [outputs]\ntemp_K = {{ value = \"temp_K\", sd = \"estimate\" }}\n"
    );
    calibrate_drift(&text, &bead(), None)
}

#[test]
fn a_prior_of_a_start_identifies_what_depends_on_it() {
    let free = calibrate_bead("start = \"temp_K\"");
    assert_eq!(free.gauges.first().map(|g| &g.parameters[..]), Some(&[0, 1][..]), "{:?}", free.gauges);
    let priors = ["start = 2.0, sd = 0.001", "start = \"temp_K\", sd = 0.001", "start = 2.0, sd = 1e-6"];
    for start in priors.into_iter().chain(["start = \"1.0 * temp_K\", sd = 0.001"]) {
        let found = calibrate_bead(start);
        assert!(found.gauges.is_empty(), "{start}: {:?}", found.gauges);
        let [value, error] = [found.values[0], found.standard_errors[0].expect("an error")];
        assert!((value - 6.0).abs() < 4.0 * error && error < 0.5, "{start}: {value} +- {error}");
    }
}

#[test]
fn a_prior_about_a_parameter_moves_with_the_parameter() {
    // The block begins at the temperature of the room, which is declared 2 K too low.
    let found = calibrate_bead("start = \"room_K - 22.0\", sd = 0.001");
    let [room, start] = [found.values[3], found.initial_states[0].0[1]];
    assert!((room - 22.0 - start).abs() < 0.01 && (room - 24.0).abs() < 0.5, "{room} {start}");
}

#[test]
fn parameters_stay_within_their_bounds() {
    let bounded = "a_m_s = { nominal = 0.1, min = 0.0, max = 0.5 }";
    let found = calibrate_drift(
        &drift_model("a_m_s", bounded),
        &record(|t, k| 0.7 * t + 0.01 * pseudo_random(k)),
        None,
    );
    assert_eq!((found.values[0], found.at_bound[0]), (0.5, true));
}

#[test]
fn windows_stop_growing_where_the_model_does_not_follow_the_data() {
    // A jump of the level disturbs only the window that contains it: the others have initial states of their
    // own.
    let jump = record(|t, k| 0.7 * t + if t > 7.9 { 5.0 } else { 0.0 } + 1e-3 * pseudo_random(k));
    let found = calibrate_drift(&drift_model("a_m_s", SLOPE), &jump, None);
    assert_eq!(found.stages.last().map(|s| s.windows), Some(2), "{:?}", found.stages);
    assert!(found.stopped.is_some() && (found.values[0] - 0.7).abs() < 1e-3);
    let straight = record(|t, k| 0.7 * t + 1e-3 * pseudo_random(k));
    let found = calibrate_drift(&drift_model("a_m_s", SLOPE), &straight, None);
    assert_eq!((found.stopped, found.stages.last().map(|s| s.windows)), (None, Some(1)));
}

#[test]
fn result_does_not_depend_on_the_number_of_threads() {
    let record = record(|t, k| 0.7 * t + 0.2 * pseudo_random(k));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| calibrate_drift(&drift_model("a_m_s", SLOPE), &record, None))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn initial_state_depends_on_the_first_samples_only() {
    let text = drift_model("a_m_s", SLOPE);
    let model = model::parse(&text, "drift.toml").unwrap_or_else(|e| panic!("{e}"));
    let system = EquationSystem::declared_only(&model).expect("a system");
    let mut data = record(|t, k| if k < 6 { 2.0 + 0.5 * t + [0.1, -0.1][k % 2] } else { 1e3 });
    system.prepare(&mut data, &[]).expect("a record");
    let start =
        estimate_initial_state(&system, &data, 6, &[0.5], &[0.0], &[]).unwrap_or_else(|e| panic!("{e}"));
    assert!((start.state[0] - 2.0).abs() < 1e-9, "{:?}", start.state);
    assert!((start.rmse[0] - 0.1).abs() < 1e-9, "{:?}", start.rmse);
}

#[test]
fn every_group_gets_the_slope_of_its_own_records() {
    let model = model::parse(
        &drift_model("a_m_s + b_m_s", &format!("{SLOPE}\nb_m_s = {{ nominal = 0.3, frozen = true }}")),
        "drift.toml",
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let system = EquationSystem::declared_only(&model).expect("a system").with_windows(Some(2.0));
    let of_group = |group: usize, slope: f64| {
        let mut record = record(|t, k| slope * t + 0.2 * pseudo_random(k));
        record.group = group;
        system.prepare(&mut record, &[]).expect("a record");
        record
    };
    let names: Vec<String> = ["first", "second", "absent"].map(str::to_owned).to_vec();
    let records = [of_group(0, 0.7), of_group(1, -0.4)];
    let per_group = PerGroup::new(&system, &[0], &names, &records);
    let found = per_group.collected(calibrate(&per_group, &records, Some(3.0), None).expect("a fit"));
    let groups = &found.groups[0];
    // Each group alone gives the same slope and, with a noise of its own, nearly the same standard error.
    for (group, record) in records.iter().enumerate() {
        let alone = calibrate(&system, std::slice::from_ref(record), Some(3.0), None).expect("a fit");
        assert!((groups.values[group] - alone.values[0]).abs() < 1e-6, "{groups:?}");
        let ratio =
            groups.standard_errors[group].zip(alone.standard_errors[0]).map_or(f64::NAN, |(a, b)| a / b);
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
    }
    assert_eq!(
        (groups.parameter, groups.values[2], groups.standard_errors[2]),
        (0, 0.0, None),
        "the absent group"
    );
    let mean = groups.values.iter().sum::<f64>() / 3.0;
    assert_eq!((found.values.clone(), found.standard_errors[0]), (vec![mean, 0.3], None));
}
