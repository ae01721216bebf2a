//! Scores: values that are picked from a task's result and fill a row of the table.

use super::fault::{SweepDataError, SweepFault};
use serde_json::Value;
use serde_json_path::JsonPath;
use std::collections::BTreeMap;

/// A column of the table and the JSONPath of its value in a result.
#[derive(Debug)]
pub struct Score {
    column: String,
    path: JsonPath,
}

impl Score {
    /// Parses the JSONPath (RFC 9535) of a score's column.
    ///
    /// # Errors
    /// The path is not valid.
    pub fn new(column: &str, path: &str) -> Result<Self, SweepFault> {
        let column = column.to_owned();
        match JsonPath::parse(path) {
            Ok(path) => Ok(Score { column, path }),
            Err(cause) => Err(SweepFault::ScorePath { column, path: path.to_owned(), cause }),
        }
    }

    /// Reads the score from a result; `None` if it is absent or null.
    ///
    /// # Errors
    /// The path selects several values, a list or an object.
    fn read(&self, result: &Value) -> anyhow::Result<Option<Value>> {
        let found = self.path.query(result).all();
        match found.as_slice() {
            [] | [Value::Null] => Ok(None),
            [Value::Array(_) | Value::Object(_)] => {
                let (column, path) = (self.column.clone(), self.path.clone());
                Err(SweepDataError::ScoreOfMany { column, path }.into())
            }
            [one] => Ok(Some((*one).clone())),
            several => {
                let (column, path, values) = (self.column.clone(), self.path.clone(), several.len());
                Err(SweepDataError::ScoreTwice { column, path, values }.into())
            }
        }
    }
}

/// Returns the scores of a result by column name.
///
/// If none are requested, these are all values of the result outside lists.
///
/// # Errors
/// A path selects more than one value.
pub fn scores(requested: &[Score], result: &Value) -> anyhow::Result<BTreeMap<String, Value>> {
    let mut found = BTreeMap::new();
    if requested.is_empty() {
        leaves("", result, &mut found);
        return Ok(found);
    }
    for score in requested {
        if let Some(value) = score.read(result)? {
            found.insert(score.column.clone(), value);
        }
    }
    Ok(found)
}

/// Adds all values of `value` outside lists to `found` by dotted path, except texts of several lines.
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
    //! Contract: a score is one value of the result. A path with several values is an error, one without a value is empty.
    use super::*;
    use serde_json::json;

    fn rows() -> Value {
        json!({"rows": [{"model": "A", "pos_mm": 1.5}, {"model": "B", "pos_mm": 2.5}], "deep": {"n": 3, "why": "so"},
               "text": "a\nb"})
    }

    #[test]
    fn selects_one_row_by_path() {
        let score = Score::new("pos_mm", "$.rows[?@.model=='B'].pos_mm").unwrap();
        assert_eq!(score.read(&rows()).unwrap(), Some(json!(2.5)));
    }

    #[test]
    fn rejects_several_values_and_accepts_none() {
        let several =
            Score::new("pos_mm", "$.rows[*].pos_mm").unwrap().read(&rows()).unwrap_err().to_string();
        assert!(several.contains("pos_mm") && several.contains("2 values"), "{several}");
        assert_eq!(Score::new("x", "$.nowhere").unwrap().read(&rows()).unwrap(), None);
        assert!(Score::new("x", "rows[0]").unwrap_err().to_string().contains("not a valid JSONPath"));
    }

    #[test]
    fn takes_all_values_outside_lists_by_default() {
        let found = scores(&[], &rows()).unwrap();
        assert_eq!(found, BTreeMap::from([("deep.n".into(), json!(3)), ("deep.why".into(), json!("so"))]));
    }
}
