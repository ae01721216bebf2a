//! Records of which only every so many samples are looked at.

use super::WrittenSystem;
use super::records::{Scene, signal};
use crate::engine::{Change, Record as EngineRecord, Signal, Window};
use augsim_physics::system::{Record, Stream};

/// Ratio of what cubics miss over longer and over the shortest stretches up to which both miss noise alone.
const NOISE_ALONE: f64 = 1.1;
/// Weights of four neighbours a step apart in the cubic through them halfway between the inner two.
const HALFWAY: [f64; 4] = [-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0];

impl WrittenSystem {
    /// Whether every `every`th sample of the records, which were prepared by this system, tells as much as all: a cubic through those
    /// neighbours misses the samples halfway between by no more than one through the nearest neighbours, and runs of the system with
    /// inputs averaged over that many samples pass the same places as with the measured inputs. Both are small beside the noise of
    /// the sensors, as errors of steps are. `every` is even.
    pub fn is_told_by(&self, every: usize, records: &[Record]) -> bool {
        let noise = self.noise(records);
        let [near, far] = [2, every].map(|every| missed(records, every, &noise));
        far.is_accepted()
            && far.root_mean_square <= NOISE_ALONE * near.root_mean_square
            && self.scenes(records).iter().all(|scene| self.runs_alike(scene, every, &noise).unwrap_or(false))
    }

    /// Whether two runs of a scene, with all knots of its inputs and with every `every`th, agree; nothing where one cannot be simulated.
    fn runs_alike(&self, scene: &Scene, every: usize, noise: &[f64]) -> Option<bool> {
        let thinned = |times: &[f64]| -> Vec<f64> { times.iter().copied().step_by(every).collect() };
        let fewer = |signal: &Signal| {
            let knots = thinned(signal.knots());
            Signal::new(&knots, &signal.averaged(&knots), signal.hold())
        };
        let kept = thinned(&scene.record.times);
        let inputs = scene.record.inputs.iter().map(fewer).collect();
        let record = EngineRecord::new(&scene.record.name, kept, inputs).ok()?;
        let run = |record: &EngineRecord| {
            let (last, start) = (record.times.len() - 1, &scene.start[..]);
            let window = Window { record, first: 0, last, start, parameters: &scene.parameters };
            Some(self.compiled.simulate(&[window], &[], &self.options).pop()?.ok()?.values)
        };
        let every_value: Vec<f64> =
            run(&scene.record)?.chunks(noise.len()).step_by(every).flatten().copied().collect();
        Some(Change::of(&run(&record)?, &every_value, noise).is_accepted())
    }

    /// The inputs of a record as measured with knots at every `every`th of its samples: what was between them is averaged.
    pub fn thinned_inputs(&self, record: &Record, every: usize) -> Vec<Vec<f64>> {
        let times: Vec<f64> = record.times.iter().copied().step_by(every).collect();
        let inputs = self.model().inputs.iter().zip(record.inputs.iter());
        inputs.map(|(input, stream): (_, &Stream)| signal(input, stream).averaged(&times)).collect()
    }
}

/// By how much cubics through four samples that are `every` apart miss the samples halfway between, in units of the noise.
fn missed(records: &[Record], every: usize, noise: &[f64]) -> Change {
    let reach = every + every / 2;
    let (mut between, mut measured) = (Vec::new(), Vec::new());
    for record in records {
        for at in (reach..record.times.len().saturating_sub(reach)).step_by(every) {
            let neighbours = [at - reach, at - every / 2, at + every / 2, at + reach];
            for values in &record.values {
                between.push(neighbours.iter().zip(HALFWAY).map(|(k, weight)| weight * values[*k]).sum());
                measured.push(values[at]);
            }
        }
    }
    if measured.is_empty() { Change::ENDLESS } else { Change::of(&between, &measured, noise) }
}
