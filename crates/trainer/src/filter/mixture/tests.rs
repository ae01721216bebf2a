//! Contract: on a linear model the filter gives the closed-form posterior.
//! A forecast depends on the seed and the rows observed so far, and computing one changes no later result.
use super::super::moments::weighted;
use super::super::weights::shares;
use super::*;

/// A random walk whose latent is its drift: x' = x + w + noise, with w ~ N(0, 1).
#[derive(Debug)]
struct Drift;

/// Standard deviations of the process noise of a step and of the measurement noise.
const STEP: f64 = 0.1;
const SEEN: f64 = 0.3;

impl StepLaw for Drift {
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
        for ((mean, x), w) in next.mean.iter_mut().zip(states).zip(latents) {
            *mean = x + w;
        }
        next.variance.fill(STEP * STEP);
        Ok(())
    }
}

fn filter(rows: &[f64], seed: u64) -> Filter<'static> {
    let start = StartLaw { mean: vec![0.0], sd: vec![1.0] };
    let sensor = Sensor::new(vec![Some(SEEN)]).unwrap();
    let mut filter = Filter::new(Box::new(Drift), (sensor, start), (&[], 0), 2000, (seed, 0));
    rows.iter().for_each(|row| filter.observe(&[*row]).unwrap());
    filter
}

/// Posterior of (x, w) given the rows, by a Kalman filter on the joint state.
fn exact(rows: &[f64]) -> Gaussian {
    let mut joint = Gaussian::diagonal(&[0.0, 0.0], &[1.0, 1.0]);
    for (t, row) in rows.iter().enumerate() {
        if t > 0 {
            joint.mean[0] += joint.mean[1];
            let [a, b, _, d] = joint.covariance[..] else { panic!("two by two") };
            joint.covariance = vec![a + 2.0 * b + d + STEP * STEP, b + d, b + d, d];
        }
        joint.measure(0, *row, SEEN * SEEN);
    }
    joint
}

#[test]
fn the_posterior_of_a_linear_law_is_its_closed_form() {
    // A drift of 2.5 is far out in the prior, so the row needs several tempering steps.
    let rows: Vec<f64> = (0..12).map(|t| 2.5 * f64::from(t) + 0.2 * f64::from(t % 3)).collect();
    for n in [2, 4, 12] {
        let found = filter(&rows[..n], 1);
        let weights = shares(&found.weights);
        let w = weighted(&found.latents, &weights, 1);
        let wanted = exact(&rows[..n]);
        // 2,000 particles that moves have made nearly independent: four standard errors of mean and
        // deviation.
        let (mean, sd) = (wanted.mean[1], wanted.covariance[3].sqrt());
        assert!((w.mean[0] - mean).abs() < 4.0 * sd / 1000_f64.sqrt(), "n {n}: {} {mean}", w.mean[0]);
        assert!((w.covariance[0].sqrt() / sd - 1.0).abs() < 0.1, "n {n}: {} {sd}", w.covariance[0].sqrt());
    }
}

#[test]
fn bands_of_forecasts_are_those_of_the_closed_form() {
    let rows = [0.1, 0.8, 1.3, 2.2];
    let joint = exact(&rows);
    let samples = filter(&rows, 2).forecast(3, 4000).unwrap().clone();
    let last = &samples.values[2 * 4000..];
    let mean = last.iter().map(|v| f64::from(*v)).sum::<f64>() / 4000.0;
    let variance = last.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / 4000.0;
    let [a, b, _, d] = joint.covariance[..] else { panic!("two by two") };
    let wanted = a + 6.0 * b + 9.0 * d + 3.0 * STEP * STEP;
    assert!((mean - joint.mean[0] - 3.0 * joint.mean[1]).abs() < 4.0 * (wanted / 1000.0).sqrt());
    assert!((variance / wanted - 1.0).abs() < 0.15, "{variance} {wanted}");
}

#[test]
fn a_forecast_depends_on_seed_and_rows_and_not_on_what_comes_later() {
    let early = filter(&[0.1, 0.8], 3).forecast(2, 50).unwrap().clone();
    assert_eq!(*filter(&[0.1, 0.8], 3).forecast(2, 50).unwrap(), early);
    assert_ne!(*filter(&[0.1, 0.8], 4).forecast(2, 50).unwrap(), early);
    let mut streamed = filter(&[0.1, 0.8], 3);
    assert_eq!(*streamed.forecast(2, 50).unwrap(), early);
    // Computing a forecast must not change later ones.
    let _ = streamed.observe(&[1.6]);
    assert_eq!(streamed.forecast(2, 50).unwrap(), filter(&[0.1, 0.8, 1.6], 3).forecast(2, 50).unwrap());
}

#[test]
fn a_row_that_is_none_is_refused_and_changes_nothing() {
    let mut filter = filter(&[0.1], 1);
    assert!(matches!(filter.observe(&[f64::NAN]), Err(TrainerError::Unseen { row: 1, column: 0 })));
    assert!(matches!(filter.observe(&[0.2, 0.3]), Err(TrainerError::Row { row: 1, found: 2, .. })));
    assert_eq!(filter.seen(), 1);
}

#[test]
fn nothing_is_forecast_behind_nothing() {
    assert!(filter(&[], 1).forecast(2, 10).is_err());
}
