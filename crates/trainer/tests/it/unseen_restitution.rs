//! Contract: Hybrid+ filters drops with restitutions outside the range of its training set.
//!
//! Its latent shifts the restitution of the physics, so that one rebound identifies it.

use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::filter::{
    FilterSettings, InitialStatePrior, Sensor, evaluate_filtered, same_prefix_lengths,
};
use augsim_trainer::{Engine, NetModel, Recipe, Sequence, Sequences, Settings, Training};

const ROWS: usize = 200;
/// Number of observed rows; the first rebound is about ten rows earlier.
const OBSERVED_ROWS: usize = 75;

#[test]
fn a_restitution_outside_the_training_range_is_identified_from_one_rebound() {
    let law = DropDistribution::default();
    let (data, _) = law.generate(60, 5).expect("drops");
    let drops = Sequences::new(&data, &["height_m", "velocity_m_s"]).expect("sequences");
    let mut settings = Settings::new(Recipe::HybridPlus, 400, 3, Engine::PybulletBall(published_predictor()));
    settings.batch = 30;
    let mut training = Training::new(settings, &drops).expect("a run");
    for _ in 0..400 {
        training.step().expect("a step");
    }
    let model = NetModel::new(training.finish().expect("an end").clone()).expect("a model");

    // The restitutions of the training set are drawn from N(0.5, 0.1).
    let items = [0.15, 0.2, 0.78, 0.82].map(|restitution| {
        let ball = BulletBall { restitution, ..law.ball };
        let [heights, velocities] = ball.simulate_underside(4.6, 0.0, ROWS);
        let states = heights.into_iter().zip(velocities).flat_map(|(h, v)| [h, v]).collect();
        Sequence { id: restitution.to_string(), time: ROWS, states, actions: Vec::new() }
    });
    let test = Sequences { items: items.to_vec(), ..drops.clone() };
    let sensor = Sensor::new(vec![Some(0.002), None]).expect("a sensor");
    let lengths = same_prefix_lengths(&[OBSERVED_ROWS], test.items.len());
    let prior = (&sensor, &InitialStatePrior::from_training_set(&drops));
    let scores = evaluate_filtered(&model, &test, prior, &lengths, FilterSettings::new(256, 1));
    let score = scores.expect("forecasts").remove(0);
    // Measured: 0.03 m. A perceptron that has to learn the product of latent and speed has an error of 0.14 m
    // after the same training.
    assert!(score.forecast_rows[0] < 0.05, "{:.4} m", score.forecast_rows[0]);
}
