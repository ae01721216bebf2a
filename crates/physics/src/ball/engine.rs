//! The event-driven engine: simulates from impact to impact, exactly where flight has a closed form.
//!
//! Flight without a state-dependent force is a parabola with a closed formula for the contact time. Otherwise
//! flight is integrated by Runge-Kutta steps, and the contact time is found by Newton's method on the
//! integration step itself. The last Newton iteration is computed in the scalar of the simulation, so that
//! dual numbers contain the derivative of the event time. Infinitely many bounces in finite time (Zeno) are
//! avoided by a rest condition: a ball that leaves the ground slower than [`REST_SPEED`] stays on it.

use super::contact::Contact;
use super::effects::{Flight, Law, Measurement};
use super::flight::{Step, parabola, time_to_contact};
use super::{
    Covariates, FLOOR, GRAVITY, INERTIA_RATIO, Impact, ImpactRecord, RADIUS, RESTITUTION, State, World,
};
use crate::Scalar;
use crate::scalar::{axpy, cross, dot};

/// Normal speed after an impact below which the ball stays on the ground, m/s; it would rise by 0.5 nm.
const REST_SPEED: f64 = 1e-4;
/// Integration step of flight, s; the position error is 1e-6 m for a table-tennis ball with drag at 5 m/s.
const STEP_S: f64 = 0.05;
/// Number of bounces after which the ball is taken to be at rest; guards against endless loops.
const MAX_BOUNCES: usize = 20_000;

/// Offsets that are added to the restitution at impacts: realisations of its random scatter.
#[derive(Clone, Copy, Debug)]
pub enum Offsets<'a, S> {
    /// No offsets: every impact has the restitution of the model.
    None,
    /// One offset of the restitution per impact; 0 for impacts beyond the end of the slice.
    PerImpact(&'a [S]),
    /// The same offset of the restitution for every impact.
    Shared(S),
}

/// Inputs of one simulation: effects, parameters, initial state, covariates and restitution offsets.
#[derive(Clone, Copy, Debug)]
pub struct Throw<'a, S> {
    /// Effects that act on the ball, and the layout of the parameters.
    pub world: &'a World,
    /// Parameter values of base model and effects, as many as `world.parameter_count()`.
    pub parameters: &'a [S],
    /// Initial state of the ball, which is held there before `start.time`.
    pub start: State<S>,
    /// Covariates of the simulated trajectory.
    pub covariates: &'a Covariates,
    /// Offsets that are added to the restitution at the impacts.
    pub offsets: Offsets<'a, S>,
    /// Whether velocities are sampled too, which makes the simulation slower.
    pub velocities: bool,
}

/// Result of a simulation. Reuse one for many runs to avoid allocations.
#[derive(Clone, Debug, Default)]
pub struct Run<S> {
    /// Measured position of the ball at each requested time, m, including sensor effects.
    pub positions: Vec<[S; 3]>,
    /// True velocity of the ball at each requested time, m/s, if velocities were requested.
    pub velocities: Vec<[S; 3]>,
    /// Impacts up to the last requested time; their positions have heights relative to the floor, m.
    pub impacts: Vec<ImpactRecord<S>>,
    /// Time at which the ball came to rest, s; `None` if it did not.
    pub rest_time: Option<S>,
}

/// Simulates a throw and samples it at `times`, s since the release, in ascending order.
///
/// ```
/// use augsim_physics::ball::{Axes, Covariates, Offsets, Run, State, Throw, simulate};
/// use augsim_physics::model::Model;
/// // With a restitution of 0.5, a ball dropped from 1 m rebounds to 0.25 m.
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
    Engine::new(throw, times, run).run();
}

/// State of one simulation by the event-driven engine. Inside, heights are relative to the floor.
struct Engine<'a, S> {
    /// Active effects, each with its parameter values.
    laws: Vec<(&'a dyn Law<S>, &'a [S])>,
    restitution: S,
    radius: S,
    inertia_ratio: S,
    /// Height of the floor in the coordinates of the data, m.
    floor: S,
    /// Unit normal of the ground, upwards.
    normal: [S; 3],
    /// Constant part of the ball's acceleration, m/s².
    constant: [S; 3],
    /// Velocity of the air (wind), m/s.
    air: [S; 3],
    has_closed_form: bool,
    samples_velocity: bool,
    has_sensor_effects: bool,
    /// Indices of the coordinates that are simulated.
    active: &'static [usize],
    /// Duration of an impact, s; `None` for instantaneous impacts.
    contact_duration: Option<S>,
    /// Delay of the measured position, s.
    delay: S,
    throw: &'a Throw<'a, S>,
    times: &'a [f64],
    run: &'a mut Run<S>,
}

impl<'a, S: Scalar> Engine<'a, S> {
    fn new(throw: &'a Throw<'a, S>, times: &'a [f64], run: &'a mut Run<S>) -> Self {
        let (zero, one) = (S::zero(), S::constant(1.0));
        let effects = throw.world.laws(throw.parameters);
        let base = |i: usize| throw.parameters.get(i).copied().unwrap_or(zero);
        let (mut constant, mut air) = ([zero, zero, -base(GRAVITY)], [zero; 3]);
        let (mut normal, mut contact_duration, mut delay) = ([zero, zero, one], None, zero);
        for (law, p) in &effects {
            law.constant_acceleration(p, &mut constant);
            law.air_velocity(p, &mut air);
            if let Some(angle) = law.ground_angle(p) {
                normal = [-angle.sin(), zero, angle.cos()];
            }
            contact_duration = law.contact_duration(p).or(contact_duration);
            delay = law.delay(p).unwrap_or(delay);
        }
        Self {
            has_closed_form: !effects.iter().any(|(law, _)| law.changes_flight()),
            samples_velocity: throw.velocities || effects.iter().any(|(law, _)| law.uses_velocity()),
            has_sensor_effects: effects.iter().any(|(law, _)| law.changes_measurement()),
            active: throw.world.axes.indices(),
            laws: effects,
            restitution: base(RESTITUTION),
            radius: base(RADIUS),
            inertia_ratio: base(INERTIA_RATIO),
            floor: base(FLOOR),
            normal,
            constant,
            air,
            contact_duration,
            delay,
            throw,
            times,
            run,
        }
    }

    /// Simulates the throw until all requested samples are emitted.
    fn run(&mut self) {
        let mut state = self.throw.start;
        // Heights are relative to the floor from here on, so that effects do not depend on the origin of the
        // data.
        state.position[2] -= self.floor;
        for (law, p) in &self.laws {
            law.spin(p, &mut state.spin);
        }
        let initial = state;
        self.emit(state.time, |_| initial.position, |_| initial.velocity);
        if self.gap(&state.position).value() <= 0.0 && self.normal_velocity(&state.velocity).value() <= 0.0 {
            // Released on or below the ground: the ball bounces immediately or rests.
            match self.bounce(&state) {
                Some(next) => state = next,
                None => return self.simulate_rest(state),
            }
        }
        for _ in 0..MAX_BOUNCES {
            if self.is_done() {
                return;
            }
            let arrival =
                if self.has_closed_form { self.fly_parabola(&state) } else { self.fly_steps(&state, false) };
            let Some(arrival) = arrival else { return };
            match self.bounce(&arrival) {
                Some(next) => state = next,
                None => return self.simulate_rest(arrival),
            }
        }
        self.simulate_rest(state);
    }

    /// Whether all requested samples are emitted.
    fn is_done(&self) -> bool {
        self.run.positions.len() >= self.times.len()
    }

    /// Time of the state in the last sample, s: samples show the state `delay` seconds earlier.
    fn last_visible_time(&self) -> f64 {
        self.times.last().map_or(f64::NEG_INFINITY, |t| t - self.delay.value())
    }

    /// Distance of `position` from the ground along its normal, m.
    fn gap(&self, position: &[S; 3]) -> S {
        dot(&self.normal, position)
    }

    /// Component of `velocity` along the normal of the ground, m/s.
    fn normal_velocity(&self, velocity: &[S; 3]) -> S {
        dot(&self.normal, velocity)
    }

    /// Emits all samples before time `until`, given position and velocity as functions of time.
    fn emit(&mut self, until: S, position: impl Fn(S) -> [S; 3], velocity: impl Fn(S) -> [S; 3]) {
        while let Some(&t) = self.times.get(self.run.positions.len()) {
            let time = -self.delay + t;
            if time.value() >= until.value() {
                return;
            }
            let truth = position(time);
            let velocity = if self.samples_velocity { Some(velocity(time)) } else { None };
            if self.has_sensor_effects {
                let mut sight =
                    Measurement { position: truth, truth, velocity: velocity.unwrap_or([S::zero(); 3]) };
                for (law, p) in &self.laws {
                    law.observe(p, &mut sight);
                }
                self.push_position(sight.position);
            } else {
                self.push_position(truth);
            }
            self.run.velocities.extend(velocity);
        }
    }

    /// Appends a sampled position, converted to the coordinates of the data.
    fn push_position(&mut self, [x, y, z]: [S; 3]) {
        self.run.positions.push([x, y, z + self.floor]);
    }

    /// Emits the samples before time `until` on a parabola with acceleration `a`.
    fn emit_parabola(&mut self, until: S, state: &State<S>, a: &[S; 3]) {
        let active = self.active;
        self.emit(
            until,
            |t| parabola(state, a, t - state.time, active),
            |t| axpy(&state.velocity, a, t - state.time),
        );
    }

    /// Emits the samples before time `until` in one integration step.
    fn emit_step(&mut self, until: S, step: &Step<S>) {
        let (active, t0) = (self.active, step.start.time);
        self.emit(until, |t| step.position(t - t0, active), |t| step.velocity(t - t0));
    }

    /// Flies on a parabola until contact (returns that state) or until all samples are emitted (`None`).
    fn fly_parabola(&mut self, state: &State<S>) -> Option<State<S>> {
        let a = self.constant;
        let duration = time_to_contact(
            self.gap(&state.position),
            self.normal_velocity(&state.velocity),
            dot(&self.normal, &a),
        );
        let until = duration.map_or(S::constant(f64::INFINITY), |d| state.time + d);
        self.emit_parabola(until, state, &a);
        let duration = duration?;
        if until.value() > self.last_visible_time() {
            return None;
        }
        Some(State {
            time: until,
            position: parabola(state, &a, duration, self.active),
            velocity: axpy(&state.velocity, &a, duration),
            spin: state.spin,
        })
    }

    /// Acceleration of the ball with all effects, m/s²; for a resting ball only its part along the ground.
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

    /// Integrates flight until contact (returns that state) or until all samples are emitted (`None`).
    ///
    /// A `resting` ball moves along the ground and has no further contact.
    fn fly_steps(&mut self, start: &State<S>, resting: bool) -> Option<State<S>> {
        let mut state = *start;
        while !self.is_done() {
            let length = S::constant(STEP_S);
            let spin = state.spin;
            let step = {
                let this = &*self;
                let acceleration = |t: S, p: &[S; 3], v: &[S; 3]| this.acceleration(&spin, resting, t, p, v);
                let step = Step::rk4(&state, length, this.active, &acceleration);
                if !resting && this.gap(&step.end.position).value() < 0.0 {
                    let arrival = this.locate_contact(&step, &acceleration);
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
                    let length = arrival.time - step.start.time;
                    self.emit_step(arrival.time, &Step { start: step.start, end: arrival, length });
                    return (arrival.time.value() <= self.last_visible_time()).then_some(arrival);
                }
            }
        }
        None
    }

    /// Finds the contact within `step` by bisection on the interpolant, then by Newton's method.
    fn locate_contact(
        &self,
        step: &Step<S>,
        acceleration: &impl Fn(S, &[S; 3], &[S; 3]) -> [S; 3],
    ) -> State<S> {
        let length = step.length.value();
        let (rate0, rate1) = (
            self.normal_velocity(&step.start.velocity).value(),
            self.normal_velocity(&step.end.velocity).value(),
        );
        // After a bounce the gap is zero at s = 0 too, so the bracket starts at the apex of the hop.
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
        // Newton's method on the length of the integration step, which the interpolant approximates to
        // micrometres. The first iteration corrects the value, the second one yields the derivative in `S`.
        let mut s = S::constant(high);
        for _ in 0..2 {
            let end = Step::rk4(&step.start, S::constant(s.value()), self.active, acceleration).end;
            s = S::constant(s.value()) - self.gap(&end.position) / self.normal_velocity(&end.velocity);
            // At a grazing contact the normal velocity is near 0 and Newton's method fails: use the result of
            // the bisection, without its derivative.
            if !(0.0..=length).contains(&s.value()) {
                s = S::constant(high);
                break;
            }
        }
        Step::rk4(&step.start, s, self.active, acceleration).end
    }

    /// Coefficient of restitution of an impact, with all effects and the random offset; at least 0.
    fn restitution_at(&self, impact: &Impact<'_, S>) -> S {
        if impact.normal_speed.value() > 0.0 {
            let mut e = self.restitution;
            for (law, p) in &self.laws {
                e = law.restitution(p, impact, e);
            }
            e = match self.throw.offsets {
                Offsets::None => e,
                Offsets::Shared(xi) => e + xi,
                Offsets::PerImpact(xi) => xi.get(impact.index).map_or(e, |&x| e + x),
            };
            if e.value() > 0.0 { e } else { S::zero() }
        } else {
            S::zero()
        }
    }

    /// Simulates an impact from the state `arrival`; returns the state after it, `None` if the ball stays.
    fn bounce(&mut self, arrival: &State<S>) -> Option<State<S>> {
        let normal_velocity = self.normal_velocity(&arrival.velocity);
        let speed = -normal_velocity;
        let tangential = axpy(&arrival.velocity, &self.normal, -normal_velocity);
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
        let e = self.restitution_at(&impact);
        impact.restitution = e;
        let mut jump = [S::zero(); 3];
        for (law, p) in &self.laws {
            law.tangential(p, &impact, &mut jump);
        }
        let contact = match self.contact_duration {
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
        // The tangential impulse is taken to act evenly over the contact, so the mean velocity has half of
        // the jump.
        let drift = axpy(&tangential, &jump, S::constant(0.5));
        let time = arrival.time + duration;
        if let Some(Some(c)) = &contact {
            self.emit_contact(time, arrival, &drift, c);
        }
        let moved = axpy(&arrival.position, &drift, duration);
        Some(State {
            time,
            position: axpy(&moved, &self.normal, -self.gap(&moved)),
            velocity: axpy(&axpy(&tangential, &jump, S::constant(1.0)), &self.normal, speed_out),
            spin: self.spin_after(&arrival.spin, &jump),
        })
    }

    /// Emits the samples before time `until` during a contact; `drift` is the mean tangential velocity.
    fn emit_contact(&mut self, until: S, arrival: &State<S>, drift: &[S; 3], contact: &Contact<S>) {
        let normal = self.normal;
        self.emit(
            until,
            |t| {
                let s = t - arrival.time;
                axpy(&axpy(&arrival.position, drift, s), &normal, contact.at(s).0)
            },
            |t| axpy(drift, &normal, contact.at(t - arrival.time).1),
        );
    }

    /// Spin after an impact that changes the tangential velocity by `jump`: ω' = ω - n × jump / (i R).
    fn spin_after(&self, spin: &[S; 3], jump: &[S; 3]) -> [S; 3] {
        if self.radius.value() > 0.0 {
            axpy(spin, &cross(&self.normal, jump), S::constant(-1.0) / (self.inertia_ratio * self.radius))
        } else {
            *spin
        }
    }

    /// Simulates a ball that stays on the ground and moves along it, without normal acceleration.
    fn simulate_rest(&mut self, arrival: State<S>) {
        self.run.rest_time = Some(arrival.time);
        let mut state = arrival;
        state.position = axpy(&state.position, &self.normal, -self.gap(&state.position));
        state.velocity = axpy(&state.velocity, &self.normal, -self.normal_velocity(&state.velocity));
        if self.has_closed_form {
            let a = axpy(&self.constant, &self.normal, -dot(&self.normal, &self.constant));
            self.emit_parabola(S::constant(f64::INFINITY), &state, &a);
        } else {
            self.fly_steps(&state, true);
        }
    }
}
