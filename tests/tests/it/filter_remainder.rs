//! Contract: if the residual is a nonlinear function of the prefix, forecasts reach the noise level and bands
//! cover.
use augsim_data::random_stream;
use augsim_trainer::filter::{
    FilterSettings, InitialStatePrior, Sensor, TrajectoryRegression, evaluate_filtered, same_prefix_lengths,
};
use augsim_trainer::{Sequence, Sequences};
use rand_distr::{Distribution, StandardNormal};

const SD: f64 = 0.01;

/// Generates curves whose later part rises with the square of their slope at the beginning.
fn curves(count: usize, noise: f64, seed: u64) -> Sequences {
    let mut rng = random_stream(seed, "curves", 0);
    let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
    let items = (0..count).map(|i| {
        let a = draw();
        let at = |t: f64| a * t.min(0.5) + if t > 0.5 { a * a * (t - 0.5) } else { 0.0 };
        let states = (0..40).map(|k| at(f64::from(k) / 20.0) + noise * draw()).collect();
        Sequence { id: i.to_string(), time: 40, states, actions: Vec::new() }
    });
    Sequences { columns: vec!["x_m".into()], action_columns: Vec::new(), items: items.collect() }
}

#[test]
fn the_beginning_tells_the_rest() {
    let model = TrajectoryRegression::fit(&curves(400, SD, 1), &[SD], &[1, 11]).unwrap();
    let test = curves(200, 0.0, 2);
    let (sensor, start) =
        (Sensor::new(vec![Some(SD)]).unwrap(), InitialStatePrior { mean: vec![0.0], sd: vec![0.0] });
    let lengths = same_prefix_lengths(&[1, 11], 200);
    let scores =
        evaluate_filtered(&model, &test, (&sensor, &start), &lengths, FilterSettings::new(0, 1)).unwrap();
    // The slope is known to 0.01 from eleven readings, the rest then to about 0.02 where nothing was known to 0.5.
    assert!(scores[0].forecast_rows[0] > 0.3 && scores[1].forecast_rows[0] < 0.03, "{scores:?}");
    let inside = scores[1].coverage90.unwrap();
    assert!((0.8..0.97).contains(&inside), "{inside}");
}

#[test]
fn other_lengths_and_too_few_curves_are_refused() {
    assert!(TrajectoryRegression::fit(&curves(10, SD, 1), &[SD], &[5]).is_err());
    assert!(TrajectoryRegression::fit(&curves(100, SD, 1), &[SD], &[40]).is_err());
}
