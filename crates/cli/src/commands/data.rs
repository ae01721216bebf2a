//! `augsim data inspect`.

use crate::args::{Data, DataAction};
use crate::exit::Outcome;
use crate::output::Output;
use augsim_data::{MissingCells, Summary, read_dataset};

/// Runs the subcommand.
pub fn run(args: &Data, output: &Output) -> anyhow::Result<Outcome> {
    match &args.action {
        DataAction::Inspect { file } => {
            let summary = Summary::of(&read_dataset(file, MissingCells::AsGap)?);
            output.result(&summary, || summary.to_string())?;
        }
    }
    Ok(Outcome::Done)
}
