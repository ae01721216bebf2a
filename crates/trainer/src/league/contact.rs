//! The quasi-static contact of a stride of a push, for classes that put something of their own into the analytical model.

use crate::engine::ModelPush;
use augsim_physics::Scalar as Real;
use augsim_physics::push::planar::{Rotation, add, dot, rot90, scale};
use augsim_physics::push::{ContactFriction, Outline, Pose, Support, Touch, respond};

/// Straight pieces of a stride that the model is asked about.
const PIECES: usize = 4;

/// The object and the rod, with what is declared about their friction.
#[derive(Debug, Clone)]
pub(super) struct Contact {
    outline: Outline,
    rod_radius_m: f64,
    /// Ratio of the largest moment to the largest force of the support's friction, m.
    pub c_m: f64,
    /// Friction between rod and object.
    pub friction: f64,
}

/// A contact elsewhere than the outline says.
#[derive(Debug, Clone, Copy)]
pub(super) struct Misplaced<S> {
    /// Way of the contact along the side, m.
    pub shift: S,
    /// Turn of its normal, rad.
    pub turn: S,
}

impl Contact {
    /// That of a declared model.
    pub fn of(push: &ModelPush) -> Self {
        Contact {
            outline: push.world().object().outline.clone(),
            rod_radius_m: push.rod_radius_m(),
            c_m: push.c_m(),
            friction: push.contact_friction(),
        }
    }

    /// Displacement (m, m, rad) in the object's frame at the beginning of the stride, while the rod goes from `rod` by `travel`, m.
    pub fn displacement<S: Real>(
        &self,
        rod: [f64; 2],
        travel: [f64; 2],
        support: &Support<'_, S>,
        law: &ContactFriction<S>,
        misplaced: Option<&Misplaced<S>>,
    ) -> [S; 3] {
        let mut pose = Pose::new(S::zero(), S::zero(), S::zero());
        let step = travel.map(|v| S::constant(v / PIECES as f64));
        for piece in 0..PIECES {
            let share = piece as f64 / PIECES as f64;
            let at = [0, 1].map(|j| S::constant(rod[j] + share * travel[j]));
            let nearest = self.outline.nearest(pose.to_body(at));
            let rotation = Rotation::new(pose.angle);
            let inward = rotation.to_world(nearest.outward.map(|n| -n));
            let gap = nearest.distance - self.rod_radius_m;
            let approach = dot(step, inward);
            // The rod moves freely until it touches.
            let pushing = if gap.value() <= 0.0 {
                S::constant(1.0)
            } else if approach.value() > gap.value() {
                -(gap / approach) + 1.0
            } else {
                continue;
            };
            let point = rotation.to_world(nearest.point);
            let (point, normal) = match misplaced {
                Some(Misplaced { shift, turn }) => {
                    let normal = Rotation::new(*turn).to_world(inward);
                    (add(point, scale(rot90(normal), *shift)), normal)
                }
                None => (point, inward),
            };
            let touch = Touch { point, normal, velocity: scale(step, pushing) };
            let twist = respond(support, &touch, law).twist;
            pose = Pose { position: add(pose.position, twist.velocity), angle: pose.angle + twist.rotation };
        }
        [pose.position[0], pose.position[1], pose.angle]
    }
}
