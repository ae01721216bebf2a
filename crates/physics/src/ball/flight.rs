//! Motion between impacts: a parabola in closed form, or one Runge-Kutta step with Hermite output.

use super::State;
use crate::Scalar;
use crate::scalar::axpy;

/// Position and velocity `s` seconds after a state, under constant acceleration `a`.
pub(super) fn parabola<S: Scalar>(state: &State<S>, a: &[S; 3], s: S) -> ([S; 3], [S; 3]) {
    let position = std::array::from_fn(|i| state.position[i] + (state.velocity[i] + a[i] * s * 0.5) * s);
    (position, axpy(&state.velocity, a, s))
}

/// Time until `gap + rate s + accel s² / 2` falls to zero, or `None` if it never does.
///
/// The form with the root in the numerator of a sum of positive numbers loses no digits after a bounce, where `gap` is
/// rounding.
pub(super) fn time_to_contact<S: Scalar>(gap: S, rate: S, accel: S) -> Option<S> {
    if accel.value() >= 0.0 {
        return (rate.value() < 0.0 && accel.value() == 0.0).then(|| gap / -rate);
    }
    let pull = -accel;
    let root = (rate * rate + pull * gap * 2.0).sqrt();
    if rate.value() >= 0.0 { Some((rate + root) / pull) } else { Some(gap * 2.0 / (root - rate)) }
}

/// The ends of one integration step, with what Hermite interpolation between them needs.
#[derive(Clone, Copy)]
pub(super) struct Step<S> {
    pub start: State<S>,
    pub end: State<S>,
    pub length: S,
}

impl<S: Scalar> Step<S> {
    /// One classical Runge-Kutta step of fourth order; `acceleration(time, position, velocity)`.
    pub fn rk4(start: &State<S>, length: S, acceleration: &impl Fn(S, &[S; 3], &[S; 3]) -> [S; 3]) -> Self {
        let half = length * 0.5;
        let (p, v, t) = (&start.position, &start.velocity, start.time);
        let a1 = acceleration(t, p, v);
        let v2 = axpy(v, &a1, half);
        let a2 = acceleration(t + half, &axpy(p, v, half), &v2);
        let v3 = axpy(v, &a2, half);
        let a3 = acceleration(t + half, &axpy(p, &v2, half), &v3);
        let v4 = axpy(v, &a3, length);
        let a4 = acceleration(t + length, &axpy(p, &v3, length), &v4);
        let sixth = length * (1.0 / 6.0);
        let sum = |a: &[S; 3], b: &[S; 3], c: &[S; 3], d: &[S; 3]| -> [S; 3] {
            std::array::from_fn(|i| a[i] + (b[i] + c[i]) * 2.0 + d[i])
        };
        let mut end = *start;
        end.time = t + length;
        end.position = axpy(p, &sum(v, &v2, &v3, &v4), sixth);
        end.velocity = axpy(v, &sum(&a1, &a2, &a3, &a4), sixth);
        Self { start: *start, end, length }
    }

    /// Position and velocity `s` seconds into the step, by the cubic through both ends with their velocities.
    pub fn at(&self, s: S) -> ([S; 3], [S; 3]) {
        let (h, u) = (self.length, s / self.length);
        let (p0, p1) = (&self.start.position, &self.end.position);
        let (v0, v1) = (&self.start.velocity, &self.end.velocity);
        let w = -u + 1.0;
        let (b1, b2, b3) = (u * u * (-u * 2.0 + 3.0), u * w * w * h, -(u * u * w * h));
        let slope = u * w * 6.0 / h;
        let (c2, c3) = (w * w - u * w * 2.0, u * u - u * w * 2.0);
        (
            std::array::from_fn(|i| p0[i] + (p1[i] - p0[i]) * b1 + v0[i] * b2 + v1[i] * b3),
            std::array::from_fn(|i| (p1[i] - p0[i]) * slope + v0[i] * c2 + v1[i] * c3),
        )
    }
}
