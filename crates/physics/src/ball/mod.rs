//! A ball that falls, flies and bounces on flat ground.

pub mod bullet;
pub mod floor;
pub mod paper_law;
pub mod score;
