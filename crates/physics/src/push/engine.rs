//! The pushing engine: quasi-static by Runge-Kutta sub-steps, or with inertia by implicit Euler sub-steps.
//!
//! A sub-step ends at the end of a piece of the rod's path, at a requested time, or after the rod has
//! travelled [`Steps::travel_m`], whichever is first. Bounding the travel instead of the time gives the same
//! motion for the same path at another speed.
//!
//! Sticking, sliding and separation are continuous in the twist, so their changes need no event location.
//! Touch-down does: its time is located, and one Newton step in the scalar of the simulation carries the
//! derivative of that time.

use super::contact::Mode;
use super::field::Field;
use super::instant::{Instant, MAX_TOUCHING_GAP_M, Scene};
use super::path::{Motion, Path, Straight};
use super::planar::{Pose, Rotation, Twist, Vector, add, dot, norm, scale, sub};
use super::substep::Substep;
use super::warm_start::WarmStart;
use super::world::World;
use crate::Scalar;
use thiserror::Error;

/// Largest initial overlap of rod and object, m, that counts as measurement error.
///
/// At least this much, or half the radius of the rod if that is more.
const MAX_INITIAL_OVERLAP_M: f64 = 1e-3;

/// Speed, m/s, below which an object with inertia is at rest if the rod does not move.
const REST_SPEED_M_S: f64 = 1e-6;

/// Reason why a push cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PushError {
    /// The rod overlaps the object at the start of the push.
    #[error(
        "the rod starts {depth_mm:.2} mm inside {object} (rod centre at ({x_m:.5}, {y_m:.5}) m, object at ({object_x_m:.5}, \
         {object_y_m:.5}) m, {angle_rad:.4} rad); check the outline, rod_radius_m, the coordinate frames of rod and object, and \
         that the pose is that of the area centroid"
    )]
    StartsInside {
        /// Name of the object that overlaps the rod.
        object: String,
        /// Depth of the overlap, mm.
        depth_mm: f64,
        /// Position of the rod centre along x, m.
        x_m: f64,
        /// Position of the rod centre along y, m.
        y_m: f64,
        /// Position of the object along x, m.
        object_x_m: f64,
        /// Position of the object along y, m.
        object_y_m: f64,
        /// Angle of the object at the start, rad.
        angle_rad: f64,
    },
    /// The simulation diverged: the pose is not finite.
    #[error(
        "the simulation of {object} diverged (non-finite pose) at t = {time_s} s; check the model's parameters"
    )]
    NotFinite {
        /// Name of the simulated object.
        object: String,
        /// Time of the first sample with a pose that is not finite, s.
        time_s: f64,
    },
}

/// Bounds on the length of integration sub-steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    /// Longest travel of the rod in one sub-step, m.
    pub travel_m: f64,
    /// Longest duration of a sub-step, s; not needed for quasi-static motion along a smooth path.
    pub duration_s: f64,
    /// Longest duration of a sub-step of an object with inertia, s.
    pub inertial_s: f64,
}

impl Default for Steps {
    /// Sub-steps of 0.5 mm, or of 1 ms with inertia.
    ///
    /// They agree with sub-steps of 0.1 mm within 1 µm over a push of 15 cm.
    fn default() -> Self {
        Self { travel_m: 5e-4, duration_s: f64::INFINITY, inertial_s: 1e-3 }
    }
}

/// Inputs of the simulation of one push: object, parameters, start pose and path of the rod.
#[derive(Debug)]
pub struct Push<'a, S, P> {
    /// The object and the effects that act on it.
    pub world: &'a World,
    /// Parameter values of the object and the effects, `world.parameter_count()` of them.
    pub parameters: &'a [S],
    /// Pose of the object at the first requested time, as the sensor reports it.
    pub start: Pose<S>,
    /// Path of the rod, as reported by the robot.
    pub path: &'a P,
    /// Map of relative friction over the table, for generated data; friction is then summed over patches.
    pub field: Option<&'a Field>,
    /// Bounds on the length of integration sub-steps.
    pub steps: Steps,
}

/// Result of simulating a push; its buffers can be reused for many pushes.
#[derive(Clone, Debug, Default)]
pub struct Run<S> {
    /// Pose of the object, as the sensor reports it, at each requested time; the first is the start.
    pub poses: Vec<Pose<S>>,
    /// Contact, twist and force at each requested time less the delay of the pose sensor.
    pub instants: Vec<Instant<S>>,
    /// Number of integration sub-steps that were made.
    pub steps: usize,
}

/// Simulates a push and writes its samples at `times` (s, strictly increasing) to `run`.
///
/// # Errors
/// The rod starts inside the object, or the simulation diverges.
pub fn simulate<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    run: &mut Run<S>,
) -> Result<(), PushError> {
    simulate_push(push, times, run, false)
}

/// Simulates a push as by [`simulate`] that is already in progress at the first requested time.
///
/// An object with inertia that the rod touches begins with the twist of quasi-static motion instead of at
/// rest. An initial overlap, such as a disturbance or a delayed sensor causes, is resolved by moving the
/// object along the contact normal.
///
/// # Errors
/// The simulation diverges.
pub fn simulate_in_progress<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    run: &mut Run<S>,
) -> Result<(), PushError> {
    simulate_push(push, times, run, true)
}

/// Largest gap between rod and object, m, that counts as contact in a push in progress.
///
/// It is several times the noise of a pose.
const MAX_GAP_UNDER_WAY_M: f64 = 1e-3;

/// Simulates a push by [`simulate`], or by [`simulate_in_progress`] if `is_mid_motion` is true.
pub(super) fn simulate_push<S: Scalar, P: Path<S>>(
    push: &Push<'_, S, P>,
    times: &[f64],
    run: &mut Run<S>,
    is_mid_motion: bool,
) -> Result<(), PushError> {
    run.poses.clear();
    run.instants.clear();
    run.steps = 0;
    let Some(&first) = times.first() else { return Ok(()) };
    let mut stepper = Stepper::with_field(push.world, push.parameters, push.steps, push.field);
    let delay = stepper.scene.setting.delay_s.unwrap_or_else(S::zero);
    let mut state = State { pose: stepper.true_pose(&push.start), twist: Twist::zero(), warm_start: None };
    let start_time = first - delay.value();
    let rod = stepper.scene.true_rod(push.path.piece(start_time).position(S::constant(start_time)));
    if !is_mid_motion {
        stepper.check_start(&state.pose, rod)?;
    }
    if is_mid_motion
        && stepper.scene.has_inertia()
        && stepper.scene.gap(&state.pose, rod).0.value() < MAX_GAP_UNDER_WAY_M
    {
        stepper.scene.read_friction_map(&state.pose);
        let velocity =
            stepper.scene.true_velocity(push.path.piece(start_time).velocity(S::constant(start_time)));
        state.twist = stepper.scene.instant_at(&state.pose, rod, velocity, true, None).twist;
    }
    let mut time = start_time;
    for (i, &t) in times.iter().enumerate() {
        let until = t - delay.value();
        while time < until {
            let piece = push.path.piece(time);
            let end = push.path.end_of_piece(time).min(until);
            stepper.advance(&piece, time, end, &mut state);
            time = end;
        }
        stepper.scene.read_friction_map(&state.pose);
        // At a corner of the path, the last sample belongs to the piece before it, every other to the next.
        let piece = push.path.piece(if i + 1 == times.len() && i > 0 {
            0.5 * (times[i - 1] - delay.value() + until)
        } else {
            until
        });
        let sample_time = S::constant(until);
        let rod = stepper.scene.true_rod(piece.position(sample_time));
        let velocity = stepper.scene.true_velocity(piece.velocity(sample_time));
        let mut instant = stepper.scene.instant_at(&state.pose, rod, velocity, false, state.warm_start);
        if stepper.scene.has_inertia() {
            instant.twist = state.twist;
        }
        // With a delayed sensor the value is taken at `t - delay`; its derivative with respect to the delay
        // is minus the velocity.
        let delay_derivative = S::constant(delay.value()) - delay;
        let pose = if i == 0 { state.pose } else { state.pose.advanced(&instant.twist, delay_derivative) };
        if !(pose.position[0].value() + pose.position[1].value() + pose.angle.value()).is_finite() {
            return Err(PushError::NotFinite { object: push.world.object().name.clone(), time_s: t });
        }
        run.poses.push(if i == 0 { push.start } else { stepper.reported_pose(&pose) });
        run.instants.push(instant);
    }
    run.steps = stepper.steps_taken;
    Ok(())
}

/// State of the object between sub-steps: pose, twist and initial guess of the contact solver.
#[derive(Clone, Copy, Debug)]
struct State<S> {
    pose: Pose<S>,
    twist: Twist<S>,
    warm_start: Option<WarmStart>,
}

/// Integrator that moves one object with given parameter values.
#[derive(Clone, Debug)]
pub struct Stepper<'a, S> {
    pub(super) scene: Scene<'a, S>,
    steps: Steps,
    steps_taken: usize,
}

/// State of the object after [`Stepper::step`].
#[derive(Clone, Copy, Debug)]
pub struct StepResult<S> {
    /// Pose of the object after the step.
    pub pose: Pose<S>,
    /// Twist of the object at the end of the step; with inertia the initial twist of the next step.
    pub twist: Twist<S>,
    /// Contact, twist and force at the end of the step.
    pub instant: Instant<S>,
}

impl<'a, S: Scalar> Stepper<'a, S> {
    /// An integrator of the object and effects of `world` with these parameter values.
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

    /// Moves the object over the time between two samples of the rod.
    ///
    /// The rod moves from `from` to `to` (reported positions, m) in a straight line in `duration`, s. The
    /// object starts at `pose`; `twist` is used with inertia only. An initial overlap, such as noise causes,
    /// is resolved by moving the object along the contact normal, so the step cannot fail. `pose` is the true
    /// pose: the offset and the delay of the pose sensor are not applied.
    pub fn step(
        &mut self,
        pose: Pose<S>,
        twist: Twist<S>,
        from: Vector<S>,
        to: Vector<S>,
        duration: f64,
    ) -> StepResult<S> {
        let velocity = scale(sub(to, from), S::constant(1.0 / duration));
        let piece = Straight { start: from, velocity, since: 0.0 };
        let mut state = State { pose, twist, warm_start: None };
        self.advance(&piece, 0.0, duration, &mut state);
        self.scene.read_friction_map(&state.pose);
        let velocity = self.scene.true_velocity(velocity);
        let instant =
            self.scene.instant_at(&state.pose, self.scene.true_rod(to), velocity, false, state.warm_start);
        let twist = if self.scene.has_inertia() { state.twist } else { instant.twist };
        StepResult { pose: state.pose, twist, instant }
    }

    /// Contact, twist and force at `pose` with the reported rod at `rod`, m, moving with `velocity`, m/s.
    pub fn instant(&mut self, pose: &Pose<S>, rod: Vector<S>, velocity: Vector<S>) -> Instant<S> {
        self.scene.read_friction_map(pose);
        self.scene.instant_at(pose, self.scene.true_rod(rod), self.scene.true_velocity(velocity), false, None)
    }

    /// Pose that the sensor reports if the object has the pose `pose`.
    pub(super) fn reported_pose(&self, pose: &Pose<S>) -> Pose<S> {
        let Some((offset, turn)) = self.scene.setting.pose_offset else { return *pose };
        Pose { position: pose.to_world(offset), angle: pose.angle + turn }
    }

    /// True pose of the object if the sensor reports `pose`.
    pub(super) fn true_pose(&self, pose: &Pose<S>) -> Pose<S> {
        let Some((offset, turn)) = self.scene.setting.pose_offset else { return *pose };
        let angle = pose.angle - turn;
        Pose { position: sub(pose.position, Rotation::new(angle).to_world(offset)), angle }
    }

    /// Checks that the rod overlaps the object by no more than measurement errors explain.
    pub(super) fn check_start(&self, pose: &Pose<S>, rod: Vector<S>) -> Result<(), PushError> {
        let depth = -self.scene.gap(pose, rod).0.value();
        let max_depth = MAX_INITIAL_OVERLAP_M.max(0.5 * self.scene.setting.rod_radius_m.value());
        if depth <= max_depth {
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

    /// Number of sub-steps from time `from` to time `to`, s; 0 if nothing moves.
    pub(super) fn substep_count<M: Motion<S>>(&self, piece: &M, from: f64, to: f64) -> usize {
        let position = |t: f64| piece.position(S::constant(t)).map(S::value);
        let travel = norm(sub(position(to), position(from)));
        let has_inertia = self.scene.has_inertia();
        if travel == 0.0 && !has_inertia {
            return 0;
        }
        let longest = if has_inertia { self.steps.inertial_s } else { self.steps.duration_s };
        // The margin keeps rounding from adding a step to a travel that is a whole number of steps.
        let count = (travel / self.steps.travel_m).max((to - from) / longest);
        (count - 1e-9).ceil().max(1.0) as usize
    }

    /// Moves the object along one piece of the rod's path, from time `from` to time `to`, s.
    fn advance<M: Motion<S>>(&mut self, piece: &M, from: f64, to: f64, state: &mut State<S>) {
        let count = self.substep_count(piece, from, to);
        let has_inertia = self.scene.has_inertia();
        let h = (to - from) / count as f64;
        for i in 0..count {
            let start = from + i as f64 * h;
            self.steps_taken += 1;
            self.scene.read_friction_map(&state.pose);
            if has_inertia {
                self.inertial_substep(piece, start, h, state);
            } else {
                state.pose =
                    self.quasi_static_substep(piece, start, h, state.pose, &mut state.warm_start).end_pose;
            }
        }
    }

    /// True position of the rod, m, with its deflection if it is compliant.
    ///
    /// The deflection follows from the contact force at the undeflected position.
    fn deflected_rod<M: Motion<S>>(
        &self,
        piece: &M,
        pose: &Pose<S>,
        time: S,
        warm_start: Option<WarmStart>,
    ) -> Vector<S> {
        let rod = self.scene.true_rod(piece.position(time));
        let Some(compliance) = self.scene.setting.compliance_m_per_n else { return rod };
        let velocity = self.scene.true_velocity(piece.velocity(time));
        let force = self.scene.instant_at(pose, rod, velocity, true, warm_start).force;
        sub(rod, scale(force, compliance))
    }

    /// Makes a quasi-static sub-step of `h` s from time `start`; the object rests until the rod touches it.
    ///
    /// `warm_start` is the initial guess of the contact solver, and is updated.
    pub(super) fn quasi_static_substep<M: Motion<S>>(
        &self,
        piece: &M,
        start: f64,
        h: f64,
        pose: Pose<S>,
        warm_start: &mut Option<WarmStart>,
    ) -> Substep<S> {
        let (start_time, end) = (S::constant(start), start + h);
        let (gap, _) = self.scene.gap(&pose, self.deflected_rod(piece, &pose, start_time, *warm_start));
        if gap.value() <= MAX_TOUCHING_GAP_M {
            return self.runge_kutta(piece, start_time, S::constant(h), pose, warm_start);
        }
        let end_gap =
            self.scene.gap(&pose, self.deflected_rod(piece, &pose, S::constant(end), *warm_start)).0;
        if end_gap.value() >= 0.0 {
            return Substep::at_rest(pose, start_time, S::constant(h));
        }
        let touch = self.touch_down(piece, start, h, &pose, gap.value(), end_gap.value());
        self.runge_kutta(piece, touch, S::constant(end) - touch, pose, warm_start)
    }

    /// Time, s, at which the gap between rod and object closes, between `start` and `start + h`.
    ///
    /// Newton's method with a bracket finds the value; one more step in `S` carries the derivatives. `gap`
    /// and `end_gap` are the gaps at both ends, m.
    fn touch_down<M: Motion<S>>(
        &self,
        piece: &M,
        start: f64,
        h: f64,
        pose: &Pose<S>,
        gap: f64,
        end_gap: f64,
    ) -> S {
        let gap_at = |t: f64| {
            let time = S::constant(t);
            self.scene.gap(pose, self.deflected_rod(piece, pose, time, None))
        };
        let (mut low, mut high) = (start, start + h);
        let mut guess = start + h * gap / (gap - end_gap);
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

    /// Makes one classical Runge-Kutta step with rod and object in contact, then closes the gap.
    fn runge_kutta<M: Motion<S>>(
        &self,
        piece: &M,
        start: S,
        h: S,
        pose: Pose<S>,
        warm_start: &mut Option<WarmStart>,
    ) -> Substep<S> {
        let is_compliant = self.scene.setting.compliance_m_per_n.is_some();
        let mut twist = |pose: &Pose<S>, time: S| {
            let rod = if is_compliant {
                self.deflected_rod(piece, pose, time, *warm_start)
            } else {
                self.scene.true_rod(piece.position(time))
            };
            let velocity = self.scene.true_velocity(piece.velocity(time));
            let instant = self.scene.instant_at(pose, rod, velocity, true, *warm_start);
            *warm_start = Some(instant.warm_start(velocity));
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
        let rod = if is_compliant {
            self.deflected_rod(piece, &next, end, *warm_start)
        } else {
            self.scene.true_rod(piece.position(end))
        };
        let end_pose = self.with_gap_closed(next, rod, mode != Mode::Separate);
        Substep { start, duration: h, start_pose: pose, end_pose, start_twist: k1, end_twist: k4 }
    }

    /// Pose moved along the contact normal to remove an overlap and, if `pressing`, a gap below 1e-5 m.
    fn with_gap_closed(&self, pose: Pose<S>, rod: Vector<S>, pressing: bool) -> Pose<S> {
        let (gap, outward) = self.scene.gap(&pose, rod);
        if gap.value() >= 0.0 && !(pressing && gap.value() < 1e-5) {
            return pose;
        }
        Pose { position: add(pose.position, scale(outward, gap)), angle: pose.angle }
    }

    /// Makes an implicit Euler sub-step of `h` s from time `start` for an object with inertia.
    fn inertial_substep<M: Motion<S>>(&self, piece: &M, start: f64, h: f64, state: &mut State<S>) {
        let (begin, end) = (S::constant(start), S::constant(start + h));
        let is_still = |v: Vector<S>| dot(v, v).value() < REST_SPEED_M_S * REST_SPEED_M_S;
        let turning_speed = state.twist.rotation.value() * self.scene.world.mean_radius_m;
        let is_at_rest = is_still(state.twist.velocity) && turning_speed.abs() < REST_SPEED_M_S;
        if is_at_rest && is_still(piece.velocity(begin)) && is_still(piece.velocity(end)) {
            // Nothing can start to move: on a level table no force acts, on a tilted one friction holds the
            // object.
            state.twist = Twist::zero();
            return;
        }
        let rod = self.deflected_rod(piece, &state.pose, begin, state.warm_start);
        let next_rod = self.scene.true_rod(piece.position(end));
        let length = S::constant(h);
        let velocity = scale(sub(next_rod, self.scene.true_rod(piece.position(begin))), S::constant(1.0 / h));
        let instant =
            self.scene.implicit_euler_step(&state.pose, rod, velocity, length, state.twist, state.warm_start);
        state.warm_start = Some(instant.warm_start(velocity));
        let pose = state.pose.advanced(&instant.twist, length);
        state.pose =
            self.with_gap_closed(pose, self.deflected_rod(piece, &pose, end, state.warm_start), false);
        state.twist = instant.twist;
    }
}
