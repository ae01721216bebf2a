//! Converter of `desilva-ball-drops`: balls dropped from a bridge (de Silva et al., Front. AI 2020).

use super::Converted;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::trajectory::Trajectory;
use std::path::Path;

const LAYOUT: &str = "`drops.csv` needs the columns `ball,drop,t_s,height_m`";

/// Distance below the highest point from which a drop is used, m; higher up the ball may still be held.
const MIN_FALL_M: f64 = 1.0;

/// Model file of a ball that falls under gravity alone.
///
/// The time of release is uncertain, so the initial position and velocity are fitted.
const MODEL: &str = "\
scenario = \"ball\"

[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }

[release]
kind = \"free\"
";

/// Converts `drops.csv` to one trajectory per drop with the column `height_m`; the group is the ball.
///
/// The velocities in the file are not read, because they are derived from the heights.
pub(super) fn convert(folder: &Path) -> Result<Converted, DataError> {
    let mut source = CsvSource::open(&folder.join("drops.csv"))?;
    let mut cells = Vec::new();
    for name in ["ball", "drop", "t_s", "height_m"] {
        cells.push(source.require(name, LAYOUT)?);
    }
    let mut drops: Vec<(String, String, Vec<f64>, Vec<f64>)> = Vec::new();
    while source.next_row()? {
        let (ball, drop) = (source.text(cells[0])?.to_owned(), source.text(cells[1])?.to_owned());
        let (t, height) = (source.required_number(cells[2])?, source.required_number(cells[3])?);
        let id = format!("{ball}-{drop}");
        if drops.last().is_none_or(|d| d.0 != id) {
            drops.push((id, ball, Vec::new(), Vec::new()));
        }
        if let Some(last) = drops.last_mut() {
            last.2.push(t);
            last.3.push(height);
        }
    }
    let trajectories = drops
        .into_iter()
        .map(|(id, ball, mut t, mut z)| {
            let top = z.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let begin = z.iter().rposition(|&h| h > top - MIN_FALL_M).map_or(0, |k| k + 1).min(z.len() - 1);
            t.drain(..begin);
            z.drain(..begin);
            Trajectory::new(id, t, vec![z])?.with_group(ball)
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Converted {
        data: Dataset::from_names(&["height_m"], trajectories)?,
        model_toml: Some(MODEL.to_owned()),
    })
}
