//! Quasi-static contact model of one stride (short straight motion of the rod) of a push.
//!
//! Friction and contact are replaceable.

use crate::engine::ModelPush;
use augsim_physics::Scalar as Real;
use augsim_physics::push::planar::{Rotation, add, dot, rot90, scale};
use augsim_physics::push::{ContactFriction, Outline, Pose, Support, Touch, respond};

/// Number of equal time steps per stride (motion of the rod), in each of which the contact is linearised.
const SUBSTEPS: usize = 4;

/// A pushed object, the rod, and their declared friction parameters.
#[derive(Debug, Clone)]
pub(super) struct Contact {
    outline: Outline,
    rod_radius_m: f64,
    /// Ratio c of the largest moment to the largest force of the support friction, m.
    pub c_m: f64,
    /// Friction coefficient between rod and object.
    pub friction: f64,
}

/// Offset of the contact from the one that the object's outline gives.
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactOffset<S> {
    /// Shift of the contact point along the object's side, m.
    pub shift: S,
    /// Rotation of the contact normal from that of the outline, rad.
    pub turn: S,
}

impl Contact {
    /// Takes object, rod and friction from a declared pushing model.
    pub fn from_model(push: &ModelPush) -> Self {
        Contact {
            outline: push.world().object().outline.clone(),
            rod_radius_m: push.rod_radius_m(),
            c_m: push.c_m(),
            friction: push.contact_friction(),
        }
    }

    /// Computes the object's displacement (m, m, rad) while the rod moves from position `rod` by `travel`, m.
    ///
    /// All in the object's frame at the start of the stride.
    pub fn displacement<S: Real>(
        &self,
        rod: [f64; 2],
        travel: [f64; 2],
        support: &Support<'_, S>,
        friction: &ContactFriction<S>,
        offset: Option<&ContactOffset<S>>,
    ) -> [S; 3] {
        let mut pose = Pose::new(S::zero(), S::zero(), S::zero());
        let step = travel.map(|v| S::constant(v / SUBSTEPS as f64));
        for substep in 0..SUBSTEPS {
            let fraction = substep as f64 / SUBSTEPS as f64;
            let position = [0, 1].map(|j| S::constant(rod[j] + fraction * travel[j]));
            let nearest = self.outline.nearest(pose.to_body(position));
            let rotation = Rotation::new(pose.angle);
            let inward = rotation.to_world(nearest.outward.map(|n| -n));
            let gap = nearest.distance - self.rod_radius_m;
            let approach = dot(step, inward);
            // The rod moves freely until contact, so only the remaining fraction of the substep pushes.
            let pushing_fraction = if gap.value() <= 0.0 {
                S::constant(1.0)
            } else if approach.value() > gap.value() {
                -(gap / approach) + 1.0
            } else {
                continue;
            };
            let point = rotation.to_world(nearest.point);
            let (point, normal) = match offset {
                Some(ContactOffset { shift, turn }) => {
                    let normal = Rotation::new(*turn).to_world(inward);
                    (add(point, scale(rot90(normal), *shift)), normal)
                }
                None => (point, inward),
            };
            let touch = Touch { point, normal, velocity: scale(step, pushing_fraction) };
            let twist = respond(support, &touch, friction).twist;
            pose = Pose { position: add(pose.position, twist.velocity), angle: pose.angle + twist.rotation };
        }
        [pose.position[0], pose.position[1], pose.angle]
    }
}
