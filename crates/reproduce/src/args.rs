//! Options of `reproduce`.

use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Reproductions of published results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scenario {
    /// The bouncing ball.
    Ball,
    /// Planar pushing.
    Push,
    /// Discovery on measured data sets, and networks on the declared and on the augmented model, for the
    /// ball and for pushing.
    Loop,
    /// Models of equations on identification benchmarks, with formula search, a network on the residual,
    /// and published results for comparison.
    Systems,
    /// Arms with rigid-body models from their description files: errors of the joint torques, effects, and
    /// published values for comparison.
    Robots,
    /// Measured rigs with several units, repeated runs or hidden states: effects, and errors on held-out
    /// recordings.
    Rigs,
    /// Forecasts from a measured prefix, with the same prefixes for every model: ball drops, a repeated
    /// push and measured flights.
    Filtered,
    /// All model classes of `train` and the baselines under one protocol, in one table.
    League,
    /// Recorded runs chosen one by one as `next` would choose them, against random order: the number of runs to the
    /// verdict of the whole pool.
    Next,
}

/// Systems for which all model classes are compared (`reproduce league`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeagueScenario {
    /// The bouncing ball, on generated drops.
    Ball,
    /// Planar pushing, on pushes of the virtual laboratory.
    Push,
}

impl LeagueScenario {
    /// Returns the name of the scenario in files.
    pub fn name(self) -> &'static str {
        match self {
            LeagueScenario::Ball => "ball",
            LeagueScenario::Push => "push",
        }
    }
}

/// Scenario of a reproduction that has several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// The bouncing ball.
    Ball,
    /// Planar pushing.
    Push,
    /// Measured flights of table-tennis balls, for forecasts from a prefix
    Flights,
}

impl Part {
    /// Returns the name of the scenario in files.
    pub fn name(self) -> &'static str {
        match self {
            Part::Ball => "ball",
            Part::Push => "push",
            Part::Flights => "flights",
        }
    }
}

/// Networks of the pushing tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum NetArg {
    /// DCVRNN without physics
    Neural,
    /// Hybrid+ without physics
    NeuralPlus,
    /// DCVRNN on the physics roll-out, as published
    Hybrid,
    /// Network that corrects the physics roll-out, with dimensionless features of the roll-out as inputs
    HybridPlus,
}

/// Options of `reproduce`.
#[derive(Debug, ClapArgs)]
pub struct Reproduce {
    /// Result to reproduce.
    pub scenario: Scenario,
    /// Next: recordings (file or folder) from which runs are chosen. Without it, the pools of the data sets in `--data`.
    #[arg(requires = "explanations")]
    pub pool: Option<PathBuf>,
    /// Next: model files of the explanations of the pool, with their free parameters.
    #[arg(long, num_args = 1.., value_name = "MODEL", requires = "pool")]
    pub explanations: Vec<PathBuf>,
    /// Next: number of random orders.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub orders: u32,
    /// Next: number of first recordings, drawn at random, to which the explanations are fitted.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub first: u32,
    /// Data folder. Ball: folder with `train.csv.gz` and `test_1000.csv.gz`; without it drops with the
    /// same random restitution are generated. Push: folder with published MIT Push files (folders `abs`,
    /// `plywood`, …), with `mit-pusher-slider-runs`, or both; missing data are generated, and the table
    /// shows which. Loop, systems, robots, rigs and next: folder with all data sets.
    #[arg(long)]
    pub data: Option<PathBuf>,
    /// Ball: number of generated test drops.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    pub test_drops: u32,
    /// Output folder for training runs, `result.json` and `report.html` (default: `out/ball`,
    /// `out/push`, `out/loop`, `out/systems`, `out/robots`, `out/rigs`, `out/filtered`, `out/league`,
    /// `out/replay`).
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Run a reduced version: a tenth of the iterations. Push: also fewer pushes and fewer data sets.
    /// Systems: no formulas and no networks. Robots and rigs: no null recordings. League: less of everything.
    #[arg(long)]
    pub quick: bool,
    /// Number of training iterations of each network.
    #[arg(long, conflicts_with = "quick", value_parser = clap::value_parser!(u64).range(1..))]
    pub iterations: Option<u64>,
    /// Push: train only this network and score it on every set, as one point of the curve over
    /// training-set sizes.
    #[arg(long, value_enum)]
    pub net: Option<NetArg>,
    /// Push: train this network only on the given number of first pushes of the training set.
    #[arg(long, requires = "net", value_parser = clap::value_parser!(u32).range(1..))]
    pub train_size: Option<u32>,
    /// League and filtered: run only this scenario (default: all).
    #[arg(long = "scenario", id = "part", value_name = "SCENARIO", value_enum)]
    pub part: Option<Part>,
    /// Resume the run in `--out`, which must have the same settings.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}
