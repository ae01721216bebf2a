//! Flight between impacts: a parabola, or Runge-Kutta steps with cubic Hermite interpolation.

use super::State;
use crate::Scalar;

/// Position `s` seconds after `state` under constant acceleration `a`; only the axes in `active` move.
pub(super) fn parabola<S: Scalar>(state: &State<S>, a: &[S; 3], s: S, active: &[usize]) -> [S; 3] {
    let mut position = state.position;
    for &i in active {
        position[i] += (state.velocity[i] + a[i] * s * 0.5) * s;
    }
    position
}

/// Time, s, at which the gap `gap + rate s + accel s² / 2` falls to zero; `None` if it never does.
pub(super) fn time_to_contact<S: Scalar>(gap: S, rate: S, accel: S) -> Option<S> {
    if accel.value() >= 0.0 {
        return (rate.value() < 0.0 && accel.value() == 0.0).then(|| gap / -rate);
    }
    let pull = -accel;
    let root = (rate * rate + pull * gap * 2.0).sqrt();
    // Two forms of the same root of gap + rate s - pull s²/2. Each one adds terms of equal sign, so that no
    // digits cancel where the ball is close to the ground.
    if rate.value() >= 0.0 { Some((rate + root) / pull) } else { Some(gap * 2.0 / (root - rate)) }
}

/// A Runge-Kutta step of flight: the states at both ends, for Hermite interpolation between them.
#[derive(Clone, Copy)]
pub(super) struct Step<S> {
    pub start: State<S>,
    pub end: State<S>,
    /// Duration of the integration step, s.
    pub length: S,
}

impl<S: Scalar> Step<S> {
    /// Makes one classical fourth-order Runge-Kutta step on the axes in `active`.
    ///
    /// `acceleration(time, position, velocity)` returns m/s².
    pub fn rk4(
        start: &State<S>,
        length: S,
        active: &[usize],
        acceleration: &impl Fn(S, &[S; 3], &[S; 3]) -> [S; 3],
    ) -> Self {
        let half = length * 0.5;
        let moved = |a: &[S; 3], b: &[S; 3], h: S| {
            let mut out = *a;
            active.iter().for_each(|&i| out[i] += b[i] * h);
            out
        };
        let (p, v, t) = (&start.position, &start.velocity, start.time);
        let a1 = acceleration(t, p, v);
        let v2 = moved(v, &a1, half);
        let a2 = acceleration(t + half, &moved(p, v, half), &v2);
        let v3 = moved(v, &a2, half);
        let a3 = acceleration(t + half, &moved(p, &v2, half), &v3);
        let v4 = moved(v, &a3, length);
        let a4 = acceleration(t + length, &moved(p, &v3, length), &v4);
        let sixth = length * (1.0 / 6.0);
        let mut end = *start;
        end.time = t + length;
        for &i in active {
            end.position[i] += (v[i] + (v2[i] + v3[i]) * 2.0 + v4[i]) * sixth;
            end.velocity[i] += (a1[i] + (a2[i] + a3[i]) * 2.0 + a4[i]) * sixth;
        }
        Self { start: *start, end, length }
    }

    /// Copy of the integration step without derivatives.
    pub fn values(&self) -> Step<f64> {
        let value = |s: &State<S>| State {
            time: s.time.value(),
            position: s.position.map(S::value),
            velocity: s.velocity.map(S::value),
            spin: s.spin.map(S::value),
        };
        Step { start: value(&self.start), end: value(&self.end), length: self.length.value() }
    }

    /// Position `s` seconds into the step on the axes in `active`, by cubic Hermite interpolation.
    pub fn position(&self, s: S, active: &[usize]) -> [S; 3] {
        let (h, u) = (self.length, s / self.length);
        let (p0, p1) = (&self.start.position, &self.end.position);
        let (v0, v1) = (&self.start.velocity, &self.end.velocity);
        let w = -u + 1.0;
        let (uu, uw) = (u * u, u * w * h);
        let (b1, b2, b3) = (uu * (-u * 2.0 + 3.0), uw * w, uw * u);
        let mut out = *p0;
        for &i in active {
            out[i] += (p1[i] - p0[i]) * b1 + v0[i] * b2 - v1[i] * b3;
        }
        out
    }

    /// Velocity `s` seconds into the step: the derivative of [`position`](Step::position).
    pub fn velocity(&self, s: S) -> [S; 3] {
        let (h, u) = (self.length, s / self.length);
        let (p0, p1) = (&self.start.position, &self.end.position);
        let (v0, v1) = (&self.start.velocity, &self.end.velocity);
        let w = -u + 1.0;
        let slope = u * w * 6.0 / h;
        let (c2, c3) = (w * w - u * w * 2.0, u * u - u * w * 2.0);
        std::array::from_fn(|i| (p1[i] - p0[i]) * slope + v0[i] * c2 + v1[i] * c3)
    }
}
