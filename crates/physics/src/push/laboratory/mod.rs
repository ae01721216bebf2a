//! A virtual laboratory: pushes laid out as in the MIT set, on tables that are not what the model declares.
//!
//! The declared model is that of textbooks: ellipsoid, uniform pressure, friction of 0.25 at the contact, no inertia. The
//! truth is Coulomb friction integrated over the footprint with a friction map that is new for each push, anisotropic on some
//! supports, another friction at the contact, and inertia in pushes faster than 50 mm/s. The truth record says all of it.

mod follow;
mod generate;
mod layout;
mod map;
mod support;

pub use generate::{COLUMNS, Generated, LaboratoryError, Made, Recipe};
pub use layout::{Planned, Protocol};
pub use support::{SUPPORTS, SupportSheet};
