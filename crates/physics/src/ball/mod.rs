//! A ball that falls, flies and bounces on flat ground.
//!
//! [`simulate`] is the event-driven engine, [`Ball`] wraps it as a [`System`](augsim_system::System).
//! [`bullet`] is PyBullet's time-stepping scheme, [`drop_distribution`] and [`floor`] reproduce a published data set
//! and its best possible prediction errors.

pub mod bullet;
mod contact;
mod covariates;
mod designs;
pub mod drop_distribution;
pub mod effects;
mod engine;
mod ensemble;
mod flight;
pub mod floor;
mod impact;
mod objection;
mod order_statistics;
mod plausibility;
mod preconditions;
mod residual_axes;
mod scene;
pub mod score;
mod segmentation;
mod state;
mod system;
mod tables;
mod world;

pub use engine::{Offsets, Run, Throw, simulate};
pub use impact::{Impact, ImpactRecord};
pub use scene::detected_floor_m;
pub use state::{Axes, Covariates, State};
pub use system::{Ball, BallDeclaration};
pub use world::{BASE_PARAMETERS, FLOOR, GRAVITY, INERTIA_RATIO, LawRef, RADIUS, RESTITUTION, Term, World};
