//! Arguments and options of all commands.

use crate::commands::export::Export;
use crate::commands::report::ReportArgs;
use crate::examples;
pub use crate::reproduce_args::{NetArg, Reproduce, Scenario};
use crate::start_args::Start;
use crate::sweep::args::Sweep;
use augsim_data::checks::Check;
use augsim_session::configure::Corrected;
use augsim_session::{DataFrom, Usage};
use augsim_trainer::Recipe;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

const LIMITS: &str = "\
Environment:
  AUGSIM_LIMIT_BYTES, _CELLS, _COLUMNS, _TRAJECTORIES, _SAMPLES, _PARAMETERS and others bound what a file or an option
  may ask of the machine; the message that refuses something names its variable, such as AUGSIM_LIMIT_CELLS=1e9.";

/// Hybrid simulation: an analytical model, the effect it lacks, and a stochastic net for what remains.
#[derive(Debug, Parser)]
#[command(name = "augsim", version, propagate_version = true, arg_required_else_help = true, after_long_help = LIMITS)]
pub struct Args {
    /// Options of every subcommand.
    #[command(flatten)]
    pub global: Global,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every subcommand.
#[derive(Debug, ClapArgs)]
pub struct Global {
    /// Seed of every random draw; the same seed gives the same bytes, whatever the threads.
    #[arg(long, global = true, default_value_t = 1)]
    pub seed: u64,
    /// Worker threads (default: all cores).
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print results as JSON for programs.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print more on standard error.
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Replace what another run left in `--out`; an input is never replaced.
    #[arg(long, global = true)]
    pub force: bool,
    /// Print no notes and no progress.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Read recordings as they are, and write the data file and the model file that the other commands begin with.
    #[command(after_help = examples::START)]
    Start(Start),
    /// See the whole of it in two minutes: simulate, train, forecast, compare, report.
    #[command(after_help = examples::DEMO)]
    Demo(Demo),
    /// Write model files to start from.
    #[command(after_help = examples::MODEL)]
    Model(ModelArgs),
    /// Generate trajectories of a known law, with a truth record beside them, or of a model file of equations.
    #[command(after_help = examples::SIMULATE)]
    Simulate(Simulate),
    /// Calibrate the declared parameters of a model file of equations.
    #[command(after_help = examples::FIT)]
    Fit(Fit),
    /// List the effects that may be tried on a model.
    #[command(after_help = examples::EFFECTS)]
    Effects(Effects),
    /// Close the loop: what the model lacks, added and proved on held-out trajectories, or an honest no.
    #[command(after_help = examples::DISCOVER)]
    Discover(Discover),
    /// Train a net on trajectories; a run directory is the result.
    #[command(after_help = examples::TRAIN)]
    Train(Train),
    /// Forecast trajectories with a model file, the model of a discovery or a trained net: mean and bands.
    #[command(after_help = examples::PREDICT)]
    Predict(Predict),
    /// Write a figure of the report of a discovery as SVG.
    #[command(after_help = examples::REPORT)]
    Report(ReportArgs),
    /// Write the law of a model with its values: formulas, or a program that runs without augsim.
    #[command(after_help = examples::EXPORT)]
    Export(Export),
    /// Score a model file, a discovery or a trained net on held-out trajectories, the models before it beside it.
    #[command(after_help = examples::EVALUATE)]
    Evaluate(Evaluate),
    /// Reproduce the published tables.
    #[command(after_help = examples::REPRODUCE)]
    Reproduce(Reproduce),
    /// Many runs of a command with other settings, here or on a cluster with Slurm.
    #[command(after_help = examples::SWEEP)]
    Sweep(Sweep),
    /// Look at data files.
    #[command(after_help = examples::DATA)]
    Data(Data),
    /// Write what a shell completes on the tab key, to standard output.
    #[command(after_help = examples::COMPLETIONS)]
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// Write manual pages, one a command.
    #[command(after_help = examples::MAN)]
    Man {
        /// Folder for the pages.
        #[arg(long, default_value = "out/man")]
        out: PathBuf,
    },
    /// Print this reference as a page in Markdown.
    #[command(hide = true)]
    Reference,
}

/// Options of `demo`.
#[derive(Debug, ClapArgs)]
pub struct Demo {
    /// Directory for the report and the runs.
    #[arg(long, default_value = "out/demo")]
    pub out: PathBuf,
}

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

/// Options of `model`.
#[derive(Debug, ClapArgs)]
pub struct ModelArgs {
    /// What to do.
    #[command(subcommand)]
    pub action: ModelAction,
}

/// Actions of `augsim model`.
#[derive(Debug, Subcommand)]
pub enum ModelAction {
    /// Write a commented model file that runs as it is.
    New {
        /// Which system.
        #[arg(value_parser = templates())]
        name: String,
        /// File to write, `NAME.toml` without it.
        #[arg(long)]
        out: Option<PathBuf>,
    },
}

/// Names of the models that can be begun with.
fn templates() -> PossibleValuesParser {
    let built_in = augsim_physics::model::TEMPLATES.map(|(name, _)| name);
    PossibleValuesParser::new(built_in.into_iter().chain(augsim_written::EXAMPLES.map(|(name, _)| name)))
}

/// Options of `fit`.
#[derive(Debug, ClapArgs)]
pub struct Fit {
    /// Model file (TOML) with `scenario = "system"`.
    pub model: PathBuf,
    /// Measured trajectories (CSV, plain or gzip) with the inputs and outputs of the model.
    pub data: PathBuf,
    /// Directory for the calibrated `model.toml` and `result.json`.
    #[arg(long, default_value = "out/fit")]
    pub out: PathBuf,
}

/// Options of `effects`.
#[derive(Debug, ClapArgs)]
pub struct Effects {
    /// A library (`ball`, `push`) or an effect of one, such as `quadratic-drag`; without it both libraries.
    #[arg(conflicts_with = "model")]
    pub kind: Option<String>,
    /// Model file (TOML) of a ball, of pushing, or of equations: what may be tried on it.
    #[arg(long = "for", value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Measured trajectories, for usual sizes in the units of a model of equations.
    #[arg(long, requires = "model")]
    pub data: Option<PathBuf>,
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
    #[arg(long, default_value = "rect1", value_parser = clap::builder::PossibleValuesParser::new(augsim_physics::push::OBJECTS))]
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

/// Options of `discover`.
#[derive(Debug, ClapArgs)]
pub struct Discover {
    /// Model file (TOML): what is declared.
    pub model: PathBuf,
    /// Measured trajectories (CSV, plain or gzip).
    pub data: PathBuf,
    /// Directory for `result.json`, `report.html` and the augmented `model.toml`.
    #[arg(long, default_value = "out/discover")]
    pub out: PathBuf,
    /// Share of the trajectories that fits may see; the rest judges them.
    #[arg(long, default_value_t = 0.7)]
    pub train_share: f64,
    /// Only trajectories of this group (column `group`); may be given several times.
    #[arg(long)]
    pub group: Vec<String>,
    /// Effects that are tried: those of the library, and formulas where they end; or none of them, and formulas alone (models
    /// of equations).
    #[arg(long, value_enum, default_value_t = Library::Generic)]
    pub library: Library,
    /// End the search after so many seconds with the best so far, marked as such.
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
    /// Checks of suspicious data to do without, in the knowledge that the data are right.
    #[command(flatten)]
    pub accept: Accept,
}

/// Effects that a discovery tries before it looks for formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Library {
    /// Those of the library.
    #[default]
    Generic,
    /// None.
    None,
}

impl Library {
    /// As it is typed.
    pub fn word(self) -> &'static str {
        match self {
            Library::Generic => "generic",
            Library::None => "none",
        }
    }
}

/// Checks of suspicious data that a user overrides.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct Accept {
    /// Take the data although this check finds them suspicious (`data inspect` lists all checks); may be given several times.
    #[arg(long, value_name = "CHECK", value_parser = check_parser())]
    pub accept: Vec<Check>,
}

/// Names of checks as they are typed.
fn check_parser() -> impl TypedValueParser<Value = Check> {
    PossibleValuesParser::new(Check::all().map(Check::name))
        .try_map(|name| Check::named(&name).ok_or_else(|| format!("no check is called {name}")))
}

/// Words of the recipes, each with what it is.
fn recipes() -> impl TypedValueParser<Value = Recipe> {
    let word = |recipe: Recipe| PossibleValue::new(recipe.name()).help(recipe.about());
    PossibleValuesParser::new(Recipe::all().map(word))
        .try_map(|name| Recipe::named(&name).ok_or_else(|| format!("no recipe is called {name}")))
}

/// Options of `train`.
#[derive(Debug, ClapArgs)]
pub struct Train {
    /// Trajectories to train on (CSV, plain or gzip). Without it 800 drops are generated.
    #[arg(long)]
    pub data: Option<PathBuf>,
    /// Train on what the model in this folder of `discover` leaves of the data: the net corrects the augmented model.
    #[arg(long, value_name = "RUN", requires = "data")]
    pub residual_of: Option<PathBuf>,
    /// Model file (TOML) that says what moves in the data: the net corrects it.
    #[arg(long, value_name = "FILE", requires = "data", conflicts_with = "residual_of")]
    pub model: Option<PathBuf>,
    /// What moves in the data is the ball of the paper's experiment: height and velocity at 60 Hz, PyBullet's stepping.
    #[arg(long, requires = "data", conflicts_with_all = ["residual_of", "model"])]
    pub pybullet_ball: bool,
    /// Which net.
    #[arg(long, value_parser = recipes(), default_value = "hybrid-plus")]
    pub recipe: Recipe,
    /// Iterations; the learning-rate schedule scales with them.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub iterations: u64,
    /// Run directory.
    #[arg(long, default_value = "out/run")]
    pub out: PathBuf,
    /// Go on with the run in `--out`, bit for bit as if it had never stopped; its own settings count.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Iterations between checkpoints.
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    pub checkpoint_every: u64,
    /// Checks of suspicious data to do without.
    #[command(flatten)]
    pub accept: Accept,
}

impl Train {
    /// The model that the net is to correct, and the data; nothing for drops that are generated. Reads no file.
    ///
    /// # Errors
    /// There are data, and no option says what moves in them.
    pub fn corrected(&self) -> Result<Option<(Corrected, DataFrom)>, Usage> {
        let Some(data) = self.data.as_ref().map(DataFrom::from) else { return Ok(None) };
        let (residual_of, model) = (self.residual_of.as_deref(), self.model.as_deref());
        let named = Corrected::of_options(residual_of, model, self.pybullet_ball, &data)?;
        Ok(Some((named, data)))
    }
}

/// Options of `predict`.
#[derive(Debug, ClapArgs)]
pub struct Predict {
    /// Model file (TOML), folder of `discover`, or run directory of `train`.
    #[arg(value_name = "MODEL|RUN")]
    pub run: PathBuf,
    /// Trajectories to forecast. Of each only the beginning is used: by a net the first state, by a model of a ball the part
    /// before the first impact, by one of pushes the first pose and the rod, by equations the first samples and the inputs.
    #[arg(long)]
    pub data: PathBuf,
    /// Draws per trajectory (default: 100 of a net, 400 of a model).
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..))]
    pub samples: Option<u32>,
    /// With equations: samples, from the first of each trajectory, that its start is fitted to.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub burn_in: u32,
    /// See the first rows of each trajectory and forecast the rest: a number of samples, or seconds, such as 65 or 0.5s.
    /// Nothing later is used; what differs from trajectory to trajectory is inferred from these rows.
    #[arg(long, value_name = "N|SECONDS")]
    pub seen: Option<String>,
    /// With `--seen`: how the rows are seen.
    #[command(flatten)]
    pub view: ViewArgs,
    /// File to write (`.csv`, `.csv.gz` or `.npz`): mean, median and the 50 and 90 % bands of every column.
    #[arg(long, default_value = "out/forecast.csv")]
    pub out: PathBuf,
}

/// How the rows of `--seen` are seen.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct ViewArgs {
    /// With `--seen`: columns that are seen (default: all).
    #[arg(long, value_name = "COLUMN", value_delimiter = ',', requires = "seen")]
    pub seen_columns: Vec<String>,
    /// With `--seen`: standard deviation of the sensor, in the unit of the column: one number for all columns that are seen, or
    /// `COLUMN=NUMBER` each. Without it a net takes the rows as exact, and a model file the deviation that it declares or the
    /// one that the rows show.
    #[arg(long, value_name = "SD", value_delimiter = ',', requires = "seen")]
    pub sensor_sd: Vec<String>,
}

/// Samples of a held-out trajectory that a scored model may see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProtocolArg {
    /// The first state only.
    Forecast,
    /// The encoder sees the whole trajectory: not a prediction.
    Reconstruction,
    /// The first rows (`--seen`); the rest is forecast.
    Filtered,
}

/// Options of `evaluate`.
#[derive(Debug, ClapArgs)]
pub struct Evaluate {
    /// Model file (TOML), folder of `discover`, or run directory of `train`.
    #[arg(value_name = "MODEL|RUN")]
    pub run: PathBuf,
    /// Held-out trajectories. With the folder of a discovery and its own data: the ones that it held out are taken.
    #[arg(long)]
    pub data: PathBuf,
    /// With equations: samples, from the first of each trajectory, that its start is fitted to; errors are those of the
    /// free run over all later ones.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub burn_in: u32,
    /// Samples of a held-out trajectory that the model may see.
    #[arg(long, value_enum, default_value = "forecast")]
    pub protocol: ProtocolArg,
    /// With `--protocol filtered`: prefixes from short to long, each a number of samples, or seconds, such as 30,65 or 0.5s.
    #[arg(long, value_name = "N|SECONDS", value_delimiter = ',', required_if_eq("protocol", "filtered"))]
    pub seen: Vec<String>,
    /// With `--protocol filtered`: how the rows are seen.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Exit with code 1 unless the error of the height, or of the position of a pushed object, is below this, in m (mean of
    /// 10 samples).
    #[arg(long)]
    pub require_pos_m: Option<f64>,
}

/// Options of `data`.
#[derive(Debug, ClapArgs)]
pub struct Data {
    /// What to do with them.
    #[command(subcommand)]
    pub action: DataAction,
}

/// Actions of `augsim data`.
#[derive(Debug, Subcommand)]
pub enum DataAction {
    /// Columns, units, lengths, rates, gaps, streams and ranges of a data set, and every check of suspicious data.
    Inspect {
        /// CSV (plain or gzip), NPZ, or published push files (HDF5, JSON, a zip archive or a folder of them).
        file: PathBuf,
        /// Model file (TOML) for the checks that compare the data with gravity and sensor noise.
        #[arg(long)]
        model: Option<PathBuf>,
    },
    /// Turn a measured set in its own layout into a data file and, where one fits, a model file to begin with.
    ///
    /// `convert SET IN OUT.csv`, or `convert FOLDER --out DIR` where the folder is called as its set.
    Convert {
        /// Name of the set (mit-push, mit-pusher-slider, cmu-mlab, desilva-ball-drops, paper-stack-bounces,
        /// spindoe-table-tennis), or a folder of this name.
        set: PathBuf,
        /// Folder, archive or file of the set.
        #[arg(requires = "file", conflicts_with = "out")]
        input: Option<PathBuf>,
        /// File to write: `.csv`, `.csv.gz` or `.npz`; a model file goes to `<name>.model.toml` beside it.
        file: Option<PathBuf>,
        /// Directory for `data.csv` and `model.toml`, with FOLDER.
        #[arg(long, default_value = "out/data")]
        out: PathBuf,
        /// Interpolate onto a common clock of this rate; without it, streams keep their own clocks, marked by
        /// flags of fresh samples.
        #[arg(long)]
        rate_hz: Option<f64>,
        /// Frame of pushes: as recorded (the robot's base), or that of the object's first pose.
        #[arg(long, value_enum, default_value_t = Frame::World)]
        frame: Frame,
    },
}

/// Frame of converted pushes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Frame {
    /// As recorded: the robot's base.
    World,
    /// The object begins at the origin, unturned.
    Start,
}
