//! Arguments of the program: options of all commands, and the commands; one file for the options of each family of them.

mod data;
mod forecast;
mod models;
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
pub use models::{Effects, Fit, ModelAction, ModelArgs};
pub use simulate::{PushProtocolArg, Simulate, SimulateScenario};
pub use start::Start;
pub use train::Train;

const LIMITS: &str = "\
Environment:
  AUGSIM_LIMIT_BYTES, _CELLS, _COLUMNS, _TRAJECTORIES, _SAMPLES, _PARAMETERS and others bound what a file or an option
  may ask of the machine; the message that refuses something names its variable, such as AUGSIM_LIMIT_CELLS=1e9.";

/// Hybrid simulation: an analytical model, the effect it lacks, and a stochastic net for what remains.
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
    /// Seed of every random draw; the same seed gives the same bytes, whatever the threads.
    #[arg(long, global = true, default_value_t = 1)]
    pub seed: u64,
    /// Worker threads (default: all cores).
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print results as JSON for programs.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print more on standard error.
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Replace what another run left in `--out`; an input is never replaced.
    #[arg(long, global = true)]
    pub force: bool,
    /// Print no notes and no progress.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
}

/// Subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Read recordings as they are, and write the data file and the model file that the other commands begin with.
    #[command(after_help = examples::START)]
    Start(Start),
    /// See the whole of it in two minutes: simulate, train, forecast, compare, report.
    #[command(after_help = examples::DEMO)]
    Demo(Demo),
    /// Write model files to start from.
    #[command(after_help = examples::MODEL)]
    Model(ModelArgs),
    /// Generate trajectories of a known law, with a truth record beside them, or of a model file of equations.
    #[command(after_help = examples::SIMULATE)]
    Simulate(Simulate),
    /// Calibrate the declared parameters of a model file of equations.
    #[command(after_help = examples::FIT)]
    Fit(Fit),
    /// List the effects that may be tried on a model.
    #[command(after_help = examples::EFFECTS)]
    Effects(Effects),
    /// Close the loop: what the model lacks, established over blocks of the data, or an honest no.
    #[command(after_help = examples::DISCOVER)]
    Discover(Discover),
    /// Train a net on trajectories; a run directory is the result.
    #[command(after_help = examples::TRAIN)]
    Train(Train),
    /// Forecast trajectories with a model file, the model of a discovery or a trained net: mean and bands.
    #[command(after_help = examples::PREDICT)]
    Predict(Predict),
    /// Write a figure of the report of a discovery as SVG.
    #[command(after_help = examples::REPORT)]
    Report(ReportArgs),
    /// Write the law of a model with its values: formulas, or a program that runs without augsim.
    #[command(after_help = examples::EXPORT)]
    Export(Export),
    /// Score a model file, a discovery or a trained net on data that it has not seen, the models before it beside it.
    #[command(after_help = examples::EVALUATE)]
    Evaluate(Evaluate),
    /// Reproduce the published tables.
    #[command(after_help = examples::REPRODUCE)]
    Reproduce(Reproduce),
    /// Many runs of a command with other settings, here or on a cluster with Slurm.
    #[command(after_help = examples::SWEEP)]
    Sweep(Sweep),
    /// Look at data files.
    #[command(after_help = examples::DATA)]
    Data(Data),
    /// Write what a shell completes on the tab key, to standard output.
    #[command(after_help = examples::COMPLETIONS)]
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// Write manual pages, one a command.
    #[command(after_help = examples::MAN)]
    Man {
        /// Folder for the pages.
        #[arg(long, default_value = "out/man")]
        out: PathBuf,
    },
    /// Print this reference as a page in Markdown.
    #[command(hide = true)]
    Reference,
}

/// Options of `demo`.
#[derive(Debug, ClapArgs)]
pub struct Demo {
    /// Directory for the report and the runs.
    #[arg(long, default_value = "out/demo")]
    pub out: PathBuf,
}
