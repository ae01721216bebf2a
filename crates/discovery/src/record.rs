//! Measured records, ready for fits, and the records and windows that a fit uses.

use crate::DiscoveryError;
use crate::options::{AllowedEffects, Clock};
use crate::work_counter::WorkCounter;
use augsim_data::{Dataset, Trajectory};
use augsim_physics::system::{Declaration, Record as SystemRecord, Stream, System, Window};
use std::ops::Range;
use std::sync::Arc;

/// One record with the weights of its samples.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    /// Measured values, as the system reads them.
    pub data: SystemRecord,
    /// `weight[channel][sample]` = 1/σ in the unit of the channel; 0 for samples that are missing or masked.
    pub weight: Vec<Vec<f64>>,
    /// Whether σ is a tolerance: residuals below it are not rewarded beyond the Gaussian cost.
    pub is_tolerance: bool,
}

/// A window of a record: a segment that is simulated from its own initial state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordWindow<'a> {
    pub record: &'a Record,
    pub window: &'a Window,
}

impl Record {
    /// Windows of the record, in order.
    pub fn windows(&self) -> impl Iterator<Item = RecordWindow<'_>> {
        self.data.windows.iter().map(|window| RecordWindow { record: self, window })
    }
}

/// All records of a data set, with the declared system.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    pub name: String,
    /// The declared system.
    pub system: Arc<dyn System>,
    pub records: Vec<Record>,
    /// Whole recordings, where fits divide them into several windows.
    pub recordings: Vec<Recording>,
    pub groups: Vec<String>,
    /// Session time at which the clocks of the records start, s; `None` unless every record has a start
    /// time.
    pub clock_reference_s: Option<f64>,
    /// Share of the noise variance that differences of neighbouring samples show: a lower bound of the
    /// residual variance.
    pub white_share: f64,
    /// Counts of the work done on these records and their copies.
    pub work: Arc<WorkCounter>,
    /// Deadline of the fits to these records.
    pub clock: Clock,
    /// Effects that a search on these records tries.
    pub effects: Arc<AllowedEffects>,
}

impl Measured {
    /// Reads the columns that the system knows; ignores the others. The session clock starts at the model's
    /// reference or, without one, at the mean start time of the records.
    pub fn from_dataset(data: &Dataset, model: &dyn Declaration) -> Result<Self, DiscoveryError> {
        let name = data.origin().to_string();
        let system = model.open(&|column| data.has_column(column)).map_err(|objection| {
            DiscoveryError::Objection { data: name.clone(), model: model.file().into(), objection }
        })?;
        let schema = system.schema();
        let column_indices = |columns: &mut dyn Iterator<Item = &String>| {
            columns.map(|c| data.column_index(c)).collect::<Result<Vec<_>, _>>()
        };
        let channels = column_indices(&mut schema.channels.iter().map(|c| &c.column))?;
        let flag_index =
            |fresh: &Option<String>| fresh.as_deref().and_then(|name| data.column_index(name).ok());
        let flags: Vec<Option<usize>> =
            schema.channels.iter().map(|c| flag_index(&c.update_column)).collect();
        let inputs = schema
            .inputs
            .iter()
            .map(|i| Ok((column_indices(&mut i.columns.iter())?, flag_index(&i.update_column))));
        let inputs = inputs.collect::<Result<Vec<_>, DiscoveryError>>()?;
        for (channel, &i) in schema.channels.iter().zip(&channels) {
            if is_constant(data, i) {
                let column = channel.column.clone();
                return Err(DiscoveryError::Constant { data: name, column });
            }
        }
        let mut groups: Vec<String> =
            data.trajectories().iter().filter_map(|t| t.group().map(String::from)).collect();
        groups.sort();
        groups.dedup();
        let mut records: Vec<SystemRecord> = Vec::new();
        for t in data.trajectories() {
            let first_value = |column: &str| {
                let i = data.column_index(column).ok()?;
                t.column(i).iter().copied().find(|v| v.is_finite())
            };
            let (times, mut values) = measured(t, &channels, &flags);
            for (channel, values) in schema.channels.iter().zip(&mut values) {
                channel.period.into_iter().for_each(|period| unwrap(values, period));
            }
            let group = t.group().and_then(|g| groups.iter().position(|x| x == g));
            records.push(SystemRecord {
                id: t.id().to_string(),
                group: group.unwrap_or(0),
                times,
                values,
                inputs: inputs.iter().map(|(columns, fresh)| stream(t, columns, *fresh)).collect(),
                covariates: system.covariates(&first_value),
                ..SystemRecord::default()
            });
        }
        if groups.is_empty() {
            groups.push(String::new());
        }
        let clock_reference_s = schema.clock.and_then(|clock| {
            let starts: Option<Vec<f64>> = records.iter().map(|r| r.covariate(clock)).collect();
            let starts = starts.filter(|s| !s.is_empty())?;
            let mean = starts.iter().sum::<f64>() / starts.len() as f64;
            Some(model.clock_reference_s().unwrap_or(mean))
        });
        if let (Some(clock), Some(reference)) = (schema.clock, clock_reference_s) {
            records.iter_mut().for_each(|r| r.covariates[clock] -= reference);
        }
        let records = records
            .into_iter()
            .map(|data| Record { data, weight: Vec::new(), is_tolerance: false })
            .collect();
        Ok(Self {
            name,
            system,
            records,
            recordings: Vec::new(),
            groups,
            clock_reference_s,
            white_share: 1.0,
            work: Arc::default(),
            clock: Clock::default(),
            effects: Arc::default(),
        })
    }

    /// Whether the laws of the system are idealised, so that smooth residuals always remain.
    pub fn is_idealised(&self) -> bool {
        (0..self.system.schema().channels.len()).any(|channel| self.system.resolution(channel) > 0.0)
    }

    /// The records as the system reads them.
    pub fn system_records(&self) -> Vec<&SystemRecord> {
        self.records.iter().map(|r| &r.data).collect()
    }

    /// A data set with other records and the same metadata; it has no whole recordings.
    pub fn with_records(&self, records: Vec<Record>) -> Self {
        Self {
            name: self.name.clone(),
            groups: self.groups.clone(),
            records,
            recordings: Vec::new(),
            white_share: self.white_share,
            work: self.work.clone(),
            clock: self.clock.clone(),
            effects: self.effects.clone(),
            system: self.system.clone(),
            clock_reference_s: self.clock_reference_s,
        }
    }
}

/// Times and `[channel][sample]` of the rows in which any channel has a value. Where `flags` names a column,
/// only rows in which it is set count as measured.
fn measured(t: &Trajectory, channels: &[usize], flags: &[Option<usize>]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let value = |k: usize, (&i, flag): (&usize, &Option<usize>)| {
        if is_fresh(t, k, *flag) { t.column(i)[k] } else { f64::NAN }
    };
    let rows: Vec<usize> =
        (0..t.len()).filter(|&k| channels.iter().zip(flags).any(|c| value(k, c).is_finite())).collect();
    let times = rows.iter().map(|&k| t.time_s()[k]).collect();
    let values = channels.iter().zip(flags).map(|c| rows.iter().map(|&k| value(k, c)).collect());
    (times, values.collect())
}

/// Whether the flag column marks row `k` as a new measurement; true without a flag column.
fn is_fresh(t: &Trajectory, k: usize, flag: Option<usize>) -> bool {
    flag.is_none_or(|f| t.column(f)[k] > 0.5)
}

/// Removes jumps by a period from an angle: shifts each value to the one nearest to its predecessor.
fn unwrap(values: &mut [f64], period: f64) {
    let mut previous: Option<f64> = None;
    for v in values.iter_mut().filter(|v| v.is_finite()) {
        if let Some(previous) = previous {
            *v -= ((*v - previous) / period).round() * period;
        }
        previous = Some(*v);
    }
}

/// An input on its own clock: the rows in which all of its columns have a recorded value.
fn stream(t: &Trajectory, columns: &[usize], fresh: Option<usize>) -> Stream {
    let complete = |k: usize| columns.iter().all(|&i| t.column(i)[k].is_finite());
    let rows: Vec<usize> = (0..t.len()).filter(|&k| is_fresh(t, k, fresh) && complete(k)).collect();
    let at = |column: &[f64]| rows.iter().map(|&k| column[k]).collect::<Vec<_>>();
    Stream { times: at(t.time_s()), values: columns.iter().map(|&i| at(t.column(i))).collect() }
}

/// A recording (or a long part of one) that is fitted in several windows, with the records that its parts
/// became.
#[derive(Clone, Debug)]
pub(crate) struct Recording {
    pub whole: Record,
    /// Index of each record that is a part of it, and the first sample of that part.
    pub parts: Vec<(usize, usize)>,
}

/// The records that a fit uses.
#[derive(Clone, Copy)]
pub(crate) struct ChosenRecords<'a> {
    pub data: &'a Measured,
    /// Indices of the records.
    pub chosen: &'a [usize],
    /// Correlation of the noise of neighbouring samples.
    pub correlation: f64,
}

impl ChosenRecords<'_> {
    pub fn records(&self) -> impl Iterator<Item = &Record> {
        self.chosen.iter().map(|&j| &self.data.records[j])
    }

    /// Windows of the records, in order.
    pub fn windows(&self) -> Vec<RecordWindow<'_>> {
        self.records().flat_map(Record::windows).collect()
    }

    /// Range of the windows of each record, in order.
    pub fn windows_by_record(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let range = |record: &Record| {
            let last = first + record.data.windows.len();
            std::mem::replace(&mut first, last)..last
        };
        self.records().map(range).collect()
    }
}
/// Whether a column has no measured value, or the same one everywhere.
fn is_constant(data: &Dataset, column: usize) -> bool {
    let mut values =
        data.trajectories().iter().flat_map(|t| t.column(column)).copied().filter(|v| v.is_finite());
    let first = values.next();
    first.is_none() || values.all(|v| Some(v) == first)
}
