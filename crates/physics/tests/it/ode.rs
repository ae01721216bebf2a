//! Contract: integrated state equations and their derivatives agree with closed forms.
//!
//! This includes events, resets, rest and inputs that jump. What cannot be integrated is an error that says
//! what to do.
//!
//! Each test system has a closed solution: an oscillator (smooth), a bouncing ball (event times that depend
//! on all earlier events, down to infinitely many bounces in finite time), a driven integrator (inputs), a
//! block that a growing force pulls off a stop (rest and release). The tolerance of 1e-9 per step leaves an
//! error of a few times that after a hundred steps.

use augsim_physics::Scalar;
use augsim_physics::ode::{At, Equations, Ode, Tolerance};
use augsim_system::{
    Augment, Channel, Effect, EffectParameter, ErrorFigure, EventSchema, InitialValue, Input,
    InputInterpolation, ModelTerm, Offsets, Parameter, Quantity, Record, Schema, Seed, Simulate, Simulated,
    SimulationError, State, Stream, System, Task,
};

fn schema(system: &str, states: usize, inputs: &[InputInterpolation]) -> Schema {
    let state = |i| State { quantity: Quantity::new(&format!("x{i}"), "m"), initial: InitialValue::Free };
    Schema {
        system: system.into(),
        record: ["record".into(), "records".into()],
        states: (0..states).map(state).collect(),
        channels: vec![Channel { column: "y_m".into(), unit: "m".into(), ..Channel::default() }],
        inputs: inputs
            .iter()
            .map(|&between| Input { columns: vec!["u".into()], interpolation: between, update_column: None })
            .collect(),
        error_figures: vec![ErrorFigure {
            name: "y".into(),
            channels: vec![0],
            unit: ("mm".into(), 1e3),
            is_euclidean: false,
        }],
        ..Schema::default()
    }
}

fn parameter(name: &str, nominal: f64) -> Parameter {
    Parameter::free(name.into(), nominal, -100.0, 100.0)
}

/// Simulation input of a test: parameters, initial state, record and offsets.
struct Scene<'a> {
    parameters: &'a [f64],
    start: &'a [f64],
    record: Record,
    offsets: Offsets<'a>,
}

impl Scene<'_> {
    fn task<'a>(&'a self, seeds: &'a [Seed]) -> Task<'a> {
        Task {
            parameters: self.parameters,
            record: &self.record,
            window: 0..self.record.times.len(),
            start: self.start,
            offsets: self.offsets,
            seeds,
        }
    }

    fn run(&self, system: &dyn System, seeds: &[Seed]) -> Simulated {
        let mut out = Simulated::default();
        system.simulate(&self.task(seeds), &mut out).expect("it moves");
        out
    }

    fn refusal(&self, system: &dyn System) -> SimulationError {
        system.simulate(&self.task(&[]), &mut Simulated::default()).expect_err("refused")
    }
}

fn times(n: usize, step: f64) -> Record {
    Record { times: (0..n).map(|k| step * k as f64).collect(), ..Record::default() }
}

/// Test system x'' = -w² x, with a viscous friction as effect that may be missing.
#[derive(Debug)]
struct Oscillator(Schema, Vec<Parameter>, Vec<Effect>);

impl Oscillator {
    fn new() -> Self {
        let friction = EffectParameter {
            name: "b_per_s".into(),
            unit: "1/s".into(),
            min: 0.0,
            max: 10.0,
            typical: 0.1,
            null: 0.0,
        };
        let effect = Effect {
            kind: "friction".into(),
            location: "motion".into(),
            parameters: vec![friction],
            formula: "v' = -b v".into(),
            ..Effect::default()
        };
        Self(schema("oscillator", 2, &[]), vec![parameter("w_rad_s", 3.0)], vec![effect])
    }
}

impl Equations for Oscillator {
    fn schema(&self) -> &Schema {
        &self.0
    }
    fn parameters(&self) -> &[Parameter] {
        &self.1
    }
    fn library(&self) -> &[Effect] {
        &self.2
    }
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
        let (w, b) = (at.parameters[0], at.parameters[1]);
        rates[0] = at.states[1];
        rates[1] = -(w * w) * at.states[0] - b * at.states[1];
    }
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
}

#[test]
fn an_oscillator_and_its_derivatives_are_the_closed_form() {
    let system = Ode::new(Oscillator::new());
    let scene =
        Scene { parameters: &[3.0], start: &[0.7, -0.4], record: times(200, 0.037), offsets: Offsets::None };
    let out = scene.run(&system, &[Seed::Parameter(0), Seed::Start(0), Seed::Start(1)]);
    let w = 3.0;
    for (k, &t) in scene.record.times.iter().enumerate() {
        let (s, c) = (w * t).sin_cos();
        let expected = 0.7 * c - 0.4 / w * s;
        let slopes = [-0.7 * t * s - 0.4 * (t * c / w - s / (w * w)), c, s / w];
        assert!((out.value(k, 0) - expected).abs() < 2e-8, "{k}: {} {expected}", out.value(k, 0));
        for (found, slope) in out.slopes(k, 0).iter().zip(slopes) {
            assert!((found - slope).abs() < 1e-7, "{k}: {found} {slope}");
        }
    }
}

#[test]
fn many_windows_are_simulated_as_each_by_itself_and_refused_one_by_one() {
    let system = Ode::new(Oscillator::new());
    let good =
        Scene { parameters: &[3.0], start: &[0.7, -0.4], record: times(20, 0.1), offsets: Offsets::None };
    let bad = Scene { start: &[0.7], record: times(20, 0.1), parameters: &[3.0], offsets: Offsets::None };
    let seeds = [Seed::Parameter(0)];
    let tasks = [good.task(&seeds), bad.task(&seeds), good.task(&[]), good.task(&seeds)];
    let mut out = vec![Simulated::default(); 3];
    let done = system.simulate_batch(&tasks, &mut out);
    assert!(done[0].is_ok() && done[2].is_ok());
    assert!(matches!(
        done[1],
        Err(SimulationError::Task { part: "initial states", expected: 2, found: 1, .. })
    ));
    assert!(matches!(&done[3], Err(SimulationError::Task { part: "outputs", .. })));
    let alone = good.run(&system, &seeds);
    let values = good.run(&system, &[]);
    for k in 0..20 {
        assert_eq!((alone.value(k, 0), alone.slopes(k, 0)), (out[0].value(k, 0), out[0].slopes(k, 0)));
        assert_eq!((values.value(k, 0), out[2].lanes()), (out[2].value(k, 0), 0));
    }
}

#[test]
fn the_error_falls_with_the_tolerance() {
    // Local errors of the fifth order are held at the tolerance: the global one is in proportion to it, within a factor.
    let scene =
        Scene { parameters: &[3.0], start: &[1.0, 0.0], record: times(40, 0.5), offsets: Offsets::None };
    let error = |relative: f64| {
        let system =
            Ode::new(Oscillator::new()).with_tolerance(Tolerance { relative, absolute: 0.01 * relative });
        (scene.run(&system, &[]).value(39, 0) - (3.0f64 * 39.0 * 0.5).cos()).abs()
    };
    let [coarse, middle, fine] = [1e-5, 1e-7, 1e-9].map(error);
    assert!(coarse < 1e-2 && middle < 3e-2 * coarse && fine < 3e-2 * middle, "{coarse} {middle} {fine}");
}

#[test]
fn an_effect_that_is_added_acts_through_its_place() {
    let system = Ode::new(Oscillator::new());
    let augmented = system.augmented(&[ModelTerm::Effect(0)]).expect("in the library");
    let scene = Scene {
        parameters: &[3.0, 0.8],
        start: &[1.0, 0.0],
        record: times(60, 0.05),
        offsets: Offsets::None,
    };
    let out = scene.run(&*augmented, &[Seed::Parameter(1)]);
    let closed = |b: f64, t: f64| {
        let d = (9.0 - 0.25 * b * b).sqrt();
        (-0.5 * b * t).exp() * ((d * t).cos() + 0.5 * b / d * (d * t).sin())
    };
    for (k, &t) in scene.record.times.iter().enumerate() {
        let slope = (closed(0.8 + 1e-5, t) - closed(0.8 - 1e-5, t)) / 2e-5;
        assert!((out.value(k, 0) - closed(0.8, t)).abs() < 2e-8, "{k}");
        assert!((out.slopes(k, 0)[0] - slope).abs() < 1e-7, "{k}: {} {slope}", out.slopes(k, 0)[0]);
    }
}

/// Test system: a ball that bounces with restitution e on a floor.
///
/// With the flag set, it stays on the floor if slower than 1 mm/s.
#[derive(Debug)]
struct Bouncing(Schema, Vec<Parameter>, bool);

impl Bouncing {
    fn new(rests: bool) -> Self {
        let event = EventSchema {
            nouns: ["bounce".into(), "bounces".into()],
            parameter: 1,
            scatter: Effect::default(),
            declared: None,
            periodic_scale_feature: None,
        };
        let schema = Schema { event: Some(event), ..schema("bouncing", 2, &[]) };
        Self(schema, vec![parameter("g_m_s2", 9.81), parameter("e", 0.9)], rests)
    }
}

impl Equations for Bouncing {
    fn schema(&self) -> &Schema {
        &self.0
    }
    fn parameters(&self) -> &[Parameter] {
        &self.1
    }
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
        rates[0] = at.states[1];
        rates[1] = -at.parameters[0];
    }
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
    fn events(&self) -> usize {
        1
    }
    fn event<S: Scalar>(&self, _event: usize, at: &At<'_, S>) -> S {
        at.states[0]
    }
    fn reset<S: Scalar>(&self, _event: usize, at: &At<'_, S>, states: &mut [S]) {
        states[1] = -at.parameters[1] * at.states[1];
    }
    fn rests(&self, _event: usize, at: &At<'_, f64>) -> bool {
        self.2 && at.states[1] < 1e-3
    }
}

/// Height at time `t` of a ball dropped from `h`, with offset `xi[n]` of e, and its number of bounces.
fn bounced(g: f64, e: f64, h: f64, xi: &[f64], t: f64) -> (f64, usize) {
    let (mut v, mut begin, mut n) = ((2.0 * g * h).sqrt(), (2.0 * h / g).sqrt(), 0);
    if t < begin {
        return (h - 0.5 * g * t * t, 0);
    }
    loop {
        v *= e + xi.get(n).copied().unwrap_or(0.0);
        n += 1;
        let end = begin + 2.0 * v / g;
        if t < end {
            return (v * (t - begin) - 0.5 * g * (t - begin).powi(2), n);
        }
        begin = end;
    }
}

#[test]
fn a_ball_through_ten_bounces_is_the_closed_form() {
    let system = Ode::new(Bouncing::new(false));
    let xi = [0.01, -0.03, 0.02];
    let scene = Scene {
        parameters: &[9.81, 0.9],
        start: &[1.3, 0.0],
        record: times(800, 0.01),
        offsets: Offsets::PerEvent(&xi),
    };
    let seeds = [Seed::Parameter(0), Seed::Parameter(1), Seed::Start(0), Seed::Offset(1)];
    let out = scene.run(&system, &seeds);
    assert!(out.event_times().len() >= 10, "{}", out.event_times().len());
    let mut checked = 0;
    for (k, &t) in scene.record.times.iter().enumerate() {
        let at = |d: [f64; 4]| {
            let xi = [0.01, -0.03 + d[3], 0.02];
            bounced(9.81 + d[0], 0.9 + d[1], 1.3 + d[2], &xi, t)
        };
        let (height, bounces) = at([0.0; 4]);
        assert!((out.value(k, 0) - height).abs() < 1e-9, "{k}: {} {height}", out.value(k, 0));
        for (lane, found) in out.slopes(k, 0).iter().take(4).enumerate() {
            let step = |s: f64| at(std::array::from_fn(|i| if i == lane { s } else { 0.0 }));
            let (up, down) = (step(1e-6), step(-1e-6));
            // Central differences across a bounce have no meaning.
            if (up.1, down.1) == (bounces, bounces) {
                let slope = (up.0 - down.0) / 2e-6;
                assert!((found - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{k}, {lane}: {found} {slope}");
                checked += 1;
            }
        }
    }
    assert!(checked > 2000, "{checked}");
}

#[test]
fn hops_without_end_come_to_rest_or_are_refused() {
    let scene = Scene {
        parameters: &[9.81, 0.4],
        start: &[0.5, 0.0],
        record: times(100, 0.02),
        offsets: Offsets::None,
    };
    let resting = scene.run(&Ode::new(Bouncing::new(true)), &[Seed::Parameter(1), Seed::Start(0)]);
    let count = resting.event_times().len();
    assert!((7..12).contains(&count), "{count}");
    assert!(resting.value(99, 0).abs() < 1e-12 && resting.slopes(99, 0).iter().all(|s| s.abs() < 1e-6));
    let error = scene.refusal(&Ode::new(Bouncing::new(false))).to_string();
    assert!(
        error.contains("the bouncing system passes more than") && error.contains("declare a rest condition"),
        "{error}"
    );
}

#[test]
fn a_ball_that_begins_on_the_floor_and_falls_bounces_at_once() {
    let scene = Scene {
        parameters: &[9.81, 0.5],
        start: &[0.0, -2.0],
        record: times(10, 0.01),
        offsets: Offsets::None,
    };
    let out = scene.run(&Ode::new(Bouncing::new(false)), &[]);
    assert_eq!(out.event_times(), [0.0]);
    assert!((out.value(9, 0) - (0.09 - 0.5 * 9.81 * 0.0081)).abs() < 1e-10, "{}", out.value(9, 0));
}

#[test]
fn any_number_of_seeds_gives_the_bytes_of_one_at_a_time() {
    let system = Ode::new(Bouncing::new(false));
    let xi: Vec<f64> = (0..40).map(|i| 1e-3 * f64::from(i)).collect();
    let scene = Scene {
        parameters: &[9.81, 0.9],
        start: &[1.3, 0.0],
        record: times(300, 0.01),
        offsets: Offsets::PerEvent(&xi),
    };
    // 44 derivatives: two blocks.
    let mut seeds = vec![Seed::Parameter(0), Seed::Parameter(1), Seed::Start(0), Seed::Start(1)];
    seeds.extend((0..40).map(Seed::Offset));
    let wide = scene.run(&system, &seeds);
    for (lane, seed) in seeds.iter().enumerate() {
        let one = scene.run(&system, &[*seed]);
        for k in 0..300 {
            assert_eq!(one.value(k, 0).to_bits(), wide.value(k, 0).to_bits());
            assert_eq!(one.slopes(k, 0)[0].to_bits(), wide.slopes(k, 0)[lane].to_bits(), "{k}, {lane}");
        }
    }
}

/// Test system x' = k u with input u.
#[derive(Debug)]
struct Driven(Schema, Vec<Parameter>);

impl Equations for Driven {
    fn schema(&self) -> &Schema {
        &self.0
    }
    fn parameters(&self) -> &[Parameter] {
        &self.1
    }
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
        rates[0] = at.parameters[0] * at.inputs[0];
    }
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
}

#[test]
fn inputs_are_held_or_linear_between_their_own_samples() {
    let (knots, u) = (vec![0.1, 0.25, 0.31, 0.7], vec![1.0, -2.0, 4.0, 0.5]);
    let integral = |between: InputInterpolation, t: f64| {
        // Before the first sample and after the last the value is held.
        let mut sum = u[0] * t.min(knots[0]);
        for i in 0..3 {
            let (a, b) = (knots[i], knots[i + 1]);
            let end = t.clamp(a, b);
            let slope = if between == InputInterpolation::Linear { (u[i + 1] - u[i]) / (b - a) } else { 0.0 };
            sum += u[i] * (end - a) + 0.5 * slope * (end - a).powi(2);
        }
        sum + u[3] * (t - knots[3]).max(0.0)
    };
    for between in [InputInterpolation::ZeroOrderHold, InputInterpolation::Linear] {
        let system = Ode::new(Driven(schema("driven", 1, &[between]), vec![parameter("k", 2.0)]));
        let stream = Stream { times: knots.clone(), values: vec![u.clone()] };
        let record = Record { inputs: [stream].into(), ..times(50, 0.02) };
        let scene = Scene { parameters: &[2.0], start: &[0.3], record, offsets: Offsets::None };
        let out = scene.run(&system, &[Seed::Parameter(0), Seed::Start(0)]);
        for (k, &t) in scene.record.times.iter().enumerate() {
            let along = integral(between, t);
            assert!((out.value(k, 0) - 0.3 - 2.0 * along).abs() < 1e-9, "{between:?} {k}");
            assert!((out.slopes(k, 0)[0] - along).abs() < 1e-9 && (out.slopes(k, 0)[1] - 1.0).abs() < 1e-12);
        }
    }
}

/// Test system: a block pressed against a stop at 0.
///
/// It leaves the stop when a force that grows as `r t` exceeds the pressing force.
#[derive(Debug)]
struct Stop(Schema, Vec<Parameter>);

impl Stop {
    fn force<S: Scalar>(at: &At<'_, S>) -> S {
        at.parameters[0] * at.time - at.parameters[1]
    }
}

impl Equations for Stop {
    fn schema(&self) -> &Schema {
        &self.0
    }
    fn parameters(&self) -> &[Parameter] {
        &self.1
    }
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
        rates[0] = at.states[1];
        rates[1] = Self::force(at);
    }
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
    fn events(&self) -> usize {
        1
    }
    fn event<S: Scalar>(&self, _event: usize, at: &At<'_, S>) -> S {
        at.states[0]
    }
    fn reset<S: Scalar>(&self, _event: usize, _at: &At<'_, S>, states: &mut [S]) {
        states[1] = S::zero();
    }
    fn rests(&self, _event: usize, _at: &At<'_, f64>) -> bool {
        true
    }
    fn release<S: Scalar>(&self, _event: usize, at: &At<'_, S>) -> S {
        -Self::force(at)
    }
}

#[test]
fn a_block_rests_until_it_is_pulled_off() {
    let system = Ode::new(Stop(schema("stop", 2, &[]), vec![parameter("r", 3.0), parameter("f", 2.4)]));
    let scene = Scene {
        parameters: &[3.0, 2.4],
        start: &[0.01, 0.0],
        record: times(80, 0.02),
        offsets: Offsets::None,
    };
    let out = scene.run(&system, &[Seed::Parameter(0), Seed::Parameter(1), Seed::Start(0)]);
    assert_eq!(out.event_times().len(), 1);
    // Released when r t = f, from rest: x = r (t - f/r)³ / 6, whatever it did before.
    let released = |r: f64, f: f64, t: f64| r / 6.0 * (t - f / r).max(0.0).powi(3);
    for (k, &t) in scene.record.times.iter().enumerate().filter(|(_, t)| **t > 0.2) {
        let at = |r, f| released(r, f, t);
        let slopes = [
            (at(3.0 + 1e-6, 2.4) - at(3.0 - 1e-6, 2.4)) / 2e-6,
            (at(3.0, 2.4 + 1e-6) - at(3.0, 2.4 - 1e-6)) / 2e-6,
            0.0,
        ];
        assert!((out.value(k, 0) - at(3.0, 2.4)).abs() < 1e-9, "{k}: {} {}", out.value(k, 0), at(3.0, 2.4));
        for (found, slope) in out.slopes(k, 0).iter().zip(slopes) {
            assert!((found - slope).abs() < 1e-8, "{k}: {found} {slope}");
        }
    }
}

/// Test system x' = x², whose state becomes infinite at t = 1/x(0).
#[derive(Debug)]
struct Explosion(Schema);

impl Equations for Explosion {
    fn schema(&self) -> &Schema {
        &self.0
    }
    fn parameters(&self) -> &[Parameter] {
        &[]
    }
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
        rates[0] = at.states[0] * at.states[0];
    }
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
}

#[test]
fn a_solution_that_ends_is_refused() {
    let system = Ode::new(Explosion(schema("explosion", 1, &[])));
    let scene = Scene { parameters: &[], start: &[1.0], record: times(3, 0.6), offsets: Offsets::None };
    let error = scene.refusal(&system).to_string();
    assert!(error.contains("the explosion system") && error.contains("check the"), "{error}");
}
