//! Formulas that no library names: shapes of one quantity and products of two, at every equation that could lack a term.

use super::expand::{Candidate, expand};
use crate::error::ModelError;
use crate::model::{Model, Row, read_all};

/// The text of the shapes.
const SHAPES: &str = include_str!("../../formulas.toml");

/// All formulas of the grammar at their places in a model, each named by its shape and place.
///
/// # Errors
/// None: the text is part of this crate, and a test reads it.
pub(crate) fn formulas(model: &Model) -> Result<Vec<Candidate>, ModelError> {
    let rows: Vec<Row> = read_all(SHAPES, "formulas.toml")?;
    let mut all = Vec::new();
    for row in &rows {
        for mut candidate in expand(row, model)? {
            let shape = candidate.text().map_or("", shape_of);
            candidate.name = format!("{shape} on {}", candidate.on);
            candidate.shape = candidate.names.first().map(|(_, z)| z.clone());
            all.push(candidate);
        }
    }
    Ok(all)
}

/// The shape of a formula, without its coefficient: that of a constant is 1.
fn shape_of(text: &str) -> &str {
    if text == "c" { "1" } else { text.strip_prefix("c * ").unwrap_or(text) }
}

#[cfg(test)]
mod tests {
    //! Contract: every shape can be placed in every example, and no two formulas of a model have one name.
    use super::*;

    #[test]
    fn formulas_stand_in_every_example_under_names_of_their_own() {
        for (name, text) in crate::example::EXAMPLES {
            let model = crate::model::parse(text, name).expect("an example");
            let all = formulas(&model).expect("shapes that can be placed");
            assert!(all.len() > 30, "{name}: {}", all.len());
            let mut names: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all.len(), "{name}");
            assert!(names.iter().any(|n| n.starts_with("1 on ")), "{name}: no constant");
        }
    }
}
