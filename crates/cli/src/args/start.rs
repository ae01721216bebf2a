//! Options of `start`.

use augsim_data::ColumnMapping;
use clap::Args as ClapArgs;
use std::path::PathBuf;

/// Options of `start`.
#[derive(Debug, ClapArgs)]
pub struct Start {
    /// Recordings as text files, plain or gzip: one file with all trajectories, one file per trajectory,
    /// or a folder of files.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
    /// Output folder for `data.csv` and `model.toml`.
    #[arg(long, default_value = "out/start")]
    pub out: PathBuf,
    /// Time column, with its unit after a colon: `clock:ms`, `frame:frames`.
    #[arg(long, value_name = "NAME[:UNIT]")]
    pub time: Option<String>,
    /// Column that identifies the trajectory.
    #[arg(long, value_name = "NAME")]
    pub trajectory: Option<String>,
    /// Coordinate columns: name in the file, new name, and the unit in the file or the number of metres
    /// per unit; separated by commas.
    #[arg(long, value_name = "NAME=COLUMN[:UNIT],…", value_delimiter = ',')]
    pub columns: Vec<ColumnMapping>,
    /// Coordinate that points upwards, or downwards if it has a minus sign, as in images: `-y`.
    #[arg(long, value_name = "[-]NAME", allow_hyphen_values = true)]
    pub up: Option<String>,
    /// Cell separator: `;`, `tab`, `space`.
    #[arg(long, value_parser = separator)]
    pub sep: Option<char>,
    /// Decimal mark: `.` or `,`.
    #[arg(long, value_parser = [".", ","])]
    pub decimal: Option<String>,
    /// Frame rate in frames per second. It is needed if the time is a frame number or is not recorded.
    #[arg(long)]
    pub rate_hz: Option<f64>,
}

/// Parses the option for the cell separator: one ASCII character, `tab` or `space`.
fn separator(text: &str) -> Result<char, String> {
    let mut chars = text.chars();
    match (text, chars.next(), chars.next()) {
        ("tab" | "\\t", ..) => Ok('\t'),
        ("space" | "blank", ..) => Ok(' '),
        (_, Some(separator), None) if separator.is_ascii() => Ok(separator),
        _ => Err("give one character, or `tab` or `space`".to_owned()),
    }
}
