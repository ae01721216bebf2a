//! Random effects: a parameter that varies at random between events or records.

/// Whether a random effect has a new draw for each event or for each record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ScatterPer {
    /// The parameter has a new random offset at each event, such as an impact.
    Event,
    /// The parameter has one random offset for each record.
    Record,
}

/// Random variation (random effect) of a parameter between events or records.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Whether the parameter varies between events or between records.
    pub per: ScatterPer,
    /// Standard deviation of the random variation, in the unit of the parameter.
    pub sd: f64,
    /// 95 % interval of the standard deviation; `None` if the model file gives none.
    pub ci95: Option<[f64; 2]>,
}
