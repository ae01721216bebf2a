//! Converter of `paper-stack-bounces`: marbles on stacks of paper, high-speed video in pixels.

use super::Converted;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::trajectory::Trajectory;
use std::collections::BTreeMap;
use std::path::Path;

const INDEX: &str = "`index.csv` needs the columns `series,file,sheets,pressure_mbar,usable_impacts,accel_px_per_frame2,t_imp1_frame,v_in1_px_per_frame,e1,v_in2_px_per_frame,e2,v_in3_px_per_frame,note`";
const DROPS: &str = "`drops.csv` needs the columns `series,file,frame,y_px`";
const FRAMES_PER_S: f64 = 200.0;
/// Gravity of the Earth, m/s².
const GRAVITY: f64 = 9.81;
/// Number of video frames on each side of an impact that are left out.
///
/// The ball is then in contact with the paper, which is not modelled.
const CONTACT_FRAMES: f64 = 3.0;

/// Model file with one constant restitution per stack of paper and one floor height per drop.
const MODEL: &str = "\
scenario = \"ball\"

[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
restitution = { nominal = 0.5, min = 0.0, max = 1.0, per = \"group\" }

[release]
kind = \"free\"

[[effect]]
kind = \"height-offset\"
b_m = { nominal = 0.0, per = \"trajectory\" }
";

/// Drop of a marble as the index file describes it; lengths are in pixels, times in frames.
struct Drop {
    /// Acceleration of the ball in free flight, pixels per frame squared.
    acceleration: f64,
    /// Speed of the ball before the first impact, pixels per frame.
    speed: f64,
    /// Times of the impacts, frames.
    impacts: Vec<f64>,
    /// Label of the stack (series, sheets of paper and air pressure), which becomes the group.
    stack: String,
}

/// Series and file name, which together identify a drop.
type DropKey = (String, String);

/// Converts the drops with at least two usable impacts to heights above the first contact, m.
///
/// The files are `index.csv` and `drops.csv`. The scale of each drop is its acceleration in free flight. The
/// track begins while the ball is held, so it is used from a time after the release. Restitution depends on
/// the stack (series, sheets, air pressure), which is the group.
pub(super) fn convert(folder: &Path) -> Result<Converted, DataError> {
    let mut drops = read_index(&folder.join("index.csv"))?;
    let tracks = read_tracks(&folder.join("drops.csv"), &drops)?;
    let mut trajectories = Vec::new();
    for (key, track) in tracks {
        let Some(drop) = drops.remove(&key) else { continue };
        let impact = drop.impacts[0];
        let metres_per_px = GRAVITY / (drop.acceleration * FRAMES_PER_S * FRAMES_PER_S);
        // The fall lasts speed / acceleration frames; in the first fifth the ball may still be held.
        let begin = impact - 0.8 * drop.speed / drop.acceleration;
        let track: Vec<_> = track.into_iter().filter(|s| s.0 >= begin).collect();
        let is_increasing = track.windows(2).all(|w| w[1].0 > w[0].0);
        let floor =
            track.iter().filter(|s| (s.0 - impact).abs() <= 2.0).map(|s| s.1).fold(f64::NAN, f64::max);
        if track.len() < 20 || !is_increasing || !floor.is_finite() {
            continue;
        }
        let is_flight = |s: &(f64, f64)| drop.impacts.iter().all(|i| (s.0 - i).abs() > CONTACT_FRAMES);
        let track: Vec<_> = track.into_iter().filter(is_flight).collect();
        let times = track.iter().map(|s| (s.0 - begin) / FRAMES_PER_S).collect();
        let heights = track.iter().map(|s| (floor - s.1) * metres_per_px).collect();
        let (series, file) = key;
        let trajectory = Trajectory::new(format!("{series}/{file}"), times, vec![heights])?;
        trajectories.push(trajectory.with_group(drop.stack)?);
    }
    Ok(Converted {
        data: Dataset::from_names(&["height_m"], trajectories)?,
        model_toml: Some(MODEL.to_owned()),
    })
}

/// Reads from the index the drops with at least two usable impacts and no remark.
fn read_index(path: &Path) -> Result<BTreeMap<DropKey, Drop>, DataError> {
    let mut index = CsvSource::open(path)?;
    let mut cells = Vec::new();
    for name in [
        "series",
        "file",
        "usable_impacts",
        "accel_px_per_frame2",
        "t_imp1_frame",
        "v_in1_px_per_frame",
        "note",
        "sheets",
        "pressure_mbar",
        "e1",
        "v_in2_px_per_frame",
        "e2",
        "v_in3_px_per_frame",
    ] {
        cells.push(index.require(name, INDEX)?);
    }
    let mut drops = BTreeMap::new();
    while index.next_row()? {
        let key = (index.text(cells[0])?.to_owned(), index.text(cells[1])?.to_owned());
        let numbers = [
            index.number(cells[3])?,
            index.number(cells[4])?,
            index.number(cells[5])?,
            index.number(cells[2])?,
        ];
        let has_remark = !index.text(cells[6])?.is_empty();
        if let [Some(acceleration), Some(impact), Some(speed), Some(usable_impacts)] = numbers
            && usable_impacts >= 2.0
            && !has_remark
        {
            let (sheets, pressure) = (index.text(cells[7])?, index.text(cells[8])?);
            let air = if pressure.is_empty() { String::new() } else { format!(" at {pressure} mbar") };
            let stack = format!("{} {sheets} sheets{air}", key.0);
            let mut impacts = vec![impact];
            // A flight from speed v_out to speed v_in lasts (v_out + v_in) / acceleration.
            let mut speed_out = index.number(cells[9])?.map(|e| e * speed);
            for (speed_in, restitution) in [(cells[10], Some(cells[11])), (cells[12], None)] {
                let (Some(v_out), Some(v_in)) = (speed_out, index.number(speed_in)?) else { break };
                impacts.push(impacts[impacts.len() - 1] + (v_out + v_in) / acceleration);
                speed_out = match restitution {
                    Some(cell) => index.number(cell)?.map(|e| e * v_in),
                    None => None,
                };
            }
            drops.insert(key, Drop { acceleration, speed, impacts, stack });
        }
    }
    Ok(drops)
}

/// Reads the tracks of `drops`: pairs of frame number and vertical position in pixels, downwards.
fn read_tracks(
    path: &Path,
    drops: &BTreeMap<DropKey, Drop>,
) -> Result<BTreeMap<DropKey, Vec<(f64, f64)>>, DataError> {
    let mut source = CsvSource::open(path)?;
    let mut cells = Vec::new();
    for name in ["series", "file", "frame", "y_px"] {
        cells.push(source.require(name, DROPS)?);
    }
    let mut tracks: BTreeMap<DropKey, Vec<(f64, f64)>> = BTreeMap::new();
    while source.next_row()? {
        let key = (source.text(cells[0])?.to_owned(), source.text(cells[1])?.to_owned());
        if drops.contains_key(&key) {
            let sample = (source.required_number(cells[2])?, source.required_number(cells[3])?);
            tracks.entry(key).or_default().push(sample);
        }
    }
    Ok(tracks)
}
