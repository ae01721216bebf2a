//! A model file with the sizes of data in it, for the loop to open.

use super::WrittenSystem;
use crate::error::ModelError;
use crate::model::{Model, Parameter};
use augsim_data::checks::Expected;
use augsim_physics::system::{
    Addition, Augmentation, Declaration, Fitted, FittedValues, Law, NotReadable, Objection, Record, System,
};
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

    fn written(&self, found: &Augmentation) -> Option<String> {
        let system = &self.system;
        let laws: Vec<Law> = found
            .additions
            .iter()
            .filter_map(|a| if let Addition::Law(law, _) = a { Some(law.clone()) } else { None })
            .collect();
        let mut model = self.model.clone();
        let mut places: Vec<usize> = (0..model.parameters.len()).collect();
        for law in &laws {
            places.extend(system.add(&mut model, law).ok()?.into_iter().map(|(_, place)| place));
        }
        let mut put = |place: usize, fitted: &Fitted| -> Option<()> {
            let p: &mut Parameter = model.parameters.get_mut(place)?;
            match &fitted.values {
                FittedValues::One(value) => (p.nominal, p.ci95) = (*value, fitted.ci95),
                FittedValues::ByGroup(groups) => {
                    let mean = groups.iter().map(|(_, v)| v).sum::<f64>() / groups.len() as f64;
                    p.nominal = mean.clamp(p.min, p.max);
                }
            }
            Some(())
        };
        for (index, fitted) in &found.declared {
            put(*places.get(*index)?, fitted)?;
        }
        let mut next = self.model.parameters.len();
        for addition in &found.additions {
            if let Addition::Law(_, values) = addition {
                for fitted in values {
                    put(*places.get(next)?, fitted)?;
                    next += 1;
                }
            }
        }
        let text = model.to_toml().ok()?;
        let again = crate::model::parse(&text, &model.file).ok()?;
        let same = again.nominals() == model.nominals() && again.additions.len() == model.additions.len();
        same.then_some(text)
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
        Expected::default()
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
        self.written(found).ok_or_else(|| NotReadable { model: self.model.file.clone(), source: None })
    }
}
