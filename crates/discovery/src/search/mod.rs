//! The search: linearise, select, refit, repeat.

mod five_steps;
mod heterogeneity;
mod length;
mod refit;
mod select;

pub(crate) use five_steps::{Found, chosen_again, run, without};
pub(crate) use heterogeneity::{differences, parts};
pub(crate) use length::{calibrated, lengthened, refitted};
pub(crate) use refit::{ALPHA, Price, Search, Starts};
pub(crate) use select::{Chosen, chances_beside, is_significant, select, select_of};
