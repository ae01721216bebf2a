//! Simulation of poses at sample times that need not end a sub-step (dense output).

use super::engine::{Push, PushError, Run, Stepper, simulate_push};
use super::path::{Motion, Path};
use super::planar::Pose;
use super::substep::Substep;
use crate::Scalar;

/// Simulates a push and writes the reported poses at `times` (s, strictly increasing) to `poses`.
///
/// The first pose is the start.
///
/// The motion is that of [`simulate`](super::simulate), or with `is_mid_motion` that of
/// [`simulate_in_progress`](super::simulate_in_progress). Sub-steps end only at corners of the path, and poses
/// between are interpolated, so the cost does not grow with the number of samples if they are closer than
/// [`Steps::travel_m`](super::Steps::travel_m). Objects with inertia are stepped from sample to sample.
///
/// # Errors
/// The errors of [`simulate`](super::simulate).
pub fn simulate_poses<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    is_mid_motion: bool,
    poses: &mut Vec<Pose<S>>,
) -> Result<(), PushError> {
    poses.clear();
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Ok(()) };
    let mut stepper = Stepper::with_field(push.world, push.parameters, push.steps, push.field);
    if stepper.scene.has_inertia() {
        let mut run = Run { poses: Vec::new(), instants: Vec::new(), steps: 0 };
        simulate_push(push, times, &mut run, is_mid_motion)?;
        *poses = run.poses;
        return Ok(());
    }
    let delay = stepper.scene.setting.delay_s.unwrap_or_else(S::zero);
    let start_time = first - delay.value();
    let (mut pose, mut warm_start) = (stepper.true_pose(&push.start), None);
    let rod = stepper.scene.true_rod(push.path.piece(start_time).position(S::constant(start_time)));
    if !is_mid_motion {
        stepper.check_start(&pose, rod)?;
    }
    poses.push(push.start);
    let mut sample_times = times[1..].iter().map(|t| S::constant(*t) - delay).peekable();
    let (mut time, end_time) = (start_time, last - delay.value());
    while sample_times.peek().is_some() {
        let piece = push.path.piece(time);
        let until = push.path.end_of_piece(time).min(end_time);
        let count = stepper.substep_count(&piece, time, until);
        // Nothing moves: one sub-step at rest covers the interval.
        let steps = count.max(1);
        let h = (until - time) / steps as f64;
        for i in 0..steps {
            let start = time + i as f64 * h;
            let substep = if count == 0 {
                Substep::at_rest(pose, S::constant(start), S::constant(h))
            } else {
                stepper.scene.read_friction_map(&pose);
                stepper.quasi_static_substep(&piece, start, h, pose, &mut warm_start)
            };
            // The last sub-step takes all samples that are left, so that rounding cannot lose one.
            let substep_end = if until >= end_time && i + 1 == steps { f64::INFINITY } else { start + h };
            while let Some(sample_time) = sample_times.next_if(|t| t.value() <= substep_end) {
                let reported = stepper.reported_pose(&substep.pose_at(sample_time));
                if !(reported.position[0].value() + reported.position[1].value() + reported.angle.value())
                    .is_finite()
                {
                    let object = push.world.object().name.clone();
                    return Err(PushError::NotFinite { object, time_s: sample_time.value() });
                }
                poses.push(reported);
            }
            pose = substep.end_pose;
        }
        time = until;
    }
    Ok(())
}
