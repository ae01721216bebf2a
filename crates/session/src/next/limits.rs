//! Limits of an experiment: from a file, and by default the ranges that the recordings so far have.

use super::fault::NextFault;
use super::source::Source;
use crate::Usage;
use crate::equations::fit::prepare_records;
use augsim_design::{InputLimits, Limits};
use augsim_equations::{EquationSystem, Model};
use augsim_system::statistics::median;
use augsim_system::{InitialValue, Record, Simulate};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Content of a file of limits.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsFile {
    duration_s: Option<f64>,
    sample_s: Option<f64>,
    #[serde(default)]
    inputs: BTreeMap<String, InputTable>,
    #[serde(default)]
    ranges: BTreeMap<String, [f64; 2]>,
    #[serde(default)]
    starts: BTreeMap<String, StartRange>,
}

/// Limits of one input.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct InputTable {
    range: Option<[f64; 2]>,
    rate_per_s: Option<f64>,
    energy: Option<f64>,
}

/// Start value of a state: a number, or a range to choose from.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum StartRange {
    One(f64),
    Range([f64; 2]),
}

/// Limits as far as they are known.
#[derive(Debug, Default)]
pub struct PartialLimits {
    inputs: BTreeMap<String, InputLimits>,
    ranges: BTreeMap<String, [f64; 2]>,
    starts: BTreeMap<String, [f64; 2]>,
    duration_s: Option<f64>,
    step_s: Option<f64>,
}

/// Limits that the recordings so far have kept: ranges and rates of inputs, ranges of outputs, duration, sampling, starts.
///
/// # Errors
/// The model cannot be compiled, or refuses a recording.
pub fn default_limits(model: &Model, records: &[Record]) -> anyhow::Result<PartialLimits> {
    let mut limits = PartialLimits::default();
    if records.is_empty() {
        return Ok(limits);
    }
    let range_of = |values: &mut dyn Iterator<Item = f64>| {
        values
            .filter(|v| v.is_finite())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    for (index, input) in model.inputs.iter().enumerate() {
        let streams = || records.iter().filter_map(|r| r.inputs.get(index));
        let range = range_of(&mut streams().filter_map(|s| s.values.first()).flatten().copied());
        let rate = streams()
            .filter_map(|s| Some((&s.times, s.values.first()?)))
            .flat_map(|(t, v)| {
                t.windows(2).zip(v.windows(2)).map(|(t, v)| (v[1] - v[0]).abs() / (t[1] - t[0]))
            })
            .filter(|r| r.is_finite())
            .fold(0.0, f64::max);
        let name = input.name.clone();
        limits.inputs.insert(
            name.clone(),
            InputLimits { name, range, rate_per_s: (rate > 0.0).then_some(rate), energy: None },
        );
    }
    for (index, output) in model.outputs.iter().enumerate() {
        let range = range_of(&mut records.iter().filter_map(|r| r.values.get(index)).flatten().copied());
        limits.ranges.insert(output.name.clone(), range);
    }
    let durations = records.iter().filter_map(|r| Some(r.times.last()? - r.times.first()?));
    limits.duration_s = Some(median(&mut durations.collect::<Vec<_>>()));
    limits.step_s = Some(median(&mut records.iter().map(Record::typical_step).collect::<Vec<_>>()));
    limits.starts = usual_starts(model, records)?;
    Ok(limits)
}

/// Median rough initial value of each state that has none by declaration.
fn usual_starts(model: &Model, records: &[Record]) -> anyhow::Result<BTreeMap<String, [f64; 2]>> {
    let system = EquationSystem::declared_only(model)?;
    let prepared = prepare_records(&system, records)?;
    let states = system.schema().states.iter().enumerate();
    let start = |(index, state): (usize, &augsim_system::State)| {
        let values = prepared.iter().filter_map(|r| r.windows.first()?.start.get(index).copied());
        let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        let is_declared = matches!(state.initial, InitialValue::Fixed(_) | InitialValue::Prior(..));
        if is_declared || values.is_empty() {
            return None;
        }
        let middle = median(&mut values);
        Some((state.quantity.name.clone(), [middle, middle]))
    };
    Ok(states.filter_map(start).collect())
}

/// Reads a file of limits; what it does not say is as in `default`.
///
/// # Errors
/// The file cannot be read, names unknown quantities, or a limit is neither in the file nor known.
pub fn read_limits(
    path: Option<&Path>,
    default: PartialLimits,
    sources: &[Source],
) -> anyhow::Result<Limits> {
    let shown = path.map_or_else(|| "--limits".to_owned(), |p| p.display().to_string());
    let fault = |fault: NextFault| Usage::model(&shown, crate::usage::ModelFault::Next(fault));
    let file: LimitsFile = match path {
        Some(path) => toml::from_str(&augsim_data::read_text(path)?)
            .map_err(|e| fault(NextFault::Limits { cause: e.to_string().trim_end().to_owned() }))?,
        None => LimitsFile::default(),
    };
    let model = &sources[0].model;
    let known = |section, names: Vec<String>, given: Vec<&String>| match given
        .into_iter()
        .find(|name| !names.contains(name))
    {
        Some(name) => {
            Err(fault(NextFault::UnknownName { section, name: name.clone(), known: names.clone() }))
        }
        None => Ok(()),
    };
    let states = || sources.iter().flat_map(|s| s.model.states.iter().map(|s| s.name.clone()));
    let inputs: Vec<String> = model.inputs.iter().map(|i| i.name.clone()).collect();
    let outputs = model.outputs.iter().map(|o| o.name.clone());
    known("inputs", inputs, file.inputs.keys().collect())?;
    known("ranges", outputs.chain(states()).collect(), file.ranges.keys().collect())?;
    known("starts", states().collect(), file.starts.keys().collect())?;
    let positive = |value: Option<f64>, what: &str, key: &str| match value {
        Some(v) if v > 0.0 && v.is_finite() => Ok(v),
        Some(_) => Err(fault(NextFault::NotPositive { key: key.to_owned() })),
        None => Err(fault(NextFault::NoLimit { what: what.to_owned(), key: key.to_owned() })),
    };
    let mut limits = Limits {
        duration_s: positive(file.duration_s.or(default.duration_s), "the duration of a run", "duration_s")?,
        step_s: positive(file.sample_s.or(default.step_s), "the time between samples", "sample_s")?,
        ranges: default.ranges,
        starts: default.starts,
        inputs: Vec::new(),
    };
    limits.ranges.extend(file.ranges);
    limits.starts.extend(file.starts.into_iter().map(|(name, start)| match start {
        StartRange::One(value) => (name, [value; 2]),
        StartRange::Range(range) => (name, range),
    }));
    for input in &model.inputs {
        let (given, usual) = (file.inputs.get(&input.name), default.inputs.get(&input.name));
        let key = || format!("inputs.{}.range", input.name);
        let missing = || {
            fault(NextFault::NoLimit { what: format!("the range of the input {}", input.name), key: key() })
        };
        let limit = |value: Option<f64>, name: &str| match value {
            Some(v) if v.is_nan() || v <= 0.0 => {
                Err(fault(NextFault::NotPositive { key: format!("inputs.{}.{name}", input.name) }))
            }
            other => Ok(other),
        };
        limits.inputs.push(InputLimits {
            name: input.name.clone(),
            range: given.and_then(|g| g.range).or(usual.map(|u| u.range)).ok_or_else(missing)?,
            rate_per_s: limit(
                given.map_or(usual.and_then(|u| u.rate_per_s), |g| g.rate_per_s),
                "rate_per_s",
            )?,
            energy: limit(given.and_then(|g| g.energy), "energy")?,
        });
    }
    check_ranges(&limits, &fault)?;
    Ok(limits)
}

/// Checks that no range is empty, and that there is something to vary.
fn check_ranges(limits: &Limits, fault: &dyn Fn(NextFault) -> Usage) -> Result<(), Usage> {
    let is_empty = |[low, high]: [f64; 2]| !(low < high && low.is_finite() && high.is_finite());
    let empty = |section, name: &str| Err(fault(NextFault::EmptyRange { section, name: name.to_owned() }));
    for input in &limits.inputs {
        if is_empty(input.range) {
            return empty("inputs", &input.name);
        }
    }
    for (name, range) in &limits.ranges {
        if range[0].is_nan() || range[1].is_nan() || range[0] >= range[1] {
            return empty("ranges", name);
        }
    }
    for (name, [low, high]) in &limits.starts {
        if !(low <= high && low.is_finite() && high.is_finite()) {
            return empty("starts", name);
        }
    }
    match limits.inputs.is_empty() && limits.starts.values().all(|[low, high]| low == high) {
        true => Err(fault(NextFault::NothingToVary)),
        false => Ok(()),
    }
}
