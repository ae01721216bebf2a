//! The model classes behind [`crate::Forecaster`].

mod apart;
mod law;
mod net;
mod physics;
mod scattered;
mod still;
mod zero;

pub use apart::Apart;
pub use law::Law;
pub use net::NetModel;
pub use physics::Physics;
pub use scattered::ScatteredBall;
pub use still::Still;
pub use zero::Zero;
