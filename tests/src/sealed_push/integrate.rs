//! Simulates a square that a rod pushes along a straight line, by midpoint steps of the rod's travel.

use super::dissipation::{Body, Surface};
use super::make::{PushKind, PushTruth};

/// Half the side of the pushed square, m.
pub(super) const HALF_M: f64 = 0.045;
/// Radius of the pushing rod, m.
pub(super) const ROD_M: f64 = 0.00475;
/// Friction force of the sliding square, N: coefficient 0.15, mass 0.8374 kg.
const SLIDING_N: f64 = 0.15 * 0.8374 * 9.81;
/// Coefficient of friction between the square and its support.
const SUPPORT: f64 = 0.15;
/// Travel of the rod in one integration step, m.
const STEP_M: f64 = 5e-4;

/// True physics of one push: effect, friction model and centre of pressure.
pub(super) struct World<'a> {
    pub truth: &'a PushTruth,
    pub surface: Surface,
    /// The matrix `A^(1/2)` of anisotropic friction, in the frame to which the anisotropy is fixed.
    pub stretch: [[f64; 2]; 2],
    /// Centre of pressure of the square in the body frame, m.
    pub centre: [f64; 2],
}

/// Pose of the square: position x and y, m, and angle, rad.
type Pose = [f64; 3];

/// For a rod at `p` in the body frame: closest point of the square, outward normal there, and gap (m).
fn closest(p: [f64; 2]) -> ([f64; 2], [f64; 2], f64) {
    let c = p.map(|x| x.clamp(-HALF_M, HALF_M));
    let d = [p[0] - c[0], p[1] - c[1]];
    let distance = d[0].hypot(d[1]);
    if distance > 1e-9 {
        return (c, [d[0] / distance, d[1] / distance], distance - ROD_M);
    }
    // The centre is inside the square: use the nearest face.
    let i = if p[0].abs() > p[1].abs() { 0 } else { 1 };
    let (mut point, mut n) = (p, [0.0; 2]);
    point[i] = HALF_M * p[i].signum();
    n[i] = p[i].signum();
    (point, n, p[i].abs() - HALF_M - ROD_M)
}

impl World<'_> {
    /// Parameter of the true effect if `pick` accepts it, else 0.
    fn number(&self, pick: impl Fn(&PushKind) -> Option<f64>) -> f64 {
        self.truth.effect.as_ref().and_then(pick).unwrap_or(0.0)
    }

    /// Position of the rod in the body frame of a square at `pose`, m.
    fn in_body(pose: Pose, rod: [f64; 2]) -> [f64; 2] {
        let (s, c) = pose[2].sin_cos();
        let (dx, dy) = (rod[0] - pose[0], rod[1] - pose[1]);
        [c * dx + s * dy, c * dy - s * dx]
    }

    /// Twist of the square and force on it (N), in the world frame, for a rod at `rod` with velocity `u`.
    fn respond(&self, pose: Pose, rod: [f64; 2], u: [f64; 2]) -> Option<([f64; 3], [f64; 2])> {
        let (s, c) = pose[2].sin_cos();
        let to_body = |v: [f64; 2]| [c * v[0] + s * v[1], c * v[1] - s * v[0]];
        let to_world = |v: [f64; 2]| [c * v[0] - s * v[1], s * v[0] + c * v[1]];
        let (r, out, _) = closest(Self::in_body(pose, rod));
        let mut body = Body {
            surface: &self.surface,
            centre: self.centre,
            stretch: [[1.0, 0.0], [0.0, 1.0]],
            gradient: [0.0; 2],
            load: [0.0; 2],
        };
        let mut rise = 0.0;
        let mut height = 0.0;
        match self.truth.effect {
            Some(PushKind::ObjectAnisotropy(..)) => body.stretch = self.stretch,
            Some(PushKind::TableAnisotropy(..)) => {
                // The map of the table in the body frame: R' H R.
                let h = self.stretch;
                let column = |e: [f64; 2]| {
                    let w = to_world(e);
                    to_body([h[0][0] * w[0] + h[0][1] * w[1], h[1][0] * w[0] + h[1][1] * w[1]])
                };
                let (x, y) = (column([1.0, 0.0]), column([0.0, 1.0]));
                body.stretch = [[x[0], y[0]], [x[1], y[1]]];
            }
            Some(PushKind::FrictionGradient(x, y)) => {
                let g = to_body([x, y]);
                match self.surface {
                    Surface::Patches(_) => body.gradient = g,
                    // A load that grows with the gradient g has its centre at <rho rho'> g.
                    _ => body.centre = g.map(|g| g * HALF_M * HALF_M / 3.0),
                }
            }
            Some(PushKind::TableTilt(angle, direction)) => {
                let f = angle.tan() / SUPPORT;
                body.load = to_body([f * direction.cos(), f * direction.sin()]);
            }
            Some(PushKind::ContactSlip(k)) => rise = k,
            Some(PushKind::PushHeight(z)) => height = z,
            _ => {}
        }
        let friction = |slip: f64| self.truth.contact_friction * (1.0 + rise * slip);
        let n = out.map(|x| -x);
        let mut response = body.pushed_motion(r, n, to_body(u), &friction, 0.0)?;
        if height > 0.0 {
            for _ in 0..4 {
                body.centre = response.1.map(|f| f * height * SUPPORT);
                response = body.pushed_motion(r, n, to_body(u), &friction, response.0[2])?;
            }
        }
        let v = to_world([response.0[0], response.0[1]]);
        Some(([v[0], v[1], response.0[2]], to_world(response.1).map(|f| f * SLIDING_N)))
    }

    /// Simulates the poses of the square at `times` (s).
    ///
    /// The rod starts at `from` at time 0 with velocity `u` and stops after `duration`, s.
    pub fn poses(&self, start: Pose, from: [f64; 2], u: [f64; 2], duration: f64, times: &[f64]) -> Vec<Pose> {
        let bias = match self.truth.effect {
            Some(PushKind::TipOffset(x, y)) => [x, y],
            _ => [0.0; 2],
        };
        let compliance = self.number(|k| if let PushKind::RodCompliance(c) = k { Some(*c) } else { None });
        let to_true_frame = |v: [f64; 2]| match self.truth.effect {
            Some(PushKind::FrameRegistration(scale, angle)) => {
                let (s, c) = angle.sin_cos();
                [c * v[0] - s * v[1], s * v[0] + c * v[1]].map(|x| (1.0 + scale) * x)
            }
            _ => v,
        };
        let (from, u) = (to_true_frame(from), to_true_frame(u));
        let rod_at = |t: f64| {
            let t = t.clamp(0.0, duration);
            [from[0] + bias[0] + u[0] * t, from[1] + bias[1] + u[1] * t]
        };
        let speed = u[0].hypot(u[1]);
        let mut force = [0.0; 2];
        let (mut pose, mut now) = (start, 0.0);
        let mut poses = Vec::new();
        for &until in times {
            while now < until.min(duration) - 1e-12 {
                let h = (STEP_M / speed).min(until.min(duration) - now);
                let deflected = |p: [f64; 2]| [p[0] - compliance * force[0], p[1] - compliance * force[1]];
                let (a, b) = (deflected(rod_at(now)), deflected(rod_at(now + h)));
                let gap_a = closest(Self::in_body(pose, a)).2;
                let gap_b = closest(Self::in_body(pose, b)).2;
                if gap_a > 1e-6 && gap_b > 0.0 {
                    now += h;
                    force = [0.0; 2];
                    continue;
                }
                // Integrate from the instant of touch-down.
                let touch_fraction =
                    if gap_a > 1e-6 { (gap_a / (gap_a - gap_b)).clamp(0.0, 1.0) } else { 0.0 };
                let remaining = (1.0 - touch_fraction) * h;
                let rod_in_step = |s: f64| [0, 1].map(|i| a[i] + (b[i] - a[i]) * s);
                if let Some((k1, _)) = self.respond(pose, rod_in_step(touch_fraction), u) {
                    let middle = [0, 1, 2].map(|i| pose[i] + 0.5 * remaining * k1[i]);
                    let (k2, f) = self
                        .respond(middle, rod_in_step(0.5 * (touch_fraction + 1.0)), u)
                        .unwrap_or((k1, [0.0; 2]));
                    pose = [0, 1, 2].map(|i| pose[i] + remaining * k2[i]);
                    force = f;
                    let (_, out, gap) = closest(Self::in_body(pose, b));
                    if gap < 1e-5 {
                        let (s, c) = pose[2].sin_cos();
                        pose[0] += gap * (c * out[0] - s * out[1]);
                        pose[1] += gap * (s * out[0] + c * out[1]);
                    }
                } else {
                    force = [0.0; 2];
                }
                now += h;
            }
            poses.push(pose);
        }
        poses
    }
}
