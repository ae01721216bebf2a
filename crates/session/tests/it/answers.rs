//! Answers of the discovery loop for models and data that a test writes.

use augsim_discovery::Discovery;
use augsim_equations::model;
use augsim_session::{DataFrom, DiscoverRequest, Subject, discover};

/// The answer for a model file's text and a table of recordings.
pub(crate) fn answer(model: &str, data: &DataFrom) -> Discovery {
    let model = model::parse(model, "model.toml").unwrap_or_else(|e| panic!("{e}"));
    discover(&Subject::Equations(Box::new(model)), data, &DiscoverRequest::default(), &mut |_| {})
        .expect("an answer")
}
