//! The parts of a system as data: the loop reads names, units and roles from here and knows no others.

use super::effect::Effect;
use super::quantity::Quantity;
use super::scatter::{Scatter, ScatterPer};
use std::ops::Range;

/// How a state is at the beginning of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Begin {
    /// Fitted for each record.
    Free,
    /// Known.
    Fixed(f64),
    /// Fitted, and measured by the channel of this index.
    Measured(usize),
    /// Fitted, and known to be normal with this mean and standard deviation.
    Prior(f64, f64),
}

/// A state of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name and unit.
    pub quantity: Quantity,
    /// How it begins.
    pub begin: Begin,
}

/// A measured channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// Column of the data, its unit in the name.
    pub column: String,
    /// Unit in print.
    pub unit: String,
    /// Period, for an angle that is measured modulo a turn.
    pub period: Option<f64>,
    /// Declared standard deviation of the sensor, in the unit of the channel.
    pub sd: Option<f64>,
    /// A standard deviation that the sensor does not exceed, where one is known before (misfit over the shortest windows).
    pub sd_at_most: Option<f64>,
    /// Declared accuracy of the instrument: a marker's neighbouring samples agree better with each other than with the truth,
    /// so that no estimate far below it is believed.
    pub sd_at_least: Option<f64>,
    /// Column that is above one half in the rows in which the channel was measured anew, where the data have it.
    pub fresh: Option<String>,
}

/// How an input goes between its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// The input keeps the last value.
    Held,
    /// The input goes in straight lines.
    Linear,
}

/// An imposed input: columns that share a clock, which need not be that of the channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Columns of the data.
    pub columns: Vec<String>,
    /// How it goes between its samples.
    pub between: Between,
    /// Column that is above one half in the rows in which the input was recorded anew, where the data have it.
    pub fresh: Option<String>,
}

/// Something that a law may add to.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name and unit.
    pub quantity: Quantity,
    /// Where it acts, in the system's words (`flight`, `impact`, `sensor`, …).
    pub place: String,
    /// Whether a law there makes every simulation dearer.
    pub costly: bool,
    /// A size of an addition that matters, in the unit of the quantity.
    pub usual: f64,
}

/// Channels whose errors are one figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// Name of the error table (`position`, `rotation`).
    pub name: String,
    /// Channels, by index.
    pub channels: Vec<usize>,
    /// Unit in print, and how many of it are in one unit of the channels.
    pub unit: (String, f64),
    /// Whether the error of a sample is the length of the vector of its channels; otherwise each channel counts by itself.
    pub length: bool,
}

/// Events that a simulation passes, such as impacts.
#[derive(Clone, Debug, PartialEq)]
pub struct EventSchema {
    /// One and many, for sentences.
    pub words: [String; 2],
    /// Index of the parameter that may have an offset of its own at each event.
    pub parameter: usize,
    /// Its scatter as an effect: the name in results; its one parameter, the standard deviation, with bounds and a typical size.
    pub scatter: Effect,
    /// The scatter that the model declares.
    pub declared: Option<Scatter>,
    /// The feature that a rhythm of the surroundings would be proportional to at an event, by its place among the features.
    pub strength: Option<usize>,
}

/// Parameters of an effect that may be drawn anew for each record, about a mean that all records share.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// The effect whose parameters are drawn, by its place in the library; it vanishes where they are 0.
    pub through: usize,
    /// Places of these parameters in the declared vector, where the model declares the effect.
    pub places: Option<Range<usize>>,
    /// The scatter as an effect: the name in results; its one parameter, the standard deviation, with bounds and a typical size.
    pub scatter: Effect,
    /// The standard deviation that the model declares.
    pub declared: Option<f64>,
    /// Its 95 % interval in the model file, where that has one.
    pub declared_ci95: Option<[f64; 2]>,
}

/// The description of a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Schema {
    /// Name of the system.
    pub system: String,
    /// One record and many, for sentences (`push`, `pushes`).
    pub record: [String; 2],
    /// States, in the order of a task's start.
    pub states: Vec<State>,
    /// Channels, in the order of a simulation's values.
    pub channels: Vec<Channel>,
    /// Inputs, in the order of a record's streams.
    pub inputs: Vec<Input>,
    /// Quantities that are constant over a record, in the order of its covariates.
    pub covariates: Vec<Quantity>,
    /// The covariate that is the record's start on the clock of the session, s.
    pub clock: Option<usize>,
    /// Quantities that a table may depend on, and that residuals are shown against.
    pub features: Vec<Quantity>,
    /// Quantities that a table may add to.
    pub targets: Vec<Target>,
    /// Times after which forecasts from a measured state are compared, s; for a system whose states are all measured.
    pub horizons_s: Vec<f64>,
    /// Error tables; the first is the one that decides.
    pub measures: Vec<Measure>,
    /// Events, for a system that has them.
    pub event: Option<EventSchema>,
    /// Parameters that may be drawn anew for each record, for a system that has such.
    pub drawn: Option<Drawn>,
    /// Conditions that can be varied from record to record, in words, most telling first (`heights`, `speeds`).
    pub conditions: Vec<String>,
}

impl Schema {
    /// Unit in print of the measure that decides, with its size in the unit of the channels.
    pub fn decides(&self) -> (&str, f64) {
        self.measures.first().map_or(("", 1.0), |m| (m.unit.0.as_str(), m.unit.1))
    }

    /// Index of the covariate `name`.
    pub fn covariate(&self, name: &str) -> Option<usize> {
        self.covariates.iter().position(|c| c.name == name)
    }

    /// Index of the channel with the column `name`.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c.column == name)
    }

    /// States that are fitted at the beginning of a record.
    pub fn free_states(&self) -> impl Iterator<Item = usize> + '_ {
        self.states.iter().enumerate().filter(|(_, s)| !matches!(s.begin, Begin::Fixed(_))).map(|(i, _)| i)
    }
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
