//! Product of a small matrix with many vectors, in register tiles of 1, 2, 4, 8 or 16 outputs.
//!
//! Weights are broadcast from memory. Tiles with few outputs process several time steps at once.

use pulp::Simd;

/// Number of outputs of the next register tile when `remaining` outputs are left.
///
/// A tile is never larger than the outputs that are left, so its extents are constants for the compiler,
/// which keeps all sums in registers.
#[inline(always)]
const fn width<const MANY_REGISTERS: bool>(remaining: usize) -> usize {
    match remaining {
        16.. if MANY_REGISTERS => 16,
        8.. => 8,
        4.. => 4,
        2.. => 2,
        _ => 1,
    }
}

/// Number of floats that [`Panels::pack`] needs for `outputs x inputs` weights.
pub(crate) const fn packed_len(outputs: usize, inputs: usize) -> usize {
    outputs * inputs
}

/// Weights of a matrix product, packed as `[tile][input][output in tile]`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Panels<'a> {
    packed: &'a [f32],
    outputs: usize,
    inputs: usize,
}

impl<'a> Panels<'a> {
    /// Packs the weights that `weight(output, input)` returns.
    #[inline(always)]
    pub fn pack<const MANY_REGISTERS: bool>(
        packed: &'a mut [f32],
        outputs: usize,
        inputs: usize,
        weight: impl Fn(usize, usize) -> f32,
    ) -> Self {
        let (mut first, mut position) = (0, 0);
        while first < outputs {
            let w = width::<MANY_REGISTERS>(outputs - first);
            for input in 0..inputs {
                for (j, slot) in packed[position..position + w].iter_mut().enumerate() {
                    *slot = weight(first + j, input);
                }
                position += w;
            }
            first += w;
        }
        Panels { packed, outputs, inputs }
    }

    /// Multiplies by the weights: `out[s][o] = initial[o] + sum_i w[o, i] x[s][i]` for each time step s.
    ///
    /// Successive steps are `x_stride` vectors apart in `x` and `out_stride` vectors apart in `out`.
    #[inline(always)]
    pub fn apply<S: Simd, const MANY_REGISTERS: bool>(
        self,
        simd: S,
        initial: InitialSum<'_>,
        (x, x_stride): (&[S::f32s], usize),
        (out, out_stride): (&mut [S::f32s], usize),
        steps: usize,
    ) {
        let (mut first, mut packed) = (0, self.packed);
        while first < self.outputs {
            let w = width::<MANY_REGISTERS>(self.outputs - first);
            let (head, remainder) = packed.split_at(w * self.inputs);
            let tile = OutputTile { packed: head, initial, first, steps };
            match (w, MANY_REGISTERS) {
                (16, _) => tile.run::<S, 16, 1>(simd, (x, x_stride), (out, out_stride)),
                (8, true) => tile.run::<S, 8, 2>(simd, (x, x_stride), (out, out_stride)),
                (8, false) => tile.run::<S, 8, 1>(simd, (x, x_stride), (out, out_stride)),
                (4, true) => tile.run::<S, 4, 4>(simd, (x, x_stride), (out, out_stride)),
                (4, false) => tile.run::<S, 4, 2>(simd, (x, x_stride), (out, out_stride)),
                (2, _) => tile.run::<S, 2, 4>(simd, (x, x_stride), (out, out_stride)),
                _ => tile.run::<S, 1, 8>(simd, (x, x_stride), (out, out_stride)),
            }
            packed = remainder;
            first += w;
        }
    }
}

/// The value to which a matrix product is added.
#[derive(Debug, Clone, Copy)]
pub(crate) enum InitialSum<'a> {
    /// The product is added to zero.
    Zero,
    /// The product is added to a bias for each output.
    Bias(&'a [f32]),
    /// The product is added to the present value of the output.
    Output,
}

/// A tile of outputs (packed weights and first output) that is computed over all steps.
struct OutputTile<'a> {
    packed: &'a [f32],
    initial: InitialSum<'a>,
    first: usize,
    steps: usize,
}

impl OutputTile<'_> {
    /// Computes the `N` outputs of the tile for all steps, `M` steps at once.
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

    /// Computes the `N` outputs of the tile for `M` steps from step `s`.
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
        let position = |m: usize| (s + m) * out_stride + self.first;
        let mut acc = [[simd.splat_f32s(0.0); N]; M];
        match self.initial {
            InitialSum::Zero => {}
            InitialSum::Bias(bias) => {
                let bias = &bias[self.first..][..N];
                for acc in &mut acc {
                    for j in 0..N {
                        acc[j] = simd.splat_f32s(bias[j]);
                    }
                }
            }
            InitialSum::Output => {
                for (m, acc) in acc.iter_mut().enumerate() {
                    let row = &out[position(m)..][..N];
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
            let row = &mut out[position(m)..][..N];
            row.iter_mut().zip(acc[m]).for_each(|(v, a)| *v = a);
        }
    }
}
