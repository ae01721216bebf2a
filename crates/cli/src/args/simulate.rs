//! Options of `simulate`.

use clap::builder::PossibleValuesParser;
use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Scenarios that `simulate` generates without a model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SimulateScenario {
    /// Ball drops with the random restitution of the paper
    Ball,
    /// Pushes in the virtual laboratory
    Push,
}

/// Protocol of the generated pushes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PushProtocolArg {
    /// As in the MIT set: contacts, angles, speeds and accelerations; 7,128 different pushes of a
    /// rectangle.
    Mit,
    /// One push repeated, as the 2,000 repetitions of the MIT set
    Repeat,
    /// Random contact point, angle, start pose and speed
    Random,
}

/// Options of `simulate`.
#[derive(Debug, ClapArgs)]
#[command(group(clap::ArgGroup::new("which").args(["model", "named_model"])))]
pub struct Simulate {
    /// Model file (TOML) or output folder of `discover`. Without it a built-in scenario is simulated.
    #[arg(conflicts_with_all = ["scenario", "trajectories", "samples", "protocol", "object", "surface"])]
    pub model: Option<PathBuf>,
    /// The same as MODEL.
    #[arg(long = "model", value_name = "MODEL", id = "named_model",
        conflicts_with_all = ["model", "scenario", "trajectories", "samples", "protocol", "object", "surface"])]
    pub named_model: Option<PathBuf>,
    /// With MODEL: simulate at the times, with the inputs and from the initial states of these
    /// trajectories. For balls and pushes the limits of the 90 % bands are added.
    #[arg(long, value_name = "DATA", requires = "which", conflicts_with_all = ["duration_s", "input"])]
    pub like: Option<PathBuf>,
    /// With MODEL: simulated time in seconds (default: 10).
    #[arg(long, requires = "which")]
    pub duration_s: Option<f64>,
    /// With MODEL: an input as an expression of the time t in seconds, such as `force_N=2*sin(3*t)`. Can
    /// be given several times. An input that is not given is a sine wave, which a note reports.
    #[arg(long, value_name = "NAME=EXPRESSION", requires = "which")]
    pub input: Vec<String>,
    /// With MODEL: initial value of a state, such as `theta_rad=0.5`. Can be given several times.
    #[arg(long, value_name = "NAME=VALUE", requires = "which")]
    pub start: Vec<String>,
    /// With MODEL: compare with an adaptive reference solver and print the largest deviation of each
    /// output.
    #[arg(long, requires = "which")]
    pub check: bool,
    /// Scenario to simulate.
    #[arg(long, value_enum, default_value = "ball")]
    pub scenario: SimulateScenario,
    /// Number of trajectories.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub trajectories: u32,
    /// Number of samples of each drop, at 60 Hz.
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u32).range(2..))]
    pub samples: u32,
    /// Protocol of the pushes.
    #[arg(long, value_enum, default_value = "mit")]
    pub protocol: PushProtocolArg,
    /// Object that is pushed.
    #[arg(long, default_value = "rect1", value_parser = PossibleValuesParser::new(augsim_physics::push::OBJECTS))]
    pub object: String,
    /// Surface that the object lies on.
    #[arg(long, default_value = "abs", value_parser = ["abs", "delrin", "plywood", "pu"])]
    pub surface: String,
    /// Sampling rate of a push in Hz.
    #[arg(long, default_value_t = 100.0)]
    pub rate_hz: f64,
    /// Standard deviation of the measurement noise of the object's position, in m.
    #[arg(long, default_value_t = 3e-4)]
    pub position_sd_m: f64,
    /// Standard deviation of the measurement noise of the object's angle, in rad.
    #[arg(long, default_value_t = 0.001745)]
    pub angle_sd_rad: f64,
    /// File to write (`.csv`, `.csv.gz` or `.npz`; default: `out/ball.csv`, `out/push.csv` or
    /// `out/system.csv`). The file with the true values and, for pushes, the declared model are written
    /// next to it.
    #[arg(long)]
    pub out: Option<PathBuf>,
}
