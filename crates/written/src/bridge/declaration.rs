//! A model file with the sizes of data in it, for the loop to open.

use super::WrittenSystem;
use crate::error::ModelError;
use crate::model::{Model, Parameter};
use augsim_data::checks::Expected;
use augsim_physics::system::{
    Addition, Augmentation, Declaration, Fitted, FittedValues, Law, NotReadable, Objection, Record, System,
};
use std::error::Error as StdError;
use std::sync::Arc;
use thiserror::Error;

/// A model with the system that it declares, whose library has numbers, and whose steps and windows are chosen, by the data
/// that it is to explain.
#[derive(Debug, Clone)]
pub struct MeasuredModel {
    model: Model,
    system: WrittenSystem,
}

#[derive(Debug, Error)]
enum Lacking {
    #[error(
        "the data have no column `{column}`, {what} of the model; rename one, or take it out of the model"
    )]
    Column { column: String, what: &'static str },
}

/// How a text differs from the model that was written into it.
#[derive(Debug, Error)]
enum Difference {
    #[error("a parameter that was fitted has no place in it")]
    Place,
    #[error("{written} effects become {read}")]
    Additions { written: usize, read: usize },
    #[error("{name} = {written} becomes {read}")]
    Value { name: String, written: f64, read: f64 },
}

impl MeasuredModel {
    /// A model with its system.
    pub fn new(model: Model, system: WrittenSystem) -> Self {
        Self { model, system }
    }

    /// Sets what a first fit found: `values` of all parameters, and the misfit of each output over the shortest
    /// windows, in its unit.
    pub fn calibrated(mut self, values: Vec<f64>, misfit: &[f64]) -> Self {
        self.system = self.system.with_fit(values, misfit);
        self
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    fn written(&self, found: &Augmentation) -> Result<String, Box<dyn StdError + Send + Sync>> {
        let system = &self.system;
        let laws: Vec<Law> = found
            .additions
            .iter()
            .filter_map(|a| if let Addition::Law(law, _) = a { Some(law.clone()) } else { None })
            .collect();
        let mut model = self.model.clone();
        let mut places: Vec<usize> = (0..model.parameters.len()).collect();
        for law in &laws {
            places.extend(system.add(&mut model, law)?.into_iter().map(|(_, place)| place));
        }
        let added = found.additions.iter().filter_map(|a| match a {
            Addition::Law(_, values) => Some(values),
            Addition::Scatter(..) => None,
        });
        let added = (self.model.parameters.len()..).zip(added.flatten());
        for (index, fitted) in found.declared.iter().map(|(index, fitted)| (*index, fitted)).chain(added) {
            let place = *places.get(index).ok_or(Difference::Place)?;
            put(model.parameters.get_mut(place).ok_or(Difference::Place)?, fitted);
        }
        let text = model.to_toml()?;
        let again = crate::model::parse(&text, &model.file)?;
        if again.additions.len() != model.additions.len() {
            return Err(Difference::Additions {
                written: model.additions.len(),
                read: again.additions.len(),
            }
            .into());
        }
        if again.parameters.len() != model.parameters.len() {
            return Err(Difference::Place.into());
        }
        for (one, other) in model.parameters.iter().zip(&again.parameters) {
            if one.nominal != other.nominal {
                let (name, [written, read]) = (one.name.clone(), [one, other].map(|p| p.nominal));
                return Err(Difference::Value { name, written, read }.into());
            }
        }
        Ok(text)
    }
}

/// Share of a bound by which a bound of the fit and the model's own may differ: a few roundings.
const ROUNDING: f64 = 1e-12;

/// Puts what was fitted into a parameter. A bound of the fit and the model's own may differ by rounding; the model's holds.
fn put(p: &mut Parameter, fitted: &Fitted) {
    let value = match &fitted.values {
        FittedValues::One(value) => {
            p.ci95 = fitted.ci95;
            *value
        }
        FittedValues::ByGroup(groups) => groups.iter().map(|(_, v)| v).sum::<f64>() / groups.len() as f64,
    };
    let within = value.clamp(p.min, p.max);
    p.nominal = if (value - within).abs() <= ROUNDING * within.abs() { within } else { value };
}

impl Model {
    /// The columns of its outputs and inputs, for the checks of suspicious data.
    pub fn expected(&self) -> Expected {
        Expected {
            outputs: self.outputs.iter().map(|o| o.name.clone()).collect(),
            inputs: self.inputs.iter().map(|i| i.name.clone()).collect(),
            ..Expected::default()
        }
    }
}

impl WrittenSystem {
    /// The model `declared`, which this system is of but for its values, with what is known from these records: the sizes in
    /// its library, the widths of jumps, the steps and the windows. This system was tuned on them.
    ///
    /// # Errors
    /// A candidate that cannot be placed.
    pub fn measured(&self, declared: Model, records: &[Record]) -> Result<MeasuredModel, ModelError> {
        let mut system = WrittenSystem::new(&declared, &self.scales(records))?
            .with_options(self.options.clone())
            .with_windows(self.window_s);
        system.compiled = Arc::new((*system.compiled).clone().with_widths_of(&self.compiled));
        system.complete = Arc::default();
        Ok(MeasuredModel { model: declared, system })
    }
}

impl Declaration for MeasuredModel {
    fn file(&self) -> &str {
        &self.model.file
    }

    fn expected(&self) -> Expected {
        self.model.expected()
    }

    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection> {
        let outputs = self.model.outputs.iter().map(|o| (&o.name, "an output"));
        let inputs = self.model.inputs.iter().map(|i| (&i.name, "an input"));
        if let Some((column, what)) = outputs.chain(inputs).find(|(name, _)| !has(name)) {
            return Err(Objection::new(Lacking::Column { column: column.clone(), what }));
        }
        Ok(Arc::new(self.system.clone()))
    }

    fn augmented(&self, found: &Augmentation) -> Result<String, NotReadable> {
        self.written(found).map_err(|e| NotReadable { model: self.model.file.clone(), source: Some(e) })
    }
}
