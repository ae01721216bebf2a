//! `paper-stack-bounces`: marbles on stacks of paper, high-speed video in pixels.

use super::{Converted, required};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::trajectory::Trajectory;
use std::collections::BTreeMap;
use std::path::Path;

const INDEX: &str = "the index has `series,file,sheets,pressure_mbar,usable_impacts,accel_px_per_frame2,t_imp1_frame,v_in1_px_per_frame,note`";
const DROPS: &str = "the drops have `series,file,frame,x_px,y_px`";
const FRAMES_PER_S: f64 = 200.0;
const GRAVITY: f64 = 9.81;
/// Frames on each side of an impact that are left out: the ball is in the paper, which no model of a bounce follows.
const CONTACT_FRAMES: f64 = 3.0;

/// One constant restitution for each stack; each drop has its own scale (a gravity of its own, in metres of a scale that is
/// only roughly known) and its own floor.
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

/// Reads `index.csv` and `drops.csv`: drops with usable impacts, from after the release (the tracks begin while the ball is
/// held), in metres by each drop's own free-flight acceleration, heights above the first contact. Restitution depends on
/// the stack (series, sheets, air pressure), which is the group of a drop; what is asked is whether it is constant for a stack.
pub(super) fn convert(folder: &Path) -> Result<Converted, DataError> {
    let mut index = CsvSource::open(&folder.join("index.csv"))?;
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
    let mut wanted = BTreeMap::new();
    while index.next_row()? {
        let key = (index.text(cells[0])?.to_owned(), index.text(cells[1])?.to_owned());
        let numbers = [
            index.number(cells[3])?,
            index.number(cells[4])?,
            index.number(cells[5])?,
            index.number(cells[2])?,
        ];
        let noted = !index.text(cells[6])?.is_empty();
        if let [Some(accel), Some(impact), Some(speed), Some(impacts)] = numbers
            && impacts >= 2.0
            && !noted
        {
            let (sheets, pressure) = (index.text(cells[7])?, index.text(cells[8])?);
            let air = if pressure.is_empty() { String::new() } else { format!(" at {pressure} mbar") };
            let stack = format!("{} {sheets} sheets{air}", key.0);
            let mut impacts = vec![impact];
            let mut leaving = index.number(cells[9])?.map(|e| e * speed);
            for (arriving, restitution) in [(cells[10], Some(cells[11])), (cells[12], None)] {
                let (Some(out), Some(into)) = (leaving, index.number(arriving)?) else { break };
                impacts.push(impacts[impacts.len() - 1] + (out + into) / accel);
                leaving = match restitution {
                    Some(cell) => index.number(cell)?.map(|e| e * into),
                    None => None,
                };
            }
            wanted.insert(key, (accel, impacts, speed, stack));
        }
    }
    let mut source = CsvSource::open(&folder.join("drops.csv"))?;
    let mut cells = Vec::new();
    for name in ["series", "file", "frame", "y_px"] {
        cells.push(source.require(name, DROPS)?);
    }
    let mut tracks: BTreeMap<(String, String), Vec<(f64, f64)>> = BTreeMap::new();
    while source.next_row()? {
        let key = (source.text(cells[0])?.to_owned(), source.text(cells[1])?.to_owned());
        if wanted.contains_key(&key) {
            let sample = (required(&source, cells[2])?, required(&source, cells[3])?);
            tracks.entry(key).or_default().push(sample);
        }
    }
    let mut trajectories = Vec::new();
    for ((series, file), track) in tracks {
        let key = (series, file);
        let Some((accel, impacts, speed, stack)) = wanted.remove(&key) else { continue };
        let impact = impacts[0];
        let (series, file) = key;
        let metres = GRAVITY / (accel * FRAMES_PER_S * FRAMES_PER_S);
        // The fall lasted speed / accel frames; its first fifth may still be in the hand.
        let begin = impact - 0.8 * speed / accel;
        let track: Vec<_> = track.into_iter().filter(|s| s.0 >= begin).collect();
        let increasing = track.windows(2).all(|w| w[1].0 > w[0].0);
        let floor =
            track.iter().filter(|s| (s.0 - impact).abs() <= 2.0).map(|s| s.1).fold(f64::NAN, f64::max);
        if track.len() < 20 || !increasing || !floor.is_finite() {
            continue;
        }
        let track: Vec<_> =
            track.into_iter().filter(|s| impacts.iter().all(|i| (s.0 - i).abs() > CONTACT_FRAMES)).collect();
        let times = track.iter().map(|s| (s.0 - begin) / FRAMES_PER_S).collect();
        let heights = track.iter().map(|s| (floor - s.1) * metres).collect();
        let drop = Trajectory::new(format!("{series}/{file}"), times, vec![heights])?;
        trajectories.push(drop.with_group(stack)?);
    }
    Ok(Converted {
        data: Dataset::from_names(&["height_m"], trajectories)?,
        model_toml: Some(MODEL.to_owned()),
    })
}
