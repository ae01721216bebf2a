//! `augsim predict`: forecasts trajectories with a model file, a discovery or a network.

mod filtered;
mod model;
mod net;

use crate::args::Predict;
use augsim_session::ModelOrRun;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;

/// Runs `augsim predict`: forecasts trajectories with a model file, a discovery or a network.
pub fn run(args: &Predict, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(seen) = &args.seen {
        return filtered::run(args, seen.parse()?, seed, output);
    }
    match ModelOrRun::from_path(&args.run)? {
        ModelOrRun::Net => net::run(args, seed, output),
        ModelOrRun::Model { file, .. } => model::run(args, &file, seed, output),
    }
}
