//! `augsim evaluate`.

use super::evaluate_system;
use crate::args::{Evaluate, ProtocolArg};
use crate::exit::{Outcome, Usage};
use crate::experiment::layout::Layout;
use crate::experiment::rows::{Row, table};
use crate::output::Output;
use augsim_session::run_data::load;
use augsim_session::run_dir::{DataSource, RunDir};
use augsim_session::written;
use augsim_trainer::{Correction, NetModel, Protocol, evaluate_forecast, evaluate_reconstruction};

/// Runs the subcommand.
pub fn run(args: &Evaluate, output: &Output) -> anyhow::Result<Outcome> {
    if args.run.is_file() && written::is_model(&args.run) {
        return evaluate_system::run(args, output);
    }
    let model = NetModel::new(RunDir::open(&args.run).read_model()?)?;
    let settings = &model.state().settings;
    if settings.correction == Correction::Rollout && args.protocol == ProtocolArg::Reconstruction {
        let text = "nets of pushes only forecast; leave out --protocol reconstruction";
        return Err(Usage(text.to_owned()).into());
    }
    let test = load(&DataSource::File(args.data.clone()), &settings.engine)?;
    let (protocol, score) = match args.protocol {
        ProtocolArg::Forecast => (Protocol::Forecast, evaluate_forecast(&model, &test)?),
        ProtocolArg::Reconstruction => (Protocol::Reconstruction, evaluate_reconstruction(&model, &test)?),
    };
    let rows = [Row::new(Layout::of(&settings.engine), settings.recipe.label(), protocol, &score)];
    output.result(&rows[0], || table(&rows))?;
    let met = args.require_pos_m.is_none_or(|limit| score.mean_of_10.absolute[0] < limit);
    Ok(if met { Outcome::Done } else { Outcome::CriterionNotMet })
}
