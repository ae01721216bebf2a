//! A written system as the loop takes it: calibrated first, with windows over which the declared model follows the data.

use super::fit::{fit, gauge_sentence, gauge_untold, prepared, share_starts};
use super::thinned::thinned;
use super::{noise, records, unit_text};
use crate::DataFrom;
use augsim_calibrate::Gauge;
use augsim_data::Dataset;
use augsim_discovery::{Discovery, Verdict};
use augsim_physics::system::Record;
use augsim_written::{MeasuredModel, Model, WrittenSystem};

/// Windows that the data are to have at least, where they are long enough. More of them would be shorter, and what no output
/// shows of a start is then free too often.
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
/// something. `check` refuses data that are not to be fitted.
///
/// # Errors
/// A column is missing, `check` refuses the data, or the declared model cannot be simulated.
pub fn measured(
    model: &Model,
    source: &DataFrom,
    check: &dyn Fn(&Dataset) -> anyhow::Result<()>,
) -> anyhow::Result<Against> {
    let mut data = records::read(source, model)?.data;
    check(&data)?;
    let records = records::records(&data, model, true)?;
    let fitted = fit(model, &records)?;
    let gauges = &fitted.calibration.gauges;
    if let Some((held, sentence)) = gauges.iter().find_map(|gauge| without(model, gauge)) {
        let mut against = measured(&held, source, check)?;
        against.notes.insert(0, sentence);
        return Ok(against);
    }
    let mut notes: Vec<String> = gauges.iter().map(|gauge| gauge_sentence(model, gauge)).collect();
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

/// A model in which the last of the parameters of a gauge, which can move together without a change of what is measured, is held at
/// its declared value, and the sentence that says so. `None` where more than one would have to be held: which, is for the user to say.
fn without(model: &Model, gauge: &Gauge) -> Option<(Model, String)> {
    let [_, .., last] = gauge.parameters[..] else { return None };
    if gauge.combinations + 1 != gauge.parameters.len() {
        return None;
    }
    let mut held = model.clone();
    let p = held.parameters.get_mut(last)?;
    p.frozen = true;
    let (name, value, unit) = (p.name.clone(), p.nominal, unit_text(p.unit));
    Some((held, format!("{}: `{name}` is held at {value}{unit}", gauge_untold(model, gauge))))
}

#[cfg(test)]
mod tests {
    //! Contract: one parameter of a gauge is held where one has to be; where two have to be, or one has no effect at all, none is.
    use super::*;

    #[test]
    fn one_parameter_is_held_where_one_combination_is_free() {
        let text = augsim_written::EXAMPLES.iter().find(|(name, _)| *name == "tanks").expect("an example").1;
        let model = augsim_written::model::parse(text, "tanks.toml").expect("an example");
        let free: Vec<usize> = (0..model.parameters.len()).filter(|i| !model.parameters[*i].frozen).collect();
        let gauge =
            |parameters: &[usize], combinations| Gauge { parameters: parameters.to_vec(), combinations };
        let (held, sentence) = without(&model, &gauge(&free[..2], 1)).expect("one is held");
        let frozen = |i: &usize| held.parameters[*i].frozen;
        assert!(!frozen(&free[0]) && frozen(&free[1]));
        let name = &model.parameters[free[1]].name;
        assert!(
            sentence.contains("only one combination")
                && sentence.contains(&format!(": `{name}` is held at "))
        );
        assert!(without(&model, &gauge(&free[..3], 1)).is_none(), "two would have to be held");
        assert!(without(&model, &gauge(&free[..1], 0)).is_none(), "it has no effect");
    }
}
