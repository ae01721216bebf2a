//! Options of `data`.

use clap::{Args as ClapArgs, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Options of `data`.
#[derive(Debug, ClapArgs)]
pub struct Data {
    /// The action on data files.
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
        /// Put the samples on the frames that their time stamps jitter about: one period for all trajectories, found from the
        /// stamps.
        #[arg(long, conflicts_with = "rate_hz")]
        frame_clock: bool,
        /// Frame of pushes: as recorded (the robot's base), or that of the object's first pose.
        #[arg(long, value_enum, default_value_t = Frame::World)]
        frame: Frame,
    },
}

/// Frame of converted pushes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Frame {
    /// As recorded: the robot's base.
    World,
    /// The object begins at the origin, unturned.
    Start,
}
