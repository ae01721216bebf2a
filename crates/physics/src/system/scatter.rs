//! Parameters that differ at random.

use super::Schema;

/// The scope of one random number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ScatterPer {
    /// A new draw at every event.
    Event,
    /// One draw for a whole record.
    Record,
}

impl ScatterPer {
    /// The word for it in the system's model files, sentences and results.
    pub fn word(self, schema: &Schema) -> &str {
        match (self, &schema.event) {
            (ScatterPer::Event, Some(event)) => &event.words[0],
            _ => &schema.record[0],
        }
    }
}

/// The scatter of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// The scope of one draw.
    pub per: ScatterPer,
    /// Standard deviation, in the unit of the parameter.
    pub sd: f64,
}
