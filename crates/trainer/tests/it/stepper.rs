//! Contract: a stepper agrees with the forecasts of its net, and rejects states of the wrong width.

use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::{
    Engine, Forecaster, NetModel, Recipe, Sequences, Settings, Stepper, Task, TrainerError, Training,
};

fn trained(recipe: Recipe) -> NetModel {
    let (data, _) = DropDistribution::default().generate(20, 5).expect("drops");
    let drops = Sequences::new(&data, &["height_m", "velocity_m_s"]).expect("sequences");
    let mut settings = Settings::new(recipe, 5, 3, Engine::PybulletBall(published_predictor()));
    settings.batch = 20;
    let mut training = Training::new(settings, &drops).expect("a run");
    for _ in 0..5 {
        training.step().expect("a step");
    }
    NetModel::new(training.finish().expect("an end").clone()).expect("a model")
}

#[test]
fn steps_of_the_papers_nets_agree_with_their_forecasts() {
    for recipe in [Recipe::Neural, Recipe::Hybrid, Recipe::HybridStandardised] {
        let model = trained(recipe);
        let (start, time, index) = ([4.5, -0.3], 70, 6);
        let task = Task { start: &start, actions: &[], time, index };
        let forecast = model.forecast(task, 1).expect("a forecast");
        let mut stepper = Stepper::new(&model).expect("a stepper");
        for _ in 0..2 {
            stepper.begin(&start, index).expect("a start");
            for t in 1..time {
                let next = stepper.step(None).expect("a step");
                let expected = &forecast.values[2 * t..2 * t + 2];
                assert_eq!(
                    next.mean.iter().map(|v| *v as f32).collect::<Vec<_>>(),
                    expected,
                    "{recipe:?} {t}"
                );
                assert_eq!(next.sd, [0.0, 0.0]);
            }
        }
    }
}

#[test]
fn steps_of_hybrid_plus_have_the_distribution_of_its_forecasts() {
    let model = trained(Recipe::HybridPlus);
    let (start, samples) = ([4.5, -0.3], 4000);
    let mut stepper = Stepper::new(&model).expect("a stepper");
    // A one-sample forecast of trajectory `index` has the latent of the stepper, so it differs by the step
    // noise alone.
    let (mut mean, mut square) = ([0.0; 2], [0.0; 2]);
    for index in 0..samples {
        stepper.begin(&start, index).expect("a start");
        let next = stepper.step(Some(&start)).expect("a step");
        assert!(next.sd.iter().all(|sd| *sd > 0.0));
        let task = Task { start: &start, actions: &[], time: 2, index };
        let drawn = model.forecast(task, 1).expect("a forecast");
        for j in 0..2 {
            let z = (f64::from(drawn.values[2 + j]) - next.mean[j]) / next.sd[j];
            mean[j] += z / samples as f64;
            square[j] += z * z / samples as f64;
        }
    }
    for j in 0..2 {
        assert!(mean[j].abs() < 5.0 / (samples as f64).sqrt(), "{mean:?}");
        assert!((square[j] - 1.0).abs() < 5.0 * (2.0 / samples as f64).sqrt(), "{square:?}");
    }
}

#[test]
fn states_of_the_wrong_width_are_rejected() {
    let mut stepper = Stepper::new(&trained(Recipe::HybridPlus)).expect("a stepper");
    for wrong in [&[1.0][..], &[1.0, 2.0, 3.0], &[]] {
        assert!(matches!(stepper.step(Some(wrong)), Err(TrainerError::Mismatch { .. })));
        assert!(matches!(stepper.begin(wrong, 0), Err(TrainerError::Mismatch { .. })));
    }
}
