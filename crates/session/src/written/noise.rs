//! States and noise of measured records under a model whose parameters are known.

use super::fit::prepared;
use augsim_calibrate::{Smoothed, smooth};
use augsim_physics::system::{Record, System};
use augsim_written::{Model, WrittenSystem};

/// States of records at every sample, and the noise by which the records differ from runs of a model. Readings of later samples are
/// used as well: states are estimates of the past, no forecasts.
///
/// # Errors
/// The model cannot be compiled, nothing was measured, or a record cannot be simulated.
pub fn smoothed(model: &Model, records: &[Record]) -> anyhow::Result<Smoothed> {
    let system = WrittenSystem::declared_only(model)?;
    let records = prepared(&system, records)?;
    let system = system.tuned(&records)?;
    let values: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let declared: Vec<Option<f64>> = model.outputs.iter().map(|output| output.sd).collect();
    let (shown, pushed) = (system.showing_states()?, system.pushed_states());
    Ok(smooth(&shown, model.outputs.len(), &records, &values, &pushed, &declared)?)
}
