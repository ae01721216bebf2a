//! A model file with the sizes of data in it, for the loop to open.

use super::WrittenSystem;
use crate::engine::Options;
use crate::library::Scales;
use crate::model::{Model, Parameter};
use crate::system::System as Compiled;
use augsim_data::checks::Expected;
use augsim_physics::system::{
    Addition, Augmentation, Declaration, Fitted, FittedValues, Law, NotReadable, Objection, Record, System,
};
use std::sync::Arc;
use thiserror::Error;

/// A model whose library has numbers, and whose steps are chosen, by the data that it is to explain.
#[derive(Debug, Clone)]
pub struct MeasuredModel {
    model: Model,
    scales: Scales,
    options: Option<Options>,
    window_s: Option<f64>,
    /// The system whose widths of smoothed jumps suit the data.
    tuned: Option<Arc<Compiled>>,
}

#[derive(Debug, Error)]
enum Lacking {
    #[error(
        "the data have no column `{column}`, {what} of the model; rename one, or take it out of the model"
    )]
    Column { column: String, what: &'static str },
}

impl MeasuredModel {
    /// A model with the sizes of its quantities in data; `options` are the steps, `window_s` the length of windows.
    pub fn new(model: Model, scales: Scales, options: Option<Options>, window_s: Option<f64>) -> Self {
        Self { model, scales, options, window_s, tuned: None }
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    fn system(&self) -> Result<WrittenSystem, Objection> {
        let system = WrittenSystem::new(&self.model, &self.scales).map_err(Objection::new)?;
        let options = self.options.clone().unwrap_or_else(|| system.options().clone());
        let system = system.with_options(options).with_windows(self.window_s);
        Ok(match &self.tuned {
            Some(tuned) => system.with_widths_of(tuned),
            None => system,
        })
    }

    fn written(&self, found: &Augmentation) -> Option<String> {
        let system = self.system().ok()?;
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
    /// The model of this system, which was tuned on these records, with their sizes in its library.
    pub fn measured(&self, records: &[Record]) -> MeasuredModel {
        let (model, scales) = (self.model().clone(), self.scales(records));
        let options = Some(self.options.clone());
        MeasuredModel { model, scales, options, window_s: self.window_s, tuned: Some(self.compiled.clone()) }
    }

    fn with_widths_of(mut self, tuned: &Compiled) -> Self {
        self.compiled = Arc::new((*self.compiled).clone().with_widths_of(tuned));
        self.complete = Arc::default();
        self
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
        Ok(Arc::new(self.system()?))
    }

    fn augmented(&self, found: &Augmentation) -> Result<String, NotReadable> {
        self.written(found).ok_or_else(|| NotReadable { model: self.model.file.clone(), source: None })
    }
}
