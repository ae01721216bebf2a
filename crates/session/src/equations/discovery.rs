//! Prepares an equation model for discovery: calibration, and length of the shooting windows.

use super::downsample::downsample;
use super::fit::{estimate_shared_starts, fit, gauge_finding, gauge_sentence, prepare_records};
use super::forecast::{BURN_IN, free_runs};
use super::{degrees, noise, records, unit_text};
use augsim_data::checks::AcceptedChecks;
use augsim_data::{Dataset, digits};
use augsim_discovery::{Discovery, Observer, RepeatScatter, Repeats, Verdict};
use augsim_equations::model::Output;
use augsim_equations::{CalibratedModel, EquationSystem, Model};
use augsim_fit::Gauge;
use augsim_system::Record;
use std::collections::BTreeMap;
use std::time::Instant;

/// Minimum number of shooting windows over all records, if these are long enough.
///
/// With more windows, which would be shorter, the unmeasured initial states would add too many free values.
const MIN_WINDOWS: f64 = 8.0;
/// Minimum number of shooting windows of each group of recordings, if these are long enough.
const MIN_WINDOWS_PER_GROUP: f64 = 4.0;
/// Maximum number of samples of a shooting window in the search for effects.
///
/// The engine simulates many windows in one pass of SIMD lanes, and a few long windows leave lanes unused.
const MAX_WINDOW_SAMPLES: f64 = 500.0;

/// Completes the result of a discovery with shared initial states and the noise of the augmented model.
///
/// Parameters of `gauges`, of which only combinations can be identified, lose their intervals.
///
/// # Errors
/// The model cannot be simulated over the shortest windows.
pub fn complete(
    found: &mut Discovery,
    declared: &Model,
    data: &Dataset,
    gauges: &[Vec<String>],
) -> anyhow::Result<()> {
    let mut model = declared.parse_changed(&found.model_toml)?;
    mark_gauges(found, &mut model, gauges);
    let records = records::records(data, &model, true)?;
    estimate_shared_starts(&mut model, &records)?;
    add_repeats(found, &model, &records);
    if found.verdict != Verdict::NotThisSystem {
        // If the model diverges over a whole record, the noise is not estimated, but the findings remain
        // valid.
        match noise::find(&mut model, &records) {
            Ok(noise) => {
                let duration_s = |r: &Record| r.times.last().zip(r.times.first()).map_or(0.0, |(b, a)| b - a);
                found.set_noise_cause(noise, &records.iter().map(duration_s).collect::<Vec<_>>());
            }
            Err(error) => {
                found
                    .notes
                    .push(format!("process noise and measurement noise could not be estimated: {error}"));
            }
        }
    }
    found.model_toml = model.to_toml()?;
    complete_rivals(found, declared, &records)
}

/// Completes the models of the rivals with shared initial states and their noise; drops those that diverge.
fn complete_rivals(found: &mut Discovery, declared: &Model, records: &[Record]) -> anyhow::Result<()> {
    let rivals = std::mem::take(&mut found.models.rivals);
    for mut rival in rivals {
        let mut model = declared.parse_changed(&rival.model_toml)?;
        estimate_shared_starts(&mut model, records)?;
        if noise::find(&mut model, records).is_ok() {
            rival.model_toml = model.to_toml()?;
            found.models.rivals.push(rival);
        }
    }
    Ok(())
}

/// Measures how the errors of the augmented model scatter between recordings with the same inputs, and tells it in a remark.
fn add_repeats(found: &mut Discovery, model: &Model, records: &[Record]) {
    let repeats = Repeats::find(records);
    if repeats.is_empty() {
        return;
    }
    // Without a simulation of whole recordings there are no errors to compare.
    let Ok(runs) = free_runs(model, records, BURN_IN) else { return };
    let errors: Vec<_> = runs.iter().map(|run| run.errors(model)).collect();
    let unit = |output: &Output| output.unit.map_or_else(String::new, |unit| unit.symbol());
    let outputs: Vec<_> = model.outputs.iter().map(|output| (output.name.clone(), unit(output))).collect();
    found.repeats = repeats.scatter(&errors, &outputs);
    let Some(first) = found.repeats.first() else { return };
    let amounts = |value: &dyn Fn(&RepeatScatter) -> f64| {
        let amount = |r: &RepeatScatter| {
            format!("{} in `{}`", format!("{} {}", digits(value(r)), r.unit).trim_end(), r.output)
        };
        found.repeats.iter().map(amount).collect::<Vec<_>>().join(", ")
    };
    let sets = if first.sets == 1 { String::new() } else { format!(", in {} sets", first.sets) };
    let remark = format!(
        "{} recordings have the same inputs{sets}; between them the errors of the augmented model over whole recordings scatter by {} \
         (standard deviation), which no model predicts from these inputs; all repeats have {} in common, which a better model would \
         predict",
        first.recordings,
        amounts(&|r| r.sd),
        amounts(&|r| r.common)
    );
    found.notes.push(remark);
}

/// A calibrated model with the data in which missing effects are searched.
#[derive(Debug)]
pub struct CalibratedProblem {
    /// The declared model with its calibrated values.
    pub declared: CalibratedModel,
    /// The data, downsampled where possible, in the columns of the model.
    pub data: Dataset,
    /// Notes for the user on what was fixed or downsampled, one sentence each.
    pub notes: Vec<String>,
    /// Names of parameters of which only combinations can be identified, one list per such set; one of each was fixed.
    pub gauges: Vec<Vec<String>>,
}

/// Marks parameters identifiable only in combination as not identified, and removes their confidence intervals.
///
/// One parameter of each list in `gauges` was fixed at an arbitrary value.
fn mark_gauges(found: &mut Discovery, model: &mut Model, gauges: &[Vec<String>]) {
    for names in gauges {
        for name in names {
            let others: Vec<String> = names.iter().filter(|n| *n != name).cloned().collect();
            for list in [&mut found.parameters, &mut found.calibrated] {
                list.get_mut(name).into_iter().for_each(|e| e.set_not_identified(&others));
            }
        }
        let is_part = |p: &&mut augsim_equations::model::Parameter| names.contains(&p.name);
        model.parameters.iter_mut().filter(is_part).for_each(|p| p.ci95 = None);
        // What is known relative to the parameter that was fixed is not known apart from it.
        model.covariance = None;
    }
}

/// Calibrates a model on data, and prepares both for the search for missing effects.
///
/// Data that are sampled more finely than needed are downsampled. After `until` the best values so far are taken.
/// `observer` receives the calibrated model file.
///
/// # Errors
/// The data lack a column of the model, or the declared model cannot be simulated.
pub fn calibrated_problem(
    model: &Model,
    data: &Dataset,
    accepted: AcceptedChecks,
    until: Option<Instant>,
    observer: &mut dyn Observer,
) -> anyhow::Result<CalibratedProblem> {
    let records = records::records(data, model, true)?;
    degrees::check(model, data, &records, accepted)?;
    calibrated_on(model, data, &records, until, observer)
}

/// Calibrates a model on records of its data, see [`calibrated_problem`].
fn calibrated_on(
    model: &Model,
    data: &Dataset,
    records: &[Record],
    until: Option<Instant>,
    observer: &mut dyn Observer,
) -> anyhow::Result<CalibratedProblem> {
    let fitted = fit(model, records, until)?;
    let gauges = &fitted.calibration.gauges;
    let fixed = gauges.iter().find_map(|gauge| Some((gauge, fix_gauge(model, gauge)?)));
    if let Some((gauge, (reduced, sentence))) = fixed {
        // A fixed parameter changes neither the records nor their units.
        let mut calibrated = calibrated_on(&reduced, data, records, until, observer)?;
        calibrated.notes.insert(0, sentence);
        calibrated.gauges.push(gauge.parameters.iter().map(|p| model.parameters[*p].name.clone()).collect());
        return Ok(calibrated);
    }
    if observer.takes_interim() {
        observer.calibrated(fitted.model.to_toml()?);
    }
    let mut notes: Vec<String> = gauges.iter().map(|gauge| gauge_sentence(model, gauge)).collect();
    let stages = &fitted.calibration.stages;
    let duration_s = |r: &Record| r.times.last().zip(r.times.first()).map_or(0.0, |(b, a)| b - a);
    let step_s = records.iter().map(Record::typical_step).fold(f64::INFINITY, f64::min);
    let longest_s = (records.iter().map(duration_s).sum::<f64>() / MIN_WINDOWS)
        .min(MAX_WINDOW_SAMPLES * step_s)
        .min(longest_window_of_groups_s(data));
    let chosen = stages.iter().rev().find(|stage| stage.window_s <= longest_s);
    let window_s = chosen.or(stages.first()).map(|stage| stage.window_s);
    let shortest_window_noise =
        fitted.calibration.stages.first().map_or_else(Vec::new, |stage| stage.noise.clone());
    // Scales, steps and smoothing widths come from a simulation with the calibrated values; the declared
    // values stay unchanged.
    let found = EquationSystem::declared_only(&fitted.model)?.with_windows(window_s);
    let mut windows = prepare_records(&found, records)?;
    let mut found = found.tuned(&windows)?;
    let downsampled = downsample(&found, data, &windows)?;
    if let Some(fewer) = &downsampled {
        notes.push(fewer.sentence());
        windows = prepare_records(&found, &records::records(&fewer.data, model, true)?)?;
        found = found.tuned(&windows)?;
    }
    let data = downsampled.map_or_else(|| data.clone(), |fewer| fewer.data);
    let mut declared = model.clone();
    for (input, found) in declared.inputs.iter_mut().zip(&fitted.model.inputs) {
        input.hold = found.hold;
    }
    let declared = found.measured(declared, &windows)?;
    let declared = declared.calibrated(fitted.calibration.values, &shortest_window_noise);
    Ok(CalibratedProblem { declared, data, notes, gauges: Vec::new() })
}

/// Longest duration of a window that leaves each group of recordings several windows, s; infinite without groups.
///
/// The values of a group are judged by predictions of a part of its data from the others.
fn longest_window_of_groups_s(data: &Dataset) -> f64 {
    let mut durations_s: BTreeMap<&str, f64> = BTreeMap::new();
    for trajectory in data.trajectories() {
        let [Some(first), Some(last)] = [trajectory.time_s().first(), trajectory.time_s().last()] else {
            continue;
        };
        *durations_s.entry(trajectory.group().unwrap_or_default()).or_default() += last - first;
    }
    let is_grouped = durations_s.len() > 1;
    let shortest_s = durations_s.into_values().fold(f64::INFINITY, f64::min);
    if is_grouped { shortest_s / MIN_WINDOWS_PER_GROUP } else { f64::INFINITY }
}

/// Makes the other parameters of a gauge identifiable: fixes the last one at its declared value.
///
/// A gauge is a set of parameters of which only combinations can be identified. Returns the changed model and
/// a sentence. `None` if more than one parameter would have to be fixed, which is left to the user, or if a
/// single parameter has no effect.
fn fix_gauge(model: &Model, gauge: &Gauge) -> Option<(Model, String)> {
    let [_, .., last] = gauge.parameters[..] else { return None };
    if gauge.combinations + 1 != gauge.parameters.len() {
        return None;
    }
    let mut reduced = model.clone();
    let p = reduced.parameters.get_mut(last)?;
    p.frozen = true;
    let (name, value, unit) = (p.name.clone(), p.nominal, unit_text(p.unit));
    Some((
        reduced,
        format!(
            "{}: `{name}` is fixed at {value}{unit}, and the others are relative to it",
            gauge_finding(model, gauge)
        ),
    ))
}

#[cfg(test)]
mod tests {
    //! Contract: one parameter of a gauge (parameters identifiable only in combination) is fixed if that
    //! makes the others identifiable; otherwise none is fixed.
    use super::*;

    #[test]
    fn one_parameter_is_fixed_if_the_gauge_has_one_degree_of_freedom() {
        let text =
            augsim_equations::EXAMPLES.iter().find(|(name, _)| *name == "tanks").expect("an example").1;
        let model = augsim_equations::model::parse(text, "tanks.toml").expect("an example");
        let free: Vec<usize> = (0..model.parameters.len()).filter(|i| !model.parameters[*i].frozen).collect();
        let gauge =
            |parameters: &[usize], combinations| Gauge { parameters: parameters.to_vec(), combinations };
        let (reduced, sentence) = fix_gauge(&model, &gauge(&free[..2], 1)).expect("one is fixed");
        let frozen = |i: &usize| reduced.parameters[*i].frozen;
        assert!(!frozen(&free[0]) && frozen(&free[1]));
        let name = &model.parameters[free[1]].name;
        assert!(
            sentence.contains("only one combination")
                && sentence.contains(&format!(": `{name}` is fixed at "))
        );
        assert!(fix_gauge(&model, &gauge(&free[..3], 1)).is_none(), "two would have to be fixed");
        assert!(fix_gauge(&model, &gauge(&free[..1], 0)).is_none(), "it has no effect");
    }
}
