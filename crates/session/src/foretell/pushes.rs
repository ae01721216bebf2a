//! Draws of noise of the motion: pushes on the rates that a model says are shaken.

use augsim_physics::system::{Record, Stream};
use augsim_written::model::Shaken;
use augsim_written::{ModelError, WrittenSystem};
use std::sync::Arc;

/// A system that takes pushes, and how they wander.
pub(super) struct Pushes {
    pub system: WrittenSystem,
    shaken: Vec<Shaken>,
}

impl Pushes {
    /// The system of a model with the inputs that push it; none where nothing is shaken.
    ///
    /// # Errors
    /// [`ModelError`]: the model does not compile.
    pub fn on(system: &WrittenSystem) -> Result<Option<Self>, ModelError> {
        let shaken = system.shaken();
        let taken = |shaken: Vec<Shaken>| Ok(Pushes { system: system.with_pushes()?, shaken });
        (!shaken.is_empty()).then_some(shaken).map(taken).transpose()
    }

    /// A record with drawn pushes behind its first `known` samples, which tell what pushed there.
    pub fn drawn(&self, record: &Record, known: usize, normal: &mut dyn FnMut() -> f64) -> Record {
        let begins = known.saturating_sub(1);
        let push = |shaken: &Shaken| {
            let mut now = shaken.sd * normal();
            let mut values = vec![0.0; record.times.len()];
            for (k, value) in values.iter_mut().enumerate().skip(begins) {
                *value = now;
                let lasts = record.times.get(k + 1).map_or(0.0, |next| next - record.times[k]);
                let kept = if shaken.memory_s > 0.0 { (-lasts / shaken.memory_s).exp() } else { 0.0 };
                now = kept * now + shaken.sd * (1.0 - kept * kept).sqrt() * normal();
            }
            Stream { times: record.times.clone(), values: vec![values] }
        };
        let pushes = self.shaken.iter().map(push).collect::<Vec<_>>();
        let inputs: Arc<[Stream]> = record.inputs.iter().cloned().chain(pushes).collect();
        Record { inputs, ..record.clone() }
    }
}
