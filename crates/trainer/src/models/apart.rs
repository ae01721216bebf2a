//! A forecaster of pushes whose samples are moved to the nearest poses that bodies can take.
//!
//! Measured poses carry noise, so that measured pushes themselves overlap with the rod and stir before it touches. A forecast that must
//! not do so gives up the noise of its poses there, and its bands hold fewer measured ones: the league shows both rows.

use crate::engine::ModelPush;
use crate::violations::{TOUCH_M, gap};
use crate::{Difference, Engine, Forecaster, Samples, Task, TrainerError};

/// Times that a pose is moved out of the rod: once is enough at a side, at a corner what is nearest may change.
const PROJECTIONS: usize = 4;

/// A forecaster whose objects rest until the rod touches them and then stay outside of it.
#[derive(Debug)]
pub struct Apart<'a, F> {
    model: &'a F,
    push: &'a ModelPush,
}

impl<'a, F: Forecaster> Apart<'a, F> {
    /// The forecaster `model` of pushes by `engine`.
    ///
    /// # Errors
    /// [`TrainerError::Foreign`] if the engine pushes nothing.
    pub fn new(model: &'a F, engine: &'a Engine) -> Result<Self, TrainerError> {
        let push = engine.pushing().ok_or(Difference::OtherSystem)?;
        Ok(Apart { model, push })
    }
}

impl<F: Forecaster> Forecaster for Apart<'_, F> {
    fn name(&self) -> &str {
        self.model.name()
    }

    fn is_deterministic(&self) -> bool {
        self.model.is_deterministic()
    }

    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
        let mut out = self.model.forecast(task, samples)?;
        keep_apart(self.push, task, &mut out);
        Ok(out)
    }
}

/// Moves sampled poses `[time, 3, sample]` to the nearest that bodies can take.
fn keep_apart(push: &ModelPush, task: Task<'_>, samples: &mut Samples) {
    let n = samples.count;
    let start = [task.start[0], task.start[1], task.start[2]];
    let first = (0..task.time).find(|&t| gap(push, &task, t, start).0 < TOUCH_M).unwrap_or(task.time);
    for sample in 0..n {
        for t in 0..task.time {
            let at = |j: usize| (t * 3 + j) * n + sample;
            let mut pose = match t <= first {
                true => start,
                false => [0, 1, 2].map(|j| f64::from(samples.values[at(j)])),
            };
            for _ in 0..PROJECTIONS {
                let (gap, outward) = gap(push, &task, t, pose);
                if gap >= 0.0 {
                    break;
                }
                (0..2).for_each(|j| pose[j] += gap * outward[j]);
            }
            (0..3).for_each(|j| samples.values[at(j)] = pose[j] as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: poses that are kept apart violate nothing.
    use super::*;
    use crate::violations::{Violations, violations};

    #[test]
    fn bodies_that_are_kept_apart_violate_nothing() {
        let object = augsim_physics::push::Object::named("rect1").expect("built in");
        let model =
            augsim_physics::model::ModelFile::Push(augsim_physics::model::PushModel::textbook(object));
        let engine = Engine::of(&model, None).expect("an engine");
        let push = engine.pushing().expect("pushing");
        let time = 40;
        let actions: Vec<f64> =
            (0..time).flat_map(|t| [-0.06 + 0.002 * f64::from(t), 0.01, 0.1 * f64::from(t)]).collect();
        let (start, time) = ([0.0; 3], time as usize);
        let task = Task { start: &start, actions: &actions, time, index: 0 };
        let path = engine.rollout(&start, &actions, time);
        // Two samples: one lags, one runs ahead and turns.
        let sample =
            |v: f64, i: usize, k: usize| v * [0.7, 1.2][k] + if i.is_multiple_of(7) { 1e-3 } else { -4e-4 };
        let values: Vec<f32> =
            path.iter().enumerate().flat_map(|(i, v)| [0, 1].map(|k| sample(*v, i, k) as f32)).collect();
        let mut samples = Samples { count: 2, values };
        let broken = violations(&engine, task, &samples);
        let is_broken = |v: &Option<Violations>, limit: f64| matches!(v, Some(Violations::Push { overlap_m, untouched_m }) if *overlap_m > limit && *untouched_m > limit);
        assert!(is_broken(&broken, 1e-4), "{broken:?}");
        keep_apart(push, task, &mut samples);
        let Some(Violations::Push { overlap_m, untouched_m }) = violations(&engine, task, &samples) else {
            panic!("a push")
        };
        // Poses are kept in single precision.
        assert!(overlap_m < 1e-7 && untouched_m == 0.0, "{overlap_m} m {untouched_m} m");
    }
}
