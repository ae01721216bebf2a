//! A small matrix times many vectors: register tiles of 1, 2, 4, 8 or 16 outputs with weights broadcast from
//! memory, several time steps at once where the outputs are few.

use pulp::Simd;

/// Outputs of the next tile when `rest` are left: all of a tile's outputs exist, so that its extents are known to
/// the compiler, which then keeps the sums in registers from first to last.
#[inline(always)]
const fn width<const ROOMY: bool>(rest: usize) -> usize {
    match rest {
        16.. if ROOMY => 16,
        8.. => 8,
        4.. => 4,
        2.. => 2,
        _ => 1,
    }
}

/// Floats that [`Panels::pack`] needs for `outputs x inputs` weights.
pub(crate) const fn packed_len(outputs: usize, inputs: usize) -> usize {
    outputs * inputs
}

/// Packed weights `[tile][input][output in tile]`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Panels<'a> {
    packed: &'a [f32],
    outputs: usize,
    inputs: usize,
}

impl<'a> Panels<'a> {
    /// Packs `weight(output, input)`.
    #[inline(always)]
    pub fn pack<const ROOMY: bool>(
        packed: &'a mut [f32],
        outputs: usize,
        inputs: usize,
        weight: impl Fn(usize, usize) -> f32,
    ) -> Self {
        let (mut first, mut at) = (0, 0);
        while first < outputs {
            let w = width::<ROOMY>(outputs - first);
            for input in 0..inputs {
                for (j, slot) in packed[at..at + w].iter_mut().enumerate() {
                    *slot = weight(first + j, input);
                }
                at += w;
            }
            first += w;
        }
        Panels { packed, outputs, inputs }
    }

    /// For each step s: `out[s][o] = start[o] + sum_i w[o, i] x[s][i]`, where `x` and `out` hold a step
    /// every `x_stride` and `out_stride` vectors.
    #[inline(always)]
    pub fn apply<S: Simd, const ROOMY: bool>(
        self,
        simd: S,
        start: Start<'_>,
        (x, x_stride): (&[S::f32s], usize),
        (out, out_stride): (&mut [S::f32s], usize),
        steps: usize,
    ) {
        let (mut first, mut packed) = (0, self.packed);
        while first < self.outputs {
            let w = width::<ROOMY>(self.outputs - first);
            let (head, rest) = packed.split_at(w * self.inputs);
            let job = Job { packed: head, start, first, steps };
            match (w, ROOMY) {
                (16, _) => job.run::<S, 16, 1>(simd, (x, x_stride), (out, out_stride)),
                (8, true) => job.run::<S, 8, 2>(simd, (x, x_stride), (out, out_stride)),
                (8, false) => job.run::<S, 8, 1>(simd, (x, x_stride), (out, out_stride)),
                (4, true) => job.run::<S, 4, 4>(simd, (x, x_stride), (out, out_stride)),
                (4, false) => job.run::<S, 4, 2>(simd, (x, x_stride), (out, out_stride)),
                (2, _) => job.run::<S, 2, 4>(simd, (x, x_stride), (out, out_stride)),
                _ => job.run::<S, 1, 8>(simd, (x, x_stride), (out, out_stride)),
            }
            packed = rest;
            first += w;
        }
    }
}

/// The value that a product is added to.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Start<'a> {
    /// Nothing.
    Zero,
    /// One value an output.
    Bias(&'a [f32]),
    /// The present value of the output.
    Output,
}

/// One tile of outputs over all steps.
struct Job<'a> {
    packed: &'a [f32],
    start: Start<'a>,
    first: usize,
    steps: usize,
}

impl Job<'_> {
    #[inline(always)]
    fn run<S: Simd, const N: usize, const M: usize>(
        &self,
        simd: S,
        x: (&[S::f32s], usize),
        (out, out_stride): (&mut [S::f32s], usize),
    ) {
        let mut s = 0;
        while s + M <= self.steps {
            self.tile::<S, N, M>(simd, s, x, (out, out_stride));
            s += M;
        }
        while s < self.steps {
            self.tile::<S, N, 1>(simd, s, x, (out, out_stride));
            s += 1;
        }
    }

    /// `M` steps from step `s`.
    #[inline(always)]
    fn tile<S: Simd, const N: usize, const M: usize>(
        &self,
        simd: S,
        s: usize,
        (x, x_stride): (&[S::f32s], usize),
        (out, out_stride): (&mut [S::f32s], usize),
    ) {
        let weights = self.packed.as_chunks::<N>().0;
        let rows: [&[S::f32s]; M] = std::array::from_fn(|m| &x[(s + m) * x_stride..][..weights.len()]);
        let at = |m: usize| (s + m) * out_stride + self.first;
        let mut acc = [[simd.splat_f32s(0.0); N]; M];
        match self.start {
            Start::Zero => {}
            Start::Bias(bias) => {
                let bias = &bias[self.first..][..N];
                for acc in &mut acc {
                    for j in 0..N {
                        acc[j] = simd.splat_f32s(bias[j]);
                    }
                }
            }
            Start::Output => {
                for (m, acc) in acc.iter_mut().enumerate() {
                    let row = &out[at(m)..][..N];
                    acc.iter_mut().zip(row).for_each(|(a, v)| *a = *v);
                }
            }
        }
        for (i, w) in weights.iter().enumerate() {
            for m in 0..M {
                let v = rows[m][i];
                for j in 0..N {
                    acc[m][j] = simd.mul_add_e_f32s(simd.splat_f32s(w[j]), v, acc[m][j]);
                }
            }
        }
        for m in 0..M {
            let row = &mut out[at(m)..][..N];
            row.iter_mut().zip(acc[m]).for_each(|(v, a)| *v = a);
        }
    }
}
