//! Command line of the program: global options and subcommands. Each family of subcommands has its own
//! file.

mod data;
mod forecast;
mod models;
mod next;
mod simulate;
mod start;
mod train;

use crate::commands::export::Export;
use crate::commands::report::ReportArgs;
use crate::examples;
use augsim_reproduce::args::Reproduce;
use augsim_sweep::args::Sweep;
use augsim_terminal::discover_args::Discover;
use clap::{Args as ClapArgs, Parser, Subcommand};
use std::path::PathBuf;

pub use data::{Data, DataAction, Frame};
pub use forecast::{Evaluate, Predict, ProtocolArg, ViewArgs};
pub use models::{Effects, Fit, FormulationArg, FreeArg, FromRobot, ModelAction, ModelArgs};
pub use next::{Listen, Next};
pub use simulate::{PushProtocolArg, Simulate, SimulateScenario};
pub use start::Start;
pub use train::Train;

const LIMITS: &str = "\
Environment:
  AUGSIM_LIMIT_BYTES, _CELLS, _COLUMNS, _TRAJECTORIES, _SAMPLES, _PARAMETERS and others limit the size of files and
  options. An error about a limit names the variable that raises it, for example AUGSIM_LIMIT_CELLS=1e9.";

/// Hybrid simulation: a physics model, the effects it lacks, and a stochastic network for the remaining
/// residual.
#[derive(Debug, Parser)]
#[command(name = "augsim", version, propagate_version = true, arg_required_else_help = true, after_long_help = LIMITS)]
pub struct Args {
    /// Options of every subcommand.
    #[command(flatten)]
    pub global: Global,
    /// The subcommand.
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every subcommand.
#[derive(Debug, ClapArgs)]
pub struct Global {
    /// Random seed. The same seed gives identical results for any number of threads.
    #[arg(long, global = true, default_value_t = 1)]
    pub seed: u64,
    /// Number of worker threads (default: all cores).
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print results as JSON.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print additional notes on standard error.
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Overwrite the results of another run in the output folder. Input files are never overwritten.
    #[arg(long, global = true)]
    pub force: bool,
    /// Do not print notes and progress.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
}

/// Subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Convert raw recordings into a data file and a starting model file for the other commands.
    #[command(after_help = examples::START)]
    Start(Start),
    /// Run a two-minute demonstration: simulate, train, forecast, compare and report.
    #[command(after_help = examples::DEMO)]
    Demo(Demo),
    /// Write a model file to start from.
    #[command(after_help = examples::MODEL)]
    Model(ModelArgs),
    /// Simulate a model file, or generate trajectories of a built-in scenario together with their true
    /// parameter values.
    #[command(after_help = examples::SIMULATE)]
    Simulate(Simulate),
    /// Calibrate the parameters of a model file of equations on measured data.
    #[command(after_help = examples::FIT)]
    Fit(Fit),
    /// List the effects that can be added to a model.
    #[command(after_help = examples::EFFECTS)]
    Effects(Effects),
    /// Find the effects that a model lacks, validate them on held-out data, and write the augmented
    /// model and a report.
    #[command(after_help = examples::DISCOVER)]
    Discover(Discover),
    /// Design the next experiment: inputs that separate the explanations of the data so far, with the odds
    /// that they promise.
    #[command(after_help = examples::NEXT)]
    Next(Next),
    /// Judge new recordings: update the weights of the explanations of a plan, and say whether they are
    /// enough.
    #[command(after_help = examples::LISTEN)]
    Listen(Listen),
    /// Train a network on trajectories and write a run directory.
    #[command(after_help = examples::TRAIN)]
    Train(Train),
    /// Forecast trajectories with a model file, a discovered model or a trained network: mean and
    /// prediction bands.
    #[command(after_help = examples::PREDICT)]
    Predict(Predict),
    /// Write one figure of a discovery report as an SVG file.
    #[command(after_help = examples::REPORT)]
    Report(ReportArgs),
    /// Export a model with its parameter values: LaTeX, a Python module, a step function in C, an FMU, or
    /// the description of its robot; none of them needs augsim.
    #[command(after_help = examples::EXPORT)]
    Export(Export),
    /// Score a model file, a discovery or a trained network on unseen data, next to the simpler models
    /// that it improves on.
    #[command(after_help = examples::EVALUATE)]
    Evaluate(Evaluate),
    /// Reproduce the published result tables.
    #[command(after_help = examples::REPRODUCE)]
    Reproduce(Reproduce),
    /// Run a command with many combinations of settings, on this machine or on a Slurm cluster.
    #[command(after_help = examples::SWEEP)]
    Sweep(Sweep),
    /// Inspect and convert data files.
    #[command(after_help = examples::DATA)]
    Data(Data),
    /// Print a completion script for a shell.
    #[command(after_help = examples::COMPLETIONS)]
    Completions {
        /// Shell that the script is for.
        shell: clap_complete::Shell,
    },
    /// Write the manual pages, one for each command.
    #[command(after_help = examples::MAN)]
    Man {
        /// Folder to write the pages to.
        #[arg(long, default_value = "out/man")]
        out: PathBuf,
    },
    /// Print the command reference as Markdown.
    #[command(hide = true)]
    Reference,
}

/// Options of `demo`.
#[derive(Debug, ClapArgs)]
pub struct Demo {
    /// Folder for the report and the training runs.
    #[arg(long, default_value = "out/demo")]
    pub out: PathBuf,
}
