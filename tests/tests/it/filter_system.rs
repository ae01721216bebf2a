//! Contract: the filter's posterior of a flight equals that of linear regression. After a rebound the
//! restitution of a trajectory is as certain as the measurements allow, before it as certain as its prior. A
//! prefix that is too short for an estimate is rejected.
use augsim_physics::ball::Axes;
use augsim_physics::model::Model;
use augsim_system::{Record, Simulate};
use augsim_trainer::filter::{
    FilterSettings, InitialStatePrior, Prefix, PrefixForecaster, Sensor, SystemFilter,
};
use augsim_trainer::{Samples, TrainerError};
use std::sync::Arc;

const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
    restitution = { nominal = 0.7, min = 0.0, max = 1.0 }\n[[effect]]\nkind = \"restitution-scatter\"\n\
    per = \"trajectory\"\nsd = { nominal = 0.05, min = 0.0, max = 0.5 }\n";
const STEP_S: f64 = 0.01;
const SD_M: f64 = 0.002;

fn times(count: usize) -> Vec<f64> {
    (0..count).map(|k| STEP_S * k as f64).collect()
}

/// Heights (m) of a ball with restitution `e`, dropped from 1 m at rest, every 10 ms.
fn heights(e: f64, count: usize) -> Vec<f64> {
    let fall = (2.0 / 9.81_f64).sqrt();
    let of = |t: f64| {
        let up = t - fall;
        if up < 0.0 { 1.0 - 0.5 * 9.81 * t * t } else { (e * 9.81 * fall - 0.5 * 9.81 * up) * up }
    };
    times(count).into_iter().map(of).collect()
}

fn forecast(rows: &[f64], time: usize) -> Result<Samples, TrainerError> {
    let system = Arc::new(Model::parse(MODEL, "model.toml").expect("a model").open(Axes::Vertical));
    let covariates = vec![f64::NAN; system.schema().covariates.len()];
    let values = vec![vec![0.0; time]];
    let record = Record { times: times(time), values, covariates, ..Record::default() };
    let filter = SystemFilter::new(system, &[record], &[None]);
    let sensor = Sensor::new(vec![Some(SD_M)]).expect("a sensor");
    let start = InitialStatePrior { mean: vec![0.0], sd: vec![0.0] };
    let prefix = Prefix { id: "a", rows, sensor: &sensor, start: &start, actions: &[], time, index: 0 };
    let settings = FilterSettings { particles: 2000, samples: 2000, seed: 1, is_measured: false };
    Ok(filter.forecasts(prefix, &[rows.len()], settings)?.remove(0))
}

fn moments(samples: &Samples, row: usize) -> (f64, f64) {
    let values = &samples.values[row * samples.count..][..samples.count];
    let n = samples.count as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    (mean, (values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / n).sqrt())
}

#[test]
fn the_posterior_of_a_flight_is_that_of_linear_regression() {
    // Twelve heights, an unknown start and an unknown speed: the variance of the line at a later time.
    let rows = heights(0.7, 12);
    let found = forecast(&rows, 40).unwrap();
    let late = 20;
    let (mean, sd) = moments(&found, late - 12);
    let (n, middle) = (12.0, 5.5);
    let spread: f64 = (0..12).map(|k| (f64::from(k) - middle).powi(2)).sum();
    let wanted = SD_M * (1.0 / n + (late as f64 - middle).powi(2) / spread).sqrt();
    assert!((sd / wanted - 1.0).abs() < 0.06, "{sd} {wanted}");
    assert!((mean - heights(0.7, 40)[late]).abs() < 4.0 * wanted / 2000_f64.sqrt() + 1e-6, "{mean}");
}

#[test]
fn a_rebound_tells_the_restitution_and_nothing_before_it_does() {
    let truth = heights(0.62, 70);
    let (_, before) = moments(&forecast(&truth[..40], 70).unwrap(), 25);
    let (mean, after) = moments(&forecast(&truth[..60], 70).unwrap(), 5);
    // 0.05 of 4.43 m/s for 0.2 s, and then a few millimetres.
    assert!((0.03..0.06).contains(&before), "{before}");
    assert!(after < 0.005 && (mean - truth[65]).abs() < 3.0 * after, "{mean} {after} {}", truth[65]);
}

#[test]
fn one_height_does_not_say_how_a_flight_began() {
    let refused = forecast(&heights(0.7, 1), 40);
    assert!(
        matches!(refused, Err(TrainerError::UndeterminedStart { rows: 1, needed: 2, .. })),
        "{refused:?}"
    );
}
