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
    /// Its 95 % interval in the model file, where that has one.
    pub ci95: Option<[f64; 2]>,
}
