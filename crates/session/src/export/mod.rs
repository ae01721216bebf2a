//! A model written out as a law with its values: formulas for a paper, programs that run without augsim.

mod ball;
mod equations;

use crate::{Subject, Usage};
use augsim_physics::model::ModelFile;

/// Languages that a law can be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// A LaTeX document.
    Latex,
    /// A Python 3 program that needs nothing but Python.
    Python,
    /// A C99 program that needs nothing but the C library.
    C,
}

/// The text of the law of a model.
///
/// # Errors
/// [`Usage`] names the part of the model that cannot be written out, and what can.
pub fn export(subject: &Subject, language: Language) -> Result<String, Usage> {
    match subject {
        Subject::Written(model) => equations::export(model, language),
        Subject::BuiltIn(model) => match &**model {
            ModelFile::Ball(model) => ball::export(model, language),
            ModelFile::Push(model) => Err(Usage(format!(
                "{}: the contact of a pushed object has no short law to write out; `augsim simulate` and `augsim predict` run \
                 the model file itself",
                model.file
            ))),
        },
    }
}

/// A number with all of its digits, as Python, C and LaTeX read it.
fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A name as LaTeX sets it.
fn latex_name(name: &str) -> String {
    format!("\\mathrm{{{}}}", name.replace('_', "\\_"))
}

/// A document around lines of text and formulas.
fn latex_document(title: &str, body: &str) -> String {
    let title = title.replace('_', "\\_");
    format!(
        "\\documentclass{{article}}\n\\usepackage{{amsmath}}\n\\begin{{document}}\n\\section*{{{title}}}\n{body}\\end{{document}}\n"
    )
}
