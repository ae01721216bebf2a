//! Measured records, ready for fits, and the records and windows that a fit uses.

use crate::DiscoveryError;
use crate::options::{AllowedEffects, Clock};
use crate::work_counter::WorkCounter;
use augsim_data::{Dataset, Trajectory};
use augsim_system::{
    Declaration, Record as SystemRecord, RecordReader, System, Window, shift_session_clocks,
};
use std::ops::Range;
use std::sync::Arc;

/// One measured record with the weights of its samples.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    /// Measured values and windows, as the system reads them.
    pub data: SystemRecord,
    /// `weight[channel][sample]` = 1/σ in the unit of the channel; 0 for samples that are missing or masked.
    pub weight: Vec<Vec<f64>>,
    /// Whether σ is a tolerance rather than noise: residuals below it are not rewarded beyond the Gaussian
    /// cost.
    pub is_tolerance: bool,
    /// Name of the recording that the record is, or is a part of.
    pub recording: Arc<str>,
}

/// A window of a record: a segment that is simulated from its own initial state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordWindow<'a> {
    pub record: &'a Record,
    pub window: &'a Window,
}

impl Record {
    /// A record, which is a recording of its own, whose samples have no weights yet.
    pub fn unweighted(data: SystemRecord) -> Self {
        let recording = data.id.as_str().into();
        Self { data, weight: Vec::new(), is_tolerance: false, recording }
    }

    /// Windows of the record, in order of time.
    pub fn windows(&self) -> impl Iterator<Item = RecordWindow<'_>> {
        self.data.windows.iter().map(|window| RecordWindow { record: self, window })
    }
}

/// All records of a data set, with the declared system that models them.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    pub name: String,
    /// System that the model declares, without additions.
    pub system: Arc<dyn System>,
    pub records: Vec<Record>,
    /// Recordings that fits divide into several windows, each as a whole; empty if there are none.
    pub recordings: Vec<Recording>,
    pub groups: Vec<String>,
    /// Session time at which the clocks of the records start, s. `None` unless every record has a start time.
    pub clock_reference_s: Option<f64>,
    /// Share of the noise variance that differences of neighbouring samples show. It is a lower bound of the
    /// ratio of residual variance to noise variance.
    pub white_share: f64,
    /// Counters of the work done on these records and their copies.
    pub work: Arc<WorkCounter>,
    /// Deadline of calibration and search on these records.
    pub clock: Clock,
    /// Which effects a search on these records tries.
    pub effects: Arc<AllowedEffects>,
}

impl Measured {
    /// Reads the columns that the system of `model` knows from a data set, and ignores the other columns. The
    /// session clock starts at the model's reference or, without one, at the mean start time of the records.
    pub fn from_dataset(data: &Dataset, model: &dyn Declaration) -> Result<Self, DiscoveryError> {
        let name = data.origin().to_string();
        let system = model.open(&|column| data.has_column(column)).map_err(|objection| {
            DiscoveryError::Objection { data: name.clone(), model: model.file().into(), objection }
        })?;
        let schema = system.schema();
        let reader = RecordReader::new(schema, data)?;
        for channel in &schema.channels {
            if is_constant(data, data.column_index(&channel.column)?) {
                let column = channel.column.clone();
                return Err(DiscoveryError::Constant { data: name, column });
            }
        }
        let mut groups: Vec<String> =
            data.trajectories().iter().filter_map(|t| t.group().map(String::from)).collect();
        groups.sort();
        groups.dedup();
        let read = |t: &Trajectory| {
            let mut record = reader.read(t);
            record.unwrap_angles(schema);
            record.group = t.group().and_then(|g| groups.iter().position(|x| x == g)).unwrap_or(0);
            record.covariates = system.covariates(&|column| reader.first_value(t, column));
            record
        };
        let mut records: Vec<SystemRecord> = data.trajectories().iter().map(read).collect();
        if groups.is_empty() {
            groups.push(String::new());
        }
        let clock_reference_s = schema
            .clock
            .and_then(|clock| shift_session_clocks(&mut records, clock, model.clock_reference_s()));
        let records = records.into_iter().map(Record::unweighted).collect();
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

    /// The records in the form in which the system reads them.
    pub fn system_records(&self) -> Vec<&SystemRecord> {
        self.records.iter().map(|r| &r.data).collect()
    }

    /// A data set with other records and the same metadata, without whole recordings.
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

/// A recording (or a long part of one) that is fitted in several windows, and the records that its parts
/// became.
#[derive(Clone, Debug)]
pub(crate) struct Recording {
    pub whole: Record,
    /// For each part: index of the record that it became, and its first sample in the recording.
    pub parts: Vec<(usize, usize)>,
}

/// The records of a data set that a fit uses.
#[derive(Clone, Copy)]
pub(crate) struct ChosenRecords<'a> {
    pub data: &'a Measured,
    /// Indices of the used records in the data set.
    pub chosen: &'a [usize],
    /// Correlation of the noise of neighbouring samples of a channel.
    pub correlation: f64,
}

impl ChosenRecords<'_> {
    pub fn records(&self) -> impl Iterator<Item = &Record> {
        self.chosen.iter().map(|&j| &self.data.records[j])
    }

    /// Windows of all used records, in order.
    pub fn windows(&self) -> Vec<RecordWindow<'_>> {
        self.records().flat_map(Record::windows).collect()
    }

    /// For each used record, the range of its windows in [`windows`](Self::windows).
    pub fn windows_by_record(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let range = |record: &Record| {
            let last = first + record.data.windows.len();
            std::mem::replace(&mut first, last)..last
        };
        self.records().map(range).collect()
    }
}
/// Whether a column has no measured value, or the same value in all samples.
fn is_constant(data: &Dataset, column: usize) -> bool {
    let mut values =
        data.trajectories().iter().flat_map(|t| t.column(column)).copied().filter(|v| v.is_finite());
    let first = values.next();
    first.is_none() || values.all(|v| Some(v) == first)
}
