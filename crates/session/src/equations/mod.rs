//! Equation models written by users: model files, data, calibration and predictions.

pub mod degrees;
pub mod discovery;
mod downsample;
pub mod figures;
pub mod fit;
pub mod fitted;
pub mod forecast;
mod hidden_states;
mod new_unit;
pub mod noise;
pub mod records;
mod rejection;
pub mod states;

use augsim_equations::{Model, ModelError};
use std::path::Path;

/// Whether a file contains an equation model.
///
/// `false` for an unreadable file, which the reader of other models reports.
pub fn is_model(path: &Path) -> bool {
    // Only regular files are read here: a pipe can be read only once, and its reader comes later.
    let text = path.is_file().then(|| augsim_data::read_text(path).ok()).flatten();
    text.is_some_and(|text| is_model_text(&text))
}

/// Whether a text is the content of an equation model file.
pub fn is_model_text(text: &str) -> bool {
    #[derive(serde::Deserialize)]
    struct Head {
        scenario: Option<String>,
    }
    match toml::from_str::<Head>(text) {
        Ok(head) => head.scenario.as_deref() == Some("system"),
        // With a syntax error further down, the file still counts as an equation model, whose reader reports
        // the error.
        Err(_) => text.lines().any(|line| line.replace(' ', "").starts_with("scenario=\"system\"")),
    }
}

/// Reads the file of an equation model.
///
/// # Errors
/// The first mistake, with file, line, key and remedy.
pub fn read(path: &Path) -> Result<Model, ModelError> {
    augsim_equations::model::read(path)
}

/// Symbol of a unit for display, with a space before it; empty if dimensionless.
pub fn unit_text(unit: Option<augsim_data::Unit>) -> String {
    unit.map(|u| u.symbol()).filter(|symbol| !symbol.is_empty()).map_or_else(String::new, |s| format!(" {s}"))
}
