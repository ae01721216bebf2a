//! Options of `reproduce`.

use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Tables that can be reproduced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scenario {
    /// The bouncing ball.
    Ball,
    /// Planar pushing.
    Push,
    /// The loop on measured sets, and the chain from the declared model to the net on the augmented one, for the ball and for
    /// pushing.
    Loop,
    /// Systems of equations on benchmark sets, with formulas where the library is emptied and a net on what is left, beside
    /// published figures.
    Systems,
    /// Drops, a push that is repeated, and measured flights of which the beginning is seen: every model behind the same
    /// prefixes.
    Filtered,
    /// Every model class that `train` knows, and the baselines, under one protocol in one table.
    League,
}

/// Scenarios of the league.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeagueScenario {
    /// The bouncing ball.
    Ball,
    /// Planar pushing.
    Push,
}

impl LeagueScenario {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            LeagueScenario::Ball => "ball",
            LeagueScenario::Push => "push",
        }
    }
}

/// Scenarios of reproductions that have several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// The bouncing ball.
    Ball,
    /// Planar pushing.
    Push,
    /// Measured flights of table-tennis balls, of filtered forecasts.
    Flights,
}

impl Part {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Part::Ball => "ball",
            Part::Push => "push",
            Part::Flights => "flights",
        }
    }
}

/// Nets of the pushing tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum NetArg {
    /// DCVRNN without physics.
    Neural,
    /// Hybrid+ without physics.
    NeuralPlus,
    /// DCVRNN on the physics roll-out, as published.
    Hybrid,
    /// Corrects the physics roll-out by its dimensionless features.
    HybridPlus,
}

/// Options of `reproduce`.
#[derive(Debug, ClapArgs)]
pub struct Reproduce {
    /// Which.
    pub scenario: Scenario,
    /// Ball: directory with `train.csv.gz` and `test_1000.csv.gz`; without it drops of the same law are generated. Push:
    /// directory with published MIT Push files (folders `abs`, `plywood`, …), with `mit-pusher-slider-runs`, or both; what
    /// is not there is generated. The table says which. Loop and systems: the folder of all sets.
    #[arg(long)]
    pub data: Option<PathBuf>,
    /// Ball: test drops, where they are generated.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    pub test_drops: u32,
    /// Directory for runs, `result.json` and `report.html` (default: `out/ball`, `out/push`, `out/loop`, `out/systems`,
    /// `out/filtered`, `out/league`).
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// A tenth of the iterations; of pushes, also fewer and on fewer sets; of systems, no formulas and no nets; of the league, fewer of all.
    #[arg(long)]
    pub quick: bool,
    /// Iterations of each net.
    #[arg(long, conflicts_with = "quick", value_parser = clap::value_parser!(u64).range(1..))]
    pub iterations: Option<u64>,
    /// Push: this net alone, scored on every set: a point of the size curve, for sweeps.
    #[arg(long, value_enum)]
    pub net: Option<NetArg>,
    /// Push: train that net on the first pushes of the training set only.
    #[arg(long, requires = "net", value_parser = clap::value_parser!(u32).range(1..))]
    pub train_size: Option<u32>,
    /// League and filtered: this scenario alone (default: all).
    #[arg(long = "scenario", id = "part", value_name = "SCENARIO", value_enum)]
    pub part: Option<Part>,
    /// Go on with what is in `--out`, which the same settings must have made.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}
