//! Paths of the rod: constant velocity, recorded positions, and straight pushes with acceleration.

use super::planar::{Vector, add, constant, scale};
use crate::Scalar;

/// A smooth piece of the rod's motion; the rod does not spin.
pub trait Motion<S: Scalar>: Copy {
    /// Position of the rod's centre at `time`, m.
    fn position(&self, time: S) -> Vector<S>;
    /// Velocity of the rod at `time`, m/s.
    fn velocity(&self, time: S) -> Vector<S>;
}

/// The motion of the rod, as a sequence of smooth pieces.
pub trait Path<S: Scalar>: Sync {
    /// Type of the smooth pieces of the path.
    type MotionPiece: Motion<S>;
    /// Piece of the path that contains `time`, s, or begins there.
    fn piece(&self, time: f64) -> Self::MotionPiece;
    /// Time at which the piece that contains `time` ends, s; infinity for the last piece.
    fn end_of_piece(&self, time: f64) -> f64;
}

/// Motion of the rod at constant velocity.
#[derive(Clone, Copy, Debug)]
pub struct Straight<S> {
    /// Position of the rod at time `since`, m.
    pub start: Vector<S>,
    /// Constant velocity of the rod, m/s.
    pub velocity: Vector<S>,
    /// Time at which the rod is at `start`, s.
    pub since: f64,
}

impl<S: Scalar> Motion<S> for Straight<S> {
    #[inline]
    fn position(&self, time: S) -> Vector<S> {
        add(self.start, scale(self.velocity, time + -self.since))
    }
    #[inline]
    fn velocity(&self, _time: S) -> Vector<S> {
        self.velocity
    }
}

impl<S: Scalar> Path<S> for Straight<S> {
    type MotionPiece = Self;
    fn piece(&self, _time: f64) -> Self {
        *self
    }
    fn end_of_piece(&self, _time: f64) -> f64 {
        f64::INFINITY
    }
}

/// Path through recorded positions, linear in time between them; at rest before the first and after the last.
///
/// The velocity of a piece is its chord divided by its duration, so noisy positions are not differentiated on
/// a finer grid than the recorded one.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'a> {
    times: &'a [f64],
    x: &'a [f64],
    y: &'a [f64],
}

impl<'a> Recorded<'a> {
    /// A path through `(x, y)`, m, at strictly increasing `times`, s.
    ///
    /// Returns `None` for unequal lengths, no positions, times that do not increase, or numbers that are not
    /// finite.
    pub fn new(times: &'a [f64], x: &'a [f64], y: &'a [f64]) -> Option<Self> {
        let ordered = times.windows(2).all(|w| w[0] < w[1]);
        let finite = times.iter().chain(x).chain(y).all(|v| v.is_finite());
        let lengths = !times.is_empty() && times.len() == x.len() && times.len() == y.len();
        (ordered && finite && lengths).then_some(Self { times, x, y })
    }

    /// Index of the first recorded time later than `time`.
    fn index_after(&self, time: f64) -> usize {
        self.times.partition_point(|&t| t <= time)
    }
}

/// Indices of a subset of recorded positions that approximates the path within `tolerance_m`.
///
/// At every recorded time, the path that is linear in time between the subset is within `tolerance_m` of the
/// recorded position, in x and in y. The subset is chosen greedily in one pass.
pub fn simplify_path(times: &[f64], x: &[f64], y: &[f64], tolerance_m: f64) -> Vec<usize> {
    let n = times.len();
    let mut kept_indices: Vec<usize> = (0..n.min(1)).collect();
    let mut from = 0;
    // Velocities with which a line from the last index kept passes all positions since within the tolerance.
    let unbounded = [[f64::NEG_INFINITY, f64::INFINITY]; 2];
    let mut allowed = unbounded;
    for k in 1..n {
        let corridor = |from: usize, z: &[f64]| {
            let (dt, dz) = (times[k] - times[from], z[k] - z[from]);
            [(dz - tolerance_m) / dt, dz / dt, (dz + tolerance_m) / dt]
        };
        let extends = [x, y].iter().zip(allowed).all(|(z, [low, high])| {
            let middle = corridor(from, z)[1];
            low <= middle && middle <= high
        });
        if !extends {
            from = k - 1;
            kept_indices.push(from);
            allowed = unbounded;
        }
        for (z, a) in [x, y].iter().zip(&mut allowed) {
            let [low, _, high] = corridor(from, z);
            *a = [a[0].max(low), a[1].min(high)];
        }
    }
    if n > 1 {
        kept_indices.push(n - 1);
    }
    kept_indices
}

impl<S: Scalar> Path<S> for Recorded<'_> {
    type MotionPiece = Straight<S>;

    fn piece(&self, time: f64) -> Straight<S> {
        let next = self.index_after(time);
        let position = |i: usize| [self.x[i], self.y[i]];
        if next == 0 || next == self.times.len() {
            let end_index = next.saturating_sub(1);
            return Straight { start: constant(position(end_index)), velocity: [S::zero(); 2], since: time };
        }
        let (a, b) = (position(next - 1), position(next));
        let k = 1.0 / (self.times[next] - self.times[next - 1]);
        let velocity = constant([(b[0] - a[0]) * k, (b[1] - a[1]) * k]);
        Straight { start: constant(a), velocity, since: self.times[next - 1] }
    }

    fn end_of_piece(&self, time: f64) -> f64 {
        self.times.get(self.index_after(time)).copied().unwrap_or(f64::INFINITY)
    }
}

/// A straight push of given travel at constant speed, or accelerated from rest to that speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StraightPush {
    /// Position of the rod's centre at time 0, m.
    pub start_m: Vector<f64>,
    /// Unit vector of the direction of motion.
    pub direction: Vector<f64>,
    /// Speed of the rod, m/s: constant, or the highest speed if accelerated.
    pub speed_m_s: f64,
    /// Acceleration of the rod, m/s²; 0 for full speed from the start.
    pub acceleration_m_s2: f64,
    /// Distance that the rod travels, m; it then rests.
    pub travel_m: f64,
}

impl StraightPush {
    /// Duration of the acceleration phase, s.
    fn ramp_s(&self) -> f64 {
        if self.acceleration_m_s2 > 0.0 {
            (self.speed_m_s / self.acceleration_m_s2)
                .min((2.0 * self.travel_m / self.acceleration_m_s2).sqrt())
        } else {
            0.0
        }
    }

    /// Time at which the rod has covered its travel, s.
    pub fn duration_s(&self) -> f64 {
        let ramp = self.ramp_s();
        let covered = 0.5 * self.acceleration_m_s2 * ramp * ramp;
        if covered >= self.travel_m * (1.0 - 1e-12) {
            ramp
        } else {
            ramp + (self.travel_m - covered) / self.speed_m_s
        }
    }

    /// Distance covered, m, and speed, m/s, of the rod at `time` in a piece of the push.
    ///
    /// `piece` is 0 during acceleration, 1 at constant speed and 2 at rest.
    fn progress<S: Scalar>(&self, piece: u8, time: S) -> (S, S) {
        let a = self.acceleration_m_s2;
        let ramp = self.ramp_s();
        match piece {
            0 => (time * time * (0.5 * a), time * a),
            1 => ((time + -ramp) * self.speed_m_s + 0.5 * a * ramp * ramp, S::constant(self.speed_m_s)),
            _ => (S::constant(self.travel_m), S::zero()),
        }
    }
}

/// One smooth piece of a [`StraightPush`]: acceleration, constant speed or rest.
#[derive(Clone, Copy, Debug)]
pub struct StraightPiece {
    push: StraightPush,
    piece: u8,
}

impl<S: Scalar> Motion<S> for StraightPiece {
    fn position(&self, time: S) -> Vector<S> {
        let along = self.push.progress(self.piece, time).0;
        add(constant(self.push.start_m), scale(constant(self.push.direction), along))
    }
    fn velocity(&self, time: S) -> Vector<S> {
        scale(constant(self.push.direction), self.push.progress(self.piece, time).1)
    }
}

impl<S: Scalar> Path<S> for StraightPush {
    type MotionPiece = StraightPiece;

    fn piece(&self, time: f64) -> StraightPiece {
        let piece = match time {
            t if t >= self.duration_s() => 2,
            t if t >= self.ramp_s() => 1,
            _ => 0,
        };
        StraightPiece { push: *self, piece }
    }

    fn end_of_piece(&self, time: f64) -> f64 {
        match <Self as Path<S>>::piece(self, time).piece {
            0 => self.ramp_s(),
            1 => self.duration_s(),
            _ => f64::INFINITY,
        }
    }
}
