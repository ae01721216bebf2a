//! The pushing engine: quasi-static by Runge-Kutta sub-steps, or with inertia by implicit Euler sub-steps.
//!
//! A sub-step ends where a piece of the rod's path or a requested time does, and no later than the rod has travelled
//! [`Steps::travel_m`]: the same path at another speed gives the same motion. Sticking, sliding and separation are continuous
//! in the twist and need no event. Touch-down does: it is located, and one Newton step in the scalar of the simulation carries
//! the derivative of the event time.

use super::arc::Arc;
use super::contact::Mode;
use super::field::Field;
use super::instant::{Instant, Scene, TOUCHING_M};
use super::near::Near;
use super::path::{Motion, Path, Straight};
use super::planar::{Pose, Rotation, Twist, Vector, add, dot, norm, scale, sub};
use super::world::World;
use crate::Scalar;
use thiserror::Error;

/// Overlap of rod and object that counts as an error of measurement at the start, m; half the rod's radius if that is more.
const TOLERATED_OVERLAP_M: f64 = 1e-3;

/// Speed below which an object with inertia that nothing moves is at rest, m/s.
const RESTING_M_S: f64 = 1e-6;

/// A push that cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PushError {
    /// The rod starts inside the object.
    #[error(
        "the rod starts {depth_mm:.2} mm inside {object} (rod centre at ({x_m:.5}, {y_m:.5}) m, object at ({object_x_m:.5}, \
         {object_y_m:.5}) m, {angle_rad:.4} rad); check the outline, rod_radius_m, the frames of pusher and object, and that \
         the pose is that of the area centroid"
    )]
    StartsInside {
        /// Name of the object.
        object: String,
        /// Overlap, mm.
        depth_mm: f64,
        /// Rod centre, m.
        x_m: f64,
        /// Rod centre, m.
        y_m: f64,
        /// Object, m.
        object_x_m: f64,
        /// Object, m.
        object_y_m: f64,
        /// Object, rad.
        angle_rad: f64,
    },
    /// The simulation left the finite numbers.
    #[error(
        "the simulation of {object} left the finite numbers at t = {time_s} s; check the model's parameters"
    )]
    NotFinite {
        /// Name of the object.
        object: String,
        /// When, s.
        time_s: f64,
    },
}

/// How finely a push is integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    /// Longest travel of the rod in a sub-step, m.
    pub travel_m: f64,
    /// Longest sub-step, s. Quasi-static motion along a smooth path needs no bound.
    pub duration_s: f64,
    /// Longest sub-step where inertia acts, s.
    pub inertial_s: f64,
}

impl Default for Steps {
    /// 0.5 mm: within 1 µm of 0.1 mm over a push of 15 cm. Inertia by 1 ms.
    fn default() -> Self {
        Self { travel_m: 5e-4, duration_s: f64::INFINITY, inertial_s: 1e-3 }
    }
}

/// One push to simulate.
#[derive(Debug)]
pub struct Push<'a, S, P> {
    /// Object and laws.
    pub world: &'a World,
    /// Parameter values, `world.parameter_count()` of them.
    pub parameters: &'a [S],
    /// Pose of the object at the first requested time, as the sensor would report it.
    pub start: Pose<S>,
    /// The rod's path, as it is reported.
    pub path: &'a P,
    /// Relative friction over the table, for truths that have one; friction is then summed over patches.
    pub field: Option<&'a Field>,
    /// How finely to integrate.
    pub steps: Steps,
}

/// The result of a simulation. Reuse one for many pushes: its buffers stay allocated.
#[derive(Clone, Debug, Default)]
pub struct Run<S> {
    /// Pose as the sensor reports it, at each requested time; the first is the start.
    pub poses: Vec<Pose<S>>,
    /// Contact, twist and force at each requested time (with a late sensor: at the time that it reports).
    pub instants: Vec<Instant<S>>,
    /// Integration sub-steps taken.
    pub steps: usize,
}

/// Simulates a push and samples it at `times` (s, strictly increasing), into `run`.
///
/// # Errors
/// The rod starts inside the object, or the numbers overflow.
pub fn simulate<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    run: &mut Run<S>,
) -> Result<(), PushError> {
    follow(push, times, run, false)
}

/// [`simulate`] for a push that is already under way at the first requested time: an object with inertia that the rod touches
/// begins with the twist of quasi-static motion instead of at rest, and an overlap, such as a knock or a late sensor makes, is
/// resolved by moving the object along the normal.
///
/// # Errors
/// The numbers overflow.
pub fn simulate_under_way<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    run: &mut Run<S>,
) -> Result<(), PushError> {
    follow(push, times, run, true)
}

/// Gap within which a push under way counts as touching, m: several times the noise of a pose.
const UNDER_WAY_GAP_M: f64 = 1e-3;

pub(super) fn follow<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    run: &mut Run<S>,
    under_way: bool,
) -> Result<(), PushError> {
    run.poses.clear();
    run.instants.clear();
    run.steps = 0;
    let Some(&first) = times.first() else { return Ok(()) };
    let mut stepper = Stepper::with_field(push.world, push.parameters, push.steps, push.field);
    let delay = stepper.scene.setting.delay_s.unwrap_or_else(S::zero);
    let mut state = State { pose: stepper.unreported(&push.start), twist: Twist::zero(), near: None };
    let begin = first - delay.value();
    let rod = stepper.scene.true_rod(push.path.piece(begin).position(S::constant(begin)));
    if !under_way {
        stepper.check_start(&state.pose, rod)?;
    }
    if under_way
        && stepper.scene.has_inertia()
        && stepper.scene.gap(&state.pose, rod).0.value() < UNDER_WAY_GAP_M
    {
        stepper.scene.place(&state.pose);
        let velocity = stepper.scene.true_velocity(push.path.piece(begin).velocity(S::constant(begin)));
        state.twist = stepper.scene.at(&state.pose, rod, velocity, true, None).twist;
    }
    let mut time = begin;
    for (i, &t) in times.iter().enumerate() {
        let until = t - delay.value();
        while time < until {
            let piece = push.path.piece(time);
            let end = push.path.end_of_piece(time).min(until);
            stepper.advance(&piece, time, end, &mut state);
            time = end;
        }
        stepper.scene.place(&state.pose);
        // The last sample ends the piece before it; every other one begins the next.
        let piece = push.path.piece(if i + 1 == times.len() && i > 0 {
            0.5 * (times[i - 1] - delay.value() + until)
        } else {
            until
        });
        let at = S::constant(until);
        let rod = stepper.scene.true_rod(piece.position(at));
        let velocity = stepper.scene.true_velocity(piece.velocity(at));
        let mut instant = stepper.scene.at(&state.pose, rod, velocity, false, state.near);
        if stepper.scene.has_inertia() {
            instant.twist = state.twist;
        }
        // A late sensor: the value is taken at `t - delay`, the derivative with respect to the delay is the velocity.
        let late = S::constant(delay.value()) - delay;
        let pose = if i == 0 { state.pose } else { state.pose.advanced(&instant.twist, late) };
        if !(pose.position[0].value() + pose.position[1].value() + pose.angle.value()).is_finite() {
            return Err(PushError::NotFinite { object: push.world.object().name.clone(), time_s: t });
        }
        run.poses.push(if i == 0 { push.start } else { stepper.reported(&pose) });
        run.instants.push(instant);
    }
    run.steps = stepper.steps_taken;
    Ok(())
}

/// The object between sub-steps.
#[derive(Clone, Copy, Debug)]
struct State<S> {
    pose: Pose<S>,
    twist: Twist<S>,
    near: Option<Near>,
}

/// A world with its numbers filled in, that moves an object step by step.
#[derive(Clone, Debug)]
pub struct Stepper<'a, S> {
    pub(super) scene: Scene<'a, S>,
    steps: Steps,
    steps_taken: usize,
}

/// The result of one step.
#[derive(Clone, Copy, Debug)]
pub struct Stepped<S> {
    /// Pose after the step.
    pub pose: Pose<S>,
    /// Twist at the end of the step; what an object with inertia goes on with.
    pub twist: Twist<S>,
    /// Contact at the end of the step.
    pub instant: Instant<S>,
}

impl<'a, S: Scalar> Stepper<'a, S> {
    /// A stepper of `world` with `parameters`.
    pub fn new(world: &'a World, parameters: &[S], steps: Steps) -> Self {
        Self::with_field(world, parameters, steps, None)
    }

    pub(super) fn with_field(
        world: &'a World,
        parameters: &[S],
        steps: Steps,
        field: Option<&'a Field>,
    ) -> Self {
        Self { scene: Scene::new(world, parameters, field), steps, steps_taken: 0 }
    }

    /// One sample to the next: the rod goes from `from` to `to` (reported positions, m) in `duration` s, in a straight line;
    /// the object starts at `pose` with `twist` (used with inertia only).
    ///
    /// Never fails: an overlap at the start, such as noise makes, is resolved by moving the object along the normal. The
    /// pose is the true one: pose offset and delay are the sensor's and do not act here.
    pub fn step(
        &mut self,
        pose: Pose<S>,
        twist: Twist<S>,
        from: Vector<S>,
        to: Vector<S>,
        duration: f64,
    ) -> Stepped<S> {
        let velocity = scale(sub(to, from), S::constant(1.0 / duration));
        let piece = Straight { start: from, velocity, since: 0.0 };
        let mut state = State { pose, twist, near: None };
        self.advance(&piece, 0.0, duration, &mut state);
        self.scene.place(&state.pose);
        let velocity = self.scene.true_velocity(velocity);
        let instant = self.scene.at(&state.pose, self.scene.true_rod(to), velocity, false, state.near);
        let twist = if self.scene.has_inertia() { state.twist } else { instant.twist };
        Stepped { pose: state.pose, twist, instant }
    }

    /// The instant at `pose` with the reported rod at `rod`, moving with `velocity`, m/s.
    pub fn instant(&mut self, pose: &Pose<S>, rod: Vector<S>, velocity: Vector<S>) -> Instant<S> {
        self.scene.place(pose);
        self.scene.at(pose, self.scene.true_rod(rod), self.scene.true_velocity(velocity), false, None)
    }

    /// The pose that the sensor reports.
    pub(super) fn reported(&self, pose: &Pose<S>) -> Pose<S> {
        let Some((offset, turn)) = self.scene.setting.pose_offset else { return *pose };
        Pose { position: pose.to_world(offset), angle: pose.angle + turn }
    }

    /// The pose that the sensor reports as `pose`.
    pub(super) fn unreported(&self, pose: &Pose<S>) -> Pose<S> {
        let Some((offset, turn)) = self.scene.setting.pose_offset else { return *pose };
        let angle = pose.angle - turn;
        Pose { position: sub(pose.position, Rotation::new(angle).to_world(offset)), angle }
    }

    pub(super) fn check_start(&self, pose: &Pose<S>, rod: Vector<S>) -> Result<(), PushError> {
        let depth = -self.scene.gap(pose, rod).0.value();
        let tolerated = TOLERATED_OVERLAP_M.max(0.5 * self.scene.setting.rod_radius_m.value());
        if depth <= tolerated {
            return Ok(());
        }
        Err(PushError::StartsInside {
            object: self.scene.world.object().name.clone(),
            depth_mm: depth * 1e3,
            x_m: rod[0].value(),
            y_m: rod[1].value(),
            object_x_m: pose.position[0].value(),
            object_y_m: pose.position[1].value(),
            angle_rad: pose.angle.value(),
        })
    }

    /// Sub-steps from `from` to `to`; none where nothing moves.
    pub(super) fn count<M: Motion<S>>(&self, piece: &M, from: f64, to: f64) -> usize {
        let position = |t: f64| piece.position(S::constant(t)).map(S::value);
        let travel = norm(sub(position(to), position(from)));
        let inertia = self.scene.has_inertia();
        if travel == 0.0 && !inertia {
            return 0;
        }
        let longest = if inertia { self.steps.inertial_s } else { self.steps.duration_s };
        // A travel that is a whole number of steps up to rounding takes that number.
        let count = (travel / self.steps.travel_m).max((to - from) / longest);
        (count - 1e-9).ceil().max(1.0) as usize
    }

    /// Moves the object along one piece of the path.
    fn advance<M: Motion<S>>(&mut self, piece: &M, from: f64, to: f64, state: &mut State<S>) {
        let count = self.count(piece, from, to);
        let inertia = self.scene.has_inertia();
        let h = (to - from) / count as f64;
        for i in 0..count {
            let start = from + i as f64 * h;
            self.steps_taken += 1;
            self.scene.place(&state.pose);
            if inertia {
                self.inertial(piece, start, h, state);
            } else {
                state.pose = self.quasi_static(piece, start, h, state.pose, &mut state.near).to;
            }
        }
    }

    /// The deflection of a rod that yields, m: the force of the contact is that of the rod as it is bent.
    fn bent<M: Motion<S>>(&self, piece: &M, pose: &Pose<S>, time: S, near: Option<Near>) -> Vector<S> {
        let rod = self.scene.true_rod(piece.position(time));
        let Some(compliance) = self.scene.setting.compliance_m_per_n else { return rod };
        let velocity = self.scene.true_velocity(piece.velocity(time));
        let force = self.scene.at(pose, rod, velocity, true, near).force;
        sub(rod, scale(force, compliance))
    }

    /// Makes a sub-step of `h` s from `start`: the object rests until the rod touches it. `near` is the contact's motion before
    /// the sub-step, and after it.
    pub(super) fn quasi_static<M: Motion<S>>(
        &self,
        piece: &M,
        start: f64,
        h: f64,
        pose: Pose<S>,
        near: &mut Option<Near>,
    ) -> Arc<S> {
        let (begin, end) = (S::constant(start), start + h);
        let (gap, _) = self.scene.gap(&pose, self.bent(piece, &pose, begin, *near));
        if gap.value() <= TOUCHING_M {
            return self.runge_kutta(piece, begin, S::constant(h), pose, near);
        }
        let at_end = self.scene.gap(&pose, self.bent(piece, &pose, S::constant(end), *near)).0;
        if at_end.value() >= 0.0 {
            return Arc::still(pose, begin, S::constant(h));
        }
        let touch = self.touch_down(piece, start, h, &pose, gap.value(), at_end.value());
        self.runge_kutta(piece, touch, S::constant(end) - touch, pose, near)
    }

    /// When the gap closes between `start` and `start + h`, s.
    fn touch_down<M: Motion<S>>(
        &self,
        piece: &M,
        start: f64,
        h: f64,
        pose: &Pose<S>,
        gap: f64,
        at_end: f64,
    ) -> S {
        let gap_at = |t: f64| {
            let time = S::constant(t);
            self.scene.gap(pose, self.bent(piece, pose, time, None))
        };
        let (mut low, mut high) = (start, start + h);
        let mut guess = start + h * gap / (gap - at_end);
        for _ in 0..60 {
            let (g, outward) = gap_at(guess);
            if g.value() > 0.0 {
                low = guess;
            } else {
                high = guess;
            }
            let rate = dot(outward, self.scene.true_velocity(piece.velocity(S::constant(guess)))).value();
            let newton = guess - g.value() / rate;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - guess).abs() <= 1e-15 * h.max(guess.abs()) || g.value() == 0.0 {
                break;
            }
            guess = next;
        }
        let (g, outward) = gap_at(guess);
        let rate = dot(outward, self.scene.true_velocity(piece.velocity(S::constant(guess))));
        S::constant(guess) - g * (1.0 / rate.value())
    }

    /// One Runge-Kutta step of a pair that touches; then the rod is put back on the outline.
    fn runge_kutta<M: Motion<S>>(
        &self,
        piece: &M,
        start: S,
        h: S,
        pose: Pose<S>,
        near: &mut Option<Near>,
    ) -> Arc<S> {
        let compliant = self.scene.setting.compliance_m_per_n.is_some();
        let mut twist = |pose: &Pose<S>, time: S| {
            let rod = if compliant {
                self.bent(piece, pose, time, *near)
            } else {
                self.scene.true_rod(piece.position(time))
            };
            let velocity = self.scene.true_velocity(piece.velocity(time));
            let instant = self.scene.at(pose, rod, velocity, true, *near);
            *near = Some(instant.near(velocity));
            (instant.twist, instant.mode)
        };
        let (k1, _) = twist(&pose, start);
        let middle = start + h * 0.5;
        let (k2, _) = twist(&pose.advanced(&k1, h * 0.5), middle);
        let (k3, _) = twist(&pose.advanced(&k2, h * 0.5), middle);
        let end = start + h;
        let (k4, mode) = twist(&pose.advanced(&k3, h), end);
        let sum = Twist {
            velocity: add(
                add(k1.velocity, k4.velocity),
                scale(add(k2.velocity, k3.velocity), S::constant(2.0)),
            ),
            rotation: k1.rotation + k4.rotation + (k2.rotation + k3.rotation) * 2.0,
        };
        let next = pose.advanced(&sum, h * (1.0 / 6.0));
        let rod = if compliant {
            self.bent(piece, &next, end, *near)
        } else {
            self.scene.true_rod(piece.position(end))
        };
        let to = self.projected(next, rod, mode != Mode::Separate);
        Arc { start, duration: h, from: pose, to, begins: k1, ends: k4 }
    }

    /// The pose moved along the normal so that nothing overlaps and, if the rod presses, that nothing gapes.
    fn projected(&self, pose: Pose<S>, rod: Vector<S>, pressing: bool) -> Pose<S> {
        let (gap, outward) = self.scene.gap(&pose, rod);
        if gap.value() >= 0.0 && !(pressing && gap.value() < 1e-5) {
            return pose;
        }
        Pose { position: add(pose.position, scale(outward, gap)), angle: pose.angle }
    }

    fn inertial<M: Motion<S>>(&self, piece: &M, start: f64, h: f64, state: &mut State<S>) {
        let (begin, end) = (S::constant(start), S::constant(start + h));
        let still = |v: Vector<S>| dot(v, v).value() < RESTING_M_S * RESTING_M_S;
        let turning = state.twist.rotation.value() * self.scene.world.mean_radius_m;
        let rests = still(state.twist.velocity) && turning.abs() < RESTING_M_S;
        if rests && still(piece.velocity(begin)) && still(piece.velocity(end)) {
            // On a level table nothing starts by itself; on a tilted one friction holds it.
            state.twist = Twist::zero();
            return;
        }
        let rod = self.bent(piece, &state.pose, begin, state.near);
        let next_rod = self.scene.true_rod(piece.position(end));
        let length = S::constant(h);
        let velocity = scale(sub(next_rod, self.scene.true_rod(piece.position(begin))), S::constant(1.0 / h));
        let instant = self.scene.after(&state.pose, rod, velocity, length, state.twist, state.near);
        state.near = Some(instant.near(velocity));
        let pose = state.pose.advanced(&instant.twist, length);
        state.pose = self.projected(pose, self.bent(piece, &pose, end, state.near), false);
        state.twist = instant.twist;
    }
}
