//! A written system as the loop takes it: calibrated first, with windows over which the declared model follows the data.

use super::fit::{fit, prepared, share_starts};
use super::thinned::thinned;
use super::{noise, records};
use crate::DataFrom;
use augsim_data::Dataset;
use augsim_discovery::{Discovery, Verdict};
use augsim_physics::system::Record;
use augsim_written::{MeasuredModel, Model, WrittenSystem};

/// Windows that the data are to have at least, where they are long enough: half of them are held out. More of them would be
/// shorter, and what no output shows of a start is then free too often.
const WINDOWS: f64 = 8.0;
/// Samples of the longest windows of the search: the engine carries many windows in one pass, and a few long ones leave it idle.
const SAMPLES: f64 = 500.0;

/// Completes an answer by the start that all trajectories share, found with its effects, and by the noise that its model leaves.
///
/// # Errors
/// The model cannot be simulated over the shortest windows.
pub fn complete(found: &mut Discovery, file: &str, data: &Dataset) -> anyhow::Result<()> {
    let mut model = augsim_written::model::parse(&found.model_toml, file)?;
    let records = records::records(data, &model, true)?;
    share_starts(&mut model, &records)?;
    if found.verdict != Verdict::NotThisSystem {
        // What was found stays found where the model runs away over a whole record.
        match noise::find(&mut model, &records) {
            Ok(noise) => {
                found.notes.extend(noise.sentence());
                found.noise_cause = Some(noise);
            }
            Err(error) => {
                found
                    .notes
                    .push(format!("noise of the motion was not told from noise of the sensor: {error}"));
            }
        }
    }
    found.model_toml = model.to_toml()?;
    Ok(())
}

/// A declaration and the data to hold it against.
#[derive(Debug)]
pub struct Against {
    /// The model with the values that its fit found.
    pub declared: MeasuredModel,
    /// The data in the columns of the model.
    pub data: Dataset,
    /// How the data were made from those of the file, one sentence each.
    pub notes: Vec<String>,
}

/// The declaration of a model for data, and the data in the columns of the model, of which as many samples are kept as tell
/// something.
///
/// # Errors
/// A column is missing, or the declared model cannot be simulated.
pub fn measured(model: &Model, data: &DataFrom) -> anyhow::Result<Against> {
    let mut data = records::read(data, model)?.data;
    let records = records::records(&data, model, true)?;
    let fitted = fit(model, &records)?;
    let stages = &fitted.calibration.stages;
    let lasts = |r: &Record| r.times.last().zip(r.times.first()).map_or(0.0, |(b, a)| b - a);
    let step_s = records.iter().map(Record::typical_step).fold(f64::INFINITY, f64::min);
    let longest_s = (records.iter().map(lasts).sum::<f64>() / WINDOWS).min(SAMPLES * step_s);
    let short = stages.iter().rev().find(|stage| stage.window_s <= longest_s);
    let window_s = short.or(stages.first()).map(|stage| stage.window_s);
    let shortest = fitted.calibration.stages.first().map_or_else(Vec::new, |stage| stage.noise.clone());
    // Sizes, steps and widths are those of a simulation with the values that were found; what is declared stays declared.
    let found = WrittenSystem::declared_only(&fitted.model)?.with_windows(window_s);
    let mut windows = prepared(&found, &records)?;
    let mut found = found.tuned(&windows)?;
    let mut notes = Vec::new();
    if let Some(thinned) = thinned(&found, &data, &windows)? {
        notes.push(thinned.sentence());
        data = thinned.data;
        windows = prepared(&found, &records::records(&data, model, true)?)?;
        found = found.tuned(&windows)?;
    }
    let mut declared = model.clone();
    for (input, found) in declared.inputs.iter_mut().zip(&fitted.model.inputs) {
        input.hold = found.hold;
    }
    let declared = found.measured(declared, &windows)?;
    let declared = declared.calibrated(fitted.calibration.values, &shortest);
    Ok(Against { declared, data, notes })
}
