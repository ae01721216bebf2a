//! Downsampling of data that are sampled more finely than the dynamics need.

use anyhow::Context;
use augsim_data::{Dataset, Trajectory};
use augsim_equations::EquationSystem;
use augsim_system::Record;

/// Maximum downsampling factor: at least one sample in this many is kept.
const MAX_FACTOR: usize = 8;

/// Data of which only every n-th sample is kept, without loss of information.
#[derive(Debug)]
pub struct Downsampled {
    /// Every n-th row of the data (n = `every`), with outputs as measured and inputs averaged.
    pub data: Dataset,
    /// Downsampling factor: one in this many samples is kept.
    pub every: usize,
}

impl Downsampled {
    /// Sentence for the user on the downsampling.
    pub fn sentence(&self) -> String {
        format!(
            "one sample in {} was fitted, with averaged inputs: the outputs are so smooth that the other samples add no information",
            self.every
        )
    }
}

/// Downsamples the data as far as no information is lost; `None` if nothing can be dropped.
///
/// `records` are the records of the data, prepared by the system with chosen integration steps.
///
/// # Errors
/// The data lack a column of the model.
pub fn downsample(
    system: &EquationSystem,
    data: &Dataset,
    records: &[Record],
) -> anyhow::Result<Option<Downsampled>> {
    let model = system.model();
    let is_output = |name: &str| model.outputs.iter().any(|o| o.name == name);
    let is_complete = |t: &Trajectory| t.values().iter().flatten().all(|v| v.is_finite());
    if model.inputs.iter().any(|i| is_output(&i.name)) || !data.trajectories().iter().all(is_complete) {
        return Ok(None);
    }
    let every = system.max_decimation(MAX_FACTOR, records);
    if every == 1 {
        return Ok(None);
    }
    let mut trajectories = Vec::new();
    for (trajectory, record) in data.trajectories().iter().zip(records) {
        let picked = |values: &[f64]| -> Vec<f64> { values.iter().copied().step_by(every).collect() };
        let mut values: Vec<Vec<f64>> = trajectory.values().iter().map(|column| picked(column)).collect();
        for (input, averaged) in model.inputs.iter().zip(system.decimated_inputs(record, every)) {
            values[data.column_index(&input.name)?] = averaged;
        }
        trajectories.push(trajectory.with_samples(picked(trajectory.time_s()), values)?);
    }
    let data = data.with_trajectories(trajectories).context("data with fewer samples")?;
    Ok(Some(Downsampled { data, every }))
}

#[cfg(test)]
mod tests {
    //! Contract: samples are dropped only if the others determine them, and the averaged inputs have the same
    //! effect.
    use super::*;
    use crate::equations::fit::prepare_records;
    use crate::equations::records::records;

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

    /// Simulates two seconds of a mass at 1 kHz under a slow push with a superposed ripple.
    ///
    /// Measurement errors are uniform up to `noise_m`.
    fn recorded(noise_m: f64) -> Dataset {
        let (count, step_s, damping_per_s) = (2000, 1e-3, 2.0_f64);
        let decay = (-damping_per_s * step_s).exp();
        let (mut x, mut v) = (0.0, 0.0);
        let (mut times, mut pushes, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..count {
            let t = step_s * f64::from(k);
            // The ripple has the same sum over the first and the second half of four samples.
            let push = (3.0 * t).sin() + 0.1 * f64::from(u8::from(matches!(k % 4, 1 | 2)));
            let scrambled = (f64::from(k) * 12.9898 + 4.1).sin() * 43_758.545_3;
            let error = noise_m * 2.0 * (scrambled - scrambled.floor() - 0.5);
            times.push(t);
            pushes.push(push);
            positions.push(x + error);
            let final_v = push / damping_per_s;
            x += final_v * step_s + (v - final_v) * (1.0 - decay) / damping_per_s;
            v = final_v + (v - final_v) * decay;
        }
        let trajectory = Trajectory::new("1", times, vec![pushes, positions]).unwrap();
        Dataset::from_names(&["push_m_s2", "position_m"], vec![trajectory]).unwrap()
    }

    fn downsampled_from(data: &Dataset) -> Option<Downsampled> {
        let model = augsim_equations::model::parse(MODEL, "mass.toml").unwrap();
        let system = EquationSystem::declared_only(&model).unwrap();
        let windows = prepare_records(&system, &records(data, &model, true).unwrap()).unwrap();
        let system = system.tuned(&windows).unwrap();
        downsample(&system, data, &windows).unwrap()
    }

    #[test]
    fn slow_motion_keeps_every_eighth_sample_and_averaged_inputs() {
        let data = recorded(1e-6);
        let thinned = downsampled_from(&data).unwrap();
        assert_eq!(thinned.every, 8);
        let (all, kept) = (&data.trajectories()[0], &thinned.data.trajectories()[0]);
        assert_eq!(kept.column(1), all.column(1).iter().copied().step_by(8).collect::<Vec<_>>());
        let mean = all.column(0)[16..24].iter().sum::<f64>() / 8.0;
        assert!((kept.column(0)[2] - mean).abs() < 1e-12);
        assert!(thinned.sentence().starts_with("one sample in 8 "));
    }

    #[test]
    fn noisy_readings_are_all_kept() {
        assert!(downsampled_from(&recorded(1e-2)).is_none());
    }

    #[test]
    fn readings_with_gaps_are_all_kept() {
        let data = recorded(1e-6);
        let whole = &data.trajectories()[0];
        let mut values = whole.values().to_vec();
        values[1][100] = f64::NAN;
        let gap = whole.with_samples(whole.time_s().to_vec(), values).unwrap();
        assert!(downsampled_from(&data.with_trajectories(vec![gap]).unwrap()).is_none());
    }
}
