//! `reproduce filtered`: forecasts from a measured prefix with the same prefixes for every model, for
//! drops, pushes and measured flights, each in a separate folder.

mod ball;
mod believed;
mod flights;
mod layout;
mod page;
mod push;
mod push_physics;
mod push_row;

use crate::args::{Part, Reproduce};
use augsim_session::usage::Inapplicable;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use std::path::{Path, PathBuf};

/// Folder name of the measured flights in the folder of all sets.
const FLIGHTS: &str = "spindoe-table-tennis";

/// Folders and command line options with which one scenario runs.
#[derive(Debug, Clone, Copy)]
struct Plan<'a> {
    /// Results folder of the scenario.
    out: &'a Path,
    /// Data folder of the scenario; data are generated if `None`.
    data: Option<&'a Path>,
    /// Command line options of `reproduce`.
    args: &'a Reproduce,
    seed: u64,
    force: bool,
}

/// Runs `reproduce filtered`.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let out = args.out.clone().unwrap_or_else(|| "out/filtered".into());
    let parts = match args.part {
        Some(one) => vec![one],
        None => vec![Part::Ball, Part::Push, Part::Flights],
    };
    for part in parts {
        let data = data_of(part, args.data.as_deref());
        let folder = out.join(part.name());
        let plan = Plan { out: &folder, data: data.as_deref(), args, seed, force };
        let outcome = match part {
            Part::Ball => ball::run(plan, output)?,
            Part::Push => push::run(plan, output)?,
            Part::Flights => match plan.data {
                Some(data) => flights::run(plan, data, output)?,
                None if args.part.is_some() => {
                    let folder = FLIGHTS;
                    return Err(Usage::Inapplicable(Inapplicable::FlightsUnmeasured { folder }).into());
                }
                None => {
                    output.note(format!("no measured flights: --data does not contain a folder `{FLIGHTS}`"));
                    Outcome::Done
                }
            },
        };
        if outcome != Outcome::Done {
            return Ok(outcome);
        }
    }
    Ok(Outcome::Done)
}

/// Returns the data folder of a scenario; `None` if data are generated.
///
/// The folder is `data` itself, or a set in `data`, the folder of all sets.
fn data_of(part: Part, data: Option<&Path>) -> Option<PathBuf> {
    let data = data?;
    let (name, file) = match part {
        Part::Ball => (crate::chain::PYBULLET, "test_1000.csv.gz"),
        Part::Flights => (FLIGHTS, "index.csv"),
        Part::Push => return None,
    };
    let inside = data.join(name);
    if inside.is_dir() {
        return Some(inside);
    }
    // Every folder is checked for drops, so that the error names a folder without them.
    (part == Part::Ball && !data.join(FLIGHTS).is_dir() && !data.join("index.csv").is_file()
        || data.join(file).is_file())
    .then(|| data.to_owned())
}
