//! A calibrated model file with scales chosen from data, as the search for effects opens it.

use super::EquationSystem;
use crate::error::ModelError;
use crate::model::{Covariance, GroupValues, Model, Parameter};
use augsim_data::Unit;
use augsim_data::checks::ExpectedData;
use augsim_system::{
    Addition, Augmentation, Declaration, Fitted, FittedValues, ModelTerm, Objection, Record, RoundTripError,
    System,
};
use std::error::Error as StdError;
use std::sync::Arc;
use thiserror::Error;

/// A declared model with its system tuned to data: scales of the effects, steps and windows are chosen.
#[derive(Debug, Clone)]
pub struct CalibratedModel {
    model: Model,
    system: EquationSystem,
}

/// Error: the data lack a column of the model.
#[derive(Debug, Error)]
enum MissingColumn {
    #[error(
        "the data have no column `{column}`, which is {what} of the model; rename the data column, or remove it from the model"
    )]
    Column { column: String, what: &'static str },
}

/// Error: how the text written for a model differs from that model when it is read again.
#[derive(Debug, Error)]
enum Difference {
    #[error("a fitted parameter has no place in the file")]
    Place,
    #[error("{written} effects were written, but {read} are read back")]
    Additions { written: usize, read: usize },
    #[error("{name} = {written} was written, but {read} is read back")]
    Value { name: String, written: f64, read: f64 },
}

impl CalibratedModel {
    /// Combines a declared model with the system compiled from it.
    pub fn new(model: Model, system: EquationSystem) -> Self {
        Self { model, system }
    }

    /// Sets the results of a first fit as start values of later fits.
    ///
    /// `values` are the fitted values of all parameters; `residuals` is the residual norm of each output over
    /// the shortest windows, in the unit of the output.
    pub fn calibrated(mut self, values: Vec<f64>, residuals: &[f64]) -> Self {
        self.system = self.system.with_fit(values, residuals);
        self
    }

    /// The declared model, without added effects.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Writes the text of the model with the effects and values that discovery found.
    ///
    /// The text is read again, and an error is returned if it reads back as another model.
    fn augmented_text(&self, found: &Augmentation) -> Result<String, Box<dyn StdError + Send + Sync>> {
        let system = &self.system;
        let terms: Vec<ModelTerm> = found
            .additions
            .iter()
            .filter_map(|a| if let Addition::Term(law, _) = a { Some(law.clone()) } else { None })
            .collect();
        let mut model = self.model.clone();
        let mut places: Vec<usize> = (0..model.parameters.len()).collect();
        for law in &terms {
            places.extend(system.add(&mut model, law)?.into_iter().map(|(_, place)| place));
        }
        let added = found.additions.iter().filter_map(|a| match a {
            Addition::Term(_, values) => Some(values),
            Addition::Scatter(..) => None,
        });
        let added = (self.model.parameters.len()..).zip(added.flatten());
        for (index, fitted) in found.declared.iter().map(|(index, fitted)| (*index, fitted)).chain(added) {
            let place = *places.get(index).ok_or(Difference::Place)?;
            set_fitted(model.parameters.get_mut(place).ok_or(Difference::Place)?, fitted);
        }
        let indices = found.declared.iter().map(|(index, _)| *index).chain(self.model.parameters.len()..);
        let fitted: Vec<usize> =
            indices.take(found.covariance.len()).filter_map(|i| places.get(i).copied()).collect();
        model.covariance = covariance_of(&fitted, &found.covariance);
        let text = model.to_toml()?;
        let again = self.model.parse_changed(&text)?;
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
        for (written_parameter, read_parameter) in model.parameters.iter().zip(&again.parameters) {
            if written_parameter.nominal != read_parameter.nominal {
                let (name, [written, read]) =
                    (written_parameter.name.clone(), [written_parameter, read_parameter].map(|p| p.nominal));
                return Err(Difference::Value { name, written, read }.into());
            }
        }
        Ok(text)
    }
}

/// Covariance of the parameters at `places`, without parameters of zero variance; `None` if none is left.
fn covariance_of(places: &[usize], matrix: &[Vec<f64>]) -> Option<Covariance> {
    let known: Vec<usize> = (0..places.len()).filter(|i| matrix[*i][*i] > 0.0).collect();
    let rows = known.iter().map(|i| known.iter().map(|j| matrix[*i][*j]).collect()).collect();
    let parameters = known.iter().map(|i| places[*i]).collect();
    (places.len() == matrix.len() && !known.is_empty()).then_some(Covariance { parameters, rows })
}

/// Relative amount by which a fitted value may exceed a bound and still be set to it: a few roundings.
const ROUNDING_RATIO: f64 = 1e-12;

/// Sets the fitted value of a parameter, and its confidence interval.
///
/// A value that exceeds the model's bound only by rounding is set to the bound.
fn set_fitted(p: &mut Parameter, fitted: &Fitted) {
    let value = match &fitted.values {
        FittedValues::One(value) => {
            p.ci95 = fitted.ci95;
            *value
        }
        FittedValues::ByGroup { values: groups, sd } => {
            p.ci95 = None;
            p.by_group = Some(GroupValues { values: groups.clone(), sd: *sd });
            groups.iter().map(|(_, v)| v).sum::<f64>() / groups.len() as f64
        }
    };
    let clamped = value.clamp(p.min, p.max);
    p.nominal = if (value - clamped).abs() <= ROUNDING_RATIO * clamped.abs() { clamped } else { value };
}

impl Model {
    /// Properties that the model expects of data, for plausibility checks: columns, periods and temperatures.
    pub fn expected(&self) -> ExpectedData {
        let kelvin = Unit::parse("K");
        let temperatures = self.parameters.iter().filter(|p| p.unit.is_some() && p.unit == kelvin);
        ExpectedData {
            periodic: self.outputs.iter().filter(|o| o.period.is_some()).map(|o| o.name.clone()).collect(),
            temperatures_kelvin: temperatures.map(|p| p.nominal).collect(),
            outputs: self.outputs.iter().map(|o| o.name.clone()).collect(),
            inputs: self.inputs.iter().map(|i| i.name.clone()).collect(),
            ..ExpectedData::default()
        }
    }
}

impl EquationSystem {
    /// Combines `declared` with the settings that this system chose from these records.
    ///
    /// `declared` is the model of this system with other parameter values. Chosen from records are the scales
    /// of the library's numbers, the widths of smoothed discontinuities, the steps and the windows.
    ///
    /// # Errors
    /// A candidate with an unknown place.
    pub fn measured(&self, declared: Model, records: &[Record]) -> Result<CalibratedModel, ModelError> {
        let mut system = EquationSystem::new(&declared, &self.scales(records))?
            .with_options(self.options.clone())
            .with_windows(self.window_s);
        system.compiled = Arc::new((*system.compiled).clone().with_widths_of(&self.compiled));
        system.complete = Arc::default();
        Ok(CalibratedModel { model: declared, system })
    }
}

impl Declaration for CalibratedModel {
    fn file(&self) -> &str {
        &self.model.file
    }

    fn expected(&self) -> ExpectedData {
        self.model.expected()
    }

    fn open(&self, has_column: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection> {
        let outputs = self.model.outputs.iter().map(|o| (&o.name, "an output"));
        let inputs = self.model.inputs.iter().map(|i| (&i.name, "an input"));
        if let Some((column, what)) = outputs.chain(inputs).find(|(name, _)| !has_column(name)) {
            return Err(Objection::new(MissingColumn::Column { column: column.clone(), what }));
        }
        Ok(Arc::new(self.system.clone()))
    }

    fn augmented(&self, found: &Augmentation) -> Result<String, RoundTripError> {
        self.augmented_text(found)
            .map_err(|e| RoundTripError { model: self.model.file.clone(), source: Some(e) })
    }
}
