//! `augsim evaluate`.

use crate::args::{Evaluate, ProtocolArg};
use crate::ball::{self, Row};
use crate::exit::Outcome;
use crate::output::Output;
use crate::run_dir::{DataSource, RunDir};
use augsim_trainer::{NetModel, Protocol, evaluate_forecast, evaluate_reconstruction};

/// Runs the subcommand.
pub fn run(args: &Evaluate, output: &Output) -> anyhow::Result<Outcome> {
    let model = NetModel::new(RunDir::open(&args.run).read_model()?)?;
    let test = ball::load(&DataSource::File(args.data.clone()))?;
    let (protocol, score) = match args.protocol {
        ProtocolArg::Forecast => (Protocol::Forecast, evaluate_forecast(&model, &test)?),
        ProtocolArg::Reconstruction => (Protocol::Reconstruction, evaluate_reconstruction(&model, &test)?),
    };
    let row = Row::of_net(model.state().settings.recipe.label(), protocol, &score);
    let rows = [row];
    output.result(&rows[0], || ball::table(&rows))?;
    let met = args.require_pos_m.is_none_or(|limit| score.mean.absolute[0] < limit);
    Ok(if met { Outcome::Done } else { Outcome::CriterionNotMet })
}
