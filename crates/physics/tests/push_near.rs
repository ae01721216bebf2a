//! Contract: a contact that is solved from its motion a moment ago moves as one that is asked alone, with the same derivatives.

use augsim_physics::push::{
    Mode, Motion, Object, Path, Pose, Push, Run, Stepper, Steps, StraightPush, World, effects,
};
use augsim_physics::push::{planar::Rotation, planar::add, planar::sub, simulate};
use augsim_physics::{Dual, Scalar};
use std::collections::BTreeSet;

/// Effects whose contacts are solved numerically, and whose sensors report the true pose.
const KINDS: [&str; 6] = [
    "contact-friction-slip",
    "exact-surface",
    "friction-gradient",
    "pressure-offset",
    "superelliptic-surface",
    "table-tilt",
];

/// Against side 0, at `fraction` of it and `angle` from its normal.
fn path(object: &Object, home: &Pose<f64>, fraction: f64, angle: f64) -> StraightPush {
    let (point, normal) = object.point_on_side(0, fraction);
    let direction = Rotation::new(home.angle).to_world(Rotation::new(angle).to_world(normal)).map(|x| -x);
    let contact = home.to_world(add(point, normal.map(|x| 0.00475 * x)));
    StraightPush {
        start_m: sub(contact, direction.map(|x| 0.003 * x)),
        direction,
        speed_m_s: 0.05,
        acceleration_m_s2: 0.5,
        travel_m: 0.1,
    }
}

#[test]
fn a_contact_within_a_push_moves_as_one_that_is_asked_alone() {
    let home = Pose::new(0.1, 0.2, 0.3);
    let times: Vec<f64> = (0..100).map(|k| 0.021 * f64::from(k)).collect();
    let mut modes = BTreeSet::new();
    for kind in KINDS {
        let mut world = World::new(Object::named("rect1").expect("built in"));
        let listed = effects::all::<f64>();
        world.add(listed.iter().position(|e| e.spec().kind == kind).expect("listed")).expect("listed");
        // A tilt of zero or a surface that is an ellipsoid would have a closed form.
        let p: Vec<f64> = world.nominal().iter().map(|v| v * 1.05 + 1e-3).collect();
        let duals: Vec<Dual<9>> = p.iter().enumerate().map(|(i, v)| Dual::variable(*v, i)).collect();
        for (fraction, angle) in [(0.65, 0.5), (0.3, -0.9), (0.5, 0.1), (0.9, 1.2), (0.05, -0.2)] {
            let path = path(world.object(), &home, fraction, angle);
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
            for (k, (pose, within)) in run.poses.iter().zip(&run.instants).enumerate() {
                let at = Dual::constant(times[k]);
                let piece = Path::<Dual<9>>::piece(&path, times[k]);
                let alone =
                    Stepper::new(&world, &duals, steps).instant(pose, piece.position(at), piece.velocity(at));
                let place = format!("{kind}, {fraction}, {angle}, sample {k}");
                assert_eq!(within.mode, alone.mode, "{place}");
                if within.mode != Mode::Free {
                    modes.insert(within.mode.name());
                }
                let pairs = [
                    (within.twist.velocity[0], alone.twist.velocity[0], 1.0),
                    (within.twist.velocity[1], alone.twist.velocity[1], 1.0),
                    (within.twist.rotation, alone.twist.rotation, 0.03),
                    (within.slip, alone.slip, 1.0),
                ];
                for (a, b, arm) in pairs {
                    // Of 50 mm/s: the exact surface sums near translation by a quadrature that is good to 1e-10. Slopes are
                    // those of Newton's last step but one, whose relative error is below 1e-6.
                    assert!(arm * (a.value - b.value).abs() < 5e-11, "{place}: {} {}", a.value, b.value);
                    for (lane, v) in p.iter().enumerate() {
                        let scale = arm * v.abs().max(1e-2);
                        let (of_a, of_b) = (scale * a.d[lane], scale * b.d[lane]);
                        assert!(
                            (of_a - of_b).abs() <= 5e-8 + 1e-6 * of_b.abs(),
                            "{place}, {lane}: {of_a} {of_b}"
                        );
                    }
                }
            }
        }
    }
    assert!(["left", "right", "stick"].iter().all(|m| modes.contains(m)), "{modes:?}");
}
