//! Access to the tables of a model file in their written order, with errors that name the place.

use crate::error::{Fault, ModelError, Place};
use crate::nearest::nearest;
use crate::text::Problem;
use augsim_data::escaped_short;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML value with its position.
pub(crate) type Value<'t> = Spanned<DeValue<'t>>;

/// The text of a model file and the file's name.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reader<'t> {
    pub(crate) file: &'t str,
    pub(crate) text: &'t str,
}

/// A value of a model file, with its place in the file.
#[derive(Debug, Clone)]
pub(crate) struct Item<'r, 't> {
    pub(crate) reader: Reader<'t>,
    /// Table and key of the value, such as `parameters.length_m`.
    pub(crate) key: String,
    pub(crate) line: usize,
    pub(crate) value: &'r Value<'t>,
}

impl<'t> Reader<'t> {
    /// Line number, from 1, of the byte `at`.
    pub(crate) fn line(&self, at: usize) -> usize {
        1 + self.text.as_bytes().iter().take(at).filter(|b| **b == b'\n').count()
    }

    /// Creates an error at a line and key.
    pub(crate) fn error(&self, line: usize, key: &str, fault: Fault) -> ModelError {
        ModelError {
            place: Place { file: self.file.into(), line, key: key.into() },
            fault: Box::new(fault),
            excerpt: None,
        }
    }

    /// Entries of a table in the order of the file, with their lines.
    pub(crate) fn entries<'r>(&self, table: &'r DeTable<'t>) -> Vec<(&'r str, usize, &'r Value<'t>)> {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let place = |(key, value): (&'r Spanned<_>, &'r Value<'t>)| -> (&'r str, usize, &'r Value<'t>) {
            let name: &std::borrow::Cow<'_, str> = key.get_ref();
            (name, self.line(key.span().start), value)
        };
        entries.into_iter().map(place).collect()
    }

    /// Checks that a table has no keys that are not among `known`.
    pub(crate) fn check_keys(
        &self,
        table: &DeTable<'t>,
        place: &str,
        known: &[&str],
    ) -> Result<(), ModelError> {
        for (key, line, _) in self.entries(table) {
            if !known.contains(&key) {
                let fault = Fault::UnknownKey {
                    key: escaped_short(key),
                    nearest: nearest(key, known.iter().copied()),
                    known: known.iter().map(|name| (*name).to_owned()).collect(),
                };
                return Err(self.error(line, place, fault));
            }
        }
        Ok(())
    }

    /// Creates an error for a problem in an expression, with the relevant part marked.
    pub(crate) fn problem(
        &self,
        line: usize,
        key: &str,
        text: &str,
        failure: (Problem, Range<usize>),
    ) -> ModelError {
        let place = Place { file: self.file.into(), line, key: key.into() };
        ModelError::in_expression(place, text, failure)
    }
}

impl<'r, 't> Item<'r, 't> {
    /// Creates an error at the place of this value.
    pub(crate) fn error(&self, fault: Fault) -> ModelError {
        self.reader.error(self.line, &self.key, fault)
    }

    /// Creates the error that this value is not as `expected`.
    pub(crate) fn wrong(&self, expected: &'static str) -> ModelError {
        self.error(Fault::WrongType { expected })
    }

    /// Entries of this table in the order of the file.
    pub(crate) fn entries(&self, expected: &'static str) -> Result<Vec<(&'r str, Item<'r, 't>)>, ModelError> {
        let entries = self.reader.entries(self.table(expected)?);
        let item = |(name, line, value): (&'r str, usize, &'r Value<'t>)| {
            (name, Item { reader: self.reader, key: join(&self.key, &escaped_short(name)), line, value })
        };
        Ok(entries.into_iter().map(item).collect())
    }

    /// The entry of this table under `key`; `None` if there is none.
    pub(crate) fn entry(&self, key: &str) -> Option<Item<'r, 't>> {
        let (found, value) = self.value.get_ref().as_table()?.get_key_value(key)?;
        let line = self.reader.line(found.span().start);
        Some(Item { reader: self.reader, key: join(&self.key, key), line, value })
    }

    /// Checks that this table has no keys that are not among `known`.
    pub(crate) fn check_keys(&self, known: &[&str]) -> Result<(), ModelError> {
        let table = self.value.get_ref().as_table();
        table.map_or(Ok(()), |table| self.reader.check_keys(table, &self.key, known))
    }

    pub(crate) fn table(&self, expected: &'static str) -> Result<&'r DeTable<'t>, ModelError> {
        self.value.get_ref().as_table().ok_or_else(|| self.wrong(expected))
    }

    pub(crate) fn text(&self, expected: &'static str) -> Result<&'r str, ModelError> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong(expected))
    }

    pub(crate) fn flag(&self) -> Result<bool, ModelError> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong("true or false"))
    }

    pub(crate) fn number(&self) -> Result<f64, ModelError> {
        self.maybe_number().ok_or_else(|| self.wrong("a finite number"))
    }

    pub(crate) fn maybe_number(&self) -> Option<f64> {
        let text = match self.value.get_ref() {
            DeValue::Float(f) => f.as_str(),
            // TOML has no whole numbers beyond 64 bits; a prefix such as 0x gives the base.
            DeValue::Integer(i) => {
                return i64::from_str_radix(i.as_str(), i.radix()).ok().map(|whole| whole as f64);
            }
            _ => return None,
        };
        text.parse::<f64>().ok().filter(|x| x.is_finite())
    }

    pub(crate) fn positive(&self) -> Result<f64, ModelError> {
        let found = self.number()?;
        if found > 0.0 { Ok(found) } else { Err(self.error(Fault::NotPositive { found })) }
    }

    pub(crate) fn numbers(&self, expected: &'static str) -> Result<Vec<f64>, ModelError> {
        let list = self.value.get_ref().as_array().ok_or_else(|| self.wrong(expected))?;
        list.iter().map(|value| Item { value, ..self.clone() }.number()).collect()
    }

    /// Reads this value as a list of two numbers, the first below the second.
    pub(crate) fn range(&self) -> Result<[f64; 2], ModelError> {
        let expected = "a list of two numbers, such as [0.0, 10.0]";
        let [min, max] = self.numbers(expected)?[..] else { return Err(self.wrong(expected)) };
        if min < max { Ok([min, max]) } else { Err(self.error(Fault::EmptyBounds { min, max })) }
    }

    /// Reads this value as a list of strings.
    pub(crate) fn texts(&self, expected: &'static str) -> Result<Vec<String>, ModelError> {
        let list = self.value.get_ref().as_array().ok_or_else(|| self.wrong(expected))?;
        let text = |value: &Value<'_>| {
            value.get_ref().as_str().map(escaped_short).ok_or_else(|| self.wrong(expected))
        };
        list.iter().map(text).collect()
    }

    /// Reads this value as text: a number as written, or a string.
    pub(crate) fn number_or_text(&self) -> Result<String, ModelError> {
        match self.maybe_number() {
            Some(number) => Ok(format!("{number:?}")),
            None => self.text("a number, or an expression in quotes").map(str::to_owned),
        }
    }

    /// Lists the blocks `[[key]]`, each with its line, and with its kind or its number in its key.
    pub(crate) fn blocks(
        &self,
        key: &'static str,
        expected: &'static str,
    ) -> Result<Vec<Item<'r, 't>>, ModelError> {
        let Some(list) = self.entry(key) else { return Ok(Vec::new()) };
        let blocks = list.value.get_ref().as_array().ok_or_else(|| list.wrong(expected))?;
        let block = |(index, value): (usize, &'r Value<'t>)| {
            let line = self.reader.line(Value::span(value).start);
            let mut item = Item { reader: self.reader, key: format!("{key}.{}", index + 1), line, value };
            item.table(expected)?;
            if let Some(kind) = item.entry("kind").and_then(|k| k.value.get_ref().as_str()) {
                item.key = format!("{key}.{}", escaped_short(kind));
            }
            Ok(item)
        };
        blocks.iter().enumerate().map(block).collect()
    }

    /// Reads this value as one of the given words; returns what belongs to that word.
    pub(crate) fn word<T: Copy>(&self, words: &[(&str, T)], expected: &'static str) -> Result<T, ModelError> {
        let text = self.text(expected)?;
        words.iter().find(|(w, _)| *w == text).map(|(_, v)| *v).ok_or_else(|| self.wrong(expected))
    }
}

fn join(table: &str, key: &str) -> String {
    if table.is_empty() { key.to_owned() } else { format!("{table}.{key}") }
}
