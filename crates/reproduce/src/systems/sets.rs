//! Benchmark sets: files, declared textbook models, metrics and published results.

use augsim_data::{Column, DataError, Dataset, NamedCsv, Trajectory, Unit};
use std::path::Path;

/// A published error of another method on the same test record of a benchmark set.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Published {
    /// Name of the method.
    pub method: &'static str,
    /// Published error, in the unit of the table.
    pub error: f64,
    /// Whether the value was checked in its source; else it is from memory.
    pub verified: bool,
}

/// Training record and test record of a benchmark set.
#[derive(Debug)]
pub struct Records {
    pub train: Dataset,
    pub test: Dataset,
}

/// A benchmark data set of system identification.
#[derive(Debug, Clone, Copy)]
pub struct Set {
    /// Name of the folder with the data of the set.
    pub name: &'static str,
    /// Text of the model file with the textbook model.
    pub model: &'static str,
    /// Number of first samples from which the initial state of the free run is estimated.
    pub burn_in: usize,
    /// `(unit of the table, factor from the output's unit to it)`.
    pub unit: (&'static str, f64),
    /// Description of the error metric of the benchmark.
    pub metric: &'static str,
    /// Citation of the source of the data.
    pub source: &'static str,
    /// Errors of other methods that were published for this test record.
    pub published: &'static [Published],
    /// Reads training and test record from the folder.
    pub read: fn(&Path) -> Result<Records, DataError>,
}

const fn verified(method: &'static str, error: f64) -> Published {
    Published { method, error, verified: true }
}

const fn from_memory(method: &'static str, error: f64) -> Published {
    Published { method, error, verified: false }
}

/// All benchmark sets of `reproduce systems`.
pub const SETS: [Set; 3] = [
    Set {
        name: "silverbox",
        model: include_str!("../../models/silverbox.toml"),
        burn_in: 50,
        unit: ("mV", 1e3),
        metric: "free run over the last 21,688 samples of the multisine, start from 50 samples",
        source: "Wigren, Schoukens: Three free data sets for development and benchmarking in nonlinear system identification, \
                 ECC 2013",
        published: &[
            verified("GRU", 1.49),
            verified("LSTM", 1.50),
            verified("RNN", 1.64),
            verified("FIR-MLP", 18.9),
        ],
        read: silverbox,
    },
    Set {
        name: "emps",
        model: include_str!("../../models/emps.toml"),
        burn_in: 20,
        unit: ("mm", 1e3),
        metric: "open loop over 24.8 s of the validation record, start from 20 samples",
        source: "Janot, Gautier, Brunot: Data Set and Reference Models of EMPS, Nonlinear System Identification Benchmarks 2019",
        published: &[
            verified("LSTM", 74.1),
            verified("RNN", 89.2),
            verified("FIR-MLP", 120.8),
            verified("GRU", 220.0),
        ],
        read: emps,
    },
    Set {
        name: "cascaded-tanks",
        model: include_str!("../../models/cascaded-tanks.toml"),
        burn_in: 5,
        unit: ("V", 1.0),
        metric: "free run over the validation record, start from 5 samples",
        source: "Schoukens, Mattsson, Wigren, Noel: Cascaded tanks benchmark combining soft and hard nonlinearities, 2016",
        published: &[
            verified("grey box with overflow", 0.18),
            from_memory("continuous-time subspace encoder", 0.22),
            verified("truncated-simulation net", 0.33),
            verified("NLSS2", 0.34),
            verified("GRU", 0.396),
            verified("soft-constrained net", 0.40),
            verified("pNARX", 0.413),
            verified("GP-inspired state space", 0.45),
            verified("Volterra", 0.54),
            verified("best linear model", 0.75),
        ],
        read: tanks,
    },
];

/// Sampling rate of the Silverbox record, Hz; the next constant is the number of rows of its training part.
const RATE_HZ: f64 = 1e7 / 16_384.0;
const SILVERBOX_TRAIN: usize = 65_062;

/// Reads columns of a CSV file by name, with their units.
fn record(path: &Path, wanted: &[(&str, Unit)]) -> Result<Dataset, DataError> {
    NamedCsv::open(path)?.read(wanted)
}

fn volt() -> Unit {
    Unit::parse("V").unwrap_or(Unit::DIMENSIONLESS)
}

fn silverbox(folder: &Path) -> Result<Records, DataError> {
    let path = folder.join("multisine.csv.gz");
    let all = NamedCsv::open(&path)?.read_with_clock("sample", &[("u_v", volt()), ("y_v", volt())])?;
    let part = |from: usize, to: usize| -> Result<Dataset, DataError> {
        let trajectories = all.trajectories().iter().map(|t| {
            let range = from.min(t.len())..to.min(t.len());
            let times = (0..range.len()).map(|k| k as f64 / RATE_HZ).collect();
            let values = t.values().iter().map(|column| column[range.clone()].to_vec()).collect();
            Trajectory::new(t.id(), times, values)
        });
        let columns: Vec<Column> = all.columns().to_vec();
        Ok(Dataset::new(columns, trajectories.collect::<Result<_, _>>()?)?.with_path(&path))
    };
    Ok(Records { train: part(0, SILVERBOX_TRAIN)?, test: part(SILVERBOX_TRAIN, usize::MAX)? })
}

fn emps(folder: &Path) -> Result<Records, DataError> {
    let read = |name: &str| record(&folder.join(name), &[("vir_v", volt()), ("position_m", Unit::METRE)]);
    Ok(Records { train: read("estimation.csv.gz")?, test: read("validation.csv.gz")? })
}

fn tanks(folder: &Path) -> Result<Records, DataError> {
    let read = |name: &str| record(&folder.join(name), &[("pump_v", volt()), ("lower_level_v", volt())]);
    Ok(Records { train: read("estimation.csv")?, test: read("validation.csv")? })
}
