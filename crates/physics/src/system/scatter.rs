//! Parameters that differ at random.

/// The scope of one random number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ScatterPer {
    /// A new draw at every event.
    Event,
    /// One draw for a whole record.
    Record,
}

/// The scatter of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// The scope of one draw.
    pub per: ScatterPer,
    /// Standard deviation, in the unit of the parameter.
    pub sd: f64,
}
