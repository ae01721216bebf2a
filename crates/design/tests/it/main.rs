//! Integration tests of experiment design on small systems of equations.

mod designed;
mod evidence;
mod posterior_sample;
mod validity;

use augsim_design::{Explanation, Noise, SensorNoise};
use augsim_equations::{EquationSystem, model};
use augsim_system::{Record, Simulate, Stream};
use std::sync::Arc;

/// Explanation of a model text without process noise; `sds` are the standard deviations of its free parameters.
fn explanation(name: &str, text: &str, sds: &[f64], noise: SensorNoise) -> Explanation {
    let model = model::parse(text, name).expect("a valid model");
    let system = EquationSystem::declared_only(&model)
        .expect("a valid model")
        .with_states_as_channels()
        .expect("a valid model");
    let parameters = system.parameters();
    let uncertain: Vec<usize> = (0..parameters.len()).filter(|i| !parameters[*i].frozen).collect();
    let covariance: Vec<Vec<f64>> = (0..sds.len())
        .map(|i| (0..sds.len()).map(|j| if i == j { sds[i] * sds[i] } else { 0.0 }).collect())
        .collect();
    let explanation = Explanation {
        name: name.to_owned(),
        outputs: model.outputs.len(),
        values: parameters.iter().map(|p| p.nominal).collect(),
        uncertain,
        factor: Vec::new(),
        noise: Noise { sensors: vec![noise], process: Vec::new() },
        log_weight: 0.0,
        driven: None,
        system: Arc::new(system),
    };
    explanation.with_covariance(&covariance)
}

fn white(sd: f64) -> SensorNoise {
    SensorNoise { white_sd: sd, ..SensorNoise::default() }
}

/// A recording with these readings and one input.
fn recording(times: &[f64], input: &[f64], readings: &[f64]) -> Record {
    let stream = Stream { times: times.to_vec(), values: vec![input.to_vec()] };
    Record {
        id: "1".into(),
        times: times.to_vec(),
        values: vec![readings.to_vec()],
        inputs: vec![stream].into(),
        ..Record::default()
    }
}
