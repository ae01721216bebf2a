//! Options of `simulate`.

use clap::builder::PossibleValuesParser;
use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Scenarios that `simulate` generates without a model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SimulateScenario {
    /// Drops of the paper's law.
    Ball,
    /// Pushes of the virtual laboratory.
    Push,
}

/// How pushes are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PushProtocolArg {
    /// As the MIT set: contacts, angles, speeds and accelerations; 7,128 different pushes of a rectangle.
    Mit,
    /// One push again and again, as the 2,000 of the MIT set.
    Repeat,
    /// Contact, angle, start pose and speed at random.
    Random,
}

/// Options of `simulate`.
#[derive(Debug, ClapArgs)]
#[command(group(clap::ArgGroup::new("which").args(["model", "named_model"])))]
pub struct Simulate {
    /// Model file (TOML) or folder of `discover`; without it drops or pushes are generated.
    #[arg(conflicts_with_all = ["scenario", "trajectories", "samples", "protocol", "object", "surface"])]
    pub model: Option<PathBuf>,
    /// The same as MODEL.
    #[arg(long = "model", value_name = "MODEL", id = "named_model",
        conflicts_with_all = ["model", "scenario", "trajectories", "samples", "protocol", "object", "surface"])]
    pub named_model: Option<PathBuf>,
    /// With MODEL: simulate at the times, with the inputs and from the beginnings of these trajectories; of balls and pushes
    /// with the ends of 90 % bands.
    #[arg(long, value_name = "DATA", requires = "which", conflicts_with_all = ["duration_s", "input"])]
    pub like: Option<PathBuf>,
    /// With MODEL: seconds to simulate (default 10).
    #[arg(long, requires = "which")]
    pub duration_s: Option<f64>,
    /// With MODEL: an input as an expression of the time t in seconds, such as `force_N=2*sin(3*t)`; may be given several
    /// times. An input that is not given swings, as a note says.
    #[arg(long, value_name = "NAME=EXPRESSION", requires = "which")]
    pub input: Vec<String>,
    /// With MODEL: a state at the beginning, such as `theta_rad=0.5`; may be given several times.
    #[arg(long, value_name = "NAME=VALUE", requires = "which")]
    pub start: Vec<String>,
    /// With MODEL: compare with an adaptive reference and print the largest deviation of each output.
    #[arg(long, requires = "which")]
    pub check: bool,
    /// Scenario to simulate.
    #[arg(long, value_enum, default_value = "ball")]
    pub scenario: SimulateScenario,
    /// Number of trajectories.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub trajectories: u32,
    /// Samples of each drop, at 60 Hz.
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u32).range(2..))]
    pub samples: u32,
    /// Layout of the pushes.
    #[arg(long, value_enum, default_value = "mit")]
    pub protocol: PushProtocolArg,
    /// Object that is pushed.
    #[arg(long, default_value = "rect1", value_parser = PossibleValuesParser::new(augsim_physics::push::OBJECTS))]
    pub object: String,
    /// Support that the object lies on.
    #[arg(long, default_value = "abs", value_parser = ["abs", "delrin", "plywood", "pu"])]
    pub surface: String,
    /// Samples of a push per second.
    #[arg(long, default_value_t = 100.0)]
    pub rate_hz: f64,
    /// Sensor noise of the pushed object's position, m.
    #[arg(long, default_value_t = 3e-4)]
    pub position_sd_m: f64,
    /// Sensor noise of its angle, rad.
    #[arg(long, default_value_t = 0.001745)]
    pub angle_sd_rad: f64,
    /// File to write (`.csv`, `.csv.gz` or `.npz`), `out/ball.csv`, `out/push.csv` or `out/system.csv` without it; the truth
    /// record and, for pushes, the declared model go beside it.
    #[arg(long)]
    pub out: Option<PathBuf>,
}
