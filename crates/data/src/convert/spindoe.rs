//! Converter of `spindoe-table-tennis`: flights with measured spin (Gossard et al., SpinDOE, 2023).

use super::Converted;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::{DataError, RowRemedy};
use crate::trajectory::Trajectory;
use crate::whole_file::read_log;
use std::collections::BTreeMap;
use std::path::Path;

const LAYOUT: &str = "the index needs the columns `traj_file,x_spin,y_spin,z_spin`";
/// Recorded height of the ball when it touches the table, m, from the description of the set.
const CONTACT_CENTRE_M: f64 = -0.003;
/// Half length and half width of the table, m.
const HALF_TABLE_M: (f64, f64) = (1.52, 0.86);
/// Maximum plausible spin, rad/s; larger values are outliers of the spin measurement.
const MAX_SPIN_RAD_S: f64 = 900.0;

/// Model file of a table-tennis ball with gravity and constant restitution.
const MODEL: &str = "\
scenario = \"ball\"

[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
restitution = { nominal = 0.9, min = 0.0, max = 1.0 }
radius_m = 0.02
inertia_ratio = 0.6667

[release]
kind = \"free\"
";

/// Converts the flights `NNN.csv` (`t;x;y;z`, no header) that `index.csv` lists, with their spins.
///
/// Flights without a plausible spin or with times that do not increase are left out. A flight ends where the
/// ball is below the surface of the table, or beside the table and low.
pub(super) fn convert(folder: &Path) -> Result<Converted, DataError> {
    let mut index = CsvSource::open(&folder.join("index.csv"))?;
    let mut cells = Vec::new();
    for name in ["traj_file", "x_spin", "y_spin", "z_spin"] {
        cells.push(index.require(name, LAYOUT)?);
    }
    let mut spins = BTreeMap::new();
    while index.next_row()? {
        let number = |cell: usize| index.required_number(cells[cell]);
        spins.insert(number(0)? as u32, [number(1)?, number(2)?, number(3)?]);
    }
    let mut trajectories = Vec::new();
    for (number, spin) in spins {
        let name = format!("{number:03}");
        let path = folder.join(format!("{name}.csv"));
        let is_plausible = spin.iter().map(|w| w * w).sum::<f64>().sqrt() < MAX_SPIN_RAD_S;
        if !path.exists() || !is_plausible {
            continue;
        }
        let text = read_log(&path)?;
        let mut columns: [Vec<f64>; 4] = Default::default();
        for (line, row) in text.lines().enumerate() {
            let cells: Vec<&str> = row.split(';').map(str::trim).collect();
            if cells.len() != 4 {
                let (found, expected) = (cells.len(), 4);
                let (line, first_column) = (line as u64 + 1, "t".into());
                return Err(DataError::RaggedRow {
                    path,
                    line,
                    found,
                    expected,
                    first_column,
                    remedy: RowRemedy::Complete,
                });
            }
            for (cell, column) in cells.iter().zip(&mut columns) {
                match cell.parse::<f64>() {
                    Ok(v) if v.is_finite() => column.push(v),
                    _ => {
                        let (line, cell) = (line as u64 + 1, (*cell).to_owned());
                        return Err(DataError::BadNumber { path, line, column: "t;x;y;z".into(), cell });
                    }
                }
            }
        }
        let [t, x, y, z] = columns;
        let z: Vec<f64> = z.iter().map(|v| v - CONTACT_CENTRE_M).collect();
        let is_over_table = |k: usize| x[k].abs() < HALF_TABLE_M.1 && y[k].abs() < HALF_TABLE_M.0;
        let end =
            (0..t.len()).find(|&k| z[k] < -0.03 || (z[k] < 0.08 && !is_over_table(k))).unwrap_or(t.len());
        let is_increasing = t.windows(2).take(end.saturating_sub(1)).all(|w| w[1] > w[0]);
        if end < 15 || !is_increasing {
            continue;
        }
        let constant = |v: f64| vec![v; end];
        let values = vec![
            x[..end].to_vec(),
            y[..end].to_vec(),
            z[..end].to_vec(),
            constant(spin[0]),
            constant(spin[1]),
            constant(spin[2]),
        ];
        trajectories.push(Trajectory::new(name, t[..end].to_vec(), values)?);
    }
    let names = ["x_m", "y_m", "z_m", "spin_x_rad_s", "spin_y_rad_s", "spin_z_rad_s"];
    Ok(Converted { data: Dataset::from_names(&names, trajectories)?, model_toml: Some(MODEL.to_owned()) })
}
