//! Judgement of a search result: which findings are established, how reliable each is, and what remains
//! unexplained.

mod bootstrap;
mod established;
mod residual_tests;
mod verdict;

pub(crate) use established::{Findings, Lead, Shortcoming, judged, named};
pub(crate) use residual_tests::{ResidualTests, record_name, tabulated, test_residuals};
pub(crate) use verdict::{Doubt, doubt_from_data, doubt_from_errors, doubt_from_values, verdict};
