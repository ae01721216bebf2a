//! `augsim sweep`.

use crate::args::{Args, Command, Global};
use augsim_sweep::args::Sweep;
use augsim_sweep::{Program, Shared};
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use clap::{ArgMatches, CommandFactory, FromArgMatches};

/// Runs `augsim sweep`: plans, runs and collects many commands.
pub fn run(args: &Sweep, global: &Global, output: &Output) -> anyhow::Result<Outcome> {
    let shared = Shared { threads: global.threads, force: global.force };
    let program = Program { parser: Args::command, check };
    augsim_sweep::run(args, shared, program, output)
}

/// Checks the options of a sweep task for errors that its command would report before reading a file.
fn check(parsed: &ArgMatches) -> Result<(), Usage> {
    match Args::from_arg_matches(parsed).map(|args| args.command) {
        Ok(Command::Train(train)) => train.corrected().map(drop),
        _ => Ok(()),
    }
}
