//! Options of the commands on model files: `model`, `fit`, `effects`.

use augsim_terminal::discover_args::{Accept, TimeColumn};
use clap::builder::PossibleValuesParser;
use clap::{Args as ClapArgs, Subcommand};
use std::path::PathBuf;

/// Options of `model`.
#[derive(Debug, ClapArgs)]
pub struct ModelArgs {
    /// Action on model files.
    #[command(subcommand)]
    pub action: ModelAction,
}

/// Actions of `augsim model`.
#[derive(Debug, Subcommand)]
pub enum ModelAction {
    /// Write a commented model file that can be simulated as it is.
    New {
        /// Name of the system.
        #[arg(value_parser = templates())]
        name: String,
        /// File to write (default: `NAME.toml`).
        #[arg(long)]
        out: Option<PathBuf>,
    },
}

/// Argument parser that accepts the names of all template models.
fn templates() -> PossibleValuesParser {
    let built_in = augsim_physics::model::TEMPLATES.map(|(name, _)| name);
    PossibleValuesParser::new(built_in.into_iter().chain(augsim_equations::EXAMPLES.map(|(name, _)| name)))
}

/// Options of `fit`.
#[derive(Debug, ClapArgs)]
pub struct Fit {
    /// Model file (TOML) with `scenario = "system"`.
    pub model: PathBuf,
    /// Measured trajectories with the inputs and outputs of the model: files in any layout that `start`
    /// reads, or folders with one file per recording.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
    /// Time column of the data.
    #[command(flatten)]
    pub time: TimeColumn,
    /// Data checks to ignore because the user knows that the data are right.
    #[command(flatten)]
    pub accept: Accept,
    /// Output folder for the calibrated `model.toml` and `result.json`.
    #[arg(long, default_value = "out/fit")]
    pub out: PathBuf,
    /// End after this time in seconds with the best values so far: half of it is for the fit, the rest for
    /// the estimate of the noise.
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
}

/// Options of `effects`.
#[derive(Debug, ClapArgs)]
pub struct Effects {
    /// Name of a library (`ball`, `push`) or of an effect, such as `quadratic-drag` (default: all
    /// effects).
    pub kind: Option<String>,
    /// Model file (TOML) of a ball, of pushing or of equations. Only effects that can be added to this
    /// model are listed.
    #[arg(long = "for", value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Measured trajectories. They are used to show typical parameter values in the units of a model of
    /// equations.
    #[arg(long, requires = "model")]
    pub data: Option<PathBuf>,
}
