//! One tile of a batch, and the loss that a net records for it.

use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// A tile of a batch: up to [`crate::TILE`] trajectories, `[time, feature, lane]`.
#[derive(Debug, Clone, Copy)]
pub struct Tile<'a, T> {
    /// Time steps (of the longest trajectory).
    pub time: usize,
    /// Trajectories.
    pub lanes: usize,
    /// Targets `[time, X, lanes]`.
    pub x: &'a [T],
    /// Conditions `[time, U, lanes]`.
    pub u: &'a [T],
    /// Standard normal draws `[rows, L, lanes]`, rows as [`super::Net::noise_rows`] says.
    pub eps: &'a [T],
    /// 1 where a sample exists and 0 beyond the end of a shorter trajectory, `[time, 1, lanes]`; empty
    /// if all have the same length.
    pub mask: &'a [T],
}

/// Loss of a tile and its two parts, each a scalar: sums over the tile's trajectories.
#[derive(Debug, Clone, Copy)]
pub struct LossVars {
    /// Divergence plus misfit.
    pub total: Var,
    /// Kullback-Leibler part.
    pub kl: Var,
    /// Negative log-likelihood part (less constants).
    pub misfit: Var,
}

/// Values of the two parts of a tile's loss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Losses<T> {
    /// Kullback-Leibler part.
    pub kl: T,
    /// Negative log-likelihood part (less constants).
    pub misfit: T,
}

/// Values of a loss, after `scale` times its gradient was computed.
pub(crate) fn pull_back<T: Scalar>(
    tape: &mut Tape<T>,
    loss: LossVars,
    scale: f64,
) -> Result<Losses<T>, TensorError> {
    let scaled = tape.scale(loss.total, scale)?;
    tape.backward(scaled)?;
    Ok(Losses { kl: tape.value(loss.kl)[0], misfit: tape.value(loss.misfit)[0] })
}

/// Sum over all elements of `v [time, F, lanes]`, without those that the mask hides.
pub(crate) fn masked_sum<T: Scalar>(
    tape: &mut Tape<T>,
    v: Var,
    mask: Option<Var>,
) -> Result<Var, TensorError> {
    match mask {
        None => tape.sum_all(v),
        Some(mask) => {
            let visible = tape.mul(v, mask)?;
            tape.sum_all(visible)
        }
    }
}

/// Records the tile's mask, if it has one.
pub(crate) fn mask_of<T: Scalar>(tape: &mut Tape<T>, tile: &Tile<'_, T>) -> Result<Option<Var>, TensorError> {
    if tile.mask.is_empty() {
        return Ok(None);
    }
    tape.constant(&[tile.time, 1, tile.lanes], tile.mask).map(Some)
}
