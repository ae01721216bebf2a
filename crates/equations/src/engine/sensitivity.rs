//! The Runge-Kutta step on the sensitivity equation `S' = J S + P`, for systems with few states.
//!
//! With at most [`MAX_DENSE_STATES`] states the Jacobian is stored with its zeros, and a column stays in
//! vector registers from its first stage to its last. Other systems use the sparse form in `block.rs`.

use pulp::Simd;

/// Maximum number of states with a dense Jacobian; a longer column would not fit into registers.
const MAX_DENSE_STATES: usize = 6;

/// For each Runge-Kutta stage: position of the next stage as a share of the step, and its own weight in sixths.
pub(super) const STAGES: [(f64, f64); 4] = [(0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)];

/// Layout of the memory slots for derivatives of the rates at each stage of a step.
///
/// First the Jacobian row by row if it is dense, then every entry of the gradient, and last one slot that is
/// always 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slots {
    /// Number of slots of the dense Jacobian; 0 if the Jacobian is not dense.
    pub(super) dense: usize,
    /// Number of all slots for the derivatives of one stage.
    pub(super) count: usize,
}

impl Slots {
    pub(super) fn new(states: usize, entries: usize) -> Self {
        let dense = if states <= MAX_DENSE_STATES { states * states } else { 0 };
        Self { dense, count: dense + entries + 1 }
    }

    /// Index of the slot that is always 0.
    pub(super) fn zero(self) -> usize {
        self.count - 1
    }
}

/// Advances all sensitivity columns by a step with lengths `h`; every number is `L` lanes wide.
///
/// `direct` has, per column, the slot of each rate's derivative with respect to the seed itself; `gradients`
/// holds the derivatives of the rates at the four stages, by slots. Returns false, with nothing changed, if
/// the vectors of the instruction set are wider than `L` lanes or the system has too many states.
#[inline(always)]
pub(super) fn advance_dense_sensitivities<S: Simd, const L: usize>(
    simd: S,
    direct: &[Vec<usize>],
    h: &[f64; L],
    gradients: &[[f64; L]],
    s: &mut [[f64; L]],
    states: usize,
) -> bool {
    if !L.is_multiple_of(S::F64_LANES) {
        return false;
    }
    let (h, _) = S::as_simd_f64s(h);
    let (gradients, _) = S::as_simd_f64s(gradients.as_flattened());
    let (s, _) = S::as_mut_simd_f64s(s.as_flattened_mut());
    let step = Step { simd, direct, h, gradients };
    match states {
        1 => step.all_columns::<1>(s),
        2 => step.all_columns::<2>(s),
        3 => step.all_columns::<3>(s),
        4 => step.all_columns::<4>(s),
        5 => step.all_columns::<5>(s),
        6 => step.all_columns::<6>(s),
        _ => return false,
    }
    true
}

/// A Runge-Kutta step of all sensitivity columns, in vectors of the instruction set.
struct Step<'s, S: Simd> {
    simd: S,
    direct: &'s [Vec<usize>],
    h: &'s [S::f64s],
    gradients: &'s [S::f64s],
}

impl<S: Simd> Step<'_, S> {
    /// Advances all sensitivity columns of a system with `N` states.
    #[inline(always)]
    fn all_columns<const N: usize>(&self, s: &mut [S::f64s]) {
        let width = self.h.len();
        for (column, direct) in s.chunks_exact_mut(N * width).zip(self.direct) {
            let Ok(direct) = <&[usize; N]>::try_from(&direct[..]) else { continue };
            for vector in 0..width {
                self.column(column, direct, vector);
            }
        }
    }

    /// Advances one vector of lanes of a sensitivity column.
    ///
    /// `direct` has the slot of each rate's derivative with respect to the seed.
    #[inline(always)]
    fn column<const N: usize>(&self, s: &mut [S::f64s], direct: &[usize; N], vector: usize) {
        let (simd, width) = (self.simd, self.h.len());
        let slots = self.gradients.len() / width / STAGES.len();
        let zero = simd.splat_f64s(0.0);
        let mut from = [zero; N];
        for (i, from) in from.iter_mut().enumerate() {
            *from = s[i * width + vector];
        }
        let (mut stage, mut total) = (from, [zero; N]);
        for (index, (next_at, weight)) in STAGES.into_iter().enumerate() {
            let gradient = |slot: usize| self.gradients[(index * slots + slot) * width + vector];
            let next_at = simd.mul_f64s(self.h[vector], simd.splat_f64s(next_at));
            let weight = simd.splat_f64s(weight);
            let mut next = from;
            for i in 0..N {
                let mut rate = gradient(direct[i]);
                for (j, z) in stage.iter().enumerate() {
                    rate = simd.mul_add_f64s(gradient(i * N + j), *z, rate);
                }
                total[i] = simd.mul_add_f64s(rate, weight, total[i]);
                next[i] = simd.mul_add_f64s(next_at, rate, from[i]);
            }
            stage = next;
        }
        let sixth = simd.mul_f64s(self.h[vector], simd.splat_f64s(1.0 / 6.0));
        for i in 0..N {
            s[i * width + vector] = simd.mul_add_f64s(sixth, total[i], from[i]);
        }
    }
}
