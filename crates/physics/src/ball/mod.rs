//! The bouncing ball: state, world, event-driven engine.

mod contact;
mod engine;
mod flight;
mod impact;
mod state;
mod world;

pub use engine::{Offsets, Run, Sample, Throw, simulate};
pub use impact::{Impact, ImpactRecord};
pub use state::{Axes, Covariates, State};
pub use world::{
    BASE_PARAMETERS, GRAVITY, INERTIA_RATIO, LawRef, RADIUS, RESTITUTION, Term, World,
};
