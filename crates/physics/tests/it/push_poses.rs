//! Contract of dense output and warm starts.
//!
//! - Interpolated poses and their derivatives agree with the stepped simulation for every effect.
//! - A simplified path stays within its tolerance of the recorded one.
//! - A contact solved from a warm start has the same motion and derivatives as one solved alone.

use augsim_physics::push::planar::{Rotation, add, sub};
use augsim_physics::push::{
    Mode, Motion, Object, Path, Pose, Push, Run, Stepper, Steps, StraightPush, World,
};
use augsim_physics::push::{effects, simplify_path, simulate, simulate_poses};
use augsim_physics::{Dual, Scalar};
use proptest::prelude::*;
use std::collections::BTreeSet;

const HOME: [f64; 3] = [0.1, 0.2, 0.3];

/// Path of a push that starts 3 mm from a side at `fraction`, at `angle` from the normal.
fn path(object: &Object, fraction: f64, angle: f64) -> StraightPush {
    let home = Pose::new(HOME[0], HOME[1], HOME[2]);
    let (point, normal) = object.point_on_side(0, fraction);
    let direction = Rotation::new(home.angle).to_world(Rotation::new(angle).to_world(normal)).map(|x| -x);
    let contact = home.to_world(add(point, normal.map(|x| 0.00475 * x)));
    StraightPush {
        start_m: sub(contact, direction.map(|x| 0.003 * x)),
        direction,
        speed_m_s: 0.05,
        acceleration_m_s2: 0.0,
        travel_m: 0.1,
    }
}

fn stepped_and_interpolated<S: Scalar>(world: &World, p: &[S], path: &StraightPush) -> [Vec<Pose<S>>; 2] {
    // Samples are 0.33 mm of travel apart and include rest at the end.
    let times: Vec<f64> = (0..320).map(|k| 0.0066 * f64::from(k)).collect();
    let start = Pose::new(HOME[0], HOME[1], HOME[2]).lift();
    let push = |travel_m| Push {
        world,
        parameters: p,
        start,
        path,
        field: None,
        steps: Steps { travel_m, inertial_s: 5e-3, ..Steps::default() },
    };
    let mut run = Run { poses: vec![], instants: vec![], steps: 0 };
    simulate(&push(1e-3), &times, &mut run).expect("starts outside");
    let mut poses = vec![];
    simulate_poses(&push(2e-3), &times, false, &mut poses).expect("starts outside");
    [run.poses, poses]
}

#[test]
fn interpolated_poses_and_derivatives_agree_with_the_stepped_simulation() {
    let mut kinds: Vec<Option<usize>> = vec![None];
    kinds.extend((0..effects::all::<f64>().len()).map(Some));
    for kind in kinds {
        let name = kind.map_or("plain", |i| effects::all::<f64>()[i].spec().kind);
        let mut world = World::new(Object::named("rect1").expect("built in"));
        if let Some(index) = kind {
            world.add(index).expect("listed");
        }
        let p = world.nominal();
        // Five base parameters and at most four of an effect.
        let duals: Vec<Dual<9>> = p.iter().enumerate().map(|(i, v)| Dual::variable(*v, i)).collect();
        for (fraction, angle) in [(0.65, 0.5), (0.3, -0.9), (0.5, 0.1)] {
            let path = path(world.object(), fraction, angle);
            let [stepped, interpolated] = stepped_and_interpolated(&world, &duals, &path);
            assert_eq!(stepped.len(), interpolated.len());
            for (k, (a, b)) in stepped.iter().zip(&interpolated).enumerate() {
                let pairs = [
                    (a.position[0], b.position[0], 1.0),
                    (a.position[1], b.position[1], 1.0),
                    (a.angle, b.angle, 0.03),
                ];
                for (x, y, arm) in pairs {
                    // Sub-steps of 2 mm are within 10 µm of the finest. Derivatives jump where the contact
                    // begins to slide; with coarse sub-steps by up to 10 % of what 2 mm of travel change.
                    let off = arm * (x.value - y.value).abs();
                    assert!(off < 1e-5, "{name}, sample {k}: {off:e} m");
                    for (lane, v) in p.iter().enumerate() {
                        let scale = arm * v.abs().max(1e-2);
                        let (dx, dy) = (scale * x.d[lane], scale * y.d[lane]);
                        assert!((dx - dy).abs() < 2e-4 + 0.02 * dx.abs(), "{name}, {k}, {lane}: {dx} {dy}");
                    }
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn a_simplified_path_stays_within_its_tolerance(seed in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 2..200)) {
        let times: Vec<f64> = (0..seed.len()).map(|k| 0.01 * k as f64).collect();
        let sum = |pick: fn(&(f64, f64)) -> f64| -> Vec<f64> {
            seed.iter().scan(0.0, |at, s| { *at += 1e-5 * pick(s); Some(*at) }).collect()
        };
        let (x, y) = (sum(|s| s.0), sum(|s| s.1));
        let tolerance = 1.5e-5;
        let kept_indices = simplify_path(&times, &x, &y, tolerance);
        prop_assert_eq!((kept_indices[0], *kept_indices.last().expect("two or more")), (0, times.len() - 1));
        for pair in kept_indices.windows(2) {
            prop_assert!(pair[0] < pair[1]);
            for k in pair[0]..=pair[1] {
                let s = (times[k] - times[pair[0]]) / (times[pair[1]] - times[pair[0]]);
                for z in [&x, &y] {
                    let line = z[pair[0]] + s * (z[pair[1]] - z[pair[0]]);
                    prop_assert!((line - z[k]).abs() <= tolerance * (1.0 + 1e-9));
                }
            }
        }
    }
}

#[test]
fn a_straight_path_is_simplified_to_its_ends() {
    let times: Vec<f64> = (0..100).map(f64::from).collect();
    let x: Vec<f64> = times.iter().map(|t| 0.3 + 1e-3 * t).collect();
    assert_eq!(simplify_path(&times, &x, &x, 1e-9), [0, 99]);
    assert_eq!(simplify_path(&[1.0], &[0.0], &[0.0], 1e-9), [0]);
    assert!(simplify_path(&[], &[], &[], 1e-9).is_empty());
}

/// Kinds of effects whose contacts are solved numerically, and whose sensors report the true pose.
const KINDS: [&str; 6] = [
    "contact-friction-slip",
    "exact-surface",
    "friction-gradient",
    "pressure-offset",
    "superelliptic-surface",
    "table-tilt",
];

#[test]
fn a_warm_started_contact_moves_as_one_solved_alone() {
    let home = Pose::new(HOME[0], HOME[1], HOME[2]);
    let times: Vec<f64> = (0..100).map(|k| 0.021 * f64::from(k)).collect();
    let mut modes = BTreeSet::new();
    for kind in KINDS {
        let mut world = World::new(Object::named("rect1").expect("built in"));
        world.add_kind(kind).expect("listed");
        // At the nominal values a contact could have a closed form (no tilt, or an ellipsoid).
        let p: Vec<f64> = world.nominal().iter().map(|v| v * 1.05 + 1e-3).collect();
        let duals: Vec<Dual<9>> = p.iter().enumerate().map(|(i, v)| Dual::variable(*v, i)).collect();
        for (fraction, angle) in [(0.65, 0.5), (0.3, -0.9), (0.5, 0.1), (0.9, 1.2), (0.05, -0.2)] {
            let path = StraightPush { acceleration_m_s2: 0.5, ..path(world.object(), fraction, angle) };
            let steps = Steps { travel_m: 2e-3, ..Steps::default() };
            let push = Push {
                world: &world,
                parameters: &duals,
                start: home.lift(),
                path: &path,
                field: None,
                steps,
            };
            let mut run = Run { poses: vec![], instants: vec![], steps: 0 };
            simulate(&push, &times, &mut run).expect("starts outside");
            for (k, (pose, warm_started)) in run.poses.iter().zip(&run.instants).enumerate() {
                let time = Dual::constant(times[k]);
                let piece = Path::<Dual<9>>::piece(&path, times[k]);
                let alone = Stepper::new(&world, &duals, steps).instant(
                    pose,
                    piece.position(time),
                    piece.velocity(time),
                );
                let place = format!("{kind}, {fraction}, {angle}, sample {k}");
                assert_eq!(warm_started.mode, alone.mode, "{place}");
                if warm_started.mode != Mode::Free {
                    modes.insert(warm_started.mode.name());
                }
                let pairs = [
                    (warm_started.twist.velocity[0], alone.twist.velocity[0], 1.0),
                    (warm_started.twist.velocity[1], alone.twist.velocity[1], 1.0),
                    (warm_started.twist.rotation, alone.twist.rotation, 0.03),
                    (warm_started.slip, alone.slip, 1.0),
                ];
                for (a, b, arm) in pairs {
                    // The rod moves at 50 mm/s. The quadrature of the exact surface near translation is
                    // accurate to 1e-10. Derivatives are evaluated one Newton step before the last, where the
                    // relative error is below 1e-6.
                    assert!(arm * (a.value - b.value).abs() < 5e-11, "{place}: {} {}", a.value, b.value);
                    for (lane, v) in p.iter().enumerate() {
                        let scale = arm * v.abs().max(1e-2);
                        let (derivative_a, derivative_b) = (scale * a.d[lane], scale * b.d[lane]);
                        assert!(
                            (derivative_a - derivative_b).abs() <= 5e-8 + 1e-6 * derivative_b.abs(),
                            "{place}, {lane}: {derivative_a} {derivative_b}"
                        );
                    }
                }
            }
        }
    }
    assert!(["left", "right", "stick"].iter().all(|m| modes.contains(m)), "{modes:?}");
}
