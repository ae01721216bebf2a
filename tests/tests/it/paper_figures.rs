//! Contract: data distribution, simulator and scores together reproduce the published errors of the
//! baselines, to the digits that the description of the regenerated set states, on its trajectories and on
//! ours.

use crate::shared_data::shared_data;
use augsim_data::{Dataset, read_legacy_ball};
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::models::{Physics, Zero};
use augsim_trainer::{Engine, Forecaster, Sequences, evaluate_forecast};

/// Errors of the baselines: Zero (m), Zero (m/s), Physics (m), Physics (m/s), Physics (%).
fn figures(truth: &Dataset) -> [f64; 5] {
    let test = Sequences::new(truth, &["height_m", "velocity_m_s"]).expect("both columns");
    let error = |model: &dyn Forecaster| evaluate_forecast(model, &test).expect("a score").mean;
    let zero = error(&Zero);
    let physics = error(&Physics(Engine::PybulletBall(published_predictor())));
    assert!((zero.trans_percent - 100.0).abs() < 1e-9);
    [zero.absolute[0], zero.absolute[1], physics.absolute[0], physics.absolute[1], physics.trans_percent]
}

#[test]
fn the_published_figures_of_the_baselines() {
    let sets = [
        ("test", [0.601, 1.329, 0.1548, 0.966, 27.81]),
        ("test_1000", [0.636, 1.421, 0.1678, 1.026, 27.26]),
        ("test_damped", [0.571, 1.253, 0.1529, 0.871, 28.61]),
    ];
    for (name, published) in sets {
        let Some(truth) = shared_data(&format!("pybullet-ball/{name}.csv.gz")) else { return };
        let figures = figures(&read_legacy_ball(&truth).expect("readable"));
        println!("{name}: {figures:.4?}");
        // Half a unit of the last published digit.
        let digits = [5e-4, 5e-4, 5e-5, 5e-4, 5e-3];
        for ((figure, published), half_unit) in figures.iter().zip(published).zip(digits) {
            assert!((figure - published).abs() <= half_unit * 1.01, "{name}: {figure} {published}");
        }
    }
}

#[test]
fn our_own_draws_give_the_same_figures() {
    let (truth, _) = DropDistribution::default().generate(1000, 1).expect("drops");
    let figures = figures(&truth);
    // Standard errors of 1000 trajectories are a tenth of those published for 100-trajectory test
    // sets times sqrt(10): 0.0054 m, 0.014 m/s, 0.003 m, 0.0095 m/s, 0.44 %; four of them.
    let published = [(0.642, 0.022), (1.429, 0.056), (0.1677, 0.012), (1.018, 0.038), (27.15, 1.8)];
    for (figure, (published, tolerance)) in figures.iter().zip(published) {
        assert!((figure - published).abs() < tolerance, "{figures:?}, published {published}");
    }
}
