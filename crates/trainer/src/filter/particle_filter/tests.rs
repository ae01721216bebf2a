//! Contract: on a linear model the filter gives the closed-form posterior.
//! A forecast depends on the seed and the rows observed so far, and computing one changes no later result.
use super::super::moments::weighted;
use super::super::weights::shares;
use super::*;

/// Test model: a random walk whose latent w is its drift, x' = x + w + noise, with w ~ N(0, 1).
#[derive(Debug)]
struct DriftingWalk;

/// Standard deviation of the process noise of a step; the next constant is that of the measurement noise.
const PROCESS_SD: f64 = 0.1;
const SENSOR_SD: f64 = 0.3;

impl TransitionModel for DriftingWalk {
    fn latent_dim(&self) -> usize {
        1
    }
    fn state_dim(&self) -> usize {
        1
    }
    fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        (0..count).map(|_| StandardNormal.sample(rng)).collect()
    }
    fn log_density(&mut self, latent: &[f64]) -> f64 {
        -0.5 * latent[0] * latent[0]
    }
    fn advance(
        &mut self,
        states: &[f64],
        latents: &[f64],
        _: [&[f64]; 2],
        next: Moments<'_>,
    ) -> Result<(), TrainerError> {
        for ((mean, x), latent) in next.mean.iter_mut().zip(states).zip(latents) {
            *mean = x + latent;
        }
        next.variance.fill(PROCESS_SD * PROCESS_SD);
        Ok(())
    }
}

fn filter(rows: &[f64], seed: u64) -> Filter<'static> {
    let start = InitialStatePrior { mean: vec![0.0], sd: vec![1.0] };
    let sensor = Sensor::new(vec![Some(SENSOR_SD)]).unwrap();
    let mut filter = Filter::new(Box::new(DriftingWalk), (sensor, start), (&[], 0), 2000, (seed, 0));
    rows.iter().for_each(|row| filter.observe(&[*row]).unwrap());
    filter
}

/// Computes the posterior of (x, w) given the rows, by a Kalman filter on the joint state.
fn kalman_posterior(rows: &[f64]) -> Gaussian {
    let mut joint = Gaussian::diagonal(&[0.0, 0.0], &[1.0, 1.0]);
    for (t, row) in rows.iter().enumerate() {
        if t > 0 {
            joint.mean[0] += joint.mean[1];
            let [a, b, _, d] = joint.covariance[..] else { panic!("two by two") };
            joint.covariance = vec![a + 2.0 * b + d + PROCESS_SD * PROCESS_SD, b + d, b + d, d];
        }
        joint.measure(0, *row, SENSOR_SD * SENSOR_SD);
    }
    joint
}

#[test]
fn posterior_of_a_linear_model_matches_the_closed_form() {
    // A drift of 2.5 is far out in the prior, so the row needs several tempering steps.
    let rows: Vec<f64> = (0..12).map(|t| 2.5 * f64::from(t) + 0.2 * f64::from(t % 3)).collect();
    for n in [2, 4, 12] {
        let posterior = filter(&rows[..n], 1);
        let weights = shares(&posterior.weights);
        let estimate = weighted(&posterior.latents, &weights, 1);
        let expected = kalman_posterior(&rows[..n]);
        // 2,000 particles that moves have made nearly independent: four standard errors of mean and
        // deviation.
        let (mean, sd) = (expected.mean[1], expected.covariance[3].sqrt());
        assert!(
            (estimate.mean[0] - mean).abs() < 4.0 * sd / 1000_f64.sqrt(),
            "n {n}: {} {mean}",
            estimate.mean[0]
        );
        assert!(
            (estimate.covariance[0].sqrt() / sd - 1.0).abs() < 0.1,
            "n {n}: {} {sd}",
            estimate.covariance[0].sqrt()
        );
    }
}

#[test]
fn forecast_mean_and_variance_match_the_closed_form() {
    let rows = [0.1, 0.8, 1.3, 2.2];
    let joint = kalman_posterior(&rows);
    let samples = filter(&rows, 2).forecast(3, 4000).unwrap().clone();
    let last = &samples.values[2 * 4000..];
    let mean = last.iter().map(|v| f64::from(*v)).sum::<f64>() / 4000.0;
    let variance = last.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / 4000.0;
    let [a, b, _, d] = joint.covariance[..] else { panic!("two by two") };
    let expected = a + 6.0 * b + 9.0 * d + 3.0 * PROCESS_SD * PROCESS_SD;
    assert!((mean - joint.mean[0] - 3.0 * joint.mean[1]).abs() < 4.0 * (expected / 1000.0).sqrt());
    assert!((variance / expected - 1.0).abs() < 0.15, "{variance} {expected}");
}

#[test]
fn forecasts_depend_on_seed_and_observed_rows_only() {
    let expected_forecast = filter(&[0.1, 0.8], 3).forecast(2, 50).unwrap().clone();
    assert_eq!(*filter(&[0.1, 0.8], 3).forecast(2, 50).unwrap(), expected_forecast);
    assert_ne!(*filter(&[0.1, 0.8], 4).forecast(2, 50).unwrap(), expected_forecast);
    let mut streamed = filter(&[0.1, 0.8], 3);
    assert_eq!(*streamed.forecast(2, 50).unwrap(), expected_forecast);
    // Computing a forecast must not change later ones.
    let _ = streamed.observe(&[1.6]);
    assert_eq!(streamed.forecast(2, 50).unwrap(), filter(&[0.1, 0.8, 1.6], 3).forecast(2, 50).unwrap());
}

#[test]
fn invalid_rows_are_refused_and_leave_the_filter_unchanged() {
    let mut filter = filter(&[0.1], 1);
    assert!(matches!(
        filter.observe(&[f64::NAN]),
        Err(TrainerError::MissingMeasurement { row: 1, column: 0 })
    ));
    assert!(matches!(filter.observe(&[0.2, 0.3]), Err(TrainerError::Row { row: 1, found: 2, .. })));
    assert_eq!(filter.observed_rows(), 1);
}

#[test]
fn forecasting_before_any_row_is_refused() {
    assert!(filter(&[], 1).forecast(2, 10).is_err());
}
