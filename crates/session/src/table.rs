//! Conversion of a table in memory to a CSV file, and of a data set to a table.

use augsim_data::{Dataset, GROUP, TIME, TRAJECTORY, Trajectory, escaped_short};
use thiserror::Error;

/// Error: a table in memory cannot be written as measurements.
#[derive(Debug, Error)]
pub enum TableFault {
    /// The table has no columns.
    #[error("the table has no columns; it needs `trajectory`, `t_s` and measured ones")]
    NoColumns,
    /// Two columns of the table have different lengths.
    #[error(
        "the table's column `{}` has {found} values, but `{}` has {rows}",
        escaped_short(name),
        escaped_short(first)
    )]
    Lengths {
        /// Name of the deviating column.
        name: String,
        /// Number of values of the deviating column.
        found: usize,
        /// Name of the first column.
        first: String,
        /// Number of values of the first column.
        rows: usize,
    },
    /// A number in the table is infinite.
    #[error(
        "the table's column `{}`, row {row}: {value} is no measurement; use NaN for a missing value",
        escaped_short(name)
    )]
    Infinite {
        /// Name of the column with the infinite number.
        name: String,
        /// Row of the infinite number, counted from 0.
        row: usize,
        /// The infinite number.
        value: f64,
    },
}

/// Values of a table's column: texts or numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// Labels of trajectories or groups.
    Text(Vec<String>),
    /// Numbers; NaN marks a missing value.
    Numbers(Vec<f64>),
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Cells::Text(text) => text.len(),
            Cells::Numbers(numbers) => numbers.len(),
        }
    }
}

/// Writes named columns as a CSV file.
///
/// Numbers are written with all digits needed to read them back exactly.
///
/// # Errors
/// There is no column, columns differ in length, or a number is infinite.
pub fn csv(columns: &[(String, Cells)]) -> anyhow::Result<Vec<u8>> {
    let Some((first, rows)) = columns.first().map(|(name, cells)| (name, cells.len())) else {
        return Err(TableFault::NoColumns.into());
    };
    if let Some((name, cells)) = columns.iter().find(|(_, cells)| cells.len() != rows) {
        let (name, first, found) = (name.clone(), first.clone(), cells.len());
        return Err(TableFault::Lengths { name, found, first, rows }.into());
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.iter().map(|(name, _)| name))?;
    for row in 0..rows {
        for (name, cells) in columns {
            match cells {
                Cells::Text(text) => writer.write_field(&text[row])?,
                Cells::Numbers(numbers) if numbers[row].is_nan() => writer.write_field("")?,
                Cells::Numbers(numbers) if numbers[row].is_finite() => {
                    writer.write_field(format!("{:e}", numbers[row]))?;
                }
                Cells::Numbers(numbers) => {
                    let (name, value) = (name.clone(), numbers[row]);
                    return Err(TableFault::Infinite { name, row, value }.into());
                }
            }
        }
        writer.write_record(None::<&[u8]>)?;
    }
    Ok(writer.into_inner()?)
}

/// Converts a data set to named columns in long format: one row per sample.
pub fn long(set: &Dataset) -> Vec<(String, Cells)> {
    let trajectories = || set.trajectories().iter();
    let labels = |label: &dyn Fn(&Trajectory) -> String| {
        Cells::Text(trajectories().flat_map(|t| std::iter::repeat_n(label(t), t.len())).collect())
    };
    let mut columns = vec![(TRAJECTORY.to_owned(), labels(&|t| t.id().to_owned()))];
    if trajectories().any(|t| t.group().is_some()) {
        columns.push((GROUP.to_owned(), labels(&|t| t.group().unwrap_or_default().to_owned())));
    }
    columns
        .push((TIME.to_owned(), Cells::Numbers(trajectories().flat_map(|t| t.time_s()).copied().collect())));
    columns.extend(set.columns().iter().enumerate().map(|(i, column)| {
        (
            column.name().to_owned(),
            Cells::Numbers(trajectories().flat_map(|t| t.column(i)).copied().collect()),
        )
    }));
    columns
}

#[cfg(test)]
mod tests {
    //! Contract: numbers read back from the CSV file are equal to those of the table, bit for bit.
    use super::*;
    use crate::DataFrom;
    use augsim_data::MissingCells;

    fn numbers(values: &[f64]) -> Cells {
        Cells::Numbers(values.to_vec())
    }

    #[test]
    fn a_table_reads_back_to_the_last_bit() {
        let heights = [0.1 + 0.2, f64::NAN, 5e-324, -1.797e308];
        let table = [
            ("trajectory".to_owned(), Cells::Text(["a, b", "a, b", "c\"", "c\""].map(String::from).to_vec())),
            ("t_s".to_owned(), numbers(&[0.0, 1.0 / 3.0, 0.0, 1e-9])),
            ("height_m".to_owned(), numbers(&heights)),
        ];
        let csv = csv(&table).expect("a table").into();
        let data = DataFrom::Table { name: "table".into(), csv }.read(MissingCells::AsGap).expect("data");
        let back: Vec<u64> =
            data.series("height_m").expect("the column").flatten().map(|v| v.to_bits()).collect();
        assert_eq!(back, heights.map(|v| if v.is_nan() { f64::NAN.to_bits() } else { v.to_bits() }));
        assert_eq!(data.trajectories()[0].id(), "a, b");
        assert_eq!(data.trajectories()[0].time_s(), [0.0, 1.0 / 3.0]);
    }

    #[test]
    fn invalid_tables_are_refused() {
        let refused = |columns: &[(&str, Cells)]| {
            let owned: Vec<_> = columns.iter().map(|(n, c)| ((*n).to_owned(), c.clone())).collect();
            csv(&owned).unwrap_err().to_string()
        };
        assert!(refused(&[]).contains("no columns"));
        let uneven = [("t_s", numbers(&[0.0, 1.0])), ("height_m", numbers(&[0.0]))];
        assert!(refused(&uneven).contains("`height_m` has 1 values, but `t_s` has 2"));
        assert!(refused(&[("height_m", numbers(&[0.0, f64::INFINITY]))]).contains("row 1: inf"));
    }
}
