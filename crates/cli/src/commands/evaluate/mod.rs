//! `augsim evaluate`: scores a model file, a discovery or a network on unseen data.

mod compare;
mod equation_net;
mod filtered;
mod model;
mod net;
mod side_by_side;
mod system;

use crate::args::{Evaluate, ProtocolArg};
use augsim_session::usage::Inapplicable;
use augsim_session::{ModelOrRun, equations};
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};

/// Runs `augsim evaluate`: scores a model file, a discovery or a network on unseen data.
pub fn run(args: &Evaluate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    if let [a, b] = &args.run[..] {
        return side_by_side::run(args, [a, b], seed, output);
    }
    match (args.protocol, args.seen.is_empty()) {
        (ProtocolArg::Filtered, _) => return filtered::run(args, seed, output),
        (_, false) => {
            return Err(Usage::Inapplicable(Inapplicable::PrefixUnfiltered).into());
        }
        (_, true) => {}
    }
    match ModelOrRun::from_path(args.model())? {
        ModelOrRun::Net => net::run(args, seed, output),
        ModelOrRun::Model { folder: None, file } if equations::is_model(&file) => system::run(args, output),
        ModelOrRun::Model { folder, file } => model::run(args, &file, folder.as_deref(), seed, output),
    }
}
