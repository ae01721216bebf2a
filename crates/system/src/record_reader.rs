//! Reads the trajectories of a data set as records of a system.

use crate::record::{Record, Stream};
use crate::schema::Schema;
use augsim_data::{DataError, Dataset, Trajectory};

/// Reads records from a data set: the columns of a system's channels and inputs.
///
/// Channels and inputs have clocks of their own. The samples of a record are the rows in which a channel has a new
/// measurement; an input is sampled in the rows in which all of its columns have a new value, whether or not a
/// channel was measured there.
#[derive(Debug)]
pub struct RecordReader<'d> {
    data: &'d Dataset,
    channels: Vec<Source>,
    inputs: Vec<Source>,
}

/// Columns that are sampled together (a channel or an input), and the column that marks rows with a new sample.
#[derive(Debug)]
struct Source {
    columns: Vec<usize>,
    update: Option<usize>,
}

impl Source {
    /// Whether row `k` is marked as a new sample; true if there is no column of marks.
    fn is_new(&self, t: &Trajectory, k: usize) -> bool {
        self.update.is_none_or(|update| t.column(update)[k] > 0.5)
    }

    /// Whether row `k` has a new value in every column of this channel or input.
    fn is_sampled(&self, t: &Trajectory, k: usize) -> bool {
        self.is_new(t, k) && self.columns.iter().all(|&column| t.column(column)[k].is_finite())
    }
}

impl<'d> RecordReader<'d> {
    /// Finds the columns of a system's channels and inputs, and the columns that mark their new samples.
    ///
    /// # Errors
    /// The data have no column of a channel or an input. A missing column of marks is none: every row is new then.
    pub fn new(schema: &Schema, data: &'d Dataset) -> Result<Self, DataError> {
        let source = |columns: &[String], update: &Option<String>| {
            let columns = columns.iter().map(|c| data.column_index(c)).collect::<Result<_, _>>()?;
            let update = update.as_deref().and_then(|name| data.column_index(name).ok());
            Ok(Source { columns, update })
        };
        let channels = schema.channels.iter();
        let channels = channels.map(|c| source(std::slice::from_ref(&c.column), &c.update_column));
        let channels = channels.collect::<Result<_, DataError>>()?;
        let inputs = schema.inputs.iter().map(|i| source(&i.columns, &i.update_column));
        Ok(Self { data, channels, inputs: inputs.collect::<Result<_, DataError>>()? })
    }

    /// Finds one column for each of these channels and inputs, by its name.
    ///
    /// # Errors
    /// The data have no such column.
    pub fn with_columns<'n>(
        channels: impl IntoIterator<Item = &'n str>,
        inputs: impl IntoIterator<Item = &'n str>,
        data: &'d Dataset,
    ) -> Result<Self, DataError> {
        let source = |name| Ok(Source { columns: vec![data.column_index(name)?], update: None });
        let channels = channels.into_iter().map(source).collect::<Result<_, DataError>>()?;
        Ok(Self { data, channels, inputs: inputs.into_iter().map(source).collect::<Result<_, DataError>>()? })
    }

    /// Makes the reader count every value as a new sample, whatever the columns of marks say.
    pub fn with_every_row(mut self) -> Self {
        self.channels.iter_mut().chain(&mut self.inputs).for_each(|source| source.update = None);
        self
    }

    /// Reads a trajectory of the data set as a record; covariates, group and windows are left empty.
    pub fn read(&self, t: &Trajectory) -> Record {
        let rows: Vec<usize> =
            (0..t.len()).filter(|&k| self.channels.iter().any(|c| c.is_sampled(t, k))).collect();
        let channel = |c: &Source| {
            let column = t.column(c.columns[0]);
            rows.iter().map(|&k| if c.is_new(t, k) { column[k] } else { f64::NAN }).collect()
        };
        Record {
            id: t.id().to_owned(),
            times: rows.iter().map(|&k| t.time_s()[k]).collect(),
            values: self.channels.iter().map(channel).collect(),
            inputs: self.inputs.iter().map(|input| stream(t, input)).collect(),
            ..Record::default()
        }
    }

    /// First value of a column in a trajectory; `None` if the data have no such column or it has no value.
    pub fn first_value(&self, t: &Trajectory, column: &str) -> Option<f64> {
        let column = self.data.column_index(column).ok()?;
        t.column(column).iter().copied().find(|v| v.is_finite())
    }
}

/// Reads the samples of one input from a trajectory.
fn stream(t: &Trajectory, input: &Source) -> Stream {
    let rows: Vec<usize> = (0..t.len()).filter(|&k| input.is_sampled(t, k)).collect();
    let at = |column: &[f64]| rows.iter().map(|&k| column[k]).collect();
    Stream { times: at(t.time_s()), values: input.columns.iter().map(|&c| at(t.column(c))).collect() }
}

impl Record {
    /// Unwraps periodic channels: moves each value by whole periods to the one nearest to its predecessor.
    pub fn unwrap_angles(&mut self, schema: &Schema) {
        for (channel, values) in schema.channels.iter().zip(&mut self.values) {
            if let Some(period) = channel.period {
                unwrap(values, period);
            }
        }
    }
}

fn unwrap(values: &mut [f64], period: f64) {
    let mut previous: Option<f64> = None;
    for v in values.iter_mut().filter(|v| v.is_finite()) {
        if let Some(previous) = previous {
            *v -= ((*v - previous) / period).round() * period;
        }
        previous = Some(*v);
    }
}

/// Shifts the session clock of all records so that `reference`, or else the mean of their starts, is 0.
///
/// `clock` is the index of the covariate with the session start times. Returns the reference, s; `None`,
/// without a shift, unless every record has a start time.
pub fn shift_session_clocks(records: &mut [Record], clock: usize, reference: Option<f64>) -> Option<f64> {
    let starts: Option<Vec<f64>> = records.iter().map(|r| r.covariate(clock)).collect();
    let starts = starts.filter(|s| !s.is_empty())?;
    let mean = starts.iter().sum::<f64>() / starts.len() as f64;
    let reference = reference.unwrap_or(mean);
    records.iter_mut().for_each(|r| r.covariates[clock] -= reference);
    Some(reference)
}

#[cfg(test)]
mod tests {
    //! Contract: channels and inputs keep their own clocks, marks select new samples, wrapped angles become
    //! continuous, and session clocks are shifted only if every record has one.
    use super::*;
    use crate::schema::{Channel, Input, InputInterpolation};

    fn schema() -> Schema {
        let channel = |column: &str, period, mark: Option<&str>| Channel {
            column: column.into(),
            period,
            update_column: mark.map(Into::into),
            ..Channel::default()
        };
        let input = Input {
            columns: vec!["u_m".into(), "v_m".into()],
            interpolation: InputInterpolation::Linear,
            update_column: None,
        };
        Schema {
            channels: vec![channel("x_m", None, Some("object_new")), channel("angle_rad", Some(4.0), None)],
            inputs: vec![input],
            ..Schema::default()
        }
    }

    fn data() -> Dataset {
        let none = f64::NAN;
        let columns = vec![
            vec![1.0, 1.0, 2.0, none],
            vec![1.0, 0.0, 1.0, 1.0],
            vec![none, none, 3.9, none],
            vec![0.0, none, 0.5, 0.6],
            vec![0.1, 0.2, none, 0.3],
        ];
        let times = vec![0.0, 0.1, 0.2, 0.3];
        let t = Trajectory::new("a", times, columns).expect("a trajectory");
        Dataset::from_names(&["x_m", "object_new", "angle_rad", "u_m", "v_m"], vec![t]).expect("a data set")
    }

    #[test]
    fn channels_and_inputs_keep_their_clocks() {
        let data = data();
        let t = &data.trajectories()[0];
        let marked = RecordReader::new(&schema(), &data).expect("columns").read(t);
        assert_eq!(marked.times, [0.0, 0.2], "the second row repeats x, the last one has no channel");
        assert_eq!(marked.values[0], [1.0, 2.0]);
        assert!(marked.values[1][0].is_nan() && marked.values[1][1] == 3.9);
        let input = &marked.inputs[0];
        assert_eq!((&input.times[..], &input.values[1][..]), (&[0.0, 0.3][..], &[0.1, 0.3][..]));
        let reader = RecordReader::new(&schema(), &data).expect("columns").with_every_row();
        assert_eq!(reader.read(t).times, [0.0, 0.1, 0.2]);
        assert_eq!((reader.first_value(t, "angle_rad"), reader.first_value(t, "mass_kg")), (Some(3.9), None));
    }

    #[test]
    fn angles_become_continuous_and_clocks_start_at_their_reference() {
        let values = vec![vec![0.0; 4], vec![3.9, f64::NAN, 0.1, 3.8]];
        let record =
            |start: f64| Record { values: values.clone(), covariates: vec![start], ..Record::default() };
        let mut records = [record(10.0), record(14.0)];
        records[0].unwrap_angles(&schema());
        let found: Vec<f64> = records[0].values[1].iter().map(|v| (v * 10.0).round()).collect();
        assert_eq!((found[0], found[2], found[3]), (39.0, 41.0, 38.0));
        assert_eq!(shift_session_clocks(&mut records, 0, None), Some(12.0));
        assert_eq!((records[0].covariates[0], records[1].covariates[0]), (-2.0, 2.0));
        records[0].covariates[0] = f64::NAN;
        assert_eq!(shift_session_clocks(&mut records, 0, Some(1.0)), None);
        assert_eq!(records[1].covariates[0], 2.0);
    }
}
