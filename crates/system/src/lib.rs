#![doc = include_str!("../README.md")]

mod declaration;
mod design;
mod effect;
mod error;
mod model_term;
mod parameter;
mod quantity;
mod record;
mod record_reader;
mod scatter;
mod schema;
mod seed_blocks;
mod simulated;
pub mod statistics;
mod system;
mod task;
mod top_view;

pub use declaration::{Addition, Augmentation, Declaration, Fitted, FittedValues, RoundTripError};
pub use design::{Design, Designs};
pub use effect::{
    Effect, EffectParameter, FormulaDomain, Join, Polar, Rival, Start, known_distinguishing_experiment,
};
pub use error::{Objection, SimulationError, SystemError};
pub use model_term::{ModelTerm, Table};
pub use parameter::{NORMAL_95, Parameter, Per, UnknownGroup, unknown_group};
pub use quantity::Quantity;
pub use record::{
    CORRELATION_STEPS, DetectedEvent, Record, Stream, Window, channel_sd, split_by_duration, typical_step,
};
pub use record_reader::{RecordReader, shift_session_clocks};
pub use scatter::{Scatter, ScatterPer};
pub use schema::{
    Channel, ErrorFigure, EventSchema, InitialValue, Input, InputInterpolation, RecordRandomEffect, Schema,
    State, Target, shortest_difference,
};
pub use seed_blocks::in_blocks;
pub use simulated::{Event, Simulated};
pub use system::{Augment, Describe, Prepare, Simulate, System};
pub use task::{Offsets, Seed, Task};
pub use top_view::TopView;
