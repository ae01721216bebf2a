//! `augsim predict`.

mod filtered;
mod model;
mod net;

use crate::args::Predict;
use crate::exit::Outcome;
use crate::output::Output;
use augsim_session::Given;

/// Runs the subcommand.
pub fn run(args: &Predict, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(seen) = &args.seen {
        return filtered::run(args, seen.parse()?, seed, output);
    }
    match Given::of(&args.run)? {
        Given::Net => net::run(args, seed, output),
        Given::Model { file, .. } => model::run(args, &file, seed, output),
    }
}
