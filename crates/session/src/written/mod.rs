//! Systems that users write: their model files, their data, fits and forecasts.

pub mod discovery;
pub mod fit;
pub mod fitted;
pub mod forecast;
pub mod noise;
pub mod pictures;
pub mod records;
pub mod states;
mod thinned;

use augsim_written::{Model, ModelError};
use std::path::Path;

/// Whether a file is the model of a written system. One that cannot be read, or says nothing, is left to the reader that
/// has the sentence for it.
pub fn is_model(path: &Path) -> bool {
    // A stream can be read once only, and an endless one never: what is no file is left to the reader of the others.
    let text = path.is_file().then(|| augsim_data::read_text(path).ok()).flatten();
    text.is_some_and(|text| is_model_text(&text))
}

/// Whether a text is the model of a written system.
pub fn is_model_text(text: &str) -> bool {
    #[derive(serde::Deserialize)]
    struct Head {
        scenario: Option<String>,
    }
    match toml::from_str::<Head>(text) {
        Ok(head) => head.scenario.as_deref() == Some("system"),
        // A syntax error further down does not change what the file is about.
        Err(_) => text.lines().any(|line| line.replace(' ', "").starts_with("scenario=\"system\"")),
    }
}

/// Reads a model file.
///
/// # Errors
/// The first mistake, with file, line, key and remedy.
pub fn read(path: &Path) -> Result<Model, ModelError> {
    augsim_written::model::read(path)
}

/// Unit of a quantity in print, with a blank before it; nothing for a pure number.
pub fn unit_text(unit: Option<augsim_data::Unit>) -> String {
    unit.map(|u| u.symbol()).filter(|symbol| !symbol.is_empty()).map_or_else(String::new, |s| format!(" {s}"))
}
