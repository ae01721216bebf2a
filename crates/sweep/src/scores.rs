//! Scores: values of a task's result that fill a row of the table.

use super::fault::{Spoilt, SweepFault};
use serde_json::Value;
use serde_json_path::JsonPath;
use std::collections::BTreeMap;

/// A column of the table and where its value stands in a result.
#[derive(Debug)]
pub struct Score {
    column: String,
    path: JsonPath,
}

impl Score {
    /// A column with its JSONPath (RFC 9535).
    ///
    /// # Errors
    /// The path cannot be read.
    pub fn new(column: &str, path: &str) -> Result<Self, SweepFault> {
        let column = column.to_owned();
        match JsonPath::parse(path) {
            Ok(path) => Ok(Score { column, path }),
            Err(cause) => Err(SweepFault::ScorePath { column, path: path.to_owned(), cause }),
        }
    }

    /// The one value that the path leads to; `None` where it leads nowhere or to nothing.
    ///
    /// # Errors
    /// It leads to several values, or to a list or an object.
    fn of(&self, result: &Value) -> anyhow::Result<Option<Value>> {
        let found = self.path.query(result).all();
        match found.as_slice() {
            [] | [Value::Null] => Ok(None),
            [Value::Array(_) | Value::Object(_)] => {
                let (column, path) = (self.column.clone(), self.path.clone());
                Err(Spoilt::ScoreOfMany { column, path }.into())
            }
            [one] => Ok(Some((*one).clone())),
            several => {
                let (column, path, values) = (self.column.clone(), self.path.clone(), several.len());
                Err(Spoilt::ScoreTwice { column, path, values }.into())
            }
        }
    }
}

/// The scores of a result by column: those asked for; without a wish all numbers, words and answers that no list holds.
///
/// # Errors
/// A path leads to more than one value.
pub fn scores(wishes: &[Score], result: &Value) -> anyhow::Result<BTreeMap<String, Value>> {
    let mut found = BTreeMap::new();
    if wishes.is_empty() {
        leaves("", result, &mut found);
        return Ok(found);
    }
    for wish in wishes {
        if let Some(value) = wish.of(result)? {
            found.insert(wish.column.clone(), value);
        }
    }
    Ok(found)
}

/// Values that are reached through objects alone, by their dotted path. Texts of several lines are no scores.
fn leaves(path: &str, value: &Value, found: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(all) => {
            for (name, value) in all {
                let dot = if path.is_empty() { "" } else { "." };
                leaves(&format!("{path}{dot}{name}"), value, found);
            }
        }
        Value::Null | Value::Array(_) => {}
        Value::String(text) if text.contains('\n') => {}
        value => {
            found.insert(path.to_owned(), value.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a score is one value of the result; a path that means several is refused, one that leads nowhere is empty.
    use super::*;
    use serde_json::json;

    fn rows() -> Value {
        json!({"rows": [{"model": "A", "pos_mm": 1.5}, {"model": "B", "pos_mm": 2.5}], "deep": {"n": 3, "why": "so"},
               "text": "a\nb"})
    }

    #[test]
    fn a_path_picks_one_row() {
        let score = Score::new("pos_mm", "$.rows[?@.model=='B'].pos_mm").unwrap();
        assert_eq!(score.of(&rows()).unwrap(), Some(json!(2.5)));
    }

    #[test]
    fn several_values_are_refused_and_none_is_empty() {
        let several = Score::new("pos_mm", "$.rows[*].pos_mm").unwrap().of(&rows()).unwrap_err().to_string();
        assert!(several.contains("pos_mm") && several.contains("2 values"), "{several}");
        assert_eq!(Score::new("x", "$.nowhere").unwrap().of(&rows()).unwrap(), None);
        assert!(Score::new("x", "rows[0]").unwrap_err().to_string().contains("no JSONPath"));
    }

    #[test]
    fn without_a_wish_all_leaves_outside_lists_are_scores() {
        let found = scores(&[], &rows()).unwrap();
        assert_eq!(found, BTreeMap::from([("deep.n".into(), json!(3)), ("deep.why".into(), json!("so"))]));
    }
}
