//! A ball that falls, flies and bounces on flat ground: the event-driven engine, and the PyBullet
//! stepping scheme beside it.

pub mod bullet;
mod contact;
mod covariates;
mod designs;
mod engine;
mod ensemble;
mod flight;
pub mod floor;
mod impact;
mod objection;
mod order_statistics;
pub mod paper_law;
mod possible;
mod scene;
pub mod score;
mod segment;
mod shown;
mod state;
mod system;
mod tables;
mod unlike;
mod world;

pub use engine::{Offsets, Run, Throw, simulate};
pub use impact::{Impact, ImpactRecord};
pub use scene::seen_floor_m;
pub use state::{Axes, Covariates, State};
pub use system::{Ball, Declares};
pub use world::{BASE_PARAMETERS, FLOOR, GRAVITY, INERTIA_RATIO, LawRef, RADIUS, RESTITUTION, Term, World};
