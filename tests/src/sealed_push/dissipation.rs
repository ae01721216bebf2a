//! Friction wrench of a sliding object by maximum dissipation, and the object's motion when a rod pushes it.

/// Friction model of the support on which the object slides, for a twist `(v, w)`.
#[derive(Clone, Debug)]
pub enum Surface {
    /// Dissipation `sqrt(|v|² + c² w²)` per sliding force; the number is c, m.
    Ellipsoid(f64),
    /// Dissipation `(|v|^q + |c w|^q)^(1/q)` per sliding force, `q = p / (p - 1)`; the numbers are c (m), p.
    Superellipsoid(f64, f64),
    /// Coulomb friction of patches, each with its position in the body frame (m) and its share of the load.
    Patches(Vec<([f64; 2], f64)>),
}

impl Surface {
    /// Patches of a uniform pressure on a square with this side, m.
    pub fn square(side: f64) -> Self {
        const ACROSS: usize = 12;
        let place = |i: usize| side * ((i as f64 + 0.5) / ACROSS as f64 - 0.5);
        let share = 1.0 / (ACROSS * ACROSS) as f64;
        let cells = (0..ACROSS * ACROSS).map(|i| ([place(i % ACROSS), place(i / ACROSS)], share));
        Self::Patches(cells.collect())
    }
}

/// Friction and load of the object at one instant, in its own frame; forces in units of the sliding force.
#[derive(Clone, Debug)]
pub struct Body<'a> {
    pub surface: &'a Surface,
    /// Position of the centre of friction in the body frame, m.
    pub centre: [f64; 2],
    /// The matrix `A^(1/2)` of anisotropic friction, by which the slip velocity is multiplied.
    pub stretch: [[f64; 2]; 2],
    /// Relative change of the pressure per metre, along x and y of the body.
    pub gradient: [f64; 2],
    /// Force at the centre of friction other than friction and rod force, in units of the sliding force.
    pub load: [f64; 2],
}

/// Smallest speed by which is divided, m/s, to avoid a division by zero.
const MIN_SPEED: f64 = 1e-9;

/// Product of a 2 x 2 matrix and a vector.
fn multiply(h: &[[f64; 2]; 2], v: [f64; 2]) -> [f64; 2] {
    [h[0][0] * v[0] + h[0][1] * v[1], h[1][0] * v[0] + h[1][1] * v[1]]
}

impl Body<'_> {
    /// Force and moment about the origin of the body frame that maintain the twist `(vx, vy, w)`.
    pub fn wrench(&self, twist: [f64; 3]) -> [f64; 3] {
        let [vx, vy, w] = twist;
        let h = &self.stretch;
        let mut f = match self.surface {
            Surface::Patches(cells) => {
                let mut sum = [0.0; 3];
                for (p, share) in cells {
                    let n = share * (1.0 + self.gradient[0] * p[0] + self.gradient[1] * p[1]);
                    let place = [p[0] + self.centre[0], p[1] + self.centre[1]];
                    let g = multiply(h, [vx - w * place[1], vy + w * place[0]]);
                    let speed = g[0].hypot(g[1]).max(MIN_SPEED);
                    let force = multiply(h, [n * g[0] / speed, n * g[1] / speed]);
                    sum[0] += force[0];
                    sum[1] += force[1];
                    sum[2] += place[0] * force[1] - place[1] * force[0];
                }
                sum
            }
            Surface::Ellipsoid(c) => self.closed_form(twist, *c, 2.0),
            Surface::Superellipsoid(c, p) => self.closed_form(twist, *c, p / (p - 1.0)),
        };
        f[0] -= self.load[0];
        f[1] -= self.load[1];
        f[2] -= self.centre[0] * self.load[1] - self.centre[1] * self.load[0];
        f
    }

    /// Friction force and moment of the superellipsoid with dual exponent `q`, for a twist `(vx, vy, w)`.
    fn closed_form(&self, [vx, vy, w]: [f64; 3], c: f64, q: f64) -> [f64; 3] {
        let [x, y] = self.centre;
        let g = multiply(&self.stretch, [vx - w * y, vy + w * x]);
        let (speed, turn) = (g[0].hypot(g[1]).max(MIN_SPEED), (c * w).abs().max(MIN_SPEED));
        let power = (speed.powf(q) + turn.powf(q)).powf(1.0 / q);
        let along = (speed / power).powf(q - 1.0);
        let force = multiply(&self.stretch, [along * g[0] / speed, along * g[1] / speed]);
        let moment = c * (turn / power).powf(q - 1.0) * w.signum();
        [force[0], force[1], moment + x * force[1] - y * force[0]]
    }

    /// Twist and force if the body's point `r` moves with velocity `u` without slip.
    ///
    /// Of all angular velocities it takes the one that dissipates least. `guess` is an angular velocity.
    fn sticking_motion(&self, r: [f64; 2], u: [f64; 2], guess: f64) -> ([f64; 3], [f64; 2]) {
        let twist = |w: f64| [u[0] + w * r[1], u[1] - w * r[0], w];
        let moment_residual = |w: f64| {
            let f = self.wrench(twist(w));
            (f[2] - (r[0] * f[1] - r[1] * f[0]), [f[0], f[1]])
        };
        let size = u[0].hypot(u[1]).max(1e-9) / r[0].hypot(r[1]).max(1e-3);
        let (mut a, mut b) = (guess - 0.05 * size, guess + 0.05 * size);
        let (mut fa, mut fb) = (moment_residual(a).0, moment_residual(b).0);
        let mut bracket_step = 0.1 * size;
        while fa * fb > 0.0 && bracket_step < 1e4 * size {
            // The residual rises with the angular velocity, so its sign tells where the root is.
            if fa > 0.0 {
                (b, fb) = (a, fa);
                a -= bracket_step;
                fa = moment_residual(a).0;
            } else {
                (a, fa) = (b, fb);
                b += bracket_step;
                fb = moment_residual(b).0;
            }
            bracket_step *= 2.0;
        }
        let mut w = a;
        let mut force = [0.0; 2];
        // Illinois variant of the regula falsi.
        let mut side = 0;
        for _ in 0..60 {
            w = (fa * b - fb * a) / (fa - fb);
            let f;
            (f, force) = moment_residual(w);
            if f.abs() < 1e-10 || (b - a).abs() < 1e-12 * size {
                break;
            }
            if f * fb > 0.0 {
                (b, fb) = (w, f);
                if side == 1 {
                    fa *= 0.5;
                }
                side = 1;
            } else {
                (a, fa) = (w, f);
                if side == 2 {
                    fb *= 0.5;
                }
                side = 2;
            }
        }
        (twist(w), force)
    }

    /// Twist of the body and force on it when a rod at `r` (inward normal `n`) moves with velocity `u`.
    ///
    /// `friction` returns the coefficient of contact friction at a slip speed. `None` if the rod moves away.
    pub fn pushed_motion(
        &self,
        r: [f64; 2],
        n: [f64; 2],
        u: [f64; 2],
        friction: &dyn Fn(f64) -> f64,
        guess: f64,
    ) -> Option<([f64; 3], [f64; 2])> {
        if u[0] * n[0] + u[1] * n[1] <= 0.0 {
            return None;
        }
        let t = [-n[1], n[0]];
        let parts = |f: [f64; 2]| (f[0] * n[0] + f[1] * n[1], f[0] * t[0] + f[1] * t[1]);
        let stuck = self.sticking_motion(r, u, guess);
        let (normal, tangent) = parts(stuck.1);
        if normal > 0.0 && tangent.abs() <= friction(0.0) * normal {
            return Some(stuck);
        }
        // The contact point slips along t until the force is on the edge of the friction cone.
        let sign = tangent.signum();
        let cone_residual = |slip: f64, guess: f64| {
            let sticking_motion =
                self.sticking_motion(r, [u[0] - sign * slip * t[0], u[1] - sign * slip * t[1]], guess);
            let (normal, tangent) = parts(sticking_motion.1);
            (sign * tangent - friction(slip) * normal.max(0.0), sticking_motion)
        };
        let size = u[0].hypot(u[1]);
        let (mut a, mut b) = (0.0, size);
        let (mut fa, mut last) = cone_residual(a, stuck.0[2]);
        let (mut fb, mut far) = cone_residual(b, last.0[2]);
        for _ in 0..8 {
            if fb <= 0.0 {
                break;
            }
            (a, fa) = (b, fb);
            b *= 2.0;
            (fb, far) = cone_residual(b, far.0[2]);
        }
        let mut side = 0;
        for _ in 0..60 {
            let s = (fa * b - fb * a) / (fa - fb);
            let (f, sticking_motion) = cone_residual(s, last.0[2]);
            last = sticking_motion;
            if f.abs() < 1e-9 || (b - a) < 1e-11 * size {
                break;
            }
            if f * fb > 0.0 {
                (b, fb) = (s, f);
                if side == 1 {
                    fa *= 0.5;
                }
                side = 1;
            } else {
                (a, fa) = (s, f);
                if side == 2 {
                    fb *= 0.5;
                }
                side = 2;
            }
        }
        Some(last)
    }
}
