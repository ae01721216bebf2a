//! `augsim data inspect`.

use crate::args::{Data, DataAction};
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use augsim_data::convert::CONVERTERS;
use augsim_data::{MissingCells, Summary, atomic_write, read_dataset, write_csv};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Written {
    data: PathBuf,
    model: PathBuf,
    trajectories: usize,
}

/// Runs the subcommand.
pub fn run(args: &Data, output: &Output) -> anyhow::Result<Outcome> {
    match &args.action {
        DataAction::Inspect { file } => {
            let summary = Summary::of(&read_dataset(file, MissingCells::AsGap)?);
            output.result(&summary, || summary.to_string())?;
        }
        DataAction::Convert { folder, out } => {
            let written = convert(folder, out)?;
            output.result(&written, || {
                format!(
                    "{} trajectories: {}\nmodel to begin with: {}\nnext: augsim discover {} {}",
                    written.trajectories,
                    written.data.display(),
                    written.model.display(),
                    written.model.display(),
                    written.data.display()
                )
            })?;
        }
    }
    Ok(Outcome::Done)
}

fn convert(folder: &Path, out: &Path) -> anyhow::Result<Written> {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let Some((_, converter)) = CONVERTERS.iter().find(|(known, _)| *known == name) else {
        let known: Vec<&str> = CONVERTERS.iter().map(|(name, _)| *name).collect();
        let text = format!(
            "{}: no converter for a folder of this name; known are {}",
            folder.display(),
            known.join(", ")
        );
        return Err(Usage(text).into());
    };
    let converted = converter(folder)?;
    std::fs::create_dir_all(out)?;
    let written = Written {
        data: out.join("data.csv"),
        model: out.join("model.toml"),
        trajectories: converted.data.trajectories().len(),
    };
    write_csv(&converted.data, &written.data)?;
    atomic_write(&written.model, |w| w.write_all(converted.model_toml.as_bytes()))?;
    Ok(written)
}
