//! Records of which only every so many samples are looked at.

use super::WrittenSystem;
use super::records::{Scene, signal};
use super::tune::windows;
use crate::engine::{Change, Record as EngineRecord, Signal};
use augsim_physics::system::Record;

/// Ratio of what cubics miss over longer and over the shortest stretches up to which both miss noise alone.
const NOISE_ALONE: f64 = 1.1;
/// Weights of four neighbours a step apart in the cubic through them halfway between the inner two.
const HALFWAY: [f64; 4] = [-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0];

impl WrittenSystem {
    /// The largest `every`, of the powers of two up to `most`, with which every `every`th sample of the records, which were prepared by
    /// this system, tells as much as all: a cubic through those neighbours misses the samples halfway between by no more than one
    /// through the nearest neighbours, and runs of the system with inputs averaged over that many samples pass the same places as
    /// with the measured inputs. Both are small beside the noise of the sensors, as errors of steps are. 1 where all are needed.
    pub fn told_by_every(&self, most: usize, records: &[Record]) -> usize {
        let noise = self.noise(records);
        let near = missed(records, 2, &noise);
        if !near.is_accepted() {
            return 1;
        }
        let scenes = self.scenes(records);
        let Some(all) = self.runs(&scenes) else { return 1 };
        let is_told = |every: &usize| {
            let far = missed(records, *every, &noise);
            far.is_accepted()
                && far.root_mean_square <= NOISE_ALONE * near.root_mean_square
                && self.runs_alike(&scenes, &all, *every, &noise)
        };
        let doublings = std::iter::successors(Some(2), |every| Some(2 * every)).take_while(|e| *e <= most);
        doublings.take_while(is_told).last().unwrap_or(1)
    }

    /// Whether each of some scenes runs with every `every`th knot of its inputs as it does with all, of which `all` are the outputs.
    fn runs_alike(&self, scenes: &[Scene], all: &[Vec<f64>], every: usize, noise: &[f64]) -> bool {
        let fewer: Option<Vec<Scene>> = scenes.iter().map(|scene| thinned(scene, every)).collect();
        let Some(fewer) = fewer.and_then(|fewer| self.runs(&fewer)) else { return false };
        fewer.iter().zip(all).all(|(fewer, all)| {
            let kept: Vec<f64> = all.chunks(noise.len()).step_by(every).flatten().copied().collect();
            Change::of(fewer, &kept, noise).is_accepted()
        })
    }

    /// Outputs of the runs of scenes, `[scene][sample][output]` with the last two in one row; nothing where one cannot be simulated.
    fn runs(&self, scenes: &[Scene]) -> Option<Vec<Vec<f64>>> {
        let runs = self.compiled.simulate(&windows(scenes), &[], &self.options).into_iter();
        runs.map(|run| Some(run.ok()?.values)).collect()
    }

    /// The inputs of a record with knots at every `every`th of its samples: what was between them is averaged.
    pub fn thinned_inputs(&self, record: &Record, every: usize) -> Vec<Vec<f64>> {
        let times = kept(&record.times, every);
        let inputs = self.model().inputs.iter().zip(record.inputs.iter());
        inputs.map(|(input, stream)| signal(input, stream).averaged(&times)).collect()
    }
}

/// A scene with every `every`th of its samples and of the knots of its inputs.
fn thinned(scene: &Scene, every: usize) -> Option<Scene> {
    let fewer = |signal: &Signal| {
        let knots = kept(signal.knots(), every);
        Signal::new(&knots, &signal.averaged(&knots), signal.hold())
    };
    let inputs = scene.record.inputs.iter().map(fewer).collect();
    let record = EngineRecord::new(&scene.record.name, kept(&scene.record.times, every), inputs).ok()?;
    Some(Scene { record, start: scene.start.clone(), parameters: scene.parameters.clone() })
}

fn kept(times: &[f64], every: usize) -> Vec<f64> {
    times.iter().copied().step_by(every).collect()
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
