#![doc = include_str!("../README.md")]

mod args;
mod commands;
mod examples;
mod exit;

use args::Args;
use augsim_data::Limit;
use augsim_tensor::simd::Level;
use augsim_terminal::interrupt;
use augsim_terminal::output::Output;
use augsim_terminal::threads::start_workers;
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = Args::parse();
    let output = Output::new(args.global.json, args.global.quiet, args.global.verbose);
    // Threads are counted first, because the handling of signals needs one.
    let result = start_workers(args.global.threads, &output)
        .and_then(|()| interrupt::install())
        .and_then(|()| interrupt::end_with_parent())
        .and_then(|()| check_instruction_set())
        .and_then(|()| check_limits())
        .and_then(|()| commands::run(&args, &output));
    augsim_session::folders::remove_empty();
    match result {
        Ok(outcome) => outcome.code(),
        Err(error) => exit::report(&error),
    }
}

/// Checks that this machine has the instruction set that the environment asks for.
fn check_instruction_set() -> anyhow::Result<()> {
    Ok(Level::requested().map(drop)?)
}

/// Checks the environment variables `AUGSIM_LIMIT_…` for unknown names and values.
fn check_limits() -> anyhow::Result<()> {
    Ok(Limit::check_environment()?)
}
