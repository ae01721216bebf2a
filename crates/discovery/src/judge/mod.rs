//! Judgement of a search result: which findings are established, how reliable each is, and what remains
//! unexplained.

mod bootstrap;
mod established;
mod memory;
mod repeats;
mod residual_tests;
mod verdict;

pub(crate) use established::{Findings, Lead, Shortcoming, judge_findings, named_set};
pub(crate) use memory::test_memory;
pub(crate) use residual_tests::{ResidualTests, add_tables, record_name, test_residuals};
pub(crate) use verdict::{
    WithdrawalReason, reason_from_data, reason_from_errors, reason_from_values, verdict,
};
