//! A GRU layer whose weights are packed once, for inference step by step.

use super::gru_forward::{self, Sequence};
use super::{GruDims, GruWeights};
use crate::simd::Level;

/// A GRU layer whose weights are packed for one instruction set.
#[derive(Debug, Clone)]
pub struct PackedGru {
    level: Level,
    input: usize,
    hidden: usize,
    packed: Vec<f32>,
}

impl PackedGru {
    /// Packs the weights of a GRU layer for a given instruction set.
    pub fn new(level: Level, weights: GruWeights<'_, f32>, input: usize, hidden: usize) -> Self {
        let mut packed = vec![0.0; gru_forward::packed_len(input, hidden)];
        let dims = GruDims { time: 0, input, hidden, batch: 0 };
        level.run(usize::MAX, gru_forward::Pack(weights, dims, &mut packed));
        PackedGru { level, input, hidden, packed }
    }

    /// Number of inputs I of the layer.
    pub fn input(&self) -> usize {
        self.input
    }

    /// Number of hidden units H of the layer.
    pub fn hidden(&self) -> usize {
        self.hidden
    }

    /// Number of scratch elements (floats) that [`PackedGru::run`] needs.
    pub fn scratch(&self) -> usize {
        gru_forward::scratch_packed(self.input, self.hidden)
    }

    /// Computes hidden states `y [T, H, B]` for inputs `x [T, I, B]` from the hidden state `h [H, B]`.
    ///
    /// `h` is replaced by the last state. The numbers T of steps and B of sequences follow from the lengths
    /// of `y` and `h`.
    pub fn run(&self, x: &[f32], h: &mut [f32], y: &mut [f32], scratch: &mut [f32]) {
        let batch = h.len() / self.hidden.max(1);
        let time = y.len() / h.len().max(1);
        let dims = GruDims { time, input: self.input, hidden: self.hidden, batch };
        let packed = &self.packed;
        let saved = &mut [];
        self.level.run(batch, Sequence { dims, packed, x, h0: &[], y, saved, state: h, scratch });
    }
}
