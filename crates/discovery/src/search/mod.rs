//! The search for effects: linearise at the best set, select new sets, refit them, repeat.

mod heterogeneity;
mod length;
mod refit;
mod search_loop;
mod select;

pub(crate) use heterogeneity::{MIN_INFORMATION, differences, parts};
pub(crate) use length::{calibrate_windows, choose_window_length, refit_on};
pub(crate) use refit::{ALPHA, InitialValues, Penalty, Search};
pub(crate) use search_loop::{SearchResult, complete, repeat_choice, run, without};
pub(crate) use select::{
    LinearSet, is_significant, p_values_beside, p_values_given, p_values_of, select, select_among, select_for,
};
