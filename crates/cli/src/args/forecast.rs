//! Options of `predict` and `evaluate`.

use augsim_session::DataFrom;
use augsim_terminal::discover_args::TimeColumn;
use clap::{Args as ClapArgs, ValueEnum};
use std::path::{Path, PathBuf};

/// Options of `predict`.
#[derive(Debug, ClapArgs)]
pub struct Predict {
    /// Model file (TOML), output folder of `discover`, or run directory of `train`.
    #[arg(value_name = "MODEL|RUN")]
    pub run: PathBuf,
    /// Trajectories to forecast. Only the beginning of each trajectory is used: the first state by a
    /// network, the samples before the first impact by a ball model, the first pose and the pusher
    /// motion by a push model, the first samples and the inputs by a model of equations. Several files, or
    /// folders with one file per recording, are one set.
    #[arg(long, value_name = "DATA", required = true, num_args = 1..)]
    pub data: Vec<PathBuf>,
    /// Time column of the data.
    #[command(flatten)]
    pub time: TimeColumn,
    /// Number of random draws per trajectory (default: 100 for a network, 400 for a model).
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..))]
    pub samples: Option<u32>,
    /// For models of equations: number of first samples that the initial state is estimated from.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub burn_in: u32,
    /// Length of the measured prefix: a number of samples or a time, such as 65 or 0.5s. The remaining
    /// rows are forecast without using any later data; quantities that differ between trajectories are
    /// estimated from the prefix.
    #[arg(long, value_name = "N|SECONDS")]
    pub seen: Option<String>,
    /// How the measured prefix is observed.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Output file (`.csv`, `.csv.gz` or `.npz`): mean, median and the 50 % and 90 % prediction bands of
    /// each column.
    #[arg(long, default_value = "out/forecast.csv")]
    pub out: PathBuf,
}

/// How the measured prefix of `--seen` is observed.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct ViewArgs {
    /// With `--seen`: columns that are measured (default: all).
    #[arg(long, value_name = "COLUMN", value_delimiter = ',', requires = "seen")]
    pub seen_columns: Vec<String>,
    /// With `--seen`: standard deviation of the measurement noise in the unit of the column: one number
    /// for all measured columns, or `COLUMN=NUMBER` for each. Without it a network takes the rows as
    /// exact, and a model file uses its declared noise or an estimate from the data.
    #[arg(long, value_name = "SD", value_delimiter = ',', requires = "seen")]
    pub sensor_sd: Vec<String>,
}

/// Part of a trajectory that a scored model may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProtocolArg {
    /// The model uses only the first state
    Forecast,
    /// The encoder uses the whole trajectory, so this is no forecast
    Reconstruction,
    /// The model uses the first rows (`--seen`) and forecasts the others
    Filtered,
}

/// Options of `evaluate`.
#[derive(Debug, ClapArgs)]
pub struct Evaluate {
    /// Model file (TOML), output folder of `discover`, or run directory of `train`. Two of them are compared
    /// side by side.
    #[arg(value_name = "MODEL|RUN", required = true, num_args = 1..=2)]
    pub run: Vec<PathBuf>,
    /// Trajectories that were not used for fitting. If you give the output folder of a discovery and its
    /// own data, only the held-out trajectories are scored, or all, with a note, if none were held out (a
    /// discovery holds some out of 20 or more). Several files, or folders with one file per recording, are
    /// one set.
    #[arg(long, value_name = "DATA", required = true, num_args = 1..)]
    pub data: Vec<PathBuf>,
    /// Time column of the data.
    #[command(flatten)]
    pub time: TimeColumn,
    /// For models of equations: number of first samples that the initial state is estimated from. Errors
    /// are those of the free run over all later samples.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub burn_in: u32,
    /// Part of each trajectory that the model may use.
    #[arg(long, value_enum, default_value = "forecast")]
    pub protocol: ProtocolArg,
    /// With `--protocol filtered`: lengths of the measured prefix in increasing order, each a number of
    /// samples or a time, such as 30,65 or 0.5s.
    #[arg(long, value_name = "N|SECONDS", value_delimiter = ',', required_if_eq("protocol", "filtered"))]
    pub seen: Vec<String>,
    /// With `--protocol filtered`: how the measured prefix is observed.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Exit with code 1 unless the error of the height, or of the position of a pushed object, is below
    /// this value in m (mean over 10 samples).
    #[arg(long)]
    pub require_pos_m: Option<f64>,
}

impl Predict {
    /// Source of the measured data: files and the time column that the user names.
    pub fn measured(&self) -> DataFrom {
        self.time.of_all(&self.data)
    }

    /// Paths that the output must not overwrite: `others` and those of the data.
    pub fn inputs<'a>(&'a self, others: impl IntoIterator<Item = &'a Path>) -> Vec<&'a Path> {
        others.into_iter().chain(self.data.iter().map(PathBuf::as_path)).collect()
    }
}

impl Evaluate {
    /// Source of the measured data: files and the time column that the user names.
    pub fn measured(&self) -> DataFrom {
        self.time.of_all(&self.data)
    }

    /// Path of the model that is scored, or of the first one of two.
    pub fn model(&self) -> &Path {
        self.run.first().map_or(Path::new(""), PathBuf::as_path)
    }
}
