//! `augsim evaluate`.

mod compare;
mod model;
mod net;
mod system;

use crate::args::Evaluate;
use crate::exit::Outcome;
use crate::output::Output;
use augsim_session::{Given, written};

/// Runs the subcommand.
pub fn run(args: &Evaluate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    match Given::of(&args.run)? {
        Given::Net => net::run(args, seed, output),
        Given::Model { folder: None, file } if written::is_model(&file) => system::run(args, output),
        Given::Model { folder, file } => model::run(args, &file, folder.as_deref(), seed, output),
    }
}
