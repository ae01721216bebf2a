//! Forecasts as a data set: the columns of the data, and their bands under names of their own.

use augsim_data::{Column, DataError, Dataset, Trajectory};
use augsim_discovery::{FORETOLD_LEVELS, Foretelling, Foretold};

/// The place of the median among the statistics that are written of each column.
const MEDIAN: usize = 2;

/// Names of the quantiles.
const QUANTILES: [&str; 5] = ["q05", "q25", "median", "q75", "q95"];

/// Mean, median and the 50 and 90 % bands of every column, as `predict` writes them.
pub fn bands(all: &Foretelling) -> Result<Dataset, DataError> {
    let names = |column: &str| {
        let order = [MEDIAN, 0, 1, 3, 4].map(|q| format!("{}_{column}", QUANTILES[q]));
        [vec![format!("mean_{column}")], order.to_vec()].concat()
    };
    let values = |r: &Foretold| {
        let each = r.channels.iter().flat_map(|c| {
            let order = [MEDIAN, 0, 1, 3, 4].map(|q| c.quantiles[q].clone());
            [vec![c.mean.clone()], order.to_vec()].concat()
        });
        each.collect()
    };
    dataset(all, names, values)
}

/// The trajectories of the model under the names of the columns of the data, each with the ends of its 90 % band.
pub fn trajectories(all: &Foretelling) -> Result<Dataset, DataError> {
    let names = |column: &str| vec![column.to_owned(), format!("q05_{column}"), format!("q95_{column}")];
    let values = |r: &Foretold| {
        let last = FORETOLD_LEVELS.len() - 1;
        let each = r.channels.iter();
        each.flat_map(|c| [c.forecast.clone(), c.quantiles[0].clone(), c.quantiles[last].clone()]).collect()
    };
    dataset(all, names, values)
}

fn dataset(
    all: &Foretelling,
    names: impl Fn(&str) -> Vec<String>,
    values: impl Fn(&Foretold) -> Vec<Vec<f64>>,
) -> Result<Dataset, DataError> {
    let channels = all.records.first().map_or(&[][..], |r| &r.channels);
    let mut columns = Vec::new();
    for channel in channels {
        // The unit of a column of equations may stand in the model alone.
        let unit = Column::new(&channel.column).map(|c| c.unit());
        for name in names(&channel.column) {
            columns.push(match &unit {
                Ok(unit) => Column::with_unit(&name, *unit)?,
                Err(_) => Column::with_unit(&name, augsim_data::Unit::DIMENSIONLESS)?,
            });
        }
    }
    let rows = all.records.iter().map(|r| Trajectory::new(r.id.clone(), r.times.clone(), values(r)));
    Dataset::new(columns, rows.collect::<Result<_, _>>()?)
}
