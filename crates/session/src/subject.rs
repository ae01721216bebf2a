//! A model file of any kind.

use crate::equations;
use augsim_physics::model::ModelFile;
use augsim_system::Parameter;
use std::path::Path;

/// A model that is read from a file of any kind: built-in scenario or equations.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// A model of a built-in scenario: the ball, or pushing.
    BuiltIn(Box<ModelFile>),
    /// A system of equations written in the model file.
    Equations(Box<augsim_equations::Model>),
}

impl Subject {
    /// Reads a model file of any kind: built-in scenario or equations.
    ///
    /// # Errors
    /// The first mistake, with file, line and remedy.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        // A pipe can be read only once, so the text decides the kind and is parsed as that kind.
        match augsim_data::read_text(path) {
            Ok(text) => Self::parse(&text, &path.display().to_string()),
            // This reader has the message for a file that cannot be read.
            Err(_) => Ok(Subject::BuiltIn(Box::new(ModelFile::read(path)?))),
        }
    }

    /// Parses the text of a model file; `file` is its name in messages.
    ///
    /// # Errors
    /// As [`Subject::read`].
    pub fn parse(text: &str, file: &str) -> anyhow::Result<Self> {
        match equations::is_model_text(text) {
            true => Ok(Subject::Equations(Box::new(augsim_equations::model::parse(text, file)?))),
            false => Ok(Subject::BuiltIn(Box::new(ModelFile::parse(text, file)?))),
        }
    }

    /// Name of the model's scenario in the file: `ball`, `push` or `system`.
    pub fn scenario(&self) -> &'static str {
        match self {
            Subject::BuiltIn(model) => match **model {
                ModelFile::Ball(_) => "ball",
                ModelFile::Push(_) => "push",
            },
            Subject::Equations(_) => "system",
        }
    }

    /// Lists the declared parameters, then those of the effects in the model.
    pub fn parameters(&self) -> Vec<Parameter> {
        match self {
            Subject::BuiltIn(model) => model.parameters().cloned().collect(),
            Subject::Equations(model) => {
                let declared = |p: &augsim_equations::model::Parameter| Parameter {
                    frozen: p.frozen,
                    ci95: p.ci95,
                    ..Parameter::free(p.name.clone(), p.nominal, p.min, p.max)
                };
                model.parameters.iter().map(declared).collect()
            }
        }
    }

    /// Writes the model as the text of a model file.
    ///
    /// # Errors
    /// The text of a changed model cannot be parsed back to the same model.
    pub fn to_toml(&self) -> anyhow::Result<String> {
        match self {
            Subject::BuiltIn(model) => Ok(model.readable()?),
            Subject::Equations(model) => Ok(model.to_toml()?),
        }
    }
}
