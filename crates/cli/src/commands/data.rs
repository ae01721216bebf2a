//! `augsim data`: inspects data files and converts published data sets.

use super::inspect::inspect;
use super::inspect_system;
use crate::args::{Data, DataAction, Frame};
use augsim_data::convert::{CONVERTERS, Converted, Converter};
use augsim_data::push::{in_start_frame, resample};
use augsim_data::{FrameClock, atomic_write, write_dataset};
use augsim_session::usage::{Inapplicable, UnknownName};
use augsim_terminal::destination::{Results, check_model, data_file};
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Written {
    data: PathBuf,
    model: Option<PathBuf>,
    trajectories: usize,
    samples: usize,
    pushes: bool,
}

/// Options of `data convert` for other sample times: a constant rate, Hz, or the frame clock of a camera.
#[derive(Clone, Copy)]
struct Clock {
    rate_hz: Option<f64>,
    frames: bool,
}

/// Conversion of a published data set: the converter, the path that it reads, and the files that it writes.
struct Conversion<'a> {
    converter: Converter,
    input: &'a Path,
    data: PathBuf,
    model: PathBuf,
}

/// Runs `augsim data`: inspects a data file or converts a published data set.
pub fn run(args: &Data, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    match &args.action {
        DataAction::Inspect { file, model, time } => {
            let data = time.of(file);
            if let Some(model) = inspect_system::applies(model.as_deref()) {
                let inspection = inspect_system::inspect(&data, model, output)?;
                output.result(&inspection, || inspection.to_string())?;
            } else {
                let inspection = inspect(&data, model.as_deref(), output)?;
                output.result(&inspection, || inspection.to_string())?;
            }
        }
        DataAction::Convert { set, input, file, out, rate_hz, frame_clock, frame } => {
            let clock = Clock { rate_hz: *rate_hz, frames: *frame_clock };
            let written = match (input, file) {
                (Some(input), Some(file)) => {
                    let (data, model) = (file.clone(), model_path(file));
                    let conversion = Conversion { converter: converter(set)?, input, data, model };
                    data_file(file, std::slice::from_ref(&conversion.model), &[input])?;
                    let converted = conversion.run(clock, *frame)?;
                    if let Some(text) = &converted.model_toml {
                        check_model(&conversion.model, text, force)?;
                    }
                    conversion.write(converted)?
                }
                _ => {
                    let [data, model] = ["data.csv", "model.toml"].map(|name| out.join(name));
                    let name = set.file_name().unwrap_or_default();
                    let converter = converter(Path::new(name))?;
                    let record = Record::new("data convert")
                        .setting("set", name.display())
                        .setting("rate-hz", rate_hz.map_or("as recorded".to_owned(), |r| r.to_string()))
                        .setting("frame-clock", frame_clock)
                        .setting("frame", format!("{frame:?}").to_lowercase())
                        .input("data", set);
                    let (files, inputs) = (&["data.csv", "model.toml"], &[set.as_path()]);
                    let claim = Results { folder: out, files, inputs, record, force }.claim()?;
                    let conversion = Conversion { converter, input: set, data, model };
                    let converted = conversion.run(clock, *frame)?;
                    claim.begin()?;
                    conversion.write(converted)?
                }
            };
            output.result(&written, || text(&written))?;
        }
    }
    Ok(Outcome::Done)
}

fn text(written: &Written) -> String {
    let data = written.data.display();
    let head = format!("{} trajectories, {} samples: {data}", written.trajectories, written.samples);
    match &written.model {
        Some(model) => {
            let model = model.display();
            let next = match written.pushes {
                true => format!("augsim data inspect {data}"),
                false => format!("augsim discover {model} {data}"),
            };
            format!("{head}\nstarting model: {model}\nnext: {next}")
        }
        None => format!("{head}\nnext: augsim data inspect {data}"),
    }
}

fn converter(set: &Path) -> anyhow::Result<Converter> {
    let name = set.to_string_lossy();
    let found = CONVERTERS.iter().find(|(known, _)| *known == name);
    found.map(|(_, converter)| *converter).ok_or_else(|| {
        let known = CONVERTERS.iter().map(|(name, _)| *name).collect();
        Usage::Unknown(UnknownName::Converter { name: name.into_owned(), known }).into()
    })
}

/// Returns the path of the model file: `runs.model.toml` for `runs.csv.gz`.
fn model_path(file: &Path) -> PathBuf {
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let stem = [".csv", ".csv.gz", ".npz"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name);
    file.with_file_name(format!("{stem}.model.toml"))
}

impl Conversion<'_> {
    /// Reads and converts the data set, with the requested sample times and coordinate frame.
    fn run(&self, clock: Clock, frame: Frame) -> anyhow::Result<Converted> {
        let mut converted = (self.converter)(self.input)?;
        let rate_hz = clock.rate_hz;
        if clock.frames {
            let found = FrameClock::estimate(&converted.data).ok_or_else(|| {
                let input = self.input.display().to_string();
                Usage::Inapplicable(Inapplicable::NoFrames { input })
            })?;
            converted.data = found.apply_to(&converted.data)?;
        }
        if let Some(rate_hz) = rate_hz {
            converted.data = resample(&converted.data, rate_hz)?;
        }
        if frame == Frame::Start {
            converted.data = in_start_frame(&converted.data)?;
        }
        Ok(converted)
    }

    /// Writes the converted data file and, if there is one, the model file.
    fn write(self, converted: Converted) -> anyhow::Result<Written> {
        let Converted { data: set, model_toml } = converted;
        write_dataset(&set, &self.data)?;
        let model = match model_toml {
            Some(text) => {
                atomic_write(&self.model, |w| w.write_all(text.as_bytes()))?;
                Some(self.model)
            }
            None => None,
        };
        let samples = set.trajectories().iter().map(|t| t.len()).sum();
        let pushes = set.has_column("pusher_x_m");
        Ok(Written { data: self.data, model, trajectories: set.trajectories().len(), samples, pushes })
    }
}
