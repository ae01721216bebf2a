//! `augsim export`: writes a model as LaTeX, Python, C or an FMU, or the description of its robot.

use augsim_session::export::{Language, export, export_files};
use augsim_session::robot::DescriptionCopy;
use augsim_session::usage::ModelFault;
use augsim_session::{ModelOrRun, Subject, folders};
use augsim_terminal::destination::check_file;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Languages and formats that a model can be exported to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum LanguageArg {
    /// A LaTeX document.
    Latex,
    /// A Python 3 module, which is also a program.
    Python,
    /// A step function in C99 with a header, or a program for a ball or pushes.
    C,
    /// A Functional Mock-up Unit (FMI 2.0) for model exchange and co-simulation.
    Fmu,
    /// The URDF description of the robot, with the identified values.
    Urdf,
    /// The MJCF description of the robot, with the identified values.
    Mjcf,
}

/// Options of `export`.
#[derive(Debug, clap::Args)]
pub struct Export {
    /// Model file (TOML) of a ball, of pushes or of equations, or output folder of `discover`.
    pub model: PathBuf,
    /// Language of the export; `urdf` and `mjcf` are for models with `[robot]`.
    #[arg(long = "as", value_enum)]
    pub language: LanguageArg,
    /// File to write (default: print to standard output). The header of C code is written beside it.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

#[derive(Serialize)]
struct Written {
    text: String,
}

/// Runs `augsim export`: writes the equations of a model, or the description of its robot.
pub fn run(args: &Export, output: &Output) -> anyhow::Result<Outcome> {
    let ModelOrRun::Model { file, .. } = ModelOrRun::from_path(&args.model)? else {
        return Err(Usage::model(args.model.display(), ModelFault::NetExported).into());
    };
    let language = match args.language {
        LanguageArg::Latex => Language::Latex,
        LanguageArg::Python => Language::Python,
        LanguageArg::C => Language::C,
        LanguageArg::Fmu => Language::Fmu,
        LanguageArg::Urdf => Language::Urdf,
        LanguageArg::Mjcf => Language::Mjcf,
    };
    let subject = Subject::read(&file)?;
    let Some(out) = &args.out else {
        let written = Written { text: export(&subject, language)? };
        output.result(&written, || written.text.clone())?;
        return Ok(Outcome::Done);
    };
    check_output(out, &file, &subject)?;
    let exported = export_files(&subject, language, out)?;
    for (path, _) in &exported.files {
        check_output(path, &file, &subject)?;
    }
    exported.write()?;
    output.note(format!("model: {}", out.display()));
    exported.notes.into_iter().for_each(|note| output.note(note));
    Ok(Outcome::Done)
}

/// Checks that an export can be written and replaces neither the model file nor its robot's description.
fn check_output(out: &Path, file: &Path, subject: &Subject) -> anyhow::Result<()> {
    let description = DescriptionCopy::new(subject, folders::parent_of(file));
    let inputs = [file].into_iter().chain(description.as_ref().map(|copy| copy.source.as_path()));
    check_file(out, &inputs.collect::<Vec<&Path>>())
}
