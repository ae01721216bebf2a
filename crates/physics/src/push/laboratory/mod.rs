//! Synthetic pushes, laid out as in the MIT set, whose true physics differs from the declared model.
//!
//! The declared model is the textbook one: ellipsoidal surface, uniform pressure, contact friction of 0.25,
//! no inertia. The true one has Coulomb friction integrated over the footprint with a new random friction map
//! for each push, anisotropy on some supports, another contact friction, and inertia in pushes faster than 50
//! mm/s. The truth is returned with the data.

mod follow;
mod generate;
mod layout;
mod map;
mod support;

pub use generate::{COLUMNS, Generated, GeneratedTruth, LaboratoryError, PushRecipe};
pub use layout::{PlannedPush, PushDesign};
pub use support::{SUPPORTS, SupportSheet};
