//! The result in numbers and words.

mod errors;
mod parts;

pub(crate) use errors::{Errors, errors, forecast_limit, starts};
pub(crate) use parts::AnswerParts;
