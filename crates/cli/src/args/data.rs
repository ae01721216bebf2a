//! Options of `data`.

use augsim_terminal::discover_args::TimeColumn;
use clap::{Args as ClapArgs, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Options of `data`.
#[derive(Debug, ClapArgs)]
pub struct Data {
    /// Action on data files.
    #[command(subcommand)]
    pub action: DataAction,
}

/// Actions of `augsim data`.
#[derive(Debug, Subcommand)]
pub enum DataAction {
    /// List the columns, units, lengths, sampling rates, gaps, streams and ranges of a data set, and run
    /// all data checks.
    Inspect {
        /// Data file: CSV (plain or gzip), NPZ, or published push files (HDF5, JSON, a zip archive or a
        /// folder of them).
        file: PathBuf,
        /// Model file (TOML). It enables the checks that compare the data with gravity, with declared
        /// temperatures and with the declared sensor noise.
        #[arg(long)]
        model: Option<PathBuf>,
        /// Time column of the data.
        #[command(flatten)]
        time: TimeColumn,
    },
    /// Convert a published data set into a data file and, where a built-in model fits, a starting model
    /// file.
    ///
    /// Use `convert SET IN OUT.csv`, or `convert FOLDER --out DIR` if the folder has the name of its
    /// set.
    Convert {
        /// Name of the set (mit-push, mit-pusher-slider, cmu-mlab, desilva-ball-drops,
        /// paper-stack-bounces, spindoe-table-tennis), or a folder with this name.
        set: PathBuf,
        /// Folder, archive or file that holds the set.
        #[arg(requires = "file", conflicts_with = "out")]
        input: Option<PathBuf>,
        /// Data file to write: `.csv`, `.csv.gz` or `.npz`. The model file is written next to it as
        /// `<name>.model.toml`.
        file: Option<PathBuf>,
        /// Output folder for `data.csv` and `model.toml` if only FOLDER is given.
        #[arg(long, default_value = "out/data")]
        out: PathBuf,
        /// Interpolate all streams onto a common clock with this sampling rate. Without it each stream
        /// keeps its own clock, and flag columns mark the rows with new samples.
        #[arg(long)]
        rate_hz: Option<f64>,
        /// Replace jittered time stamps by the regular frame times, with one frame period for all
        /// trajectories that is estimated from the time stamps.
        #[arg(long, conflicts_with = "rate_hz")]
        frame_clock: bool,
        /// Coordinate frame of pushes: as recorded (robot base), or relative to the first pose of the
        /// object.
        #[arg(long, value_enum, default_value_t = Frame::World)]
        frame: Frame,
    },
}

/// Coordinate frame of converted pushes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Frame {
    /// As recorded (robot base).
    World,
    /// The object starts at the origin with orientation zero.
    Start,
}
