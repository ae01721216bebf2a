//! The step of Runge and Kutta on the equation of the sensitivities, S' = J S + P, for systems of few states: a column stays in
//! vector registers from its first stage to its last.

use pulp::Simd;

/// Most states of a system whose Jacobian is kept whole, zeros included. More would not stay in the registers.
const DENSE: usize = 6;

/// How far each stage goes on, and its weight in sixths.
pub(super) const STAGES: [(f64, f64); 4] = [(0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)];

/// Where derivatives of the rates stand at each stage of a step: the Jacobian by states row by row where it is kept whole, then
/// every entry of the gradient, and last one that is always 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slots {
    pub(super) dense: usize,
    pub(super) count: usize,
}

impl Slots {
    pub(super) fn new(states: usize, entries: usize) -> Self {
        let dense = if states <= DENSE { states * states } else { 0 };
        Self { dense, count: dense + entries + 1 }
    }

    pub(super) fn zero(self) -> usize {
        self.count - 1
    }
}

/// Advances all columns by a step of lengths `h`. `own` has, column by column, the slot of each rate's derivative by the seed
/// itself; `gradients` holds the derivatives of the rates at the four stages, by slots. Every number is `L` lanes wide; `false` if
/// the instruction set has wider vectors than that, or the system too many states.
#[inline(always)]
pub(super) fn advance<S: Simd, const L: usize>(
    simd: S,
    own: &[Vec<usize>],
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
    let step = Step { simd, own, h, gradients };
    match states {
        1 => step.all::<1>(s),
        2 => step.all::<2>(s),
        3 => step.all::<3>(s),
        4 => step.all::<4>(s),
        5 => step.all::<5>(s),
        6 => step.all::<6>(s),
        _ => return false,
    }
    true
}

/// A step of all columns; numbers are vectors side by side.
struct Step<'s, S: Simd> {
    simd: S,
    own: &'s [Vec<usize>],
    h: &'s [S::f64s],
    gradients: &'s [S::f64s],
}

impl<S: Simd> Step<'_, S> {
    #[inline(always)]
    fn all<const N: usize>(&self, s: &mut [S::f64s]) {
        let width = self.h.len();
        for (column, own) in s.chunks_exact_mut(N * width).zip(self.own) {
            let Ok(own) = <&[usize; N]>::try_from(&own[..]) else { continue };
            for vector in 0..width {
                self.column(column, own, vector);
            }
        }
    }

    /// One vector of lanes of a column; `own` has the slot of each rate's derivative by the seed itself.
    #[inline(always)]
    fn column<const N: usize>(&self, s: &mut [S::f64s], own: &[usize; N], vector: usize) {
        let (simd, width) = (self.simd, self.h.len());
        let slots = self.gradients.len() / width / STAGES.len();
        let zero = simd.splat_f64s(0.0);
        let mut from = [zero; N];
        for (i, from) in from.iter_mut().enumerate() {
            *from = s[i * width + vector];
        }
        let (mut stage, mut total) = (from, [zero; N]);
        for (index, (on, weight)) in STAGES.into_iter().enumerate() {
            let at = |slot: usize| self.gradients[(index * slots + slot) * width + vector];
            let on = simd.mul_f64s(self.h[vector], simd.splat_f64s(on));
            let weight = simd.splat_f64s(weight);
            let mut next = from;
            for i in 0..N {
                let mut rate = at(own[i]);
                for (j, z) in stage.iter().enumerate() {
                    rate = simd.mul_add_f64s(at(i * N + j), *z, rate);
                }
                total[i] = simd.mul_add_f64s(rate, weight, total[i]);
                next[i] = simd.mul_add_f64s(on, rate, from[i]);
            }
            stage = next;
        }
        let sixth = simd.mul_f64s(self.h[vector], simd.splat_f64s(1.0 / 6.0));
        for i in 0..N {
            s[i * width + vector] = simd.mul_add_f64s(sixth, total[i], from[i]);
        }
    }
}
