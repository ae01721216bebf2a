//! The event-driven engine obeys the physical laws of a bouncing ball.
//!
//! Each test compares with a closed form or an exact inequality; tolerances are a few thousand rounding
//! errors of metres or seconds.

use augsim_physics::ball::{Axes, Covariates, Offsets, Run, State, Throw, World, simulate};
use proptest::prelude::*;

const G: f64 = 9.81;
/// Tolerance for closed forms, m or s: a few thousand rounding errors.
const EXACT: f64 = 1e-11;

fn run(world: &World, extra: &[f64], e: f64, start: State<f64>, times: &[f64]) -> Run<f64> {
    let mut p = vec![G, e, 0.02, 0.4, 0.0];
    p.extend(extra);
    let mut run = Run::default();
    let throw = Throw {
        world,
        parameters: &p,
        start,
        covariates: &Covariates::default(),
        offsets: Offsets::None,
        velocities: true,
    };
    simulate(&throw, times, &mut run);
    run
}

fn drop_from(h: f64, e: f64, times: &[f64]) -> Run<f64> {
    run(&World::new(Axes::Vertical), &[], e, State::at_rest(h), times)
}

fn grid(until: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| until * i as f64 / n as f64).collect()
}

#[test]
fn apex_after_a_bounce_is_e_squared_times_the_drop_height() {
    // A drop from 10 m, for which time-stepping engines are inaccurate.
    for e in [0.3, 0.65, 0.9] {
        let fall = (2.0 * 10.0 / G).sqrt();
        let apex = fall * (1.0 + e);
        let height = drop_from(10.0, e, &[apex]).positions[0][2];
        assert!((height - e * e * 10.0).abs() < 10.0 * EXACT, "{height}");
    }
}

#[test]
fn ball_comes_to_rest_at_the_zeno_limit() {
    // Infinitely many bounces take t0 (1 + e)/(1 - e). The rest condition omits bounces with v < 1e-4 m/s,
    // which take at most 2 v/(g (1 - e)).
    let e = 0.6;
    let fall = (2.0 / G).sqrt();
    let limit = fall * (1.0 + e) / (1.0 - e);
    let run = drop_from(1.0, e, &[10.0]);
    let rest = run.rest_time.expect("comes to rest");
    assert!(rest <= limit && limit - rest < 2e-4 / (G * (1.0 - e)), "{rest} {limit}");
    assert_eq!(run.positions[0][2].abs(), 0.0);
    assert_eq!(run.velocities[0][2], 0.0);
}

#[test]
fn elastic_ball_returns_to_its_height_after_many_bounces() {
    let fall = (2.0 / G).sqrt();
    let height = drop_from(1.0, 1.0, &[200.0 * fall]).positions[0][2];
    assert!((height - 1.0).abs() < 1e-9, "{height}");
}

#[test]
fn drag_in_fall_matches_the_closed_form() {
    // v(t) = v_t tanh(g t / v_t), z = h - v_t²/g ln cosh(g t / v_t). Tolerance: the integration error stated
    // at STEP_S.
    let mut world = World::new(Axes::Vertical);
    world.add_kind("quadratic-drag").expect("in the library");
    let (k, h) = (0.13f64, 6.0);
    let terminal = (G / k).sqrt();
    let times = grid(1.1, 50);
    let run = run(&world, &[k], 0.7, State::at_rest(h), &times);
    for (t, s) in times.iter().zip(&run.positions) {
        let exact = h - (G * t / terminal).cosh().ln() / k;
        assert!((s[2] - exact).abs() < 1e-6, "{t} {}", s[2] - exact);
    }
}

#[test]
fn impact_time_with_linear_drag_matches_the_closed_form() {
    // The closed form of the height must be 0 at the simulated impact time.
    let mut world = World::new(Axes::Vertical);
    world.add_kind("linear-drag").expect("in the library");
    let (c, h) = (0.5, 3.0);
    let run = run(&world, &[c], 0.7, State::at_rest(h), &[2.0]);
    let t = run.impacts[0].time;
    let z = h - G / c * (t - (1.0 - (-c * t).exp()) / c);
    assert!(z.abs() < 1e-7, "{z}");
}

#[test]
fn contact_of_zero_duration_is_an_instantaneous_bounce() {
    let mut world = World::new(Axes::Vertical);
    world.add_kind("contact-duration").expect("in the library");
    let times = grid(2.0, 200);
    let zero_duration = run(&world, &[0.0], 0.7, State::at_rest(1.0), &times);
    let instantaneous = drop_from(1.0, 0.7, &times);
    for (a, b) in zero_duration.positions.iter().zip(&instantaneous.positions) {
        assert!((a[2] - b[2]).abs() < EXACT);
    }
}

#[test]
fn finite_contact_penetrates_the_ground_and_rebounds_slower() {
    let mut world = World::new(Axes::Vertical);
    world.add_kind("contact-duration").expect("in the library");
    let soft = run(&world, &[0.02], 0.7, State::at_rest(1.0), &grid(2.0, 2000));
    let deepest = soft.positions.iter().map(|s| s[2]).fold(0.0, f64::min);
    let record = soft.impacts[0];
    assert!(deepest < -0.005 && deepest > -record.speed_in * 0.02, "{deepest}");
    assert!(record.speed_out < 0.7 * record.speed_in && record.speed_out > 0.66 * record.speed_in);
}

#[test]
fn sticking_contact_ends_the_slip() {
    // With friction high enough to stick, v_x = R ω after the impact.
    let mut world = World::new(Axes::Plane);
    world.add_kind("coulomb-friction").expect("in the library");
    let mut start = State::at_rest(1.0);
    start.velocity[0] = 1.5;
    start.spin[1] = -40.0;
    let run = run(&world, &[3.0], 0.7, start, &[1.5]);
    let second = run.impacts[1];
    assert!(run.impacts[0].slip[0].abs() > 1.0);
    assert!(second.slip[0].abs() < EXACT, "{}", second.slip[0]);
    assert!((second.tangential[0] - 0.02 * second.spin[1]).abs() < EXACT);
}

#[test]
fn tilted_ground_reflects_the_velocity_about_its_normal() {
    let mut world = World::new(Axes::Plane);
    world.add_kind("ground-tilt").expect("in the library");
    let (alpha, e) = (0.1f64, 0.8);
    let run = run(&world, &[alpha], e, State::at_rest(1.0), &[0.46]);
    let s = (2.0 * G).sqrt();
    let after = run.velocities[0];
    let vx = s * (1.0 + e) * alpha.sin() * alpha.cos();
    assert!((after[0] + vx).abs() < 1e-10, "{} {vx}", after[0]);
}

proptest! {
    #[test]
    fn energy_never_grows_at_an_impact(h in 0.01f64..20.0, e in 0.0f64..=1.0, vx in -3.0f64..3.0, mu in 0.0f64..2.0, w in -200.0f64..200.0) {
        let mut world = World::new(Axes::Plane);
        world.add_kind("coulomb-friction").expect("in the library");
        let mut start = State::at_rest(h);
        start.velocity[0] = vx;
        start.spin[1] = w;
        let run = run(&world, &[mu], e, start, &[4.0]);
        // Kinetic energy per mass before an impact, including the rotational part i R² ω² / 2.
        let energy = |i: usize| {
            let r = run.impacts[i];
            0.5 * (r.speed_in * r.speed_in + r.tangential[0].powi(2) + 0.4 * (0.02 * r.spin[1]).powi(2))
        };
        for i in 1..run.impacts.len() {
            prop_assert!(energy(i) <= energy(i - 1) * (1.0 + 1e-9) + 1e-12);
        }
    }

    #[test]
    fn ball_never_penetrates_the_ground(h in 0.0f64..10.0, e in 0.0f64..0.95, k in 0.0f64..0.3) {
        let mut world = World::new(Axes::Vertical);
        world.add_kind("quadratic-drag").expect("in the library");
        let run = run(&world, &[k], e, State::at_rest(h), &grid(5.0, 333));
        for s in run.positions {
            prop_assert!(s[2] > -1e-9, "{}", s[2]);
        }
    }

    #[test]
    fn height_is_continuous_in_the_drop_height(h in 0.2f64..5.0, e in 0.3f64..0.9, t in 0.0f64..4.0) {
        // The derivative of the height with respect to the drop height grows with each bounce, but is below
        // 1e4 before the Zeno limit here.
        let a = drop_from(h, e, &[t]).positions[0][2];
        let b = drop_from(h + 1e-9, e, &[t]).positions[0][2];
        prop_assert!((a - b).abs() < 1e-5, "{}", a - b);
    }
}
