//! Options of the commands on model files: `model`, `fit`, `effects`.

use crate::examples;
use augsim_data::ColumnMapping;
use augsim_terminal::discover_args::{Accept, TimeColumn};
use clap::builder::PossibleValuesParser;
use clap::{Args as ClapArgs, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Options of `model`.
#[derive(Debug, ClapArgs)]
pub struct ModelArgs {
    /// Action on model files.
    #[command(subcommand)]
    pub action: ModelAction,
}

/// Actions of `augsim model`.
#[derive(Debug, Subcommand)]
pub enum ModelAction {
    /// Write a commented model file that can be simulated as it is.
    New {
        /// Name of the system.
        #[arg(value_parser = templates())]
        name: String,
        /// File to write (default: `NAME.toml`).
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Write a model file and its data from a robot's URDF or MJCF file and a log of its joints.
    #[command(after_help = examples::FROM_ROBOT)]
    FromRobot(Box<FromRobot>),
}

/// Options of `model from-robot`.
#[derive(Debug, ClapArgs)]
pub struct FromRobot {
    /// Description of the robot: a URDF file, or an MJCF file of MuJoCo.
    pub robot: PathBuf,
    /// Logs of the joints, in any layout that `start` reads: positions, with torques, or with commanded positions.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
    /// Output folder for `model.toml`, `data.csv` and a copy of the description.
    #[arg(long, default_value = "out/robot")]
    pub out: PathBuf,
    /// Joints that move, in the order of the columns; all others are locked (default: those with positions in
    /// the log).
    #[arg(long, value_name = "JOINT,…", value_delimiter = ',')]
    pub joints: Vec<String>,
    /// Position of a joint as an expression of the columns, such as `joint_6=m6_rad / 32 - m5_rad / 45`.
    #[arg(long, value_name = "JOINT=EXPRESSION", value_parser = joint_expression)]
    pub position: Vec<(String, String)>,
    /// Torque of a joint as an expression of the columns, such as `joint_5=45 * current5_A`.
    #[arg(long, value_name = "JOINT=EXPRESSION", value_parser = joint_expression)]
    pub torque: Vec<(String, String)>,
    /// Whether the model computes torques from the motion (`inverse`), or the motion from torques or commands
    /// (`forward`); default: `inverse` if the log has torques.
    #[arg(long)]
    pub formulation: Option<FormulationArg>,
    /// Acceleration of gravity in the frame of the base, in m/s2 (default: that of the file, or 0,0,-9.81).
    #[arg(long, value_name = "X,Y,Z", value_parser = three_numbers, allow_hyphen_values = true)]
    pub gravity: Option<[f64; 3]>,
    /// Properties that a fit may change: `inertias` (those that the log can identify), `armature`, `viscous`.
    #[arg(long, value_name = "GROUP,…", value_delimiter = ',')]
    pub free: Vec<FreeArg>,
    /// Time column, with its unit after a colon: `clock:ms`.
    #[arg(long, value_name = "NAME[:UNIT]")]
    pub time: Option<String>,
    /// Columns under other names or in other units: `q1_deg=m1_rad:rad`.
    #[arg(long, value_name = "NAME=COLUMN[:UNIT],…", value_delimiter = ',')]
    pub columns: Vec<ColumnMapping>,
}

/// Formulation of a robot's model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FormulationArg {
    /// The motion is the input, torques are the output.
    Inverse,
    /// Torques or commands are the input, the motion is the output.
    Forward,
}

/// Properties of a robot that a fit may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FreeArg {
    /// Inertial parameters that the log can identify.
    Inertias,
    /// Inertias of the rotors.
    Armature,
    /// Viscous friction of every joint.
    Viscous,
}

/// Reads three numbers that are separated by commas.
fn three_numbers(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    let finite = numbers.iter().all(|number| number.is_finite());
    match <[f64; 3]>::try_from(numbers) {
        Ok(three) if finite && text.split(',').count() == 3 => Ok(three),
        _ => Err("write three numbers, such as 0,0,-9.81".to_owned()),
    }
}

/// Splits `JOINT=EXPRESSION` at the first equals sign.
fn joint_expression(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((joint, expression)) if !joint.trim().is_empty() && !expression.trim().is_empty() => {
            Ok((joint.trim().to_owned(), expression.trim().to_owned()))
        }
        _ => Err("write JOINT=EXPRESSION, such as joint_5=45 * current5_A".to_owned()),
    }
}

/// Argument parser that accepts the names of all template models.
fn templates() -> PossibleValuesParser {
    let built_in = augsim_physics::model::TEMPLATES.map(|(name, _)| name);
    PossibleValuesParser::new(built_in.into_iter().chain(augsim_equations::EXAMPLES.map(|(name, _)| name)))
}

/// Options of `fit`.
#[derive(Debug, ClapArgs)]
pub struct Fit {
    /// Model file (TOML) with `scenario = "system"`.
    pub model: PathBuf,
    /// Measured trajectories with the inputs and outputs of the model: files in any layout that `start`
    /// reads, or folders with one file per recording.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
    /// Time column of the data.
    #[command(flatten)]
    pub time: TimeColumn,
    /// Data checks to ignore because the user knows that the data are right.
    #[command(flatten)]
    pub accept: Accept,
    /// Fit a new unit of a fleet: only parameters with `per = "group"` are fitted, with their distribution
    /// over groups as prior; all others keep their values. The data are runs of that unit.
    #[arg(long)]
    pub new_unit: bool,
    /// Output folder for the calibrated `model.toml` and `result.json`.
    #[arg(long, default_value = "out/fit")]
    pub out: PathBuf,
    /// End after this time in seconds with the best values so far: half of it is for the fit, the rest for
    /// the estimate of the noise.
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
}

/// Options of `effects`.
#[derive(Debug, ClapArgs)]
pub struct Effects {
    /// Name of a library (`ball`, `push`) or of an effect, such as `quadratic-drag` (default: all
    /// effects).
    pub kind: Option<String>,
    /// Model file (TOML) of a ball, of pushing or of equations. Only effects that can be added to this
    /// model are listed.
    #[arg(long = "for", value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Measured trajectories. They are used to show typical parameter values in the units of a model of
    /// equations.
    #[arg(long, requires = "model")]
    pub data: Option<PathBuf>,
}
