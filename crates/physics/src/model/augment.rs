//! Writes the results of a fit into models, and implements [`Declaration`] for them.

use super::{EffectBlock, Model, ModelFile, PushModel};
use crate::ball::Axes;
use crate::ball::effects::{self, Feature, SCATTER_KIND, TABLE_KIND, Table, Target};
use crate::library::ParameterSpec;
use crate::push;
use augsim_data::checks::ExpectedData;
use augsim_system::{
    Addition, Augmentation, Declaration, Fitted, FittedValues, ModelTerm, Objection, Parameter, Per,
    RoundTripError, ScatterPer, Simulate, System,
};
use std::error::Error as StdError;
use std::sync::Arc;
use thiserror::Error;

/// Error: the data have no position columns, or a column of pushing is missing.
#[derive(Debug, Error)]
enum MissingColumns {
    #[error("no position columns; 1-D data need `height_m`, 2-D `x_m` and `z_m`, 3-D `x_m`, `y_m` and `z_m`")]
    Position,
    #[error(
        "no column `{0}`; pushes need `pusher_x_m`, `pusher_y_m` (the rod's centre) and `x_m`, `y_m`, `theta_rad` (the object's centroid); `augsim data convert` produces them from published data sets"
    )]
    Push(String),
}

/// Stores a fitted value, or fitted values by group, in a parameter.
fn store(fitted: &Fitted, p: &mut Parameter) {
    match &fitted.values {
        FittedValues::One(value) => (p.nominal, p.ci95) = (*value, fitted.ci95),
        FittedValues::ByGroup { values: groups, .. } => {
            p.per = Per::Group;
            p.groups = groups.clone();
            let mean = groups.iter().map(|(_, v)| v).sum::<f64>() / groups.len() as f64;
            // The mean of values that are all at a bound may exceed it by rounding.
            p.nominal = mean.clamp(p.min, p.max);
        }
    }
}

/// An `[[effect]]` block with fitted parameter values.
fn block(kind: &str, parameters: Vec<Parameter>, values: &[Fitted]) -> EffectBlock {
    let mut block = EffectBlock { kind: kind.into(), scatter: None, table: None, parameters };
    block.parameters.iter_mut().zip(values).for_each(|(p, v)| store(v, p));
    block
}

/// Calibrated parameters of an effect, all with the value 0.
fn blank(specs: &[ParameterSpec]) -> Vec<Parameter> {
    specs.iter().map(|s| Parameter::free(s.name.into(), 0.0, s.min, s.max)).collect()
}

/// The `[[effect]]` block of a fitted table; `None` if its target or feature is out of range.
fn tabulated(table: &augsim_system::Table, values: &[Fitted]) -> Option<EffectBlock> {
    let (target, against) = (*Target::ALL.get(table.target)?, *Feature::ALL.get(table.feature)?);
    let mut block = block(TABLE_KIND, (0..table.knots).map(Parameter::knot).collect(), values);
    block.parameters.iter_mut().for_each(|p| p.ci95 = None);
    block.table = Some(Table { target, feature: against, first: table.first, last: table.last });
    Some(block)
}

/// Stores fitted values in the base parameters, then in those of effects other than the random scatter.
fn store_declared(found: &Augmentation, base: &mut [Parameter], effects: &mut [EffectBlock]) {
    let laws = effects.iter_mut().filter(|b| b.scatter.is_none());
    let mut slots: Vec<&mut Parameter> =
        base.iter_mut().chain(laws.flat_map(|b| &mut b.parameters)).collect();
    for (index, fitted) in &found.declared {
        if let Some(p) = slots.get_mut(*index) {
            store(fitted, p);
        }
    }
    // The format of a table is a list of values without intervals.
    let tables = effects.iter_mut().filter(|b| b.table.is_some());
    tables.flat_map(|b| &mut b.parameters).for_each(|p| p.ci95 = None);
}

/// Stores the fitted standard deviation in the first random scatter of a model.
fn store_scatter(found: &Augmentation, effects: &mut [EffectBlock]) {
    let scatter = effects.iter_mut().find(|b| b.scatter.is_some());
    if let (Some(sd), Some(p)) = (found.scatter_sd, scatter.and_then(|b| b.parameters.first_mut())) {
        (p.nominal, p.ci95) = (sd, found.scatter_ci95.or(p.ci95));
    }
}

impl Model {
    /// A copy of the model with the results of a fit.
    fn with_fit(&self, found: &Augmentation) -> Self {
        let mut out = self.clone();
        out.clock_reference_s = found.clock_reference_s.or(out.clock_reference_s);
        store_declared(found, &mut out.parameters, &mut out.effects);
        // Scene parameters that were calibrated without being declared, such as the floor height, become
        // declared.
        for (index, _) in &found.declared {
            if let Some(p) = out.parameters.get_mut(*index).filter(|p| !out.declared.contains(&p.name)) {
                out.declared.push(p.name.clone());
                p.frozen = false;
            }
        }
        let library = effects::all::<f64>();
        for addition in &found.additions {
            out.effects.extend(match addition {
                Addition::Term(ModelTerm::Effect(i), values) => {
                    library.get(*i).map(|e| block(e.spec().kind, blank(e.spec().parameters), values))
                }
                Addition::Term(ModelTerm::Table(table), values) => tabulated(table, values),
                Addition::Scatter(per, _) => {
                    let parameters = blank(effects::SCATTER_SPEC.parameters);
                    Some(EffectBlock { scatter: Some(*per), ..block(SCATTER_KIND, parameters, &[]) })
                }
            });
        }
        store_scatter(found, &mut out.effects);
        out
    }
}

impl PushModel {
    /// A copy of the model with the results of a fit; every fitted parameter becomes declared.
    fn with_fit(&self, found: &Augmentation) -> Self {
        let mut out = self.clone();
        store_declared(found, &mut out.parameters, &mut out.effects);
        let library = push::effects::all::<f64>();
        for addition in &found.additions {
            out.effects.extend(match addition {
                Addition::Term(ModelTerm::Effect(i), values) => {
                    library.get(*i).map(|e| block(e.spec().kind, blank(e.spec().parameters), values))
                }
                Addition::Term(ModelTerm::Table(_), _) => None,
                Addition::Scatter(..) => {
                    let kind = push::effects::SCATTER_KIND;
                    let parameters = blank(push::effects::SCATTER_SPEC.parameters);
                    Some(EffectBlock { scatter: Some(ScatterPer::Record), ..block(kind, parameters, &[]) })
                }
            });
        }
        store_scatter(found, &mut out.effects);
        for p in &out.parameters {
            if (p.ci95.is_some() || !p.groups.is_empty()) && !out.declared.contains(&p.name) {
                out.declared.push(p.name.clone());
            }
        }
        out
    }
}

impl ModelFile {
    /// The model file as a [`Declaration`], whatever its scenario.
    pub fn declaration(&self) -> &dyn Declaration {
        match self {
            ModelFile::Ball(model) => model,
            ModelFile::Push(model) => model,
        }
    }

    /// Text of the model file, after a check that it parses back to the same model.
    ///
    /// # Errors
    /// [`RoundTripError`] if it does not.
    pub fn readable(&self) -> Result<String, RoundTripError> {
        let (file, text) = match self {
            ModelFile::Ball(model) => (&model.file, model.to_toml()),
            ModelFile::Push(model) => (&model.file, model.to_toml()),
        };
        let not_readable =
            |source: Option<Box<dyn StdError + Send + Sync>>| RoundTripError { model: file.clone(), source };
        match ModelFile::parse(&text, file) {
            Ok(back) if back == *self => Ok(text),
            Ok(_) => Err(not_readable(None)),
            Err(e) => Err(not_readable(Some(Box::new(e)))),
        }
    }
}

impl Declaration for Model {
    fn file(&self) -> &str {
        &self.file
    }

    fn expected(&self) -> ExpectedData {
        Model::expected(self)
    }

    fn clock_reference_s(&self) -> Option<f64> {
        self.clock_reference_s
    }

    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection> {
        let ball = match (has("x_m") && has("z_m"), has("y_m")) {
            (true, true) => Model::open(self, Axes::Space),
            (true, false) => Model::open(self, Axes::Plane),
            (false, _) if has("height_m") => Model::open(self, Axes::Vertical),
            (false, _) if has("z_m") => self.open_height("z_m"),
            (false, _) => return Err(Objection::new(MissingColumns::Position)),
        };
        Ok(Arc::new(ball))
    }

    fn augmented(&self, found: &Augmentation) -> Result<String, RoundTripError> {
        ModelFile::Ball(self.with_fit(found)).readable()
    }
}

impl Declaration for PushModel {
    fn file(&self) -> &str {
        &self.file
    }

    fn expected(&self) -> ExpectedData {
        PushModel::expected(self)
    }

    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection> {
        let system = PushModel::open(self);
        let schema = system.schema();
        let inputs = schema.inputs.iter().flat_map(|input| &input.columns);
        let columns = inputs.chain(schema.channels.iter().map(|channel| &channel.column));
        let missing: Vec<&str> = columns.map(String::as_str).filter(|column| !has(column)).collect();
        if missing.is_empty() {
            return Ok(Arc::new(system));
        }
        Err(Objection::new(MissingColumns::Push(missing.join("`, `"))))
    }

    fn augmented(&self, found: &Augmentation) -> Result<String, RoundTripError> {
        ModelFile::Push(self.with_fit(found)).readable()
    }
}
