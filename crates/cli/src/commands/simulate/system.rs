//! `augsim simulate MODEL.toml`: simulates a model of equations.

use crate::args::Simulate;
use crate::commands::count_trajectories;
use augsim_data::{Column, Dataset, Trajectory, Unit, write_dataset};
use augsim_equations::model::{FirstSamples, Hold};
use augsim_equations::{EquationSystem, Model, Waveform};
use augsim_session::equations::{self, fit, records, unit_text};
use augsim_session::usage::{ModelFault, Takes, UnknownName};
use augsim_system::{Describe, Offsets, Record, Simulate as _, Simulated, Stream, Task};
use augsim_terminal::destination::data_file;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Default duration of a simulation without data, s.
const DURATION_S: f64 = 10.0;
/// Maximum number of samples of a simulation without data.
const MAX_SAMPLES: u64 = 100_000_000;
/// Number of periods of the default sine input over the simulated time.
const DEFAULT_INPUT_PERIODS: f64 = 5.0;
/// Initial value of all outputs of a system without inputs and data, so that the simulation moves.
const DEFAULT_DEFLECTION: f64 = 0.5;

#[derive(Debug, Serialize)]
struct Written {
    data: PathBuf,
    trajectories: usize,
    samples: usize,
    substeps: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    check: Vec<Deviation>,
}

/// Largest deviation of one simulated output from the adaptive reference solver, in the output's unit.
#[derive(Debug, Serialize)]
struct Deviation {
    output: String,
    largest: f64,
    unit: String,
}

/// Simulates a model of equations and writes its inputs and outputs.
pub(super) fn run(args: &Simulate, model: &Path, output: &Output) -> anyhow::Result<Outcome> {
    if !equations::is_model(model) {
        augsim_physics::model::ModelFile::read(model)?;
        return Err(Usage::model(model.display(), ModelFault::BuiltInSimulated).into());
    }
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("out/system.csv"));
    let mut inputs = vec![model];
    inputs.extend(args.like.as_deref());
    data_file(&out, &[], &inputs)?;
    let mut model = equations::read(model)?;
    model.inputs.iter_mut().for_each(|input| input.hold = input.hold.or(Some(Hold::Linear)));
    let list = match &args.like {
        Some(like) => records::records(&records::read(like, &model)?.data, &model, true)?,
        None => vec![record_without_data(args, &model, output)?],
    };
    let system = EquationSystem::declared_only(&model)?.with_group_values();
    let mut list = fit::prepare_records(&system, &list)?;
    for record in &mut list {
        set_initial_state(args, &model, record, output)?;
    }
    let system = system.tuned(&list)?;
    let parameters: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let mut trajectories = Vec::with_capacity(list.len());
    let mut worst = vec![0.0_f64; model.outputs.len()];
    for record in &list {
        let start = record.windows.first().map_or(&[][..], |w| &w.start);
        let task = Task {
            parameters: &parameters,
            record,
            window: 0..record.times.len(),
            start,
            offsets: Offsets::None,
            seeds: &[],
        };
        let mut simulated = Simulated::default();
        system.simulate(&task, &mut simulated)?;
        if args.check {
            let reference = system.reference(&task)?;
            for (at, expected) in reference.iter().enumerate() {
                let channel = at % worst.len();
                let off = (simulated.value(at / worst.len(), channel) - expected).abs();
                worst[channel] = worst[channel].max(off);
            }
        }
        let driven = system.residual_axes(record, &[]);
        let mut values: Vec<Vec<f64>> =
            driven.into_iter().skip(1 + model.outputs.len()).map(|(_, values)| values).collect();
        let channel = |c: usize| (0..simulated.samples()).map(|k| simulated.value(k, c)).collect();
        values.extend((0..model.outputs.len()).map(channel));
        trajectories.push(Trajectory::new(record.id.clone(), record.times.clone(), values)?);
    }
    let column =
        |name: &str, unit: Option<Unit>| Column::with_unit(name, unit.unwrap_or(Unit::DIMENSIONLESS));
    let inputs = model.inputs.iter().map(|i| column(&i.name, i.unit));
    let columns: Result<Vec<Column>, _> =
        inputs.chain(model.outputs.iter().map(|o| column(&o.name, o.unit))).collect();
    let samples = list.iter().map(|r| r.times.len()).sum();
    write_dataset(&Dataset::new(columns?, trajectories)?, &out)?;
    let deviation = |(output, largest): (&augsim_equations::model::Output, &f64)| Deviation {
        output: output.name.clone(),
        largest: *largest,
        unit: unit_text(output.unit).trim().to_owned(),
    };
    let check =
        if args.check { model.outputs.iter().zip(&worst).map(deviation).collect() } else { Vec::new() };
    let substeps = system.options().substeps;
    let written = Written { data: out, trajectories: list.len(), samples, substeps, check };
    output.result(&written, || simulation_text(&written))?;
    Ok(Outcome::Done)
}

fn simulation_text(written: &Written) -> String {
    let steps = if written.substeps == 1 { "step" } else { "steps" };
    let mut text = format!(
        "{}, {} samples, {} {steps} between samples: {}",
        count_trajectories(written.trajectories),
        written.samples,
        written.substeps,
        written.data.display()
    );
    for d in &written.check {
        let unit = if d.unit.is_empty() { String::new() } else { format!(" {}", d.unit) };
        text += &format!("\n  {}: at most {:.2e}{unit} from the adaptive reference", d.output, d.largest);
    }
    text
}

/// Makes a record without measurements: regular sample times and the inputs of the command line.
fn record_without_data(args: &Simulate, model: &Model, output: &Output) -> anyhow::Result<Record> {
    let duration_s = args.duration_s.unwrap_or(DURATION_S);
    let samples = duration_s * args.rate_hz;
    let is_clock = duration_s > 0.0 && args.rate_hz > 0.0 && samples.is_finite();
    if !(is_clock && (1.0..=MAX_SAMPLES as f64).contains(&samples)) {
        return Err(Usage::Clock { duration_s, rate_hz: args.rate_hz, most: MAX_SAMPLES }.into());
    }
    let times: Vec<f64> = (0..=samples.round() as usize).map(|k| k as f64 / args.rate_hz).collect();
    let mut given = Vec::new();
    for text in &args.input {
        let (name, expression) = split_assignment(text, "--input", "force_N=2*sin(3*t)")?;
        if !model.inputs.iter().any(|input| input.name == name) {
            let known = model.inputs.iter().map(|i| i.name.clone()).collect();
            return Err(Usage::Unknown(UnknownName::OptionInput { name: name.to_owned(), known }).into());
        }
        let wave = Waveform::parse(expression, "--input").map_err(Usage::Waveform)?;
        given.push((name, wave));
    }
    let mut streams = Vec::with_capacity(model.inputs.len());
    for input in &model.inputs {
        let wave = match given.iter().find(|(name, _)| *name == input.name) {
            Some((_, wave)) => wave.clone(),
            None => {
                let text =
                    format!("sin({} * t)", 2.0 * std::f64::consts::PI * DEFAULT_INPUT_PERIODS / duration_s);
                output.note(format!(
                    "input {} is set to {text}; use --input {}=… to change it",
                    input.name, input.name
                ));
                Waveform::parse(&text, "the default input").map_err(Usage::Waveform)?
            }
        };
        let values = times.iter().map(|t| wave.at(*t)).collect();
        streams.push(Stream { times: times.clone(), values: vec![values] });
    }
    let gaps = vec![f64::NAN; times.len()];
    let values = vec![gaps; model.outputs.len()];
    Ok(Record { id: "1".into(), times, values, inputs: streams.into(), ..Record::default() })
}

/// Sets the initial state of a record: from `--start`, else from the data, else a default.
///
/// The default is rest, or a deflection if the model has no inputs.
fn set_initial_state(
    args: &Simulate,
    model: &Model,
    record: &mut Record,
    output: &Output,
) -> anyhow::Result<()> {
    let parameters = model.nominals();
    let mut start = record.windows.first().map(|w| w.start.clone()).unwrap_or_default();
    if args.like.is_none() {
        let deflected = if model.inputs.is_empty() { DEFAULT_DEFLECTION } else { 0.0 };
        let shown = vec![vec![deflected]; model.outputs.len()];
        let outputs: Vec<&[f64]> = shown.iter().map(Vec::as_slice).collect();
        let inputs = vec![0.0; model.inputs.len()];
        let first =
            FirstSamples { times: &[0.0], outputs: &outputs, inputs: &inputs, parameters: &parameters };
        start = model.guess_start(&first).into_iter().map(|x| if x.is_finite() { x } else { 0.0 }).collect();
        if args.start.is_empty() {
            let states: Vec<String> =
                model.states.iter().zip(&start).map(|(s, x)| format!("{} = {x}", s.name)).collect();
            output.note(format!("initial state: {}; use --start NAME=VALUE to change it", states.join(", ")));
        }
    }
    for text in &args.start {
        let (name, value) = split_assignment(text, "--start", "theta_rad=0.5")?;
        let Some(state) = model.state(name) else {
            let known = model.states.iter().map(|s| s.name.clone()).collect();
            return Err(Usage::Unknown(UnknownName::OptionState { name: name.to_owned(), known }).into());
        };
        let wrong = || Usage::option("--start", text, Takes::Finite { word: value.to_owned() });
        start[state] = value.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(wrong)?;
    }
    if let Some(window) = record.windows.first_mut() {
        window.start = start;
    }
    Ok(())
}

fn split_assignment<'t>(
    text: &'t str,
    option: &'static str,
    example: &'static str,
) -> Result<(&'t str, &'t str), Usage> {
    let parts = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    parts.ok_or_else(|| Usage::option(option, text, Takes::Assignment { example }))
}
