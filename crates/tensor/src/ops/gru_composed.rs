//! The GRU layer composed of elementary operations: a readable reference for [`Tape::gru_sequence`].

use super::gru_sequence::GruVars;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the hidden states of a GRU layer as [`Tape::gru_sequence`], composed of elementary operations.
    ///
    /// It is slow; tests compare the fused layer with it.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// // One unit, one input, one sequence; all weights 0, so that every gate is 1/2 and the new state is 0.
    /// let [w_ih, w_hh] = [tape.constant(&[3, 1], &[0.0; 3])?, tape.constant(&[3, 1], &[0.0; 3])?];
    /// let [b_ih, b_hh] = [tape.constant(&[3], &[0.0; 3])?, tape.constant(&[3], &[0.0; 3])?];
    /// let x = tape.constant(&[3, 1, 1], &[1.0, 2.0, 3.0])?;
    /// let h0 = tape.variable(&[1, 1], &[1.0])?;
    /// let w = augsim_tensor::GruVars { w_ih, w_hh, b_ih, b_hh };
    /// let fused = tape.gru_sequence(x, Some(h0), w)?;
    /// let composed = tape.gru_composed(x, Some(h0), w)?;
    /// assert_eq!(tape.value(fused), tape.value(composed));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Tape::gru_sequence`], and [`TensorError::BadShape`] for a sequence without steps.
    pub fn gru_composed(&mut self, x: Var, h0: Option<Var>, w: GruVars) -> Result<Var, TensorError> {
        let d = self.gru_dims(x, h0, w)?;
        let mut h = match h0 {
            Some(h) => h,
            None => self.constant(&[d.hidden, d.batch], &vec![T::ZERO; d.hidden * d.batch])?,
        };
        let b_ih = self.reshape(w.b_ih, &[3 * d.hidden, 1])?;
        let b_hh = self.reshape(w.b_hh, &[3 * d.hidden, 1])?;
        let one = self.constant(&[1, 1], &[T::ONE])?;
        let mut steps = Vec::with_capacity(d.time);
        for t in 0..d.time {
            let x_t = self.slice(x, 0, t, t + 1)?;
            let x_t = self.reshape(x_t, &[d.input, d.batch])?;
            let a = self.matmul(w.w_ih, x_t)?;
            let a = self.add(a, b_ih)?;
            let c = self.matmul(w.w_hh, h)?;
            let c = self.add(c, b_hh)?;
            let gate = |tape: &mut Self, v: Var, k: usize| tape.slice(v, 0, k * d.hidden, (k + 1) * d.hidden);
            let (a_r, a_z, a_n) = (gate(self, a, 0)?, gate(self, a, 1)?, gate(self, a, 2)?);
            let (c_r, c_z, c_n) = (gate(self, c, 0)?, gate(self, c, 1)?, gate(self, c, 2)?);
            let r = self.add(a_r, c_r)?;
            let r = self.sigmoid(r)?;
            let z = self.add(a_z, c_z)?;
            let z = self.sigmoid(z)?;
            let n = self.mul(r, c_n)?;
            let n = self.add(a_n, n)?;
            let n = self.tanh(n)?;
            let one_minus_z = self.sub(one, z)?;
            let candidate_part = self.mul(one_minus_z, n)?;
            let previous_part = self.mul(z, h)?;
            h = self.add(candidate_part, previous_part)?;
            steps.push(h);
        }
        self.stack_time(&steps)
    }
}
