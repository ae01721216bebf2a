//! Generates formulas that the effect library does not list: functions of one quantity and products of two.
//!
//! They are tried in every equation to which a term can be added.

use super::expand::{Candidate, expand};
use crate::error::ModelError;
use crate::model::{Model, Row, read_all};

/// Text of the rows from which formulas are generated.
const FORMULAS: &str = include_str!("../../formulas.toml");

/// Generates all formulas of the grammar at their places in a model, each named by its shape and place.
///
/// # Errors
/// None in practice: the text is part of this crate, and a test parses it.
pub(crate) fn formulas(model: &Model) -> Result<Vec<Candidate>, ModelError> {
    let rows: Vec<Row> = read_all(FORMULAS, "formulas.toml")?;
    let mut candidates = Vec::new();
    for row in &rows {
        for mut candidate in expand(row, model)? {
            let shape = candidate.text().map_or("", shape_of);
            candidate.name = format!("{shape} on {}", candidate.on);
            candidate.shape = candidate.names.first().map(|(_, z)| z.clone());
            candidates.push(candidate);
        }
    }
    Ok(candidates)
}

/// Strips the coefficient from the text of a formula; `1` for a constant.
fn shape_of(text: &str) -> &str {
    if text == "c" { "1" } else { text.strip_prefix("c * ").unwrap_or(text) }
}

#[cfg(test)]
mod tests {
    //! Contract: every formula can be placed in every example, and the formulas of a model have different
    //! names.
    use super::*;

    #[test]
    fn every_example_gets_formulas_with_unique_names() {
        for (name, text) in crate::example::EXAMPLES {
            let model = crate::model::parse(text, name).expect("an example");
            let candidates = formulas(&model).expect("shapes that can be placed");
            assert!(candidates.len() > 30, "{name}: {}", candidates.len());
            let mut names: Vec<&str> = candidates.iter().map(|c| c.name.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), candidates.len(), "{name}");
            assert!(names.iter().any(|n| n.starts_with("1 on ")), "{name}: no constant");
        }
    }
}
