//! Contract: data or a model with which the loop cannot be closed are refused with one sentence that says what to do.

use augsim_data::checks::{Accepted, Check};
use augsim_data::{Dataset, Trajectory};
use augsim_discovery::{Options, discover};
use augsim_physics::model::Model;

fn falls(count: usize) -> Vec<Trajectory> {
    (0..count)
        .map(|j| {
            let t: Vec<f64> = (0..40).map(|k| f64::from(k) / 100.0).collect();
            // A millimetre of pseudo-noise, so that the noise is not nothing.
            let ripple = |k: usize| 1e-3 * ((k * k * 7 + j * 13) as f64).sin();
            let z = t
                .iter()
                .enumerate()
                .map(|(k, t)| 3.0 + 0.01 * j as f64 - 4.905 * t * t + ripple(k))
                .collect();
            Trajectory::new(format!("{j}"), t, vec![z]).expect("well formed")
        })
        .collect()
}

fn refusal(names: &[&str], trajectories: Vec<Trajectory>, model: &Model) -> String {
    let data = Dataset::from_names(names, trajectories).expect("well formed").with_path("drops.csv");
    discover(model, &data, &Options::default(), &mut |_| {}).expect_err("refused").to_string()
}

#[test]
fn no_impacts_with_restitution_to_calibrate() {
    let text = refusal(&["height_m"], falls(10), &Model::plain(9.81, 0.7));
    assert!(
        text.contains(
            "no impacts found, so `restitution` cannot be calibrated; freeze it or remove it from model"
        ),
        "{text}"
    );
}

#[test]
fn one_trajectory_only() {
    let text = refusal(&["height_m"], falls(1), &Model::plain(9.81, 0.7));
    assert!(text.contains("1 trajectory with enough samples; at least 2 are needed"), "{text}");
}

#[test]
fn a_constant_column() {
    let flat = (0..5)
        .map(|j| {
            Trajectory::new(format!("{j}"), vec![0.0, 0.1, 0.2], vec![vec![1.0; 3]]).expect("well formed")
        })
        .collect();
    let text = refusal(&["height_m"], flat, &Model::plain(9.81, 0.7));
    assert!(text.contains("the column `height_m` never changes"), "{text}");
}

#[test]
fn no_position_column() {
    let text = refusal(&["speed_m_s"], falls(5), &Model::plain(9.81, 0.7));
    assert!(text.contains("no position columns; 1-D data need `height_m`"), "{text}");
}

#[test]
fn a_model_that_cannot_be_calibrated() {
    // Millimetres in a column of metres, of which somebody says that they are right: the calibration still refuses them.
    let big = falls(8)
        .into_iter()
        .map(|t| {
            let z = t.column(0).iter().map(|v| 1000.0 * v).collect();
            Trajectory::new(t.id(), t.time_s().to_vec(), vec![z]).expect("well formed")
        })
        .collect();
    let mut model = Model::plain(9.81, 0.7);
    model.declared.retain(|p| p != "restitution");
    model.parameters[1].frozen = true;
    let data = Dataset::from_names(&["height_m"], big).expect("well formed").with_path("drops.csv");
    let accepted = Accepted::default().with(Check::GravityDisagrees);
    let options = Options { accepted, ..Options::default() };
    let text = discover(&model, &data, &options, &mut |_| {}).expect_err("refused").to_string();
    assert!(text.contains("cannot be calibrated to drops.csv") && text.contains("check units"), "{text}");
}
