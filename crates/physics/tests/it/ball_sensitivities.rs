//! Derivatives by dual numbers are those of the simulated trajectory, including event times.
//!
//! Dual numbers, closed forms and central differences of the simulation in `f64` must agree. Central
//! differences with a step of 1e-6 are accurate to about 1e-8 of the scale of a smooth function; through five
//! bounces derivatives reach 1e2, hence the relative tolerance of 1e-6.

use augsim_physics::ball::effects::all;
use augsim_physics::ball::{Axes, Covariates, FLOOR, Offsets, Run, State, Throw, World, simulate};
use augsim_physics::{Dual, Scalar};

const G: f64 = 9.81;

struct Scene {
    world: World,
    parameters: Vec<f64>,
    start: State<f64>,
}

impl Scene {
    /// A throw with spin, under the given effects with these parameter values.
    fn new(axes: Axes, effects: &[(&str, f64)]) -> Self {
        let mut world = World::new(axes);
        let mut parameters = vec![G, 0.8, 0.02, 0.4, 0.0];
        for (kind, value) in effects {
            world.add_kind(kind).expect("in the library");
            parameters.push(*value);
        }
        let mut start = State::at_rest(1.2);
        if axes != Axes::Vertical {
            start.velocity[0] = 1.1;
            start.spin[1] = 30.0;
        }
        Scene { world, parameters, start }
    }

    fn sample<S: Scalar>(&self, parameters: &[S], start: State<S>, t: f64) -> ([S; 3], Run<S>) {
        let mut run = Run { positions: vec![], velocities: vec![], impacts: vec![], rest_time: None };
        let throw = Throw {
            world: &self.world,
            parameters,
            start,
            covariates: &Covariates { clock_s: 7.0, ..Covariates::default() },
            offsets: Offsets::None,
            velocities: true,
        };
        simulate(&throw, &[t], &mut run);
        (run.positions[0], run)
    }

    fn simulate_from<S: Scalar>(&self, parameters: &[S], height: S, t: f64) -> ([S; 3], Run<S>) {
        let s = &self.start;
        let c = S::constant;
        let start = State {
            time: c(0.0),
            position: [c(s.position[0]), c(0.0), height],
            velocity: s.velocity.map(c),
            spin: s.spin.map(c),
        };
        self.sample(parameters, start, t)
    }

    /// Compares derivatives of the position at time `t` by dual numbers with central differences.
    fn check(&self, t: f64, label: &str) {
        let n = self.parameters.len();
        let dual: Vec<_> = (0..n).map(|i| Dual::<12>::variable(self.parameters[i], i)).collect();
        let (exact, run) = self.simulate_from(&dual, Dual::variable(1.2, n), t);
        for lane in 0..=n {
            let h = 1e-6;
            let value = |sign: f64| {
                let mut p = self.parameters.clone();
                let mut z = 1.2;
                if lane < n {
                    p[lane] += sign * h
                } else {
                    z += sign * h
                }
                self.simulate_from(&p, z, t).0
            };
            let (high, low) = (value(1.0), value(-1.0));
            for axis in [0, 2] {
                let difference = (high[axis] - low[axis]) / (2.0 * h);
                let d = exact[axis].d[lane];
                assert!(
                    (d - difference).abs() < 1e-6 * (1.0 + d.abs()),
                    "{label}, t = {t}, {} impacts, lane {lane}, axis {axis}: dual {d}, difference {difference}",
                    run.impacts.len()
                );
            }
        }
    }
}

#[test]
fn derivatives_through_five_bounces_match_closed_forms() {
    // After n bounces: T_n = t0 (1 + 2 (e + … + e^(n-1))), z = v e^n s - g s²/2 with s = t - T_n, t0 =
    // √(2h/g).
    let (h, e) = (1.2f64, 0.8f64);
    let scene = Scene::new(Axes::Vertical, &[]);
    let fall = (2.0 * h / G).sqrt();
    let speed = (2.0 * G * h).sqrt();
    let mut arrival = fall;
    for bounces in 1..=5 {
        let hop = 2.0 * speed * e.powi(bounces) / G;
        let t = arrival + 0.4 * hop;
        let dual: Vec<_> = (0..5).map(|i| Dual::<6>::variable(scene.parameters[i], i)).collect();
        let (sample, run) = scene.simulate_from(&dual, Dual::variable(h, 5), t);
        assert_eq!(run.impacts.len(), bounces as usize);
        let s = t - arrival;
        let rate = speed * e.powi(bounces) - G * s;
        // Derivative with respect to e.
        let mut arrival_e = 0.0;
        for k in 1..bounces {
            arrival_e += 2.0 * fall * f64::from(k) * e.powi(k - 1);
        }
        let by_e = speed * f64::from(bounces) * e.powi(bounces - 1) * s - rate * arrival_e;
        // Derivative with respect to h: T_n scales with dt0/dh = t0/2h, and dv/dh = v/2h.
        let by_h = speed / (2.0 * h) * e.powi(bounces) * s - rate * arrival / (2.0 * h);
        let z = sample[2];
        assert!((z.d[1] - by_e).abs() < 1e-10 * (1.0 + by_e.abs()), "{bounces}: {} {by_e}", z.d[1]);
        assert!((z.d[5] - by_h).abs() < 1e-10 * (1.0 + by_h.abs()), "{bounces}: {} {by_h}", z.d[5]);
        arrival += hop;
    }
}

#[test]
fn impact_time_has_the_exact_derivative_with_respect_to_drag() {
    // z = h - ln cosh(√(g k) t)/k = 0 at t = arcosh(e^(k h))/√(g k); its derivative in k by a central
    // difference.
    let scene = Scene::new(Axes::Vertical, &[("quadratic-drag", 0.1)]);
    let dual: Vec<_> = (0..6).map(|i| Dual::<6>::variable(scene.parameters[i], i)).collect();
    let (_, run) = scene.simulate_from(&dual, Dual::constant(1.2), 0.8);
    let time = |k: f64| (k * 1.2).exp().acosh() / (G * k).sqrt();
    let slope = (time(0.1 + 1e-5) - time(0.1 - 1e-5)) / 2e-5;
    let d = run.impacts[0].time.d[5];
    assert!(d > 0.05, "{d}");
    assert!((d - slope).abs() < 1e-6, "{d} {slope}");
}

#[test]
fn each_effect_has_exact_derivatives_through_five_bounces() {
    for effect in all::<f64>() {
        let spec = effect.spec();
        let needs_drag = spec.kind == "wind";
        let mut effects = vec![];
        if needs_drag {
            effects.push(("quadratic-drag", 0.1));
        }
        effects.push((spec.kind, spec.parameters[0].typical));
        let scene = Scene::new(Axes::Plane, &effects);
        for t in [0.3, 0.7, 1.2, 1.7, 2.1, 2.5] {
            scene.check(t, spec.kind);
        }
    }
}

#[test]
fn combined_effects_have_exact_derivatives() {
    let effects = [
        ("quadratic-drag", 0.05),
        ("restitution-speed-power", 0.05),
        ("coulomb-friction", 0.1),
        ("contact-duration", 0.005),
        ("ground-tilt", 0.02),
    ];
    let scene = Scene::new(Axes::Plane, &effects);
    for t in [0.6, 1.3, 1.9, 2.3] {
        scene.check(t, "combined");
    }
    let raised = Scene {
        parameters: scene
            .parameters
            .iter()
            .enumerate()
            .map(|(i, p)| if i == FLOOR { 0.3 } else { *p })
            .collect(),
        ..scene
    };
    for t in [0.6, 1.3, 1.9, 2.3] {
        raised.check(t, "combined, with the floor at 0.3 m");
    }
}

#[test]
fn contact_duration_has_a_one_sided_derivative_at_zero() {
    // At τ = 0 the impact is instantaneous; the score test needs the derivative there.
    let scene = Scene::new(Axes::Vertical, &[("contact-duration", 0.0)]);
    let dual: Vec<_> = (0..6).map(|i| Dual::<6>::variable(scene.parameters[i], i)).collect();
    let t = 1.2;
    let exact = scene.simulate_from(&dual, Dual::constant(1.2), t).0[2].d[5];
    let height = |tau: f64| {
        let mut p = scene.parameters.clone();
        p[5] = tau;
        scene.simulate_from(&p, 1.2, t).0[2]
    };
    // Second-order one-sided difference.
    let h = 1e-5;
    let slope = (4.0 * height(h) - height(2.0 * h) - 3.0 * height(0.0)) / (2.0 * h);
    assert!((exact - slope).abs() < 1e-5 * exact.abs(), "{exact} {slope}");
}

#[test]
fn effects_vanish_at_their_null_values() {
    let plain = Scene::new(Axes::Plane, &[]);
    for effect in all::<f64>() {
        let kind = effect.spec().kind;
        let scene = Scene::new(Axes::Plane, &[(kind, 0.0)]);
        for t in [0.2, 0.9, 1.8] {
            let a = scene.simulate_from(&scene.parameters, 1.2, t).0;
            let b = plain.simulate_from(&plain.parameters, 1.2, t).0;
            // An effect in flight selects numerical integration, whose rounding errors are far below 1e-9 m.
            assert!((a[0] - b[0]).abs() < 1e-9 && (a[2] - b[2]).abs() < 1e-9, "{kind} at {t}");
        }
    }
}
