//! Implementations of [`crate::Forecaster`]: trained nets and baselines.

mod exact_distribution;
mod net;
mod non_penetrating;
mod physics;
mod scattered;
mod still;
mod zero;

pub use exact_distribution::ExactDistribution;
pub use net::NetModel;
pub use non_penetrating::NonPenetrating;
pub use physics::Physics;
pub use scattered::ScatteredBall;
pub use still::Still;
pub use zero::Zero;
