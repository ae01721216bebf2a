//! Contract: the time and the units of a table are read alike by every reader; what cannot be read is refused with
//! the unit that it names.

use augsim_data::{DataError, Dataset, MissingCells, NamedCsv, Unit, read_dataset};
use std::path::Path;

/// Reads the columns `wanted` (name, unit) of a file with the content `text`, as a model of equations does.
fn named(text: &str, time: Option<&str>, wanted: &[(&str, &str)]) -> Result<Dataset, DataError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("run.csv");
    std::fs::write(&file, text).expect("a file");
    let wanted: Vec<(&str, Unit)> =
        wanted.iter().map(|(name, unit)| (*name, Unit::parse(unit).expect("a unit"))).collect();
    NamedCsv::open_with_time(&file, time)?.read(&wanted)
}

/// CSV text with the given header and times, and a column of values that grows by 1 per row.
fn table(header: &str, times: &[&str]) -> String {
    let rows = times.iter().enumerate().map(|(k, t)| format!("{t},{}\n", 1 + k * k));
    format!("{header}\n{}", rows.collect::<String>())
}

fn times(data: &Dataset) -> Vec<f64> {
    data.trajectories()[0].time_s().to_vec()
}

#[test]
fn a_clock_is_read_alike_by_both_readers() {
    let numbers = |step: f64| -> Vec<String> { (0..20).map(|k| (step * f64::from(k)).to_string()).collect() };
    for (header, step, seconds) in [
        ("time (hours),x_m", 0.5, 1800.0),
        ("t [h],x_m", 0.5, 1800.0),
        ("t_h,x_m", 0.5, 1800.0),
        ("t_d,x_m", 0.5, 43_200.0),
        ("time (days),x_m", 0.5, 43_200.0),
        ("time (weeks),x_m", 0.5, 302_400.0),
        ("time (hr),x_m", 0.5, 1800.0),
        ("t_min,x_m", 0.5, 30.0),
        ("time (us),x_m", 500.0, 0.0005),
        ("timestamp (ns),x_m", 2e7, 0.02),
        ("time,x_m", 20.0, 0.02),
        ("time,x_m", 20_000.0, 0.02),
        ("timestamp,x_m", 2e7, 0.02),
        ("time,x_m", 60.0, 60.0),
        ("time,x_m", 2.002, 2.002),
        ("day,x_m", 1.0, 86_400.0),
    ] {
        let steps = numbers(step);
        let text = table(header, &steps.iter().map(String::as_str).collect::<Vec<_>>());
        let data = named(&text, None, &[("x_m", "m")]).unwrap_or_else(|e| panic!("{header} {step}: {e}"));
        assert!((times(&data)[1] / seconds - 1.0).abs() < 1e-12, "{header} {step}: {:?}", times(&data)[1]);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("run.csv");
        std::fs::write(&file, &text).expect("a file");
        let other =
            read_dataset(&file, MissingCells::AsGap).unwrap_or_else(|e| panic!("{header} {step}: {e}"));
        assert_eq!(times(&other), times(&data), "{header} {step}");
        assert!(!data.notes().is_empty() && !other.notes().is_empty(), "{header} {step}");
    }
}

#[test]
fn points_in_time_count_from_the_first_sample() {
    for (header, cells, last_s) in [
        ("time,x_m", ["2024-05-31T23:59:59.5Z", "2024-06-01T00:00:00Z", "2024-06-01 00:00:01"], 1.5),
        ("Date,x_m", ["2024-02-28", "2024-02-29", "2024-03-01"], 172_800.0),
        ("clock,x_m", ["23:59:58", "23:59:59.5", "00:00:01"], 3.0),
        ("timestamp,x_m", ["1717200000", "1717200001", "1717200003"], 3.0),
        ("timestamp,x_m", ["1717200000000", "1717200000020", "1717200000040"], 0.04),
        ("Year,x_m", ["1900", "1901", "1902"], 2.0 * 31_557_600.0),
    ] {
        let data =
            named(&table(header, &cells), None, &[("x_m", "m")]).unwrap_or_else(|e| panic!("{header}: {e}"));
        assert_eq!((times(&data)[0], times(&data)[2]), (0.0, last_s), "{header} {}", cells[0]);
    }
}

#[test]
fn the_user_names_the_time_column_and_its_unit() {
    let text = "k,clock,x_m\n0,0,1\n1,5,2\n2,10,4\n";
    let data = named(text, Some("clock:min"), &[("x_m", "m")]).expect("a data set");
    assert_eq!(times(&data), [0.0, 300.0, 600.0]);
    let error = named(text, Some("clock:furlongs"), &[("x_m", "m")]).unwrap_err().to_string();
    assert!(error.contains("`furlongs` is not a known unit of time"), "{error}");
    let error = named(text, Some("tick:ms"), &[("x_m", "m")]).unwrap_err().to_string();
    assert!(error.contains("there is no such column"), "{error}");
}

#[test]
fn a_time_that_cannot_be_read_is_refused_with_its_unit() {
    let error =
        named("time (fortnights),x_m\n0,1\n1,2\n2,4\n", None, &[("x_m", "m")]).unwrap_err().to_string();
    assert!(error.contains("`fortnights` is not a known unit of time"), "{error}");
    let error = named("time,x_m\n31.05.2024,1\n01.06.2024,2\n02.06.2024,4\n", None, &[("x_m", "m")]);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("line 2") && error.contains("`31.05.2024` is not a time"), "{error}");
}

#[test]
fn columns_are_converted_to_the_unit_of_the_model() {
    for (column, name, unit, value, si) in [
        ("angle (deg)", "angle_rad", "rad", 180.0, std::f64::consts::PI),
        ("angle_deg", "angle_rad", "rad", 180.0, std::f64::consts::PI),
        ("T_degC", "T_K", "K", 20.0, 293.15),
        ("T [°C]", "T_K", "K", 20.0, 293.15),
        ("speed_rpm", "speed_rad_s", "rad/s", 60.0, std::f64::consts::TAU),
        ("v (km/h)", "v_m_s", "m/s", 36.0, 10.0),
        ("p_kPa", "p_Pa", "Pa", 2.0, 2000.0),
        ("p [bar]", "p_Pa", "Pa", 2.0, 2e5),
        ("tilt_mrad", "tilt_rad", "rad", 5.0, 0.005),
        ("duty (%)", "duty", "1", 40.0, 0.4),
        ("duty (%)", "duty_ratio", "1", 40.0, 0.4),
        ("charge_Ah", "charge_C", "C", 2.0, 7200.0),
        ("power (kW)", "power_W", "W", 2.0, 2000.0),
        ("x_mm", "x_m", "m", 5.0, 0.005),
        ("x_m", "x_m", "m", 5.0, 5.0),
        ("T_in", "T_in", "1", 5.0, 5.0),
    ] {
        for time in ["t_s", "time (s)"] {
            let text = format!("{time},{column}\n0,{value}\n0.1,{value}\n0.2,{value}\n");
            let data = named(&text, None, &[(name, unit)]).unwrap_or_else(|e| panic!("{column}: {e}"));
            let found = data.trajectories()[0].column(0)[0];
            assert!((found / si - 1.0).abs() < 1e-12, "{time} {column}: {found}");
        }
    }
    let error = named("t_s,x_kg\n0,1\n1,2\n", None, &[("x_m", "m")]).unwrap_err();
    assert!(matches!(error, DataError::MissingColumn { .. }), "{error}");
}

#[test]
fn a_data_set_without_a_model_keeps_every_column() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let read = |text: &str| {
        let file = folder.path().join("run.csv");
        std::fs::write(&file, text).expect("a file");
        read_dataset(Path::new(&file), MissingCells::AsGap).expect("a data set")
    };
    let data = read("time (s),temperature_degC,speed_rpm,mood\n0,20,60,1\n0.1,21,60,2\n0.2,22,60,1\n");
    let names: Vec<&str> = data.columns().iter().map(|c| c.name()).collect();
    assert_eq!(names, ["temperature_K", "speed_rad_s", "mood"]);
    assert_eq!(data.trajectories()[0].column(0)[0], 293.15);
    assert!(data.notes().iter().any(|n| n.contains("mood states no known unit")), "{:?}", data.notes());
}
