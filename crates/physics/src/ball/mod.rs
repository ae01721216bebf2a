//! A ball that falls, flies and bounces on flat ground.

pub mod bullet;
mod ensemble;
pub mod floor;
mod order_statistics;
pub mod paper_law;
pub mod score;
