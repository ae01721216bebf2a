//! How an object responds to the rod: which form of the contact's equations applies.

use super::contact::{ContactFriction, Mode, Response, Touch, ellipsoid};
use super::contact_solver::general;
use super::near::Near;
use super::planar::{Twist, dot};
use super::support::{Support, free_twist};
use super::surface::Surface;
use crate::Scalar;

/// The twist of an object that the rod touches, and the force between them.
#[inline]
pub fn respond<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
) -> Response<S> {
    respond_near(support, touch, friction, None)
}

/// [`respond`] of a contact whose motion a moment ago is known.
#[inline]
pub(super) fn respond_near<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
    near: Option<Near>,
) -> Response<S> {
    let approach = dot(touch.velocity, touch.normal).value();
    let Some(inertia) = &support.inertia else {
        if approach <= 0.0 {
            return Response::without_force(Mode::Separate, Twist::zero());
        }
        return match (&support.surface, support.loaded, friction.rise_s_per_m) {
            (Surface::Ellipsoid { c }, false, None) => ellipsoid(support, *c, touch, friction.at_rest),
            _ => general(support, touch, friction, near),
        };
    };
    // With inertia an object may run ahead. Contact and free motion exclude each other (the one has a pushing force exactly
    // when the other would overlap), so that the likelier is tried first.
    let rate = |twist: &Twist<S>| dot(twist.at(touch.point), touch.normal).value();
    if approach > rate(&inertia.previous) {
        let response = general(support, touch, friction, near);
        if dot(response.force, touch.normal).value() > 0.0 {
            return response;
        }
    }
    let free = free_twist(support);
    if rate(&free) >= approach {
        return Response::without_force(Mode::Separate, free);
    }
    general(support, touch, friction, near)
}
