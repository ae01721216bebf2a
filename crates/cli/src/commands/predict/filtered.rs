//! `augsim predict --seen`: forecasts each trajectory from its measured prefix.

use crate::args::{Predict, ViewArgs};
use augsim_data::{Dataset, write_dataset};
use augsim_session::filtered::{
    ObservedColumns, PARTICLES, PrefixLength, bands, net_on_prefix, system_on_prefix,
};
use augsim_session::run_dir::{FILES, RunDir};
use augsim_session::{ModelOrRun, Subject};
use augsim_terminal::Outcome;
use augsim_terminal::destination::data_file;
use augsim_terminal::output::Output;
use augsim_trainer::filter::FilterSettings;
use serde::Serialize;
use std::path::PathBuf;

/// Default number of random draws of each trajectory's forecast.
const DRAWS: u32 = 100;

#[derive(Serialize)]
struct Written {
    forecast: PathBuf,
    /// Name of the protocol, always `filtered`.
    protocol: &'static str,
    /// Length of the measured prefix, as given on the command line.
    seen: String,
    trajectories: usize,
    samples: u32,
}

impl ViewArgs {
    /// Converts the command-line options on observed columns and sensor noise to the library's type.
    pub fn view(&self) -> ObservedColumns {
        ObservedColumns { columns: self.seen_columns.clone(), sensor_sd: self.sensor_sd.clone() }
    }
}

/// Forecasts each trajectory from its first rows (the prefix `seen`) and writes the prediction bands.
pub(super) fn run(args: &Predict, seen: PrefixLength, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let (from, view) = (args.measured(), args.view.view());
    let samples = args.samples.unwrap_or(DRAWS);
    let settings =
        FilterSettings { particles: PARTICLES, samples: samples as usize, seed, is_measured: true };
    let all: Dataset = match ModelOrRun::from_path(&args.run)? {
        ModelOrRun::Net => {
            let run = RunDir::open(&args.run);
            let trained = FILES.map(|name| run.file(name));
            let inputs = args.inputs(trained.iter().map(PathBuf::as_path));
            data_file(&args.out, &[], &inputs)?;
            let net = net_on_prefix(&run, &from, &view)?;
            bands(&net.model, &net.data, (&net.sensor, &net.start), seen, settings)?
        }
        ModelOrRun::Model { file, .. } => {
            data_file(&args.out, &[], &args.inputs([file.as_path()]))?;
            let system = system_on_prefix(&Subject::read(&file)?, &from, &view, None)?;
            bands(&system.filter, &system.data, (&system.sensor, &system.start), seen, settings)?
        }
    };
    write_dataset(&all, &args.out)?;
    let written = Written {
        forecast: args.out.clone(),
        protocol: "filtered",
        seen: seen.to_string(),
        trajectories: all.trajectories().len(),
        samples,
    };
    output.result(&written, || {
        let noun = if let PrefixLength::Rows(1) = seen { "sample" } else { "samples" };
        let prefix =
            if let PrefixLength::Rows(_) = seen { format!("{seen} {noun}") } else { seen.to_string() };
        format!(
            "{} forecasts from the first {prefix} of each trajectory, {samples} draws each: {}",
            written.trajectories,
            written.forecast.display()
        )
    })?;
    Ok(Outcome::Done)
}
