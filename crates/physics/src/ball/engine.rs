//! The event-driven engine: from impact to impact, exact where flight has a closed form.
//!
//! Flight without a state-dependent force is a parabola whose contact time is a closed formula. Otherwise flight is
//! integrated by Runge-Kutta steps, and the contact is found by Newton's method on the integration step itself, carried out
//! in the scalar of the simulation, so that dual numbers come out with the derivative of the event time in them.
//! Infinitely many bounces (Zeno) end by rule: a ball that leaves slower than [`REST_SPEED`] stays on the ground.

use super::contact::Contact;
use super::flight::{Step, parabola, time_to_contact};
use super::{
    Covariates, FLOOR, GRAVITY, INERTIA_RATIO, Impact, ImpactRecord, RADIUS, RESTITUTION, State, World,
};
use crate::Scalar;
use crate::effects::{Flight, Law, Sight};
use crate::scalar::{axpy, cross, dot};

/// Normal speed below which a ball stays on the ground, m/s. The bounce it cuts is half a nanometre high.
const REST_SPEED: f64 = 1e-4;
/// Longest integration step, s: 1e-6 m of output error at the drag of a table-tennis ball at 5 m/s.
const STEP: f64 = 0.05;
/// Bounces after which a ball is taken to be at rest (a restitution of 1 would bounce for ever within one sample).
const MOST_BOUNCES: usize = 20_000;

/// Random offsets of the restitution, inputs of the simulation.
#[derive(Clone, Copy, Debug)]
pub enum Offsets<'a, S> {
    /// None.
    None,
    /// One per impact; 0 beyond the end of the slice.
    PerImpact(&'a [S]),
    /// One offset for every impact.
    Shared(S),
}

/// One simulation to run.
#[derive(Clone, Copy, Debug)]
pub struct Throw<'a, S> {
    /// The laws.
    pub world: &'a World,
    /// Parameter values, `world.parameter_count()` of them.
    pub parameters: &'a [S],
    /// Start of the flight. Before `start.time` the ball is held there.
    pub start: State<S>,
    /// The trajectory's recorded metadata.
    pub covariates: &'a Covariates,
    /// Offsets of the restitution.
    pub offsets: Offsets<'a, S>,
    /// Whether velocities are sampled too: flights cost less without.
    pub velocities: bool,
}

/// The result of a simulation. Reuse one for many runs: its buffers stay allocated.
#[derive(Clone, Debug, Default)]
pub struct Run<S> {
    /// Position as the sensor reports it, m, at each requested time.
    pub positions: Vec<[S; 3]>,
    /// True velocity, m/s, at each requested time, if velocities were asked for.
    pub velocities: Vec<[S; 3]>,
    /// Impacts up to the last requested time; their positions count heights from the floor.
    pub impacts: Vec<ImpactRecord<S>>,
    /// When the ball came to rest, if it did, s.
    pub rest_time: Option<S>,
}

/// Simulates a throw and samples it at `times` (s since the release, not decreasing), into `run`.
///
/// ```
/// use augsim_physics::ball::{Axes, Covariates, Offsets, Run, State, Throw, simulate};
/// use augsim_physics::model::Model;
/// // Dropped from 1 m with a restitution of 0.5, a ball comes back to 0.25 m.
/// let (world, parameters) = Model::plain(9.81, 0.5).world(Axes::Vertical);
/// let fall = (2.0 / 9.81_f64).sqrt();
/// let throw = Throw {
///     world: &world,
///     parameters: &parameters,
///     start: State::at_rest(1.0),
///     covariates: &Covariates::default(),
///     offsets: Offsets::None,
///     velocities: false,
/// };
/// let mut run = Run { positions: vec![], velocities: vec![], impacts: vec![], rest_time: None };
/// simulate(&throw, &[0.0, 1.5 * fall], &mut run);
/// assert!((run.positions[1][2] - 0.25).abs() < 1e-12);
/// assert!((run.impacts[0].time - fall).abs() < 1e-12);
/// ```
pub fn simulate<S: Scalar>(throw: &Throw<'_, S>, times: &[f64], run: &mut Run<S>) {
    run.positions.clear();
    run.velocities.clear();
    run.impacts.clear();
    run.rest_time = None;
    Engine::new(throw, times, run).go();
}

struct Engine<'a, S> {
    laws: Vec<(&'a dyn Law<S>, &'a [S])>,
    restitution: S,
    radius: S,
    inertia_ratio: S,
    floor: S,
    normal: [S; 3],
    constant: [S; 3],
    air: [S; 3],
    closed_form: bool,
    velocities: bool,
    observes: bool,
    active: &'static [usize],
    contact: Option<S>,
    delay: S,
    throw: &'a Throw<'a, S>,
    times: &'a [f64],
    run: &'a mut Run<S>,
}

impl<'a, S: Scalar> Engine<'a, S> {
    fn new(throw: &'a Throw<'a, S>, times: &'a [f64], run: &'a mut Run<S>) -> Self {
        let (zero, one) = (S::zero(), S::constant(1.0));
        let laws = throw.world.laws(throw.parameters);
        let base = |i: usize| throw.parameters.get(i).copied().unwrap_or(zero);
        let (mut constant, mut air) = ([zero, zero, -base(GRAVITY)], [zero; 3]);
        let (mut normal, mut contact, mut delay) = ([zero, zero, one], None, zero);
        for (law, p) in &laws {
            law.constant_acceleration(p, &mut constant);
            law.air_velocity(p, &mut air);
            if let Some(angle) = law.ground_angle(p) {
                normal = [-angle.sin(), zero, angle.cos()];
            }
            contact = law.contact_duration(p).or(contact);
            delay = law.delay(p).unwrap_or(delay);
        }
        Self {
            closed_form: !laws.iter().any(|(law, _)| law.changes_flight()),
            velocities: throw.velocities || laws.iter().any(|(law, _)| law.sees_velocity()),
            observes: laws.iter().any(|(law, _)| law.changes_sight()),
            active: throw.world.axes.indices(),
            laws,
            restitution: base(RESTITUTION),
            radius: base(RADIUS),
            inertia_ratio: base(INERTIA_RATIO),
            floor: base(FLOOR),
            normal,
            constant,
            air,
            contact,
            delay,
            throw,
            times,
            run,
        }
    }

    fn go(&mut self) {
        let mut state = self.throw.start;
        // Everything inside counts heights from the floor: laws do not depend on where the data have their zero.
        state.position[2] -= self.floor;
        for (law, p) in &self.laws {
            law.spin(p, &mut state.spin);
        }
        let held = state;
        self.emit(state.time, |_| held.position, |_| held.velocity);
        if self.gap(&state.position).value() <= 0.0 && self.rate(&state.velocity).value() <= 0.0 {
            // Released on or under the ground: it rests, or hits at once.
            match self.bounce(&state) {
                Some(next) => state = next,
                None => return self.rest(state),
            }
        }
        for _ in 0..MOST_BOUNCES {
            if self.done() {
                return;
            }
            let arrival =
                if self.closed_form { self.fly_parabola(&state) } else { self.fly_steps(&state, false) };
            let Some(arrival) = arrival else { return };
            match self.bounce(&arrival) {
                Some(next) => state = next,
                None => return self.rest(arrival),
            }
        }
        self.rest(state);
    }

    fn done(&self) -> bool {
        self.run.positions.len() >= self.times.len()
    }

    /// Time of the last state that a sample shows: a sensor that is late shows states that lie `delay` back.
    fn horizon(&self) -> f64 {
        self.times.last().map_or(f64::NEG_INFINITY, |t| t - self.delay.value())
    }

    fn gap(&self, position: &[S; 3]) -> S {
        dot(&self.normal, position)
    }

    fn rate(&self, velocity: &[S; 3]) -> S {
        dot(&self.normal, velocity)
    }

    /// Samples all requested times before `until`; `at` and `rate` give position and velocity at a time.
    fn emit(&mut self, until: S, at: impl Fn(S) -> [S; 3], rate: impl Fn(S) -> [S; 3]) {
        while let Some(&t) = self.times.get(self.run.positions.len()) {
            let time = -self.delay + t;
            if time.value() >= until.value() {
                return;
            }
            let truth = at(time);
            let velocity = if self.velocities { Some(rate(time)) } else { None };
            if self.observes {
                let mut sight =
                    Sight { position: truth, truth, velocity: velocity.unwrap_or([S::zero(); 3]) };
                for (law, p) in &self.laws {
                    law.observe(p, &mut sight);
                }
                self.put(sight.position);
            } else {
                self.put(truth);
            }
            self.run.velocities.extend(velocity);
        }
    }

    /// A sampled position, its height in the coordinates of the data.
    fn put(&mut self, [x, y, z]: [S; 3]) {
        self.run.positions.push([x, y, z + self.floor]);
    }

    fn emit_parabola(&mut self, until: S, state: &State<S>, a: &[S; 3]) {
        let active = self.active;
        self.emit(
            until,
            |t| parabola(state, a, t - state.time, active),
            |t| axpy(&state.velocity, a, t - state.time),
        );
    }

    fn emit_step(&mut self, until: S, step: &Step<S>) {
        let (active, t0) = (self.active, step.start.time);
        self.emit(until, |t| step.position(t - t0, active), |t| step.velocity(t - t0));
    }

    fn fly_parabola(&mut self, state: &State<S>) -> Option<State<S>> {
        let a = self.constant;
        let duration =
            time_to_contact(self.gap(&state.position), self.rate(&state.velocity), dot(&self.normal, &a));
        let until = duration.map_or(S::constant(f64::INFINITY), |d| state.time + d);
        self.emit_parabola(until, state, &a);
        let duration = duration?;
        if until.value() > self.horizon() {
            return None;
        }
        Some(State {
            time: until,
            position: parabola(state, &a, duration, self.active),
            velocity: axpy(&state.velocity, &a, duration),
            spin: state.spin,
        })
    }

    fn acceleration(
        &self,
        spin: &[S; 3],
        resting: bool,
        time: S,
        position: &[S; 3],
        velocity: &[S; 3],
    ) -> [S; 3] {
        let flight = Flight {
            time,
            position: *position,
            velocity: *velocity,
            airspeed: axpy(velocity, &self.air, S::constant(-1.0)),
            spin: *spin,
            covariates: self.throw.covariates,
        };
        let mut a = self.constant;
        for (law, p) in &self.laws {
            law.acceleration(p, &flight, &mut a);
        }
        if resting {
            a = axpy(&a, &self.normal, -dot(&self.normal, &a));
        }
        a
    }

    /// Integrates until contact (the arrival) or until all samples are out (`None`).
    fn fly_steps(&mut self, start: &State<S>, resting: bool) -> Option<State<S>> {
        let mut state = *start;
        while !self.done() {
            let length = S::constant(STEP);
            let spin = state.spin;
            let step = {
                let this = &*self;
                let acceleration = |t: S, p: &[S; 3], v: &[S; 3]| this.acceleration(&spin, resting, t, p, v);
                let step = Step::rk4(&state, length, this.active, &acceleration);
                if !resting && this.gap(&step.end.position).value() < 0.0 {
                    let arrival = this.locate(&step, &acceleration);
                    Err((step, arrival))
                } else {
                    Ok(step)
                }
            };
            match step {
                Ok(step) => {
                    self.emit_step(step.end.time, &step);
                    state = step.end;
                }
                Err((step, arrival)) => {
                    let short =
                        Step { start: step.start, end: arrival, length: arrival.time - step.start.time };
                    self.emit_step(arrival.time, &short);
                    return (arrival.time.value() <= self.horizon()).then_some(arrival);
                }
            }
        }
        None
    }

    /// The state at the contact inside `step`.
    fn locate(&self, step: &Step<S>, acceleration: &impl Fn(S, &[S; 3], &[S; 3]) -> [S; 3]) -> State<S> {
        let length = step.length.value();
        let (rate0, rate1) = (self.rate(&step.start.velocity).value(), self.rate(&step.end.velocity).value());
        // After a bounce the gap is zero at s = 0 too: the bracket starts at the top of the hop.
        let mut low = if rate0 > 0.0 { length * rate0 / (rate0 - rate1) } else { 0.0 };
        let mut high = length;
        let (values, normal) = (step.values(), self.normal.map(S::value));
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if dot(&normal, &values.position(middle, self.active)) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        // Newton on the integration step itself, which the cubic follows to micrometres: one iteration for the value, one,
        // in S, for the derivative.
        let mut s = S::constant(high);
        for _ in 0..2 {
            let end = Step::rk4(&step.start, S::constant(s.value()), self.active, acceleration).end;
            s = S::constant(s.value()) - self.gap(&end.position) / self.rate(&end.velocity);
            // A grazing contact has no slope to follow: the bracket is the answer, and nothing is known of its derivative.
            if !(0.0..=length).contains(&s.value()) {
                s = S::constant(high);
                break;
            }
        }
        Step::rk4(&step.start, s, self.active, acceleration).end
    }

    /// The state after the contact that begins at `arrival`; `None` if the ball stays.
    fn bounce(&mut self, arrival: &State<S>) -> Option<State<S>> {
        let rate = self.rate(&arrival.velocity);
        let speed = -rate;
        let tangential = axpy(&arrival.velocity, &self.normal, -rate);
        let surface = cross(&arrival.spin, &self.normal);
        let mut impact = Impact {
            index: self.run.impacts.len(),
            time: arrival.time,
            position: arrival.position,
            normal_speed: speed,
            slip: axpy(&tangential, &surface, -self.radius),
            tangential,
            spin: arrival.spin,
            inertia_ratio: self.inertia_ratio,
            restitution: self.restitution,
            covariates: self.throw.covariates,
        };
        if speed.value() > 0.0 {
            let mut e = self.restitution;
            for (law, p) in &self.laws {
                e = law.restitution(p, &impact, e);
            }
            e = match self.throw.offsets {
                Offsets::None => e,
                Offsets::Shared(xi) => e + xi,
                Offsets::PerImpact(xi) => xi.get(impact.index).map_or(e, |&x| e + x),
            };
            impact.restitution = if e.value() > 0.0 { e } else { S::zero() };
        } else {
            impact.restitution = S::zero();
        }
        let e = impact.restitution;
        let mut jump = [S::zero(); 3];
        for (law, p) in &self.laws {
            law.tangential(p, &impact, &mut jump);
        }
        let contact = match self.contact {
            Some(tau) if e.value() > 0.0 => {
                Some(Contact::new(tau, e, speed, -dot(&self.normal, &self.constant)))
            }
            _ => None,
        };
        let (speed_out, duration) = match &contact {
            None => (e * speed, S::zero()),
            Some(None) => (S::zero(), S::zero()),
            Some(Some(c)) => (c.speed_out(), c.duration()),
        };
        let stays = speed_out.value() < REST_SPEED;
        self.run.impacts.push(ImpactRecord {
            time: arrival.time,
            position: arrival.position,
            speed_in: speed,
            speed_out: if stays { S::zero() } else { speed_out },
            tangential,
            slip: impact.slip,
            spin: arrival.spin,
        });
        if stays {
            return None;
        }
        // The tangential impulse is taken to act evenly over the contact: on the way the ball has half of its jump.
        let drift = axpy(&tangential, &jump, S::constant(0.5));
        let time = arrival.time + duration;
        if let Some(Some(c)) = &contact {
            let normal = self.normal;
            self.emit(
                time,
                |t| {
                    let s = t - arrival.time;
                    axpy(&axpy(&arrival.position, &drift, s), &normal, c.at(s).0)
                },
                |t| axpy(&drift, &normal, c.at(t - arrival.time).1),
            );
        }
        let spin = if self.radius.value() > 0.0 {
            axpy(
                &arrival.spin,
                &cross(&self.normal, &jump),
                S::constant(-1.0) / (self.inertia_ratio * self.radius),
            )
        } else {
            arrival.spin
        };
        let moved = axpy(&arrival.position, &drift, duration);
        Some(State {
            time,
            position: axpy(&moved, &self.normal, -self.gap(&moved)),
            velocity: axpy(&axpy(&tangential, &jump, S::constant(1.0)), &self.normal, speed_out),
            spin,
        })
    }

    /// The ball stays on the ground: it moves along it, and the normal part of every force is carried by the ground.
    fn rest(&mut self, arrival: State<S>) {
        self.run.rest_time = Some(arrival.time);
        let mut state = arrival;
        state.position = axpy(&state.position, &self.normal, -self.gap(&state.position));
        state.velocity = axpy(&state.velocity, &self.normal, -self.rate(&state.velocity));
        if self.closed_form {
            let a = axpy(&self.constant, &self.normal, -dot(&self.normal, &self.constant));
            self.emit_parabola(S::constant(f64::INFINITY), &state, &a);
        } else {
            self.fly_steps(&state, true);
        }
    }
}
