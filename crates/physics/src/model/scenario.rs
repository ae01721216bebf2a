//! A model file of any scenario.

use super::parse::Reader;
use super::{Model, ModelError, Place, PushModel, read};
use std::path::Path;

/// A model file, told apart by its key `scenario`.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelFile {
    /// `scenario = "ball"`.
    Ball(Model),
    /// `scenario = "push"`.
    Push(PushModel),
}

impl ModelFile {
    /// Reads a model file.
    ///
    /// # Errors
    /// [`ModelError`] names the file, the line and the remedy.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        read(path, Self::parse)
    }

    /// Parses the text of a model file; `file` is used in messages.
    ///
    /// # Errors
    /// [`ModelError`] names the file, the line and the remedy.
    pub fn parse(text: &str, file: &str) -> Result<Self, ModelError> {
        let reader = Reader { text, file };
        let root = reader.root()?;
        let root = root.get_ref();
        if root.is_empty() {
            return Err(ModelError::Empty { file: file.into() });
        }
        // Shown between backticks: a choice of two.
        let example = "scenario = \"ball\"` or `scenario = \"push\"";
        let value = root.get("scenario");
        let value = value.ok_or_else(|| reader.missing(1, Place::File, "scenario", example))?;
        match reader.word("scenario", value, &["ball", "push"])? {
            "push" => PushModel::parse(text, file).map(ModelFile::Push),
            _ => Model::parse(text, file).map(ModelFile::Ball),
        }
    }
}
