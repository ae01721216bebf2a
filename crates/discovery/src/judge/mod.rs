//! Judgement of a search: which findings are established, how sure each is, and what is left.

mod bootstrap;
mod established;
mod remainder;
mod verdict;

pub(crate) use established::{Judgement, Lead, Short, judged, named};
pub(crate) use remainder::{Remainder, record_name, remainder, tabulated};
pub(crate) use verdict::{Doubt, before_search, of_errors, of_values, verdict};
