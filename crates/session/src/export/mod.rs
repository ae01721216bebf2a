//! Export of a model with its parameter values: LaTeX formulas, Python and C programs.
//!
//! The programs run without augsim.

mod ball;
mod equations;
mod program;
mod push;

use crate::{Subject, Usage};
use augsim_physics::model::{EffectBlock, ModelFile};

/// Languages that a model can be exported to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// A LaTeX document.
    Latex,
    /// A Python 3 program without dependencies.
    Python,
    /// A C99 program that needs only the C library.
    C,
}

/// Exports a model to a language.
///
/// # Errors
/// [`Usage`] names the part of the model that cannot be exported, and an alternative.
pub fn export(subject: &Subject, language: Language) -> Result<String, Usage> {
    match subject {
        Subject::Equations(model) => equations::export(model, language),
        Subject::BuiltIn(model) => match &**model {
            ModelFile::Ball(model) => ball::export(model, language),
            ModelFile::Push(model) => push::export(model, language),
        },
    }
}

/// A number with all its digits, valid in Python, C and LaTeX.
fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A name in upright type, with escaped underscores.
fn latex_name(name: &str) -> String {
    format!("\\mathrm{{{}}}", name.replace('_', "\\_"))
}

/// A LaTeX document with a title and a body.
fn latex_document(title: &str, body: &str) -> String {
    let title = title.replace('_', "\\_");
    format!(
        "\\documentclass{{article}}\n\\usepackage{{amsmath}}\n\\begin{{document}}\n\\section*{{{title}}}\n{body}\\end{{document}}\n"
    )
}

/// One LaTeX paragraph for each effect, with its formula, values and intervals.
fn effect_paragraphs(effects: &[EffectBlock], formula: impl Fn(&str) -> Option<&'static str>) -> String {
    let mut text = String::new();
    for block in effects {
        let formula = formula(&block.kind).unwrap_or("a tabulated law");
        text += &format!("\\paragraph{{{}}} \\verb|{}|\n\n", block.kind, formula.replace('|', "/"));
        for p in &block.parameters {
            let interval = p.ci95.map_or(String::new(), |[low, high]| {
                format!(" (95\\,\\% interval {} to {})", number(low), number(high))
            });
            text += &format!("\\noindent ${} = {}${interval}\n\n", latex_name(&p.name), number(p.nominal));
        }
    }
    text
}
