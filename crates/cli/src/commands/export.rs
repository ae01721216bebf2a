//! `augsim export`: writes the equations of a model as LaTeX, Python or C, or the description of its robot.

use augsim_data::atomic_write;
use augsim_session::export::{Language, export};
use augsim_session::robot::DescriptionCopy;
use augsim_session::usage::ModelFault;
use augsim_session::{ModelOrRun, Subject, folders};
use augsim_terminal::destination::check_file;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Languages that a model can be exported to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum LanguageArg {
    /// A LaTeX document.
    Latex,
    /// A Python 3 program.
    Python,
    /// A C99 program.
    C,
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
    /// File to write (default: print to standard output).
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
        LanguageArg::Urdf => Language::Urdf,
        LanguageArg::Mjcf => Language::Mjcf,
    };
    let subject = Subject::read(&file)?;
    if let Some(out) = &args.out {
        let description = DescriptionCopy::new(&subject, folders::parent_of(&file));
        let inputs = [&file].into_iter().chain(description.as_ref().map(|copy| &copy.source));
        check_file(out, &inputs.map(PathBuf::as_path).collect::<Vec<&Path>>())?;
    }
    let text = export(&subject, language)?;
    let Some(out) = &args.out else {
        let written = Written { text };
        output.result(&written, || written.text.clone())?;
        return Ok(Outcome::Done);
    };
    folders::make(folders::parent_of(out))?;
    atomic_write(out, |w| w.write_all(text.as_bytes()))?;
    output.note(format!("model: {}", out.display()));
    Ok(Outcome::Done)
}
