//! `augsim simulate`.

use crate::args::Simulate;
use crate::exit::Outcome;
use crate::output::Output;
use augsim_data::{atomic_write, write_csv};
use augsim_physics::ball::paper_law::PaperLaw;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Written {
    data: PathBuf,
    truth: PathBuf,
    trajectories: usize,
    samples: usize,
}

/// Runs the subcommand.
pub fn run(args: &Simulate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let law = PaperLaw { samples: args.samples as usize, ..PaperLaw::default() };
    let (data, drops) = law.generate(args.trajectories as usize, seed)?;
    if let Some(folder) = args.out.parent() {
        std::fs::create_dir_all(folder)?;
    }
    write_csv(&data, &args.out)?;
    let truth = truth_path(&args.out);
    atomic_write(&truth, |w| {
        writeln!(w, "trajectory,drop_height_m,restitution")?;
        for (i, d) in drops.iter().enumerate() {
            writeln!(w, "{i},{},{}", d.drop_height_m, d.restitution)?;
        }
        Ok(())
    })?;
    let written =
        Written { data: args.out.clone(), truth, trajectories: drops.len(), samples: args.samples as usize };
    output.result(&written, || {
        format!(
            "{} trajectories of {} samples at 60 Hz: {}\nwhat was drawn: {}",
            written.trajectories,
            written.samples,
            written.data.display(),
            written.truth.display()
        )
    })?;
    Ok(Outcome::Done)
}

/// `ball.csv.gz` to `ball.truth.csv`.
fn truth_path(out: &Path) -> PathBuf {
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.trim_end_matches(".gz").trim_end_matches(".csv");
    out.with_file_name(format!("{stem}.truth.csv"))
}
