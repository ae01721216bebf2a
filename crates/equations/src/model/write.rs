//! Writes a model back into its file: parameters, confidence intervals, noise and effects.
//!
//! Everything else, including comments and order, stays as the user wrote it.

use super::{Addition, GroupValues, How, Model, Parameter, RateNoise, SensorNoise};
use crate::error::{Fault, ModelError, Place};
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value, value};

/// Sets the path of the description file in the text of a model file; a text without `[robot]` stays as it is.
///
/// `file` is the name of the model file in messages.
///
/// # Errors
/// The text cannot be edited as TOML.
pub fn with_description_file(text: &str, file: &str, path: &str) -> Result<String, ModelError> {
    let mut document = editable(text, file)?;
    if let Some(robot) = document.get_mut("robot") {
        set(robot, "file", path.into());
    }
    Ok(document.to_string())
}

/// Parses the text of a model file so that it can be edited.
fn editable(text: &str, file: &str) -> Result<DocumentMut, ModelError> {
    text.parse().map_err(|cause: toml_edit::TomlError| {
        let place = Place { file: file.to_owned(), line: 1, key: String::new() };
        let fault = Box::new(Fault::NotEditable { cause });
        ModelError { place, fault, excerpt: None }
    })
}

impl Model {
    /// Writes this model as the text of a model file that reads back as the same model.
    ///
    /// The text from which the model was read is edited: nominal values, confidence intervals, input
    /// interpolation, noise, start values that are shared, and effects are set to those of this model.
    ///
    /// # Errors
    /// The text of the model cannot be edited as TOML.
    pub fn to_toml(&self) -> Result<String, ModelError> {
        let mut document = editable(&self.text, &self.file)?;
        for p in &self.parameters[..self.declared_parameters()] {
            let entry = match p.name.split_once('.') {
                Some((input, key)) => {
                    let inputs = document.get_mut("inputs");
                    inputs.and_then(|i| i.get_mut(input)).and_then(|i| i.get_mut(key))
                }
                None => document.get_mut("parameters").and_then(|table| table.get_mut(&p.name)),
            };
            if let Some(entry) = entry {
                set_parameter(entry, p);
            }
        }
        for input in &self.inputs {
            let hold = input.hold.map(super::Hold::word);
            if let (Some(hold), Some(entry)) =
                (hold, document.get_mut("inputs").and_then(|i| i.get_mut(&input.name)))
            {
                set_hold(entry, hold);
            }
        }
        for output in &self.outputs {
            if let (Some(sd), Some(entry)) =
                (output.sd, document.get_mut("outputs").and_then(|o| o.get_mut(&output.name)))
                && entry.is_table_like()
            {
                set(entry, "sd", sd.into());
            }
        }
        for output in &self.outputs {
            if let Some(entry) = document.get_mut("outputs").and_then(|o| o.get_mut(&output.name)) {
                set_noise(entry, output.noise);
            }
        }
        for state in self.states.iter().filter(|s| s.shared) {
            let entry = document.get_mut("states").and_then(|s| s.get_mut(&state.name));
            if let (Some(entry), [node]) = (entry, &state.start.tree.nodes[..])
                && let crate::text::Kind::Number(start) = node.kind
            {
                set(entry, "start", start.into());
                if let Some(sd) = state.sd {
                    set(entry, "sd", sd.into());
                }
            }
        }
        for state in &self.states[..self.declared_states()] {
            if let Some(entry) = document.get_mut("states").and_then(|s| s.get_mut(&state.name)) {
                set_process_noise(entry, state.process_noise);
            }
        }
        document.remove("covariance");
        if let Some(covariance) = &self.covariance {
            let mut table = Table::new();
            for (parameter, row) in covariance.parameters.iter().zip(&covariance.rows) {
                let name = &self.parameters[*parameter].name;
                table.insert(name, value(row.iter().copied().collect::<Array>()));
            }
            document.insert("covariance", Item::Table(table));
        }
        document.remove("effect");
        if !self.additions.is_empty() {
            let mut blocks = ArrayOfTables::new();
            self.additions.iter().for_each(|addition| blocks.push(self.block(addition)));
            document.insert("effect", Item::ArrayOfTables(blocks));
        }
        Ok(document.to_string())
    }

    /// Writes an effect as an `[[effect]]` block.
    fn block(&self, addition: &Addition) -> Table {
        let mut table = Table::new();
        let parameters = &self.parameters[addition.parameters.clone()];
        table.insert("kind", value(&addition.kind));
        table.insert("on", value(&addition.on));
        if let Some((first, last)) = addition.table {
            table.insert("against", value(addition.with.as_deref().unwrap_or("t")));
            table.insert("first", value(first));
            table.insert("last", value(last));
            table.insert("values", value(parameters.iter().map(|p| p.nominal).collect::<Array>()));
        } else {
            if let Some(with) = &addition.with {
                table.insert("with", value(with));
            }
            if addition.kind == "formula" {
                for change in &addition.changes {
                    let how: How = change.how;
                    table.insert(how.key(), value(&change.value.tree.text));
                }
            }
            for p in parameters {
                let mut entry = InlineTable::new();
                entry.insert("nominal", p.nominal.into());
                for (key, bound) in [("min", p.min), ("max", p.max)] {
                    if bound.is_finite() {
                        entry.insert(key, bound.into());
                    }
                }
                if p.frozen {
                    entry.insert("frozen", true.into());
                }
                if let Some(ci95) = p.ci95 {
                    entry.insert("ci95", ci95.into_iter().collect::<Array>().into());
                }
                for (key, group_value) in p.by_group.iter().flat_map(group_entries) {
                    entry.insert(key, group_value);
                }
                if let Some(unit) = p.unit {
                    let symbol = unit.symbol();
                    entry.insert("unit", if symbol.is_empty() { "1".into() } else { symbol.into() });
                }
                table.insert(addition.local_name(&p.name), value(entry));
            }
        }
        if !addition.equivalent_expressions.is_empty() {
            table.insert(
                "also_fits",
                value(addition.equivalent_expressions.iter().map(String::as_str).collect::<Array>()),
            );
        }
        table
    }
}

/// Sets value, interval and `frozen` of a parameter in its entry of the file, which is a number or a table.
fn set_parameter(entry: &mut Item, p: &Parameter) {
    // A delay that is a plain number is frozen anyway.
    let is_frozen = p.frozen && (entry.is_table_like() || !p.name.contains('.'));
    if entry.is_table_like() {
        set(entry, "nominal", p.nominal.into());
        if is_frozen {
            set(entry, "frozen", true.into());
        }
        match p.ci95 {
            Some(ci95) => set(entry, "ci95", ci95.into_iter().collect::<Array>().into()),
            None => {
                if let Some(table) = entry.as_table_like_mut() {
                    table.remove("ci95");
                }
            }
        }
        set_group_values(entry, p.by_group.as_ref());
    } else if let Some(present) = entry.as_value_mut() {
        let mut table = InlineTable::new();
        table.insert("nominal", p.nominal.into());
        if is_frozen {
            table.insert("frozen", true.into());
        }
        if let Some(ci95) = p.ci95 {
            table.insert("ci95", ci95.into_iter().collect::<Array>().into());
        }
        for (key, group_value) in p.by_group.iter().flat_map(group_entries) {
            table.insert(key, group_value);
        }
        let is_number = table.len() == 1;
        let new = if is_number { p.nominal.into() } else { Value::InlineTable(table) };
        *present = decorated(new, present);
    }
}

/// Keys and values of a parameter's entry that state its values by group.
fn group_entries(by_group: &GroupValues) -> Vec<(&'static str, Value)> {
    let mut entries = vec![("per", "group".into())];
    if !by_group.values.is_empty() {
        let groups: InlineTable =
            by_group.values.iter().map(|(name, v)| (name.as_str(), Value::from(*v))).collect();
        entries.push(("groups", Value::InlineTable(groups)));
    }
    entries.extend(by_group.sd.map(|sd| ("group_sd", sd.into())));
    entries
}

/// Sets the values by group of a parameter in its entry of the file, a table, or removes them.
fn set_group_values(entry: &mut Item, by_group: Option<&GroupValues>) {
    let entries = by_group.map_or_else(Vec::new, group_entries);
    let mut is_removed = false;
    if let Some(table) = entry.as_table_like_mut() {
        for key in ["per", "groups", "group_sd"] {
            if !entries.iter().any(|(k, _)| *k == key) {
                is_removed |= table.remove(key).is_some();
            }
        }
    }
    // Without this, the white space before the brace goes with the last key.
    if let Some(inline) = entry.as_inline_table_mut().filter(|_| is_removed) {
        inline.fmt();
    }
    entries.into_iter().for_each(|(key, new)| set(entry, key, new));
}

/// Sets a value of a table if it differs from the present one, keeping white space and comments around it.
fn set(entry: &mut Item, key: &str, new: Value) {
    let Some(table) = entry.as_table_like_mut() else { return };
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(present) if is_same_value(present, &new) => {}
        Some(present) => *present = decorated(new, present),
        None => {
            table.insert(key, value(new));
            // Without this, the white space after the value that was last would be before the comma.
            if let Some(inline) = entry.as_inline_table_mut() {
                inline.fmt();
            }
        }
    }
}

/// Sets the measurement noise of an output in its entry of the file, or removes it.
fn set_noise(entry: &mut Item, noise: Option<SensorNoise>) {
    let Some(noise) = noise else {
        if let Some(table) = entry.as_table_like_mut() {
            table.remove("noise");
        }
        return;
    };
    let mut table = InlineTable::new();
    table.insert("white_sd", noise.white_sd.into());
    table.insert("autocorrelated_sd", noise.autocorrelated_sd.into());
    table.insert("correlation_time_s", noise.correlation_time_s.into());
    if !entry.is_table_like()
        && let Some(present) = entry.as_value_mut()
    {
        let mut output = InlineTable::new();
        output.insert("value", present.clone().decorated("", ""));
        *present = decorated(Value::InlineTable(output), present);
    }
    set(entry, "noise", Value::InlineTable(table));
}

/// Sets the process noise of a state in its entry of the file, or removes it.
fn set_process_noise(entry: &mut Item, shaken: Option<RateNoise>) {
    let number = |v: Option<&Item>| v.and_then(|v| v.as_float().or_else(|| v.as_integer().map(|i| i as f64)));
    let present = entry.get("shaken").map(|t| (number(t.get("sd")), number(t.get("memory_s"))));
    match (shaken, present) {
        (None, Some(_)) => {
            if let Some(table) = entry.as_table_like_mut() {
                table.remove("shaken");
            }
        }
        (Some(RateNoise { sd, correlation_time_s: memory_s }), present)
            if present != Some((Some(sd), Some(memory_s))) =>
        {
            let mut table = InlineTable::new();
            table.insert("sd", sd.into());
            table.insert("memory_s", memory_s.into());
            set(entry, "shaken", Value::InlineTable(table));
        }
        _ => {}
    }
}

/// Sets the interpolation of an input in its entry of the file, which is a string or a table.
fn set_hold(entry: &mut Item, hold: &str) {
    if entry.is_table_like() {
        set(entry, "hold", hold.into());
    } else if let Some(present) = entry.as_value_mut() {
        *present = decorated(hold.into(), present);
    }
}

/// Whether two TOML values are equal numbers or strings, whatever their notation.
///
/// This way 1e4 is not rewritten as 10000.0.
fn is_same_value(present: &Value, new: &Value) -> bool {
    let number = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
    match (number(present), number(new)) {
        (Some(a), Some(b)) => a == b,
        _ => present.as_str().zip(new.as_str()).is_some_and(|(a, b)| a == b),
    }
}

/// Returns the value `new` with the white space and comments of `present`.
fn decorated(mut new: Value, present: &Value) -> Value {
    *new.decor_mut() = present.decor().clone();
    new
}
