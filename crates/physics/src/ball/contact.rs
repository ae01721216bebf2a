//! Contact of finite duration: a damped linear spring under gravity, solved in closed form.
//!
//! The contact obeys z'' = -a - 2 l z' - w0² z while z < 0. With the half period without gravity τ = π /
//! sqrt(w0² - l²), the loss L = l τ = -ln e and the scaled time θ = t/τ, the solution for the approach speed
//! v is
//!
//! 1. z/τ = X(θ) = -G + e^(-Lθ) (G cos πθ + D sin πθ),
//! 2. G = a τ / (π² + L²),
//! 3. D = (L G - v)/π.
//!
//! Nothing is singular at τ = 0, where the phase is the instantaneous bounce v → e v; the derivative with
//! respect to τ exists there and is exact. Source: Cross 1999, Am. J. Phys. 67:222 (Kelvin-Voigt contact).

use crate::Scalar;

/// The contact of the ball with the ground, from touchdown to take-off.
pub(super) struct Contact<S> {
    /// Half period of the contact spring without gravity, τ, s.
    tau: S,
    /// Logarithmic loss of speed in the contact, L = -ln e in formula (1).
    loss: S,
    /// Static deflection divided by τ, G in formula (2), m/s.
    sag: S,
    /// Amplitude of the sine term divided by τ, D in formula (3), m/s.
    sine: S,
    /// Time of take-off since touchdown, in units of τ.
    end: S,
}

impl<S: Scalar> Contact<S> {
    /// The contact phase after an approach at speed `v`, with restitution `e` and acceleration `a` into the
    /// ground.
    ///
    /// `None` if the ball does not take off again.
    pub fn new(tau: S, e: S, v: S, a: S) -> Option<Self> {
        if e.value() <= 1e-6 {
            return None;
        }
        let loss = -e.ln();
        let sag = a * tau / (loss * loss + std::f64::consts::PI.powi(2));
        let sine = (loss * sag - v) * std::f64::consts::FRAC_1_PI;
        let mut contact = Self { tau, loss, sag, sine, end: S::constant(1.0) };
        // Newton's method for X(θ) = 0 from θ = 1, the take-off without gravity. Each iterate enters as a
        // constant, so that the last step in `S` gives the derivative of the root.
        for _ in 0..6 {
            let theta = S::constant(contact.end.value());
            let (x, slope) = contact.scaled(theta);
            if slope.value() <= 1e-3 * e.value() * v.value() {
                return None;
            }
            contact.end = theta - x / slope;
            if contact.end.value() > 1.9 {
                return None;
            }
        }
        Some(contact)
    }

    /// Depth divided by τ, X(θ) in formula (1), and its derivative, the normal velocity; both in m/s.
    fn scaled(&self, theta: S) -> (S, S) {
        let pi = std::f64::consts::PI;
        let (cos, sin) = ((theta * pi).cos(), (theta * pi).sin());
        let decay = (-(self.loss * theta)).exp();
        let x = decay * (self.sag * cos + self.sine * sin);
        let slope = decay * (self.sine * cos - self.sag * sin) * pi - self.loss * x;
        (x - self.sag, slope)
    }

    /// Duration of the contact from touchdown to take-off, s.
    pub fn duration(&self) -> S {
        self.tau * self.end
    }

    /// Normal speed of the ball at take-off, m/s.
    pub fn speed_out(&self) -> S {
        self.scaled(self.end).1
    }

    /// Height (negative in contact), m, and normal velocity, m/s, `s` seconds after touchdown.
    pub fn at(&self, s: S) -> (S, S) {
        let (x, slope) = self.scaled(s / self.tau);
        (x * self.tau, slope)
    }
}
