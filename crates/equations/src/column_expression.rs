//! Expressions of the columns of a table, such as `45 * current5_A + 32 * current6_A`.

use crate::error::{ModelError, Place};
use crate::nearest::nearest;
use crate::text::{self, Problem, Scope, Symbol, Tree};
use augsim_data::escaped_short;

/// A function of the columns of a table, which is evaluated row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnExpression {
    tree: Tree,
}

/// Scope of the names of columns.
struct Columns<'c>(&'c [String]);

impl Scope for Columns<'_> {
    fn symbol(&self, name: &str) -> Result<Symbol, Problem> {
        self.0.iter().position(|column| column == name).map(Symbol::Input).ok_or_else(|| {
            Problem::UnknownName {
                name: escaped_short(name),
                nearest: nearest(name, self.0.iter().map(String::as_str)),
            }
        })
    }

    fn table(&self, name: &str) -> Result<usize, Problem> {
        Err(Problem::UnknownTable { name: escaped_short(name), nearest: None })
    }
}

impl ColumnExpression {
    /// Parses an expression of the columns with these names; `from` names the expression's origin in messages.
    ///
    /// # Errors
    /// The first problem, with the text and a caret.
    pub fn parse(text: &str, columns: &[String], from: &str) -> Result<Self, ModelError> {
        let tree = text::parse(text, &Columns(columns), false).map_err(|failure| {
            let place = Place { file: from.into(), line: 0, key: String::new() };
            ModelError::in_expression(place, text, failure)
        })?;
        Ok(Self { tree })
    }

    /// Value of the expression in a row, in which `value` gives that of each column.
    pub fn at(&self, value: &dyn Fn(usize) -> f64) -> f64 {
        self.tree.value_of(&|symbol| match symbol {
            Symbol::Input(column) => value(column),
            _ => f64::NAN,
        })
    }
}

#[cfg(test)]
mod tests {
    //! Contract: columns are found by name, and an unknown one is an error that proposes the nearest.
    use super::*;

    #[test]
    fn columns_of_a_row_are_combined() {
        let columns = ["current5_A".to_owned(), "current6_A".to_owned()];
        let torque =
            ColumnExpression::parse("45 * current5_A + 32 * current6_A", &columns, "--torque").unwrap();
        assert_eq!(torque.at(&|column| [2.0, -1.0][column]), 58.0);
        let error = ColumnExpression::parse("45 * curent5_A", &columns, "--torque").unwrap_err().to_string();
        let expected = "--torque: unknown name `curent5_A`; did you mean `current5_A`?\n";
        assert!(error.starts_with(expected), "{error}");
    }
}
