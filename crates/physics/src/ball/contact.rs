//! Contact that lasts: a damped linear spring under gravity, in closed form.

use crate::Scalar;

/// A contact phase of a spring and damper whose half period without gravity is `tau` and whose loss gives restitution `e`.
///
/// In the scaled time `θ = t/τ`, with `L = -ln e`, pull `a` into the ground and `G = a τ / (π² + L²)`, the depth obeys
/// `z/τ = X(θ) = -G + e^(-Lθ) (G cos πθ + D sin πθ)`, `D = (L G - v)/π`. Nothing is singular at `τ = 0`, where the phase is
/// the instantaneous bounce `v → e v`: the derivative with respect to τ exists there and is exact.
pub(super) struct Contact<S> {
    tau: S,
    loss: S,
    sag: S,
    sine: S,
    /// End of the phase in scaled time.
    end: S,
}

impl<S: Scalar> Contact<S> {
    /// The phase after an approach at speed `v` with restitution `e` and pull `a`; `None` if the ball does not leave again.
    pub fn new(tau: S, e: S, v: S, a: S) -> Option<Self> {
        if e.value() <= 1e-6 {
            return None;
        }
        let loss = -e.ln();
        let sag = a * tau / (loss * loss + std::f64::consts::PI.powi(2));
        let sine = (loss * sag - v) * std::f64::consts::FRAC_1_PI;
        let mut contact = Self { tau, loss, sag, sine, end: S::constant(1.0) };
        // Newton from the end without gravity; the last step in S gives the derivative of the root.
        for _ in 0..6 {
            let at = S::constant(contact.end.value());
            let (x, slope) = contact.scaled(at);
            if slope.value() <= 1e-3 * e.value() * v.value() {
                return None;
            }
            contact.end = at - x / slope;
            if contact.end.value() > 1.9 {
                return None;
            }
        }
        Some(contact)
    }

    fn scaled(&self, theta: S) -> (S, S) {
        let pi = std::f64::consts::PI;
        let (cos, sin) = ((theta * pi).cos(), (theta * pi).sin());
        let decay = (-(self.loss * theta)).exp();
        let x = decay * (self.sag * cos + self.sine * sin);
        let slope = decay * (self.sine * cos - self.sag * sin) * pi - self.loss * x;
        (x - self.sag, slope)
    }

    /// Duration, s.
    pub fn duration(&self) -> S {
        self.tau * self.end
    }

    /// Normal speed at the end, m/s.
    pub fn speed_out(&self) -> S {
        self.scaled(self.end).1
    }

    /// Height (negative: depth), m, and normal velocity, m/s, `s` seconds into the phase.
    pub fn at(&self, s: S) -> (S, S) {
        let (x, slope) = self.scaled(s / self.tau);
        (x * self.tau, slope)
    }
}
