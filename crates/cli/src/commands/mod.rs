//! One file per subcommand.

mod completions;
mod data;
mod demo;
pub mod discover;
mod effects;
mod evaluate;
pub mod export;
mod fit;
mod from_robot;
mod inspect;
mod inspect_system;
mod model;
mod next;
mod own_data;
mod predict;
mod reference;
pub mod report;
mod simulate;
mod start;
mod sweep;
mod train;

use crate::args::{Args, Command, Global};
use augsim_equations::Model;
use augsim_session::DataFrom;
use augsim_session::equations::records;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use std::fmt::Display;

/// The number of trajectories in words: `1 trajectory`, `2 trajectories`.
fn count_trajectories(count: usize) -> String {
    format!("{count} {}", if count == 1 { "trajectory" } else { "trajectories" })
}

/// Prints the assumptions about time column and units of data; nothing where the file states them all.
fn note_conversions(data: impl Display, conversions: &[String], output: &Output) {
    if !conversions.is_empty() {
        output.note(format!("{data}: {}", conversions.join("; ")));
    }
}

/// Prints the assumptions about time column and units with which a model of equations reads the data.
fn note_reading(from: &DataFrom, model: &Model, output: &Output) -> anyhow::Result<()> {
    note_conversions(from, &records::reading(from, model)?, output);
    Ok(())
}

/// Runs the subcommand that the parsed command line names.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Outcome> {
    let Global { seed, force, .. } = args.global;
    match &args.command {
        Command::Start(a) => start::run(a, force, output),
        Command::Completions { shell } => completions::completions(*shell),
        Command::Man { out } => completions::man(out, output),
        Command::Demo(a) => demo::run(a, seed, force, output),
        Command::Model(a) => model::run(a, force, output),
        Command::Fit(a) => fit::run(a, force, output),
        Command::Effects(a) => effects::run(a, output),
        Command::Simulate(a) => simulate::run(a, seed, force, output),
        Command::Discover(a) => discover::run(a, seed, force, output),
        Command::Next(a) => next::next(a, seed, force, output),
        Command::Listen(a) => next::hear(a, force, output),
        Command::Train(a) => train::run(a, seed, force, output),
        Command::Predict(a) => predict::run(a, seed, output),
        Command::Export(a) => export::run(a, output),
        Command::Report(a) => report::run(a, output),
        Command::Evaluate(a) => evaluate::run(a, seed, output),
        Command::Reproduce(a) => augsim_reproduce::run(a, seed, force, output),
        Command::Sweep(a) => sweep::run(a, &args.global, output),
        Command::Data(a) => data::run(a, force, output),
        Command::Reference => reference::run(output),
    }
}
