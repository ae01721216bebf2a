//! Export of a model with its parameter values: LaTeX formulas, Python and C programs, and FMUs.
//!
//! The programs and FMUs run without augsim. A model of a robot is also exported as the robot's description, URDF or MJCF.

mod ball;
mod equations;
mod fmu;
mod groups;
mod program;
mod push;
mod robot;
mod routine;
mod templates;
mod words;

use crate::usage::ModelFault;
use crate::{Subject, Usage, folders};
use augsim_data::{Unit, atomic_write};
use augsim_physics::model::{EffectBlock, ModelFile};
use augsim_robot::description::Format;
use augsim_system::Parameter;
use fmu::Fmu;
use program::CFiles;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The language or format to which a model is exported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// The model is exported as a LaTeX document.
    Latex,
    /// The model is exported as a Python 3 program without dependencies.
    Python,
    /// The model is exported as a C99 program that needs only the C library.
    C,
    /// The model is exported as a Functional Mock-up Unit of FMI 2.0, for model exchange and co-simulation.
    Fmu,
    /// The description file of the model's robot is exported as URDF, with the values of the model.
    Urdf,
    /// The description file of the model's robot is exported as MJCF, with the values of the model.
    Mjcf,
}

impl Language {
    /// Language of a name as users write it, such as `python`; `None` if there is none.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "latex" => Language::Latex,
            "python" => Language::Python,
            "c" => Language::C,
            "fmu" => Language::Fmu,
            "urdf" => Language::Urdf,
            "mjcf" => Language::Mjcf,
            _ => return None,
        })
    }
}

/// Files of an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// Path and content of each file: the one that was asked for, then those beside it.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// Sentences for the user on what the export leaves out.
    pub notes: Vec<String>,
}

impl Exported {
    /// Writes all files; folders that do not exist are made.
    ///
    /// # Errors
    /// A folder cannot be made, or a file cannot be written.
    pub fn write(&self) -> anyhow::Result<()> {
        for (path, bytes) in &self.files {
            folders::make(folders::parent_of(path))?;
            atomic_write(path, |w| w.write_all(bytes))?;
        }
        Ok(())
    }
}

/// Exports a model, with its parameter values, as the file `out` and files beside it; nothing is written.
///
/// An equation model in C has a header beside its source file, and all names in both begin with the name of the file.
/// An FMU is compiled where a C compiler can be run; otherwise it has sources only, and the note says so.
///
/// # Errors
/// Those of [`export`].
pub fn export_files(subject: &Subject, language: Language, out: &Path) -> anyhow::Result<Exported> {
    let name = words::c_identifier(&out.file_stem().unwrap_or_default().to_string_lossy());
    let mut notes = Vec::new();
    let files = match (subject, language) {
        (Subject::Equations(model), Language::C) => {
            let CFiles { header, source } = program::c_files(model, &name)?;
            let beside = out.with_file_name(format!("{name}.h"));
            notes.extend(negative_delays(model));
            vec![(out.to_owned(), source.into_bytes()), (beside, header.into_bytes())]
        }
        (Subject::Equations(model), Language::Fmu) => {
            let Fmu { archive, without_library } = fmu::fmu(model, &name)?;
            notes.extend(negative_delays(model));
            notes.extend(without_library.map(|reason| {
                format!(
                    "the FMU has sources only, because {reason}; set CC to a C compiler, or use an importer that compiles sources"
                )
            }));
            vec![(out.to_owned(), archive)]
        }
        _ => vec![(out.to_owned(), export(subject, language)?.into_bytes())],
    };
    if let (Subject::Equations(model), Language::C | Language::Python | Language::Fmu) = (subject, language) {
        notes.extend(unfiltered_outputs(model));
    }
    Ok(Exported { files, notes })
}

/// Note on outputs that are compared behind a low-pass, which needs values still to come; `None` if there are none.
fn unfiltered_outputs(model: &augsim_equations::Model) -> Option<String> {
    let is_filtered = |o: &&augsim_equations::model::Output| o.low_pass_hz.is_some();
    let names: Vec<&str> = model.outputs.iter().filter(is_filtered).map(|o| o.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{}: written as computed from the inputs, without the filter of low_pass_hz",
            names.join(", ")
        )
    })
}

/// Note on inputs that act before they are recorded, which a step function cannot know yet; `None` if there are none.
fn negative_delays(model: &augsim_equations::Model) -> Option<String> {
    let is_negative = |delay: usize| model.parameters[delay].nominal < 0.0;
    let names: Vec<&str> =
        model.inputs.iter().filter(|i| i.delay.is_some_and(is_negative)).map(|i| i.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} has a negative delay, that is, it acts before it is recorded; step functions and FMUs take the delay as 0",
            names.join(", ")
        )
    })
}

/// Exports a model, with its parameter values, as one text.
///
/// # Errors
/// [`Usage`] names the part of the model that cannot be exported, and an alternative; a model of
/// equations that cannot be compiled gives the error of the compiler.
pub fn export(subject: &Subject, language: Language) -> anyhow::Result<String> {
    let format = match language {
        Language::Urdf => Some(Format::Urdf),
        Language::Mjcf => Some(Format::Mjcf),
        Language::Latex | Language::Python | Language::C => None,
        Language::Fmu => {
            let fault = match subject {
                Subject::Equations(_) => ModelFault::FmuWithoutFile,
                Subject::BuiltIn(_) => ModelFault::BuiltInFmu,
            };
            return Err(Usage::model(file_of(subject), fault).into());
        }
    };
    Ok(match (subject, format) {
        (Subject::Equations(model), Some(format)) => robot::description(model, format)?,
        (Subject::BuiltIn(_), Some(_)) => {
            return Err(Usage::model(file_of(subject), ModelFault::NoRobotExported).into());
        }
        (Subject::Equations(model), None) if language == Language::Latex => equations::document(model),
        (Subject::Equations(model), None) => program::program(model, language)?,
        (Subject::BuiltIn(model), None) => match &**model {
            ModelFile::Ball(model) => ball::export(model, language)?,
            ModelFile::Push(model) => push::export(model, language)?,
        },
    })
}

/// File that a model was read from.
fn file_of(subject: &Subject) -> &str {
    match subject {
        Subject::Equations(model) => &model.file,
        Subject::BuiltIn(model) => match &**model {
            ModelFile::Ball(model) => &model.file,
            ModelFile::Push(model) => &model.file,
        },
    }
}

/// Writes a number with all its digits, valid in Python and C.
fn number(value: f64) -> String {
    format!("{value:?}")
}

/// Writes a number for a LaTeX formula, rounded to six digits.
fn latex_number(value: f64) -> String {
    if value == std::f64::consts::PI {
        return "\\pi".to_owned();
    }
    let text = format!("{value:.5e}");
    let Some((digits, exponent)) = text.split_once('e') else { return text };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trim = |digits: &str| match digits.contains('.') {
        true => digits.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => digits.to_owned(),
    };
    if (-4..6).contains(&exponent) {
        let decimals = usize::try_from(5 - exponent).unwrap_or(0);
        return trim(&format!("{value:.decimals$}"));
    }
    format!("{} \\times 10^{{{exponent}}}", trim(digits))
}

/// Writes a unit after a number in a LaTeX formula, such as `N\,m/s^{2}`.
fn latex_unit(unit: Option<Unit>) -> String {
    let symbol = unit.map_or_else(String::new, Unit::symbol);
    if symbol.is_empty() {
        return symbol;
    }
    let mut text = String::from("\\,\\mathrm{");
    let mut signs = symbol.chars().peekable();
    while let Some(sign) = signs.next() {
        match sign {
            ' ' => text += "\\,",
            '^' => {
                let mut power = String::new();
                while let Some(digit) = signs.next_if(|c| c.is_ascii_digit() || *c == '-') {
                    power.push(digit);
                }
                text += &format!("^{{{power}}}");
            }
            '°' => text += "{}^\\circ ",
            sign => text += &words::latex(&sign.to_string()),
        }
    }
    text + "}"
}

/// Writes a name in upright type for a LaTeX formula.
fn latex_name(name: &str) -> String {
    format!("\\mathrm{{{}}}", words::latex(name))
}

/// Writes a LaTeX document with a title and a body.
fn latex_document(title: &str, body: &str) -> String {
    let title = words::latex(title);
    format!(
        "\\documentclass{{article}}\n\\usepackage{{amsmath}}\n\\usepackage{{textcomp}}\n\\begin{{document}}\n\\section*{{{title}}}\n{body}\\end{{document}}\n"
    )
}

/// One LaTeX paragraph for each effect, with its formula, values and intervals, all values by group included.
fn effect_paragraphs(effects: &[EffectBlock], formula: impl Fn(&str) -> Option<&'static str>) -> String {
    let mut text = String::new();
    for block in effects {
        let formula = formula(&block.kind).unwrap_or("a tabulated law");
        let (kind, formula) = (words::latex(&block.kind), words::latex(formula));
        text += &format!("\\paragraph{{{kind}}} \\texttt{{{formula}}}\n\n");
        for p in &block.parameters {
            text += &parameter_paragraph(&latex_name(&p.name), p);
        }
    }
    text
}

/// LaTeX text of a parameter: its value with the interval, or its values by group.
fn parameter_paragraph(symbol: &str, p: &Parameter) -> String {
    if p.groups.is_empty() {
        let interval = p.ci95.map_or(String::new(), |[low, high]| {
            format!(" (95\\,\\% interval ${}$ to ${}$)", latex_number(low), latex_number(high))
        });
        return format!("\\noindent ${symbol} = {}${interval}\n\n", latex_number(p.nominal));
    }
    let mut text = format!("\\noindent ${symbol}$ by group:\n\n");
    for (group, value) in &p.groups {
        let group = words::latex(group);
        text += &format!("\\noindent \\quad \\texttt{{{group}}}: ${}$\n\n", latex_number(*value));
    }
    text
}
