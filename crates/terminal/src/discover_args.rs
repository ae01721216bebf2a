//! Options of `discover`.

use augsim_data::checks::Check;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Options of `discover`.
#[derive(Debug, ClapArgs)]
pub struct Discover {
    /// Model file (TOML): what is declared.
    pub model: PathBuf,
    /// Measured trajectories: a CSV file, plain or gzip, or a folder of them, one recording each.
    pub data: PathBuf,
    /// Directory for `result.json`, `report.html` and the augmented `model.toml`.
    #[arg(long, default_value = "out/discover")]
    pub out: PathBuf,
    /// Records like the measured ones, made without a missing effect, on which the selection is repeated; how many of them name
    /// an effect is reported. At most 1000; 0 makes none.
    #[arg(long, default_value_t = 19, value_name = "N")]
    pub null_runs: usize,
    /// Only trajectories of this group (column `group`); may be given several times.
    #[arg(long)]
    pub group: Vec<String>,
    /// Effects that are tried: those of the library, and formulas where they end; or none of them, and formulas alone (models
    /// of equations).
    #[arg(long, value_enum, default_value_t = Library::Generic)]
    pub library: Library,
    /// End the search after so many seconds with the best so far, marked as such.
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
    /// Checks of suspicious data to do without, in the knowledge that the data are right.
    #[command(flatten)]
    pub accept: Accept,
}

/// Effects that a discovery tries before it looks for formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Library {
    /// Those of the library.
    #[default]
    Generic,
    /// None.
    None,
}

impl Library {
    /// As it is typed.
    pub fn word(self) -> &'static str {
        match self {
            Library::Generic => "generic",
            Library::None => "none",
        }
    }
}

/// Checks of suspicious data that a user overrides.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct Accept {
    /// Take the data although this check finds them suspicious (`data inspect` lists all checks); may be given several times.
    #[arg(long, value_name = "CHECK", value_parser = check_parser())]
    pub accept: Vec<Check>,
}

/// Names of checks as they are typed.
fn check_parser() -> impl TypedValueParser<Value = Check> {
    PossibleValuesParser::new(Check::all().map(Check::name))
        .try_map(|name| Check::named(&name).ok_or_else(|| format!("no check is called {name}")))
}
