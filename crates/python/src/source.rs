//! Data from Python: a file, or columns of a table.

use crate::error::unlocked;
use crate::numbers::{Numbers, memory};
use augsim_data::{Dataset, MissingCells, Trajectory, write_dataset};
use augsim_session::usage::UnknownName;
use augsim_session::{DataFrom, Usage, table};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::path::PathBuf;

/// Source of trajectories: a file, a folder or the columns of a table.
#[pyclass(frozen, module = "augsim._augsim")]
pub struct Source {
    pub from: DataFrom,
}

/// Values of one column of a table. The Python package has checked that the column is one-dimensional and
/// contiguous.
#[derive(FromPyObject)]
enum Column {
    Text(Vec<String>),
    Numbers(Numbers),
}

#[pymethods]
impl Source {
    /// Creates a source from the path of a file or folder.
    #[staticmethod]
    fn file(path: PathBuf) -> Self {
        Source { from: DataFrom::File(path) }
    }

    /// Creates a source from named columns; NaN is a missing value.
    #[staticmethod]
    fn columns(py: Python<'_>, name: String, columns: Vec<(String, Column)>) -> PyResult<Self> {
        let owned = columns
            .into_iter()
            .map(|(column, cells)| {
                let cells = match cells {
                    Column::Text(text) => table::Cells::Text(text),
                    Column::Numbers(numbers) => table::Cells::Numbers(numbers.into_vec()),
                };
                (column, cells)
            })
            .collect::<Vec<_>>();
        let csv = unlocked(py, move || table::csv(&owned))?;
        Ok(Source { from: DataFrom::Table { name, csv: csv.into() } })
    }

    /// Returns the name of the data source, as messages give it.
    fn name(&self) -> String {
        self.from.to_string()
    }
}

/// Trajectories that were read into memory, with their source.
#[pyclass(frozen, module = "augsim._augsim")]
pub struct Data {
    pub source: Py<Source>,
    set: Dataset,
}

/// Reads the trajectories of a source. The names of its columns end in their units.
#[pyfunction]
pub fn read(py: Python<'_>, source: Py<Source>) -> PyResult<Data> {
    let from = source.get().from.clone();
    let set = unlocked(py, move || Ok(from.read(MissingCells::AsGap)?))?;
    Ok(Data { source, set })
}

impl Data {
    /// Wraps generated trajectories as data that were read from a table.
    pub fn from_dataset(py: Python<'_>, set: Dataset) -> PyResult<Self> {
        let csv = unlocked(py, || table::csv(&table::long(&set)))?;
        let from = DataFrom::Table { name: "table".to_owned(), csv: csv.into() };
        Ok(Data { source: Py::new(py, Source { from })?, set })
    }
}

#[pymethods]
impl Data {
    /// Returns the source from which the data were read.
    fn source(&self, py: Python<'_>) -> Py<Source> {
        self.source.clone_ref(py)
    }

    /// Writes the trajectories to a CSV file.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        unlocked(py, || Ok(write_dataset(&self.set, &path)?))
    }

    /// Returns the name and the unit symbol of each column.
    fn columns(&self) -> Vec<(String, String)> {
        self.set.columns().iter().map(|c| (c.name().to_owned(), c.unit().symbol())).collect()
    }

    /// Returns the identifier, group (`None` without groups) and number of samples of each trajectory.
    fn trajectories(&self) -> Vec<(String, Option<String>, usize)> {
        let each = |t: &Trajectory| (t.id().to_owned(), t.group().map(str::to_owned), t.len());
        self.set.trajectories().iter().map(each).collect()
    }

    /// Returns the times (name `t_s`) or the values of a column, concatenated over all trajectories.
    fn series<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyByteArray>> {
        let all = self.set.trajectories().iter();
        let values: Vec<f64> = if name == augsim_data::TIME {
            all.flat_map(|t| t.time_s()).copied().collect()
        } else {
            let column = unlocked(py, || Ok(self.set.column_index(name)?))?;
            all.flat_map(|t| t.column(column)).copied().collect()
        };
        memory(py, &values)
    }
}

/// Parses the names of the data checks whose findings are ignored.
///
/// A name that is not that of a data check.
pub fn accepted(names: &[String]) -> anyhow::Result<Vec<augsim_data::checks::Check>> {
    use augsim_data::checks::Check;
    let check = |name: &String| {
        Check::named(name).ok_or_else(|| {
            let known = Check::all().map(Check::name).collect();
            Usage::Unknown(UnknownName::Check { name: name.clone(), known }).into()
        })
    };
    names.iter().map(check).collect()
}
