//! The section `[external]`: rates of the states that a function outside the model file computes.

use super::Model;
use super::toml_reader::Item;
use crate::error::{Fault, ModelError, Place};
use crate::external::ExternalFunction;
use augsim_data::{Unit, escaped_short};

/// A function outside the model file that computes the rates of the declared states.
#[derive(Debug, Clone, PartialEq)]
pub struct External {
    /// Name of the function, for messages.
    pub function: String,
    /// Length of a step, s, if the function advances the states by steps; `None` if it computes rates.
    pub step_s: Option<f64>,
    /// Number of inputs that the function gets: those of the file, without inputs that stand for process noise.
    pub inputs: usize,
    /// Generalised forces that effects can add to, 0 without effects.
    pub forces: Vec<Force>,
    /// The function; `None` in a model that was read from a text alone.
    pub rates: Option<ExternalFunction>,
}

/// A generalised force on a coordinate of the external function.
#[derive(Debug, Clone, PartialEq)]
pub struct Force {
    /// Name of the force.
    pub name: String,
    /// Index of the state that is the position of the coordinate.
    pub position: usize,
    /// Index of the state that is its speed.
    pub speed: usize,
}

impl External {
    /// Error of a model whose function is not there, because the model was read from its text alone.
    pub(crate) fn missing(&self, model: &Model) -> ModelError {
        self.error(model, "is not in the file; make the model in Python with augsim.Model.from_rates or augsim.Model.from_step")
    }

    /// Error of an export of a model: a function of Python is no equation that another language could compute.
    pub(crate) fn not_exported(&self, model: &Model) -> ModelError {
        self.error(
            model,
            "cannot be exported; use the effects that were found in Python, or write the rates as equations",
        )
    }

    fn error(&self, model: &Model, what: &str) -> ModelError {
        let cause =
            format!("the rates of this model are the Python function `{}`, which {what}", self.function);
        let line =
            model.text.lines().position(|line| line.trim() == "[external]").map_or(1, |index| index + 1);
        let place = Place { file: model.file.clone(), line, key: "external".to_owned() };
        ModelError { place, fault: Box::new(Fault::External { cause }), excerpt: None }
    }
}

impl Force {
    /// Unit of the force, from its name; `None` if the name does not end in a unit.
    pub fn unit(&self) -> Option<Unit> {
        Unit::from_column_name(&self.name)
    }
}

/// Reads the section `[external]`; `None` if the file has none.
pub(super) fn read(file: &Item<'_, '_>, model: &Model) -> Result<Option<External>, ModelError> {
    let Some(item) = file.entry("external") else { return Ok(None) };
    item.table("a table, such as [external] with function = \"pendulum\"")?;
    item.check_keys(&["function", "step_s", "forces"])?;
    let missing = || item.error(Fault::Missing { key: "function", example: "function = \"pendulum\"" });
    let function = item.entry("function").ok_or_else(missing)?.text("the name of a function in quotes")?;
    let step_s = item.entry("step_s").map(|step| step.positive()).transpose()?;
    let mut forces = Vec::new();
    if let Some(table) = item.entry("forces") {
        let expected =
            "a table such as { torque_N_m = [\"angle_rad\", \"speed_rad_s\"] }, with position and speed";
        for (name, entry) in table.entries(expected)? {
            super::entries::check_name(&entry, name)?;
            let names = entry.texts(expected)?;
            let states: Vec<usize> = names.iter().filter_map(|state| model.state(state)).collect();
            let [position, speed] = states[..] else { return Err(entry.wrong(expected)) };
            forces.push(Force { name: name.to_owned(), position, speed });
        }
    }
    let (function, inputs) = (escaped_short(function), model.inputs.len());
    Ok(Some(External { function, step_s, inputs, forces, rates: None }))
}

impl Model {
    /// Reads the text of a changed version of this model, which has the same external function.
    ///
    /// # Errors
    /// As [`parse`](super::parse).
    pub fn parse_changed(&self, text: &str) -> Result<Model, ModelError> {
        let mut changed = super::parse(text, &self.file)?;
        if let (Some(changed), Some(own)) = (&mut changed.external, &self.external) {
            changed.rates.clone_from(&own.rates);
        }
        Ok(changed)
    }

    /// The generalised force with this index; `None` if there is none.
    pub fn force(&self, index: usize) -> Option<&Force> {
        self.external.as_ref()?.forces.get(index)
    }

    /// Indices of the parameters that the external function gets: the declared ones, without the delays of inputs.
    pub fn external_parameters(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.declared_parameters()).filter(|p| !self.parameters[*p].name.contains('.'))
    }
}
