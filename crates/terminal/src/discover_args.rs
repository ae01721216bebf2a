//! Command-line options of `discover`.

use crate::record::Record;
use augsim_data::checks::Check;
use augsim_session::DataFrom;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args as ClapArgs, ValueEnum};
use std::path::{Path, PathBuf};

/// Options of `discover`.
#[derive(Debug, Default, ClapArgs)]
pub struct Discover {
    /// Model file (TOML) of the declared physics.
    pub model: PathBuf,
    /// Measured trajectories: files in any layout that `start` reads, or folders with one file per
    /// recording.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
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
    /// Effects of the library to try.
    #[command(flatten)]
    pub effects: EffectNames,
    /// End after this time in seconds with the best model so far: half of it is for fits and search, the
    /// rest for judging the findings. A search that was cut short, or effects that were not tested yet, are
    /// stated in the result; the test on null recordings is then left out.
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
    /// Time column of the data.
    #[command(flatten)]
    pub time: TimeColumn,
    /// Data checks to ignore because the user knows that the data are right.
    #[command(flatten)]
    pub accept: Accept,
}

/// Effects of the library that a discovery tries.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct EffectNames {
    /// Try these effects of the library only (`augsim effects --for MODEL` lists all), without formulas and
    /// without values by group; separated by commas. With `--exclude`, the ones that it does not name. An
    /// effect that acts through another, as `wind` through `quadratic-drag`, is tried only with it.
    #[arg(long, value_name = "EFFECT,…", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Do not try these effects of the library; separated by commas.
    #[arg(long, value_name = "EFFECT,…", value_delimiter = ',')]
    pub exclude: Vec<String>,
}

/// The columns of time and of groups in a file, where the reader does not find them.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct TimeColumn {
    /// Time column of the data, with its unit after a colon: `clock:ms`, `t:h`, `Year:years`. By default a
    /// column called `t_s`, `time`, `timestamp` or the like, in the unit of its name, or else in the unit that
    /// its numbers show.
    #[arg(long, value_name = "COLUMN[:UNIT]")]
    pub time: Option<String>,
    /// Column that holds the group of each trajectory, such as the unit that was recorded; `trajectory` makes each
    /// trajectory a group of its own. By default the column `group`, if there is one.
    #[arg(long, value_name = "COLUMN")]
    pub group_by: Option<String>,
}

impl TimeColumn {
    /// Adds the named columns to the record of a command.
    pub fn recorded(&self, record: Record) -> Record {
        let named = [("time", &self.time), ("group-by", &self.group_by)];
        named.into_iter().fold(record, |record, (name, column)| match column {
            Some(column) => record.setting(name, column),
            None => record,
        })
    }

    /// Returns the data in the file or folder `path`, read with these columns.
    pub fn of(&self, path: &Path) -> DataFrom {
        DataFrom::with_time(path, self.time.as_deref()).with_groups(self.group_by.as_deref())
    }

    /// Returns the data in several files or folders, read with these columns.
    pub fn of_all(&self, paths: &[PathBuf]) -> DataFrom {
        DataFrom::of_paths(paths, self.time.as_deref()).with_groups(self.group_by.as_deref())
    }
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
    /// Returns the choice of candidate effects as it is written on the command line.
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

/// Returns the parser for the names of data checks.
fn check_parser() -> impl TypedValueParser<Value = Check> {
    PossibleValuesParser::new(Check::all().map(Check::name))
        .try_map(|name| Check::named(&name).ok_or_else(|| format!("no check is called {name}")))
}
