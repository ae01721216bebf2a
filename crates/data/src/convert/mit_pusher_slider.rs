//! Converter of `mit-pusher-slider`: controlled pushes of a square (Hogan and Rodriguez, WAFR 2016).

use super::Converted;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::push::PushError;
use crate::push::union_clock::{Source, union};
use crate::trajectory::Trajectory;
use std::path::{Path, PathBuf};

const LAYOUT: &str = "a run needs the columns `t_s,pusher_x_m,pusher_y_m,slider_x_m,slider_y_m,slider_th_rad,pusher_new,slider_new`";
const INDEX: &str = "the index needs the column `file`";

/// Model file of the steel square of 90 mm: c of uniform pressure; mass, rod and friction of the authors.
const MODEL: &str = "\
scenario = \"push\"
object = \"rect1\"

[parameters]
c_m = { nominal = 0.0344, min = 0.005, max = 0.1 }
contact_friction = { nominal = 0.3, min = 0.0, max = 1.0 }
rod_radius_m = { nominal = 0.00475, frozen = true }
support_friction = { nominal = 0.35, frozen = true }
mass_kg = { nominal = 1.053, frozen = true }

[sensor]
position_sd_m = 0.0003
angle_sd_rad = 0.002
";

/// Converts the runs that `index.csv` lists, or a single run.
///
/// `group` is the day (`10-21`) in the file name. The logger repeats the last value; here each stream is
/// interpolated between its fresh samples, and the times begin at 0. The offset of 10 to 20 ms between the
/// two clocks is not corrected.
pub(super) fn convert(path: &Path) -> Result<Converted, DataError> {
    let mut trajectories = Vec::new();
    if path.is_dir() {
        for file in runs(path)? {
            trajectories.push(run(&file)?);
        }
    } else {
        trajectories.push(run(path)?);
    }
    let names = ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad", "pusher_new", "object_new"];
    let data = Dataset::from_names(&names, trajectories)?.with_path(path);
    Ok(Converted { data, model_toml: Some(MODEL.to_owned()) })
}

/// Paths of the files of the runs that the index lists.
fn runs(folder: &Path) -> Result<Vec<PathBuf>, DataError> {
    let index_path = folder.join("index.csv");
    let mut index = CsvSource::open(&index_path)?;
    let file = index.require("file", INDEX)?;
    let mut runs = Vec::new();
    while index.next_row()? {
        let name = index.text(file)?;
        let run = folder.join(name);
        if !run.is_file() {
            return Err(PushError::ListedFileMissing { path: index_path, file: name.to_owned() }.into());
        }
        runs.push(run);
    }
    match runs.is_empty() {
        true => Err(DataError::HeaderOnly { path: index_path }),
        false => Ok(runs),
    }
}

/// Day of a run (month-day) from its file name: `10-21` for `1021_NoPerturbations`.
fn day(id: &str) -> Option<String> {
    let (day, _) = id.split_once('_')?;
    let digits = day.len() == 4 && day.bytes().all(|b| b.is_ascii_digit());
    digits.then(|| format!("{}-{}", &day[..2], &day[2..]))
}

/// Reads one run as a trajectory on the union of the clocks of rod and object.
fn run(path: &Path) -> Result<Trajectory, DataError> {
    let mut source = CsvSource::open(path)?;
    let cell = |name| source.require(name, LAYOUT);
    let time = cell("t_s")?;
    let streams = [
        (cell("pusher_new")?, vec![cell("pusher_x_m")?, cell("pusher_y_m")?]),
        (cell("slider_new")?, vec![cell("slider_x_m")?, cell("slider_y_m")?, cell("slider_th_rad")?]),
    ];
    let mut sources = streams.clone().map(|(_, cells)| Source {
        time_s: Vec::new(),
        columns: vec![Vec::new(); cells.len()],
        angular: vec![false, false, true][..cells.len()].to_vec(),
        max_interpolated_s: f64::INFINITY,
    });
    let id = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (mut start_s, mut previous) = (None, None);
    while source.next_row()? {
        let now = source.required_number(time)?;
        let start_s = *start_s.get_or_insert(now);
        if let Some(previous_s) = previous.replace(now).filter(|&before| now <= before) {
            let (path, line, column) = (path.to_owned(), source.line(), "t_s");
            let (trajectory, time_s) = (id, now);
            return Err(DataError::TimeNotIncreasing { path, line, column, trajectory, previous_s, time_s });
        }
        for ((fresh, cells), stream) in streams.iter().zip(&mut sources) {
            if source.required_number(*fresh)? == 0.0 {
                continue;
            }
            stream.time_s.push(now - start_s);
            for (&cell, column) in cells.iter().zip(&mut stream.columns) {
                column.push(source.required_number(cell)?);
            }
        }
    }
    if sources.iter().any(|s| s.time_s.len() < 2) {
        return Err(DataError::HeaderOnly { path: path.to_owned() });
    }
    let joined = union(&sources).ok_or_else(|| PushError::NoCommonTime { path: path.to_owned() })?;
    let day = day(&id);
    let run = Trajectory::new(id, joined.time_s, [joined.columns, joined.fresh].concat())?;
    match day {
        Some(day) => run.with_group(day),
        None => Ok(run),
    }
}
