//! A model file of either scenario, ball or pushing.

use super::parse::Reader;
use super::{Model, ModelError, Place, PushModel, read};
use std::path::Path;

/// A model file; its key `scenario` selects the variant.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelFile {
    /// Model file of the bouncing ball, `scenario = "ball"`.
    Ball(Model),
    /// Model file of planar pushing, `scenario = "push"`.
    Push(PushModel),
}

impl ModelFile {
    /// Reads and parses a model file of either scenario.
    ///
    /// # Errors
    /// [`ModelError`], with file, line and remedy.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        read(path, Self::parse)
    }

    /// Parses the text of a model file of either scenario; `file` is used in messages.
    ///
    /// # Errors
    /// [`ModelError`], with file, line and remedy.
    pub fn parse(text: &str, file: &str) -> Result<Self, ModelError> {
        let reader = Reader { text, file };
        let root = reader.root()?;
        let root = root.get_ref();
        if root.is_empty() {
            return Err(ModelError::Empty { file: file.into() });
        }
        // The message encloses this in backticks, so that two lines are suggested.
        let example = "scenario = \"ball\"` or `scenario = \"push\"";
        let value = root.get("scenario");
        let value = value.ok_or_else(|| reader.missing(1, Place::File, "scenario", example))?;
        match reader.word("scenario", value, &["ball", "push"])? {
            "push" => PushModel::parse(text, file).map(ModelFile::Push),
            _ => Model::parse(text, file).map(ModelFile::Ball),
        }
    }
}
