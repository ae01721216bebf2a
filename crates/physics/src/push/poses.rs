//! Poses of quasi-static motion at times that no sub-step ends at.

use super::arc::Arc;
use super::engine::{Push, PushError, Run, Stepper, follow};
use super::path::{Motion, Path};
use super::planar::Pose;
use crate::Scalar;

/// Poses of a push at `times` (s, strictly increasing), as the sensor reports them, into `poses`; the first is the start.
///
/// The motion is that of [`simulate`](super::simulate) (with `under_way`, of
/// [`simulate_under_way`](super::simulate_under_way)), but sub-steps end only where the path bends and the poses between are interpolated: for samples that lie closer than
/// [`Steps::travel_m`](super::Steps::travel_m) the cost no longer grows with their number. Objects with inertia are stepped
/// from sample to sample.
///
/// # Errors
/// The errors of [`simulate`](super::simulate).
pub fn simulate_poses<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    under_way: bool,
    poses: &mut Vec<Pose<S>>,
) -> Result<(), PushError> {
    poses.clear();
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Ok(()) };
    let mut stepper = Stepper::with_field(push.world, push.parameters, push.steps, push.field);
    if stepper.scene.has_inertia() {
        let mut run = Run { poses: Vec::new(), instants: Vec::new(), steps: 0 };
        follow(push, times, &mut run, under_way)?;
        *poses = run.poses;
        return Ok(());
    }
    let delay = stepper.scene.setting.delay_s.unwrap_or_else(S::zero);
    let begin = first - delay.value();
    let (mut pose, mut near) = (stepper.unreported(&push.start), None);
    let rod = stepper.scene.true_rod(push.path.piece(begin).position(S::constant(begin)));
    if !under_way {
        stepper.check_start(&pose, rod)?;
    }
    poses.push(push.start);
    let mut asked = times[1..].iter().map(|t| S::constant(*t) - delay).peekable();
    let (mut time, stop) = (begin, last - delay.value());
    while asked.peek().is_some() {
        let piece = push.path.piece(time);
        let until = push.path.end_of_piece(time).min(stop);
        let count = stepper.count(&piece, time, until);
        // At rest there is nothing to step through: one sub-step, in which nothing moves.
        let steps = count.max(1);
        let h = (until - time) / steps as f64;
        for i in 0..steps {
            let start = time + i as f64 * h;
            let arc = if count == 0 {
                Arc::still(pose, S::constant(start), S::constant(h))
            } else {
                stepper.scene.place(&pose);
                stepper.quasi_static(&piece, start, h, pose, &mut near)
            };
            // The last sub-step has whatever rounding left over.
            let ends = if until >= stop && i + 1 == steps { f64::INFINITY } else { start + h };
            while let Some(at) = asked.next_if(|t| t.value() <= ends) {
                let reported = stepper.reported(&arc.at(at));
                if !(reported.position[0].value() + reported.position[1].value() + reported.angle.value())
                    .is_finite()
                {
                    let object = push.world.object().name.clone();
                    return Err(PushError::NotFinite { object, time_s: at.value() });
                }
                poses.push(reported);
            }
            pose = arc.to;
        }
        time = until;
    }
    Ok(())
}
