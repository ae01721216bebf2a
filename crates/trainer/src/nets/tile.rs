//! Batch tiles (inputs of a net), their losses, and masked sums over them.

use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// A tile of a batch: up to [`crate::TILE`] trajectories, one per lane of `[time, feature, lane]`.
#[derive(Debug, Clone, Copy)]
pub struct Tile<'a, T> {
    /// Number of time steps of the longest trajectory in the tile.
    pub time: usize,
    /// Number of trajectories in the tile.
    pub lanes: usize,
    /// Targets `[time, X, lanes]` of the net: X targets per time step, one trajectory per lane.
    pub x: &'a [T],
    /// Conditions `[time, U, lanes]` of the net: U inputs per time step, one trajectory per lane.
    pub u: &'a [T],
    /// Standard normal draws `[rows, L, lanes]`: L latent components, rows as [`super::Net::noise_rows`] returns.
    pub eps: &'a [T],
    /// Mask `[time, 1, lanes]`: 1 for samples, 0 beyond the end of shorter trajectories.
    ///
    /// Empty if all lengths are equal.
    pub mask: &'a [T],
}

/// Tape variables of a batch tile's loss and its two parts: scalars, summed over the tile's trajectories.
#[derive(Debug, Clone, Copy)]
pub struct LossVars {
    /// Loss that is minimised.
    pub total: Var,
    /// Kullback-Leibler divergence part of the loss, nats.
    pub kl: Var,
    /// Negative log-likelihood part of the loss, without constant terms, nats.
    pub negative_ln_likelihood: Var,
}

/// Values of the two parts of a batch tile's loss, nats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Losses<T> {
    /// Kullback-Leibler divergence, nats.
    pub kl: T,
    /// Negative log-likelihood without constant terms, nats.
    pub negative_ln_likelihood: T,
}

/// Backpropagates `scale` times the loss through the tape, and returns the unscaled parts of the loss.
pub(crate) fn backpropagate<T: Scalar>(
    tape: &mut Tape<T>,
    loss: LossVars,
    scale: f64,
) -> Result<Losses<T>, TensorError> {
    let scaled = tape.scale(loss.total, scale)?;
    tape.backward(scaled)?;
    Ok(Losses {
        kl: tape.value(loss.kl)[0],
        negative_ln_likelihood: tape.value(loss.negative_ln_likelihood)[0],
    })
}

/// Records the sum over the elements of `v [time, F, lanes]` where `mask` is 1; all without a mask.
pub(crate) fn masked_sum<T: Scalar>(
    tape: &mut Tape<T>,
    v: Var,
    mask: Option<Var>,
) -> Result<Var, TensorError> {
    match mask {
        None => tape.sum_all(v),
        Some(mask) => {
            let masked = tape.mul(v, mask)?;
            tape.sum_all(masked)
        }
    }
}

/// Records the tile's mask on the tape; `None` if all trajectories have the same length.
pub(crate) fn mask_of<T: Scalar>(tape: &mut Tape<T>, tile: &Tile<'_, T>) -> Result<Option<Var>, TensorError> {
    if tile.mask.is_empty() {
        return Ok(None);
    }
    tape.constant(&[tile.time, 1, tile.lanes], tile.mask).map(Some)
}

/// Repeats each value for all lanes (trajectories): `[row]` to `[row, lane]`.
pub(crate) fn repeat_lanes(values: &[f32], lanes: usize) -> Vec<f32> {
    values.iter().flat_map(|v| std::iter::repeat_n(*v, lanes)).collect()
}
