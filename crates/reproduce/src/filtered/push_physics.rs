//! Declared physics of pushing with parameters fitted to a prefix.

use augsim_physics::model::PushModel;
use augsim_physics::push::{C_INDEX, CONTACT_FRICTION_INDEX};
use augsim_system::{Record, Stream, System};
use augsim_trainer::filter::SystemFilter;
use std::sync::Arc;

/// Prior standard deviations between pushes when both parameters are fitted: index and value.
///
/// They are of the limit surface parameter c (m) and the contact friction; the values of the ellipsoid
/// baseline of the reference on filtered forecasts, not tuned.
const RANDOM_PARAMETERS: [(usize, f64); 2] = [(C_INDEX, 1.8e-3), (CONTACT_FRICTION_INDEX, 0.02)];
/// Name of a model in the table, and its filter.
pub type Named = (&'static str, SystemFilter);

/// Returns two filters of the declared physics: pose fitted; pose, c and contact friction fitted.
pub fn fitted(declared: &PushModel, ways: &[Record]) -> [Named; 2] {
    let pose = SystemFilter::new(Arc::new(declared.open()) as Arc<dyn System>, ways, &vec![None; ways.len()]);
    let own = RANDOM_PARAMETERS
        .into_iter()
        .fold(pose.clone(), |filter, (parameter, sd)| filter.with_random_parameter(parameter, sd));
    [("Physics, pose fitted", pose), ("Physics, pose, c and friction fitted", own)]
}

/// Returns the pusher path of a push as a record without poses: times in s, positions `[x, y]` in m.
pub fn way(id: &str, times: Vec<f64>, rod: [Vec<f64>; 2]) -> Record {
    Record {
        id: id.to_owned(),
        values: vec![vec![f64::NAN; times.len()]; 3],
        inputs: [Stream { times: times.clone(), values: rod.into() }].into(),
        times,
        ..Record::default()
    }
}
