//! Options of the commands on experiments: `next`, `listen`.

use augsim_terminal::discover_args::TimeColumn;
use clap::Args as ClapArgs;
use std::path::PathBuf;

/// Options of `next`.
#[derive(Debug, ClapArgs)]
pub struct Next {
    /// Explanations of the data so far: folders of `discover`, `fit`, `next` or `listen`, and fitted model files. A
    /// discovery has the named model and its live rivals.
    #[arg(required = true)]
    pub explanations: Vec<PathBuf>,
    /// Recordings so far, whose ranges are the limits by default. Without them, those of the discovery or fit.
    #[arg(long)]
    pub data: Vec<PathBuf>,
    /// File of limits (TOML): ranges and rates of inputs, energy, ranges of outputs and states, start values,
    /// duration, sampling.
    #[arg(long)]
    pub limits: Option<PathBuf>,
    /// Maximum number of runs.
    #[arg(long, default_value_t = 4, value_name = "RUNS", value_parser = clap::value_parser!(u16).range(1..=50))]
    pub budget: u16,
    /// Odds for one explanation against each other one that are enough.
    #[arg(long, default_value_t = 1000.0, value_parser = odds)]
    pub odds: f64,
    /// Number of simulated sequences of runs, for each explanation, from which the promise is computed.
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(20..=100_000))]
    pub sequences: u32,
    /// Output folder for `plan.json`, `report.html` and a CSV file with the inputs of each run.
    #[arg(long, default_value = "out/next")]
    pub out: PathBuf,
    /// Time column of the data.
    #[command(flatten)]
    pub time: TimeColumn,
}

/// Options of `listen`.
#[derive(Debug, ClapArgs)]
pub struct Listen {
    /// Folder of `next`, or of an earlier `listen`.
    pub plan: PathBuf,
    /// New recordings, in the order in which they were made.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
    /// Output folder for `plan.json` with the updated weights, and `report.html`.
    #[arg(long, default_value = "out/listen")]
    pub out: PathBuf,
    /// Time column of the data.
    #[command(flatten)]
    pub time: TimeColumn,
}

/// Parses odds, a number above 1.
fn odds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(odds) if odds > 1.0 && odds.is_finite() => Ok(odds),
        _ => Err("odds are a number above 1, such as 1000".to_owned()),
    }
}
