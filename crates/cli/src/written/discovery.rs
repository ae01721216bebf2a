//! A written system as the loop takes it: calibrated first, with windows over which the declared model follows the data.

use super::fit::{fit, prepared};
use super::records;
use augsim_data::Dataset;
use augsim_written::{MeasuredModel, Model, WrittenSystem};
use std::path::Path;

/// The declaration of a model for data, and the data in the columns of the model.
///
/// # Errors
/// A column is missing, or the declared model cannot be simulated.
pub fn measured(model: &Model, data: &Path) -> anyhow::Result<(MeasuredModel, Dataset)> {
    let measured = records::read(data, model)?;
    let records = records::records(&measured.data, model, true)?;
    let fitted = fit(model, &records)?;
    let window_s = fitted.calibration.stages.last().map(|stage| stage.window_s);
    let shortest = fitted.calibration.stages.first().map_or_else(Vec::new, |stage| stage.rms.clone());
    // Sizes, steps and widths are those of a simulation with the values that were found; what is declared stays declared.
    let found = WrittenSystem::declared_only(&fitted.model)?.with_windows(window_s);
    let windows = prepared(&found, &records)?;
    let mut declared = model.clone();
    for (input, found) in declared.inputs.iter_mut().zip(&fitted.model.inputs) {
        input.hold = found.hold;
    }
    let declared = found.tuned(&windows)?.measured(declared, &windows)?;
    Ok((declared.calibrated(fitted.calibration.values, &shortest), measured.data))
}
