//! `augsim simulate --scenario ball`: generates ball drops.

use super::prepare_output;
use crate::args::Simulate;
use augsim_data::{atomic_write, write_dataset};
use augsim_physics::ball::drop_distribution::DropDistribution;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

#[derive(Serialize)]
struct Written {
    data: PathBuf,
    truth: PathBuf,
    trajectories: usize,
    samples: usize,
}

/// Generates ball drops with the random restitution of the paper and writes data and true values.
pub(super) fn run(args: &Simulate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let (out, [truth]) = prepare_output(args.out.as_deref(), "out/ball.csv", ["truth.csv"])?;
    let distribution = DropDistribution { samples: args.samples as usize, ..DropDistribution::default() };
    let (data, drops) = distribution.generate(args.trajectories as usize, seed)?;
    write_dataset(&data, &out)?;
    atomic_write(&truth, |w| {
        writeln!(w, "trajectory,drop_height_m,restitution")?;
        for (i, d) in drops.iter().enumerate() {
            writeln!(w, "{i},{},{}", d.drop_height_m, d.restitution)?;
        }
        Ok(())
    })?;
    let written = Written { data: out, truth, trajectories: drops.len(), samples: args.samples as usize };
    output.result(&written, || {
        format!(
            "{} trajectories of {} samples at 60 Hz: {}\ntrue values: {}",
            written.trajectories,
            written.samples,
            written.data.display(),
            written.truth.display()
        )
    })?;
    Ok(Outcome::Done)
}
