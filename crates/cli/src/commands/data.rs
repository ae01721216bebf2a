//! `augsim data inspect` and `augsim data convert`.

use super::inspect::inspect;
use crate::args::{Data, DataAction, Frame};
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use augsim_data::convert::{CONVERTERS, Converter};
use augsim_data::push::{in_start_frame, resample};
use augsim_data::{atomic_write, write_dataset};
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

/// What to convert and where to.
struct Conversion<'a> {
    converter: Converter,
    input: &'a Path,
    data: PathBuf,
    model: PathBuf,
}

/// Runs the subcommand.
pub fn run(args: &Data, output: &Output) -> anyhow::Result<Outcome> {
    match &args.action {
        DataAction::Inspect { file, model } => {
            let inspection = inspect(file, model.as_deref())?;
            output.result(&inspection, || inspection.to_string())?;
        }
        DataAction::Convert { set, input, file, out, rate_hz, frame } => {
            let conversion = match (input, file) {
                (Some(input), Some(file)) => {
                    Conversion { converter: converter(set)?, input, data: file.clone(), model: beside(file) }
                }
                _ => Conversion {
                    converter: converter(Path::new(set.file_name().unwrap_or_default()))?,
                    input: set,
                    data: out.join("data.csv"),
                    model: out.join("model.toml"),
                },
            };
            let written = convert(conversion, *rate_hz, *frame)?;
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
            format!("{head}\nmodel to begin with: {model}\nnext: {next}")
        }
        None => format!("{head}\nnext: augsim data inspect {data}"),
    }
}

fn converter(set: &Path) -> anyhow::Result<Converter> {
    let name = set.to_string_lossy();
    let found = CONVERTERS.iter().find(|(known, _)| *known == name);
    found.map(|(_, converter)| *converter).ok_or_else(|| {
        let known: Vec<&str> = CONVERTERS.iter().map(|(name, _)| *name).collect();
        let known = known.join(", ");
        Usage(format!(
            "no converter is called `{name}`; known are {known}: augsim data convert SET IN OUT.csv"
        ))
        .into()
    })
}

/// `runs.csv.gz` to `runs.model.toml`.
fn beside(file: &Path) -> PathBuf {
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let stem = [".csv", ".csv.gz", ".npz"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name);
    file.with_file_name(format!("{stem}.model.toml"))
}

fn convert(conversion: Conversion<'_>, rate_hz: Option<f64>, frame: Frame) -> anyhow::Result<Written> {
    let Conversion { converter, input, data, model } = conversion;
    let converted = converter(input)?;
    let mut set = converted.data;
    if let Some(rate_hz) = rate_hz {
        set = resample(&set, rate_hz)?;
    }
    if frame == Frame::Start {
        set = in_start_frame(&set)?;
    }
    if let Some(folder) = data.parent() {
        std::fs::create_dir_all(folder)?;
    }
    write_dataset(&set, &data)?;
    let model = match converted.model_toml {
        Some(text) => {
            atomic_write(&model, |w| w.write_all(text.as_bytes()))?;
            Some(model)
        }
        None => None,
    };
    let samples = set.trajectories().iter().map(|t| t.len()).sum();
    let pushes = set.has_column("pusher_x_m");
    Ok(Written { data, model, trajectories: set.trajectories().len(), samples, pushes })
}
