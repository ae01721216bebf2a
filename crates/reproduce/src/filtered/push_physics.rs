//! The declared physics of pushing behind a prefix, with what is fitted to it.

use augsim_physics::model::PushModel;
use augsim_physics::push::{C, CONTACT_FRICTION};
use augsim_physics::system::{Record, Stream, System};
use augsim_trainer::filter::SystemFilter;
use std::sync::Arc;

/// Standard deviations from push to push of the ellipsoid's c (m) and of the contact's friction, where both are fitted to the
/// prefix: those of the reference's baseline.
const OWN: [(usize, f64); 2] = [(C, 1.8e-3), (CONTACT_FRICTION, 0.02)];
/// A model with its name in the table.
pub type Named = (&'static str, SystemFilter);

/// The physics with the pose fitted, and with c and the friction of the contact as well.
pub fn fitted(declared: &PushModel, ways: &[Record]) -> [Named; 2] {
    let pose = SystemFilter::new(Arc::new(declared.open()) as Arc<dyn System>, ways, &vec![None; ways.len()]);
    let own = OWN.into_iter().fold(pose.clone(), |filter, (parameter, sd)| filter.with_own(parameter, sd));
    [("Physics, pose fitted", pose), ("Physics, pose, c and friction fitted", own)]
}

/// The rod's way of a push, as the system reads it, without poses: times, s, and the rod's places `[x, y]`, m.
pub fn way(id: &str, times: Vec<f64>, rod: [Vec<f64>; 2]) -> Record {
    Record {
        id: id.to_owned(),
        values: vec![vec![f64::NAN; times.len()]; 3],
        inputs: [Stream { times: times.clone(), values: rod.into() }].into(),
        times,
        ..Record::default()
    }
}
