//! Data that are sampled far more finely than the motion asks for.

use anyhow::Context;
use augsim_data::{Dataset, Trajectory};
use augsim_physics::system::Record;
use augsim_written::WrittenSystem;

/// Most samples of which one is kept.
const MOST: usize = 8;

/// Data of which every so many samples are kept, because these tell as much as all.
#[derive(Debug)]
pub struct Thinned {
    /// Every `every`th row: outputs as they were measured, inputs averaged.
    pub data: Dataset,
    /// Of how many samples one is kept.
    pub every: usize,
}

impl Thinned {
    /// The sentence for a result.
    pub fn sentence(&self) -> String {
        format!(
            "every {}th sample was fitted to, with inputs averaged: the outputs are smooth enough that these tell as much as all",
            self.every
        )
    }
}

/// The data with as few samples as tell as much as all; nothing where all are needed, or where there are gaps. `seen` are the
/// records of the data prepared by the system, whose parameters and steps suit them.
///
/// # Errors
/// The data have no such columns.
pub fn thinned(system: &WrittenSystem, data: &Dataset, seen: &[Record]) -> anyhow::Result<Option<Thinned>> {
    let model = system.model();
    let is_both = |name: &str| model.outputs.iter().any(|o| o.name == name);
    let is_complete = |t: &Trajectory| t.values().iter().flatten().all(|v| v.is_finite());
    if model.inputs.iter().any(|i| is_both(&i.name)) || !data.trajectories().iter().all(is_complete) {
        return Ok(None);
    }
    let every = system.told_by_every(MOST, seen);
    if every == 1 {
        return Ok(None);
    }
    let mut trajectories = Vec::new();
    for (trajectory, record) in data.trajectories().iter().zip(seen) {
        let picked = |values: &[f64]| -> Vec<f64> { values.iter().copied().step_by(every).collect() };
        let mut values: Vec<Vec<f64>> = trajectory.values().iter().map(|column| picked(column)).collect();
        for (input, averaged) in model.inputs.iter().zip(system.thinned_inputs(record, every)) {
            values[data.column_index(&input.name)?] = averaged;
        }
        trajectories.push(trajectory.with_samples(picked(trajectory.time_s()), values)?);
    }
    let data = data.with_trajectories(trajectories).context("data with fewer samples")?;
    Ok(Some(Thinned { data, every }))
}

#[cfg(test)]
mod tests {
    //! Contract: samples are left out only where the others tell what they were, and with inputs that push as much.
    use super::*;
    use crate::written::fit::prepared;
    use crate::written::records::records;

    const MODEL: &str = r#"
scenario = "system"
name = "mass"
[inputs]
push_m_s2 = { hold = "zero" }
[states]
x_m = { start = "position_m" }
v_m_s = { start = "slope(position_m)" }
[parameters]
damping_per_s = { nominal = 2.0, min = 0.0, max = 10.0 }
[rates]
x_m = "v_m_s"
v_m_s = "push_m_s2 - damping_per_s * v_m_s"
[outputs]
position_m = { value = "x_m", sd = "estimate" }
"#;

    /// Two seconds of that mass at 1 kHz under a slow push that is written with ripples, by its exact solution from sample to sample,
    /// with readings off by up to `noise_m`.
    fn recorded(noise_m: f64) -> Dataset {
        let (count, step_s, damping_per_s) = (2000, 1e-3, 2.0_f64);
        let decay = (-damping_per_s * step_s).exp();
        let (mut x, mut v) = (0.0, 0.0);
        let (mut times, mut pushes, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..count {
            let t = step_s * f64::from(k);
            // The ripple pushes as much in the first half of four samples as in the second.
            let push = (3.0 * t).sin() + 0.1 * f64::from(u8::from(matches!(k % 4, 1 | 2)));
            let scrambled = (f64::from(k) * 12.9898 + 4.1).sin() * 43_758.545_3;
            let off = noise_m * 2.0 * (scrambled - scrambled.floor() - 0.5);
            times.push(t);
            pushes.push(push);
            positions.push(x + off);
            let rest = push / damping_per_s;
            x += rest * step_s + (v - rest) * (1.0 - decay) / damping_per_s;
            v = rest + (v - rest) * decay;
        }
        let trajectory = Trajectory::new("1", times, vec![pushes, positions]).unwrap();
        Dataset::from_names(&["push_m_s2", "position_m"], vec![trajectory]).unwrap()
    }

    fn thinned_from(data: &Dataset) -> Option<Thinned> {
        let model = augsim_written::model::parse(MODEL, "mass.toml").unwrap();
        let system = WrittenSystem::declared_only(&model).unwrap();
        let seen = prepared(&system, &records(data, &model, true).unwrap()).unwrap();
        let system = system.tuned(&seen).unwrap();
        thinned(&system, data, &seen).unwrap()
    }

    #[test]
    fn a_slow_motion_keeps_every_eighth_sample_and_the_mean_of_its_pushes() {
        let data = recorded(1e-6);
        let thinned = thinned_from(&data).unwrap();
        assert_eq!(thinned.every, 8);
        let (all, kept) = (&data.trajectories()[0], &thinned.data.trajectories()[0]);
        assert_eq!(kept.column(1), all.column(1).iter().copied().step_by(8).collect::<Vec<_>>());
        let mean = all.column(0)[16..24].iter().sum::<f64>() / 8.0;
        assert!((kept.column(0)[2] - mean).abs() < 1e-12);
        assert!(thinned.sentence().starts_with("every 8th sample"));
    }

    #[test]
    fn readings_with_noise_that_counts_are_all_kept() {
        assert!(thinned_from(&recorded(1e-2)).is_none());
    }

    #[test]
    fn readings_with_gaps_are_all_kept() {
        let data = recorded(1e-6);
        let whole = &data.trajectories()[0];
        let mut values = whole.values().to_vec();
        values[1][100] = f64::NAN;
        let gap = whole.with_samples(whole.time_s().to_vec(), values).unwrap();
        assert!(thinned_from(&data.with_trajectories(vec![gap]).unwrap()).is_none());
    }
}
