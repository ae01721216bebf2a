//! Random effects: a parameter that varies at random between events or records.

/// Whether a random effect is drawn per event or per record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ScatterPer {
    /// One draw per event.
    Event,
    /// One draw per record.
    Record,
}

/// Random variation of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Scope of one draw.
    pub per: ScatterPer,
    /// Standard deviation, in the unit of the parameter.
    pub sd: f64,
    /// 95 % interval of the standard deviation, where the model file gives one.
    pub ci95: Option<[f64; 2]>,
}
