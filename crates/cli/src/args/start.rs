//! Arguments and options of `augsim start`.

use augsim_data::Renamed;
use clap::Args as ClapArgs;
use std::path::PathBuf;

/// Options of `start`.
#[derive(Debug, ClapArgs)]
pub struct Start {
    /// Recordings as text: one file with all trajectories, one file each, or a folder of files; plain or gzip.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
    /// Directory for `data.csv` and `model.toml`.
    #[arg(long, default_value = "out/start")]
    pub out: PathBuf,
    /// Column of the time, with its unit after a colon: `clock:ms`, `frame:frames`.
    #[arg(long, value_name = "NAME[:UNIT]")]
    pub time: Option<String>,
    /// Column that names the trajectory.
    #[arg(long, value_name = "NAME")]
    pub trajectory: Option<String>,
    /// Coordinates by hand: name in the file, name here, unit in the file or metres that one has; separated by commas.
    #[arg(long, value_name = "NAME=COLUMN[:UNIT],…", value_delimiter = ',')]
    pub columns: Vec<Renamed>,
    /// Coordinate that counts upwards, or with a minus downwards, as in images: `-y`.
    #[arg(long, value_name = "[-]NAME", allow_hyphen_values = true)]
    pub up: Option<String>,
    /// Character between cells: `;`, `tab`, `space`.
    #[arg(long, value_parser = separator)]
    pub sep: Option<char>,
    /// Decimal mark: `.` or `,`.
    #[arg(long, value_parser = [".", ","])]
    pub decimal: Option<String>,
    /// Frames a second, where the time is a number of frames or is not recorded.
    #[arg(long)]
    pub rate_hz: Option<f64>,
}

/// A separator as it is typed.
fn separator(text: &str) -> Result<char, String> {
    let mut all = text.chars();
    match (text, all.next(), all.next()) {
        ("tab" | "\\t", ..) => Ok('\t'),
        ("space" | "blank", ..) => Ok(' '),
        (_, Some(one), None) if one.is_ascii() => Ok(one),
        _ => Err("give one character, or `tab` or `space`".to_owned()),
    }
}
