//! A model written out as a law with its values: formulas for a paper, programs that run without augsim.

mod ball;
mod equations;
mod program;
mod push;

use crate::{Subject, Usage};
use augsim_physics::model::{EffectBlock, ModelFile};

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
            ModelFile::Push(model) => push::export(model, language),
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

/// Effects of a library in LaTeX, each with its formula and its values.
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
