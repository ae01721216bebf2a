//! Options of `discover`.

use augsim_data::checks::Check;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Options of `discover`.
#[derive(Debug, ClapArgs)]
pub struct Discover {
    /// Model file (TOML) of the declared physics.
    pub model: PathBuf,
    /// Measured trajectories: a CSV file, plain or gzip, or a folder with one file per recording.
    pub data: PathBuf,
    /// Output folder for `result.json`, `report.html` and the augmented `model.toml`.
    #[arg(long, default_value = "out/discover")]
    pub out: PathBuf,
    /// Number of simulated recordings without a missing effect on which the selection is repeated. The
    /// result reports how many of them lead to a false discovery. At most 1000; 0 skips this test.
    #[arg(long, default_value_t = 19, value_name = "N")]
    pub null_runs: usize,
    /// Use only trajectories of this group (column `group`). Can be given several times.
    #[arg(long)]
    pub group: Vec<String>,
    /// Candidate effects: those of the library and then formulas, or formulas only (models of
    /// equations).
    #[arg(long, value_enum, default_value_t = Library::Generic)]
    pub library: Library,
    /// End after this time in seconds with the best model so far: half of it is for fits and search, the
    /// rest for judging the findings. A search that was cut short, or effects that were not tested yet, are
    /// stated in the result; the test on null recordings is then left out.
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
    /// Data checks to ignore because the user knows that the data are right.
    #[command(flatten)]
    pub accept: Accept,
}

/// Candidate effects that a discovery tries before formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Library {
    /// The effects of the library.
    #[default]
    Generic,
    /// No library effects.
    None,
}

impl Library {
    /// Returns the value as it is written on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Library::Generic => "generic",
            Library::None => "none",
        }
    }
}

/// Data checks that a user overrides.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct Accept {
    /// Use the data although this check finds them suspicious (`data inspect` lists all checks). Can be
    /// given several times.
    #[arg(long, value_name = "CHECK", value_parser = check_parser())]
    pub accept: Vec<Check>,
}

/// Parser of the names of checks.
fn check_parser() -> impl TypedValueParser<Value = Check> {
    PossibleValuesParser::new(Check::all().map(Check::name))
        .try_map(|name| Check::named(&name).ok_or_else(|| format!("no check is called {name}")))
}
