//! Split of a single record into two parts that predict each other.

use crate::record::Record;
use augsim_system::{InitialValue, Prepare};

/// Splits a record into two parts, in the middle of a smooth segment near its middle. Also returns the time
/// of the split, s. `None` where the system names no smooth segments or has a fixed initial state.
pub(crate) fn split_record(system: &dyn Prepare, record: &Record, sd: &[f64]) -> Option<(Vec<Record>, f64)> {
    let starts_anywhere = system.schema().states.iter().all(|s| !matches!(s.initial, InitialValue::Fixed(_)));
    let mut whole = record.data.clone();
    system.prepare(&mut whole, sd).ok().filter(|()| starts_anywhere && whole.smooth_segments.len() > 2)?;
    let half = whole.times.len() / 2;
    let middles = whole.smooth_segments.iter().skip(1).map(|piece| (piece.start + piece.end) / 2);
    let cut = middles.min_by_key(|middle| middle.abs_diff(half))?;
    let part = |range: std::ops::Range<usize>, name: &str| {
        let mut data = record.data.clone();
        data.id = format!("{} ({name})", record.data.id);
        data.times = data.times[range.clone()].to_vec();
        data.values.iter_mut().for_each(|values| *values = values[range.clone()].to_vec());
        Record::unweighted(data)
    };
    let parts = vec![part(0..cut, "first part"), part(cut..record.data.times.len(), "second part")];
    Some((parts, record.data.times[cut]))
}
