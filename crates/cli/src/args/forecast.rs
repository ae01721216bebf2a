//! Options of `predict` and `evaluate`.

use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Options of `predict`.
#[derive(Debug, ClapArgs)]
pub struct Predict {
    /// Model file (TOML), folder of `discover`, or run directory of `train`.
    #[arg(value_name = "MODEL|RUN")]
    pub run: PathBuf,
    /// Trajectories to forecast. Of each only the beginning is used: by a net the first state, by a model of a ball the part
    /// before the first impact, by one of pushes the first pose and the rod, by equations the first samples and the inputs.
    #[arg(long)]
    pub data: PathBuf,
    /// Draws per trajectory (default: 100 of a net, 400 of a model).
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..))]
    pub samples: Option<u32>,
    /// With equations: samples, from the first of each trajectory, that its start is fitted to.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub burn_in: u32,
    /// See the first rows of each trajectory and forecast the rest: a number of samples, or seconds, such as 65 or 0.5s.
    /// Nothing later is used; what differs from trajectory to trajectory is inferred from these rows.
    #[arg(long, value_name = "N|SECONDS")]
    pub seen: Option<String>,
    /// With `--seen`: how the rows are seen.
    #[command(flatten)]
    pub view: ViewArgs,
    /// File to write (`.csv`, `.csv.gz` or `.npz`): mean, median and the 50 and 90 % bands of every column.
    #[arg(long, default_value = "out/forecast.csv")]
    pub out: PathBuf,
}

/// How the rows of `--seen` are seen.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct ViewArgs {
    /// With `--seen`: columns that are seen (default: all).
    #[arg(long, value_name = "COLUMN", value_delimiter = ',', requires = "seen")]
    pub seen_columns: Vec<String>,
    /// With `--seen`: standard deviation of the sensor, in the unit of the column: one number for all columns that are seen, or
    /// `COLUMN=NUMBER` each. Without it a net takes the rows as exact, and a model file the deviation that it declares or the
    /// one that the rows show.
    #[arg(long, value_name = "SD", value_delimiter = ',', requires = "seen")]
    pub sensor_sd: Vec<String>,
}

/// Samples of a trajectory that a scored model may see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProtocolArg {
    /// The first state only.
    Forecast,
    /// The encoder sees the whole trajectory: not a prediction.
    Reconstruction,
    /// The first rows (`--seen`); the rest is forecast.
    Filtered,
}

/// Options of `evaluate`.
#[derive(Debug, ClapArgs)]
pub struct Evaluate {
    /// Model file (TOML), folder of `discover`, or run directory of `train`.
    #[arg(value_name = "MODEL|RUN")]
    pub run: PathBuf,
    /// Trajectories that no fit has seen. With the folder of a discovery and its own data: those that it kept out, all where it kept none.
    #[arg(long)]
    pub data: PathBuf,
    /// With equations: samples, from the first of each trajectory, that its start is fitted to; errors are those of the
    /// free run over all later ones.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub burn_in: u32,
    /// Samples of a trajectory that the model may see.
    #[arg(long, value_enum, default_value = "forecast")]
    pub protocol: ProtocolArg,
    /// With `--protocol filtered`: prefixes from short to long, each a number of samples, or seconds, such as 30,65 or 0.5s.
    #[arg(long, value_name = "N|SECONDS", value_delimiter = ',', required_if_eq("protocol", "filtered"))]
    pub seen: Vec<String>,
    /// With `--protocol filtered`: how the rows are seen.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Exit with code 1 unless the error of the height, or of the position of a pushed object, is below this, in m (mean of
    /// 10 samples).
    #[arg(long)]
    pub require_pos_m: Option<f64>,
}
