//! A place of a model at which a library row is applied.

use crate::model::Target;

/// A place of a model to which a library row is applied.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub(super) target: Target,
    /// Further targets that the row changes, such as the second equation of a pair.
    pub(super) others: Vec<Target>,
    pub(super) on: String,
    pub(super) with: Option<String>,
    /// Names used in the library row, and the texts of the model that replace them.
    pub(super) names: Vec<(&'static str, String)>,
}
