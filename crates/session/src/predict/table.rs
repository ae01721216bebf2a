//! Writes predictions as a data set, with columns for the bands.

use augsim_data::{Column, DataError, Dataset, Trajectory};
use augsim_discovery::{PREDICTION_LEVELS, PredictedRecord, PredictionSet};

/// Index of the median in the list of quantile names.
const MEDIAN: usize = 2;

/// Column prefixes of the quantiles, in the order of [`PREDICTION_LEVELS`].
const QUANTILES: [&str; 5] = ["q05", "q25", "median", "q75", "q95"];

/// Data set of the predictions: mean, median, 50 % and 90 % bands of every column, as `predict` writes them.
pub fn bands(forecasts: &PredictionSet) -> Result<Dataset, DataError> {
    let names = |column: &str| {
        let order = [MEDIAN, 0, 1, 3, 4].map(|q| format!("{}_{column}", QUANTILES[q]));
        [vec![format!("mean_{column}")], order.to_vec()].concat()
    };
    let values = |r: &PredictedRecord| {
        let columns = r.channels.iter().flat_map(|c| {
            let order = [MEDIAN, 0, 1, 3, 4].map(|q| c.quantiles[q].clone());
            [vec![c.mean.clone()], order.to_vec()].concat()
        });
        columns.collect()
    };
    dataset(forecasts, names, values)
}

/// Data set of the noise-free predictions under the data's column names, with the ends of their 90 % bands.
pub fn trajectories(forecasts: &PredictionSet) -> Result<Dataset, DataError> {
    let names = |column: &str| vec![column.to_owned(), format!("q05_{column}"), format!("q95_{column}")];
    let values = |r: &PredictedRecord| {
        let last = PREDICTION_LEVELS.len() - 1;
        let channels = r.channels.iter();
        channels
            .flat_map(|c| [c.forecast.clone(), c.quantiles[0].clone(), c.quantiles[last].clone()])
            .collect()
    };
    dataset(forecasts, names, values)
}

fn dataset(
    forecasts: &PredictionSet,
    names: impl Fn(&str) -> Vec<String>,
    values: impl Fn(&PredictedRecord) -> Vec<Vec<f64>>,
) -> Result<Dataset, DataError> {
    let channels = forecasts.records.first().map_or(&[][..], |r| &r.channels);
    let mut columns = Vec::new();
    for channel in channels {
        // A column of an equation model need not have a unit suffix; then the unit is unknown here.
        let unit = Column::new(&channel.column).map(|c| c.unit());
        for name in names(&channel.column) {
            columns.push(match &unit {
                Ok(unit) => Column::with_unit(&name, *unit)?,
                Err(_) => Column::with_unit(&name, augsim_data::Unit::DIMENSIONLESS)?,
            });
        }
    }
    let rows = forecasts.records.iter().map(|r| Trajectory::new(r.id.clone(), r.times.clone(), values(r)));
    Dataset::new(columns, rows.collect::<Result<_, _>>()?)
}
