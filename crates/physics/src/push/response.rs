//! Response of an object to the rod: choice between closed form, numerical solution and free motion.

use super::contact::{ContactFriction, Mode, Response, Touch, ellipsoid_response};
use super::contact_solver::solve_contact;
use super::planar::{Twist, dot};
use super::support::{Support, free_twist};
use super::surface::Surface;
use super::warm_start::WarmStart;
use crate::Scalar;

/// Response of an object that the rod touches: contact mode, twist, force and slip.
#[inline]
pub fn respond<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
) -> Response<S> {
    respond_from(support, touch, friction, None)
}

/// Response as by [`respond`], with an initial guess from the motion at the previous instant.
#[inline]
pub(super) fn respond_from<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
    warm_start: Option<WarmStart>,
) -> Response<S> {
    let approach = dot(touch.velocity, touch.normal).value();
    let Some(inertia) = &support.inertia else {
        if approach <= 0.0 {
            return Response::without_force(Mode::Separate, Twist::zero());
        }
        return match (&support.surface, support.loaded, friction.rise_s_per_m) {
            (Surface::Ellipsoid { c }, false, None) => {
                ellipsoid_response(support, *c, touch, friction.at_rest)
            }
            _ => solve_contact(support, touch, friction, warm_start),
        };
    };
    // With inertia the object may move ahead of the rod. Exactly one of contact and free motion is
    // consistent: contact has a pushing force exactly if free motion would overlap. The more probable one is
    // tried first.
    let contact_speed = |twist: &Twist<S>| dot(twist.at(touch.point), touch.normal).value();
    if approach > contact_speed(&inertia.previous) {
        let response = solve_contact(support, touch, friction, warm_start);
        if dot(response.force, touch.normal).value() > 0.0 {
            return response;
        }
    }
    let free = free_twist(support);
    if contact_speed(&free) >= approach {
        return Response::without_force(Mode::Separate, free);
    }
    solve_contact(support, touch, friction, warm_start)
}
