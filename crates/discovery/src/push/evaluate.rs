//! Residuals of a window and their sensitivities to the free parameters and the start, by dual numbers.

use super::hypothesis::Hypothesis;
use super::measured::{Record, Window};
use crate::linear::{Square, eliminate};
use augsim_physics::push::{Pose, Push, Steps, simulate_poses};
use augsim_physics::{Dual, Scalar};

/// Rod travel in a sub-step of a fit, m: within 10 µm of the finest over a push of 15 cm.
const STEPS: Steps = Steps { travel_m: 2e-3, duration_s: f64::INFINITY, inertial_s: 2e-3 };

/// A window at one point of the parameters: `q = |r|²`, with `r` in units of the noise, its slopes and its curvature
/// (Gauss-Newton) in the globals, and then the start.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    /// Sum of squared residuals.
    pub q: f64,
    /// Number of residuals.
    pub m: usize,
    /// Curvature `J'J` of globals and start.
    pub h: Square,
    /// `J'r`.
    pub g: Vec<f64>,
}

impl Piece {
    /// With the start eliminated: curvature and gradient of the globals alone.
    pub fn reduced(&self, globals: usize) -> (Square, Vec<f64>) {
        let (s, u, _) = eliminate(&self.h, &self.g, globals);
        (s, u)
    }

    /// By how much `q` falls, in the quadratic approximation, when the start alone moves.
    pub fn start_gain(&self, globals: usize) -> f64 {
        let tail = [globals, globals + 1, globals + 2];
        let mut x: Vec<f64> = tail.iter().map(|&i| self.g[i]).collect();
        self.h.sub(&tail).cholesky().forward(&mut x);
        x.iter().map(|v| v * v).sum()
    }

    /// The step of the start that goes with a step of the globals.
    pub fn start_step(&self, step: &[f64]) -> [f64; 3] {
        let p = step.len();
        let tail = [p, p + 1, p + 2];
        let mut rest: Vec<f64> = tail
            .iter()
            .map(|&i| self.g[i] - (0..p).map(|j| self.h.at(i, j) * step[j]).sum::<f64>())
            .collect();
        self.h.sub(&tail).cholesky().solve(&mut rest);
        [rest[0], rest[1], rest[2]]
    }
}

/// A simulated window: poses at its samples. One that cannot be simulated stays at its start.
fn poses<S: Scalar>(
    h: &Hypothesis,
    parameters: &[S],
    start: Pose<S>,
    r: &Record,
    w: &Window,
) -> Vec<Pose<S>> {
    let times = &r.time[w.first..=w.last];
    let mut poses = Vec::new();
    if let Some(path) = r.path() {
        let push = Push { world: &h.world, parameters, start, path: &path, field: None, steps: STEPS };
        let done = simulate_poses(&push, times, w.first > 0, &mut poses);
        if done.is_ok() && poses.len() == times.len() {
            return poses;
        }
    }
    vec![start; times.len()]
}

/// Poses of a window at the values `theta`, in plain numbers.
pub(crate) fn plain(h: &Hypothesis, theta: &[f64], start: [f64; 3], r: &Record, w: &Window) -> Vec<[f64; 3]> {
    let values = h.filled(theta, r.group);
    poses(h, &values, Pose::new(start[0], start[1], start[2]), r, w)
        .into_iter()
        .map(|p| [p.position[0], p.position[1], p.angle])
        .collect()
}

/// The piece of a window. `sd` is the noise of the pose.
pub(crate) fn piece(
    h: &Hypothesis,
    theta: &[f64],
    start: [f64; 3],
    r: &Record,
    w: &Window,
    sd: [f64; 3],
) -> Piece {
    match h.lane_count() + 3 {
        0..=6 => piece_of::<6>(h, theta, start, r, w, sd),
        7..=9 => piece_of::<9>(h, theta, start, r, w, sd),
        10..=14 => piece_of::<14>(h, theta, start, r, w, sd),
        _ => piece_in_blocks::<14>(h, theta, start, r, w, sd),
    }
}

/// Poses of a window with the derivatives `first` to `first + N` of the free parameters and the start. A simulation's course
/// does not depend on which derivatives it carries.
fn simulated<const N: usize>(
    h: &Hypothesis,
    theta: &[f64],
    start: [f64; 3],
    r: &Record,
    w: &Window,
    first: usize,
) -> Vec<[Dual<N>; 3]> {
    let p = h.lane_count();
    let filled = h.filled(theta, r.group);
    // Lanes before the block wrap around to numbers that no dual has: they stay constant, as those after it do.
    let variable = |value: f64, lane: usize| Dual::<N>::variable(value, lane.wrapping_sub(first));
    let mut parameters: Vec<Dual<N>> = filled.iter().map(|&v| Dual::constant(v)).collect();
    for (f, lane) in h.free.iter().zip(&h.lanes(r.group)) {
        if let (None, Some(lane)) = (f.group, lane) {
            parameters[f.index] = variable(filled[f.index], *lane);
        }
    }
    let at = |c: usize| variable(start[c], p + c);
    let run = poses(h, &parameters, Pose::new(at(0), at(1), at(2)), r, w);
    run.into_iter().map(|pose| [pose.position[0], pose.position[1], pose.angle]).collect()
}

fn piece_of<const N: usize>(
    h: &Hypothesis,
    theta: &[f64],
    start: [f64; 3],
    r: &Record,
    w: &Window,
    sd: [f64; 3],
) -> Piece {
    let run = simulated::<N>(h, theta, start, r, w, 0);
    let n = h.lane_count() + 3;
    let (mut q, mut curvature, mut g) = (0.0, Square::zero(n), vec![0.0; n]);
    for (predicted, y) in run.iter().zip(&r.pose[w.first..=w.last]) {
        for c in 0..3 {
            let k = 1.0 / sd[c];
            let residual = (y[c] - predicted[c].value) * k;
            q += residual * residual;
            let d: [f64; N] = predicted[c].d.map(|d| d * k);
            for i in 0..n {
                g[i] += d[i] * residual;
                for j in 0..=i {
                    *curvature.at_mut(i, j) += d[i] * d[j];
                }
            }
        }
    }
    finish(h, theta, r, Piece { q, m: 3 * run.len(), h: curvature, g })
}

/// More derivatives than the widest dual number has lanes: one simulation for every `N` of them.
fn piece_in_blocks<const N: usize>(
    h: &Hypothesis,
    theta: &[f64],
    start: [f64; 3],
    r: &Record,
    w: &Window,
    sd: [f64; 3],
) -> Piece {
    let n = h.lane_count() + 3;
    let runs: Vec<_> = (0..n).step_by(N).map(|first| simulated::<N>(h, theta, start, r, w, first)).collect();
    let (mut q, mut curvature, mut g) = (0.0, Square::zero(n), vec![0.0; n]);
    let measured = &r.pose[w.first..=w.last];
    for (k, y) in measured.iter().enumerate() {
        for c in 0..3 {
            let scale = 1.0 / sd[c];
            let residual = (y[c] - runs[0][k][c].value) * scale;
            q += residual * residual;
            let d: Vec<f64> = runs.iter().flat_map(|run| run[k][c].d).take(n).map(|d| d * scale).collect();
            for i in 0..n {
                g[i] += d[i] * residual;
                for j in 0..=i {
                    *curvature.at_mut(i, j) += d[i] * d[j];
                }
            }
        }
    }
    finish(h, theta, r, Piece { q, m: 3 * measured.len(), h: curvature, g })
}

/// A piece by lanes, of which the lower half of the curvature is there, as one by free parameters.
fn finish(h: &Hypothesis, theta: &[f64], r: &Record, mut piece: Piece) -> Piece {
    let (p, n) = (h.lane_count(), h.lane_count() + 3);
    for i in 0..n {
        for j in 0..i {
            *piece.h.at_mut(j, i) = piece.h.at(i, j);
        }
    }
    if !(piece.q.is_finite() && piece.g.iter().all(|v| v.is_finite())) {
        let n = theta.len() + 3;
        return Piece { q: f64::MAX.sqrt(), h: Square::zero(n), g: vec![0.0; n], ..piece };
    }
    if theta.len() == p { piece } else { spread(&piece, &h.lanes(r.group), p) }
}

/// A piece by lanes as one by all free parameters: those without a lane change nothing.
fn spread(piece: &Piece, lanes: &[Option<usize>], p: usize) -> Piece {
    let of: Vec<Option<usize>> = lanes.iter().copied().chain((p..p + 3).map(Some)).collect();
    let n = of.len();
    let (mut h, mut g) = (Square::zero(n), vec![0.0; n]);
    for (i, a) in of.iter().enumerate() {
        let Some(a) = *a else { continue };
        g[i] = piece.g[a];
        for (j, b) in of.iter().enumerate() {
            if let Some(b) = *b {
                *h.at_mut(i, j) = piece.h.at(a, b);
            }
        }
    }
    Piece { h, g, ..piece.clone() }
}

#[cfg(test)]
mod tests {
    //! Contract: derivatives computed in blocks are those of one wide simulation. The scene is a square that a rod pushes off
    //! its centre, with the friction of the table and the contact free: five lanes with the start, in blocks of two.
    use super::*;
    use augsim_physics::model::PushModel;
    use augsim_physics::push::Object;

    #[test]
    fn blocks_of_derivatives_equal_one_wide_simulation() {
        let model = PushModel::textbook(Object::named("rect1").expect("an object"));
        let h = Hypothesis::new(&model, &[String::new()], &[]);
        let time: Vec<f64> = (0..40).map(|k| 0.05 * f64::from(k)).collect();
        // 40 mm of travel at 20 mm/s towards the centroid's left, 12 mm beside it; poses that stay behind.
        let x: Vec<f64> = time.iter().map(|t| -0.0525 + 0.02 * t).collect();
        let y = vec![0.012; 40];
        let pose = time.iter().map(|t| [0.018 * t, 0.0, -0.1 * t]).collect();
        let r = Record {
            id: "a push".into(),
            rod_time: time.clone(),
            rod_x: x.clone(),
            rod_y: y.clone(),
            corners: [time.clone(), x, y],
            time,
            pose,
            group: 0,
        };
        let w = Window { record: 0, first: 0, last: 39 };
        let (theta, sd) = (h.start(), [3e-4, 3e-4, 2e-3]);
        let wide = piece_of::<6>(&h, &theta, r.pose[0], &r, &w, sd);
        let blocks = piece_in_blocks::<2>(&h, &theta, r.pose[0], &r, &w, sd);
        assert!(wide.g.iter().any(|g| g.abs() > 1.0), "{:?}", wide.g);
        assert!((wide.q - blocks.q).abs() <= 1e-12 * wide.q, "{} {}", wide.q, blocks.q);
        let scale = wide.h.a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(wide.h.a.iter().zip(&blocks.h.a).all(|(a, b)| (a - b).abs() < 1e-12 * scale));
        assert!(wide.g.iter().zip(&blocks.g).all(|(a, b)| (a - b).abs() < 1e-12 * scale));
    }
}
