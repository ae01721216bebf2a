//! A forecaster of pushes whose sampled poses satisfy the non-penetration constraint.
//!
//! Measured poses carry noise, so even measured pushes overlap with the rod and move before contact. A
//! constrained forecast cannot contain that noise, so its prediction bands cover fewer measured poses. The
//! league shows both rows.

use crate::engine::ModelPush;
use crate::violations::{TOUCH_M, gap};
use crate::{Difference, Engine, Forecaster, Samples, Task, TrainerError};

/// Maximum number of times that a pose is moved out of the rod.
///
/// One suffices at a side; at a corner the nearest point may change.
const MAX_PROJECTIONS: usize = 4;

/// Wraps a forecaster of pushes so that the object rests until contact and never overlaps with the rod.
#[derive(Debug)]
pub struct NonPenetrating<'a, F> {
    model: &'a F,
    push: &'a ModelPush,
}

impl<'a, F: Forecaster> NonPenetrating<'a, F> {
    /// Wraps the forecaster `model`, which forecasts pushes that `engine` simulates.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] if the engine is not one of pushing.
    pub fn new(model: &'a F, engine: &'a Engine) -> Result<Self, TrainerError> {
        let push = engine.push_model().ok_or(Difference::OtherSystem)?;
        Ok(NonPenetrating { model, push })
    }
}

impl<F: Forecaster> Forecaster for NonPenetrating<'_, F> {
    fn name(&self) -> &str {
        self.model.name()
    }

    fn is_deterministic(&self) -> bool {
        self.model.is_deterministic()
    }

    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
        let mut out = self.model.forecast(task, samples)?;
        project_poses(self.push, task, &mut out);
        Ok(out)
    }
}

/// Changes sampled poses `[time, 3, sample]` so that they do not overlap with the rod or move before contact.
fn project_poses(push: &ModelPush, task: Task<'_>, samples: &mut Samples) {
    let n = samples.count;
    let start = [task.start[0], task.start[1], task.start[2]];
    let contact = (0..task.time).find(|&t| gap(push, &task, t, start).0 < TOUCH_M).unwrap_or(task.time);
    for sample in 0..n {
        for t in 0..task.time {
            let index = |j: usize| (t * 3 + j) * n + sample;
            let mut pose = match t <= contact {
                true => start,
                false => [0, 1, 2].map(|j| f64::from(samples.values[index(j)])),
            };
            for _ in 0..MAX_PROJECTIONS {
                let (gap, outward) = gap(push, &task, t, pose);
                if gap >= 0.0 {
                    break;
                }
                (0..2).for_each(|j| pose[j] += gap * outward[j]);
            }
            (0..3).for_each(|j| samples.values[index(j)] = pose[j] as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: poses after the projection have no violations.
    use super::*;
    use crate::violations::{Violations, violations};

    #[test]
    fn projected_poses_have_no_violations() {
        let object = augsim_physics::push::Object::named("rect1").expect("built in");
        let model =
            augsim_physics::model::ModelFile::Push(augsim_physics::model::PushModel::textbook(object));
        let engine = Engine::from_model_file(&model, None).expect("an engine");
        let push = engine.push_model().expect("pushing");
        let time = 40;
        let actions: Vec<f64> =
            (0..time).flat_map(|t| [-0.06 + 0.002 * f64::from(t), 0.01, 0.1 * f64::from(t)]).collect();
        let (start, time) = ([0.0; 3], time as usize);
        let task = Task { start: &start, actions: &actions, time, index: 0 };
        let path = engine.rollout(&start, &actions, time);
        // Two samples: displacements of the engine scaled by 0.7 and by 1.2, with an offset.
        let sample =
            |v: f64, i: usize, k: usize| v * [0.7, 1.2][k] + if i.is_multiple_of(7) { 1e-3 } else { -4e-4 };
        let values: Vec<f32> =
            path.iter().enumerate().flat_map(|(i, v)| [0, 1].map(|k| sample(*v, i, k) as f32)).collect();
        let mut samples = Samples { count: 2, values };
        let before = violations(&engine, task, &samples);
        let has_violations = matches!(before, Some(Violations::Push { overlap_m, untouched_m }) if overlap_m > 1e-4 && untouched_m > 1e-4);
        assert!(has_violations, "{before:?}");
        project_poses(push, task, &mut samples);
        let Some(Violations::Push { overlap_m, untouched_m }) = violations(&engine, task, &samples) else {
            panic!("a push")
        };
        // Poses are stored in single precision.
        assert!(overlap_m < 1e-7 && untouched_m == 0.0, "{overlap_m} m {untouched_m} m");
    }
}
