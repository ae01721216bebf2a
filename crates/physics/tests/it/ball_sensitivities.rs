//! Contract: derivatives by dual numbers are those of the simulated trajectory, event times included. Three routes must
//! agree: dual numbers, closed forms, central differences of the plain simulation. Differences with step 1e-6 of smooth
//! functions are good to about 1e-8 of their scale; through five bounces sensitivities reach 1e2, hence 1e-6 relative.

use augsim_physics::ball::{Axes, Covariates, FLOOR, Offsets, Run, State, Throw, World, simulate};
use augsim_physics::effects::all;
use augsim_physics::{Dual, Scalar};

const G: f64 = 9.81;

struct Scene {
    world: World,
    parameters: Vec<f64>,
    start: State<f64>,
}

impl Scene {
    /// A throw with spin, with the given effects at the given values.
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

    fn at<S: Scalar>(&self, parameters: &[S], height: S, t: f64) -> ([S; 3], Run<S>) {
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

    /// Compares all derivatives (start height, then every parameter) of the position at `t` with central differences.
    fn check(&self, t: f64, label: &str) {
        let n = self.parameters.len();
        let dual: Vec<_> = (0..n).map(|i| Dual::<12>::variable(self.parameters[i], i)).collect();
        let (exact, run) = self.at(&dual, Dual::variable(1.2, n), t);
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
                self.at(&p, z, t).0
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
fn derivatives_through_up_to_five_bounces_match_closed_forms() {
    // After n bounces at time t: T_n = t0 (1 + 2 (e + … + e^(n-1))), z = v e^n s - g s²/2 with s = t - T_n, t0 = √(2h/g).
    let (h, e) = (1.2f64, 0.8f64);
    let scene = Scene::new(Axes::Vertical, &[]);
    let fall = (2.0 * h / G).sqrt();
    let speed = (2.0 * G * h).sqrt();
    let mut arrival = fall;
    for bounces in 1..=5 {
        let hop = 2.0 * speed * e.powi(bounces) / G;
        let t = arrival + 0.4 * hop;
        let dual: Vec<_> = (0..5).map(|i| Dual::<6>::variable(scene.parameters[i], i)).collect();
        let (sample, run) = scene.at(&dual, Dual::variable(h, 5), t);
        assert_eq!(run.impacts.len(), bounces as usize);
        let s = t - arrival;
        let rate = speed * e.powi(bounces) - G * s;
        // with respect to e
        let mut arrival_e = 0.0;
        for k in 1..bounces {
            arrival_e += 2.0 * fall * f64::from(k) * e.powi(k - 1);
        }
        let by_e = speed * f64::from(bounces) * e.powi(bounces - 1) * s - rate * arrival_e;
        // with respect to h: dt0/dh = t0/2h scales T_n, dv/dh = v/2h
        let by_h = speed / (2.0 * h) * e.powi(bounces) * s - rate * arrival / (2.0 * h);
        let z = sample[2];
        assert!((z.d[1] - by_e).abs() < 1e-10 * (1.0 + by_e.abs()), "{bounces}: {} {by_e}", z.d[1]);
        assert!((z.d[5] - by_h).abs() < 1e-10 * (1.0 + by_h.abs()), "{bounces}: {} {by_h}", z.d[5]);
        arrival += hop;
    }
}

#[test]
fn derivative_of_the_impact_time_with_respect_to_drag_is_not_zero() {
    // z = h - ln cosh(√(g k) t)/k = 0 at t = arcosh(e^(k h))/√(g k); its derivative in k, by the closed form's difference.
    let scene = Scene::new(Axes::Vertical, &[("quadratic-drag", 0.1)]);
    let dual: Vec<_> = (0..6).map(|i| Dual::<6>::variable(scene.parameters[i], i)).collect();
    let (_, run) = scene.at(&dual, Dual::constant(1.2), 0.8);
    let time = |k: f64| (k * 1.2).exp().acosh() / (G * k).sqrt();
    let slope = (time(0.1 + 1e-5) - time(0.1 - 1e-5)) / 2e-5;
    let d = run.impacts[0].time.d[5];
    assert!(d > 0.05, "{d}");
    assert!((d - slope).abs() < 1e-6, "{d} {slope}");
}

#[test]
fn every_effect_has_exact_derivatives_through_five_bounces() {
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
fn effects_together_have_exact_derivatives() {
    let all = [
        ("quadratic-drag", 0.05),
        ("restitution-speed-power", 0.05),
        ("coulomb-friction", 0.1),
        ("contact-duration", 0.005),
        ("ground-tilt", 0.02),
    ];
    let scene = Scene::new(Axes::Plane, &all);
    for t in [0.6, 1.3, 1.9, 2.3] {
        scene.check(t, "together");
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
        raised.check(t, "together, over a floor at 0.3 m");
    }
}

#[test]
fn contact_duration_has_its_derivative_at_zero() {
    // One-sided: at τ = 0 the law is the instantaneous bounce, and a score test needs the slope there.
    let scene = Scene::new(Axes::Vertical, &[("contact-duration", 0.0)]);
    let dual: Vec<_> = (0..6).map(|i| Dual::<6>::variable(scene.parameters[i], i)).collect();
    let t = 1.2;
    let exact = scene.at(&dual, Dual::constant(1.2), t).0[2].d[5];
    let at = |tau: f64| {
        let mut p = scene.parameters.clone();
        p[5] = tau;
        scene.at(&p, 1.2, t).0[2]
    };
    // Second-order one-sided difference.
    let h = 1e-5;
    let slope = (4.0 * at(h) - at(2.0 * h) - 3.0 * at(0.0)) / (2.0 * h);
    assert!((exact - slope).abs() < 1e-5 * exact.abs(), "{exact} {slope}");
}

#[test]
fn effects_vanish_at_their_null_values() {
    let plain = Scene::new(Axes::Plane, &[]);
    for effect in all::<f64>() {
        let kind = effect.spec().kind;
        let scene = Scene::new(Axes::Plane, &[(kind, 0.0)]);
        for t in [0.2, 0.9, 1.8] {
            let a = scene.at(&scene.parameters, 1.2, t).0;
            let b = plain.at(&plain.parameters, 1.2, t).0;
            // Flight with a force is integrated: 1e-9 m is far above its rounding and below its error with a force.
            assert!((a[0] - b[0]).abs() < 1e-9 && (a[2] - b[2]).abs() < 1e-9, "{kind} at {t}");
        }
    }
}
