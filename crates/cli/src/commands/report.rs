//! `augsim report`: writes single figures of a discovery report.

use augsim_data::atomic_write;
use augsim_report::page::figure_names;
use augsim_session::discovery_page::page;
use augsim_session::equations::figures::figures;
use augsim_session::provenance::fingerprint;
use augsim_session::usage::{PathFault, UnknownName};
use augsim_session::{DataFrom, OpenData, ReportContext, Subject, discovery_in, folders};
use augsim_terminal::destination::check_file;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Options of `report`.
#[derive(Debug, clap::Args)]
pub struct ReportArgs {
    /// Output folder of `discover`.
    pub folder: PathBuf,
    /// Name of a figure of the report (`best`, `worst`, `correlation-of-the-estimates`, …). Without it
    /// all names are listed.
    #[arg(long, value_name = "NAME")]
    pub figure: Option<String>,
    /// SVG file to write (default: `NAME.svg`).
    #[arg(long, requires = "figure")]
    pub out: Option<PathBuf>,
    /// Width of the figure in pixels.
    #[arg(long, default_value_t = 640.0, value_parser = width)]
    pub width: f64,
}

/// Parses a figure width in pixels.
fn width(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("{text} is not a number"))?;
    if (240.0..=4000.0).contains(&value) {
        Ok(value)
    } else {
        Err("the width must be between 240 and 4000 pixels".to_owned())
    }
}

#[derive(Serialize)]
struct Listed {
    figures: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    written: Option<PathBuf>,
}

/// Runs `augsim report`: lists the figures of a discovery report, or writes one of them as SVG.
pub fn run(args: &ReportArgs, output: &Output) -> anyhow::Result<Outcome> {
    let Some(found) = discovery_in(&args.folder) else {
        return Err(Usage::path(&args.folder, PathFault::NoDiscovery).into());
    };
    let place = args.folder.join("declared").display().to_string();
    let subject = Subject::parse(&found.models.declared_toml, &place)?;
    let mut context = ReportContext::default();
    match data_of(&args.folder) {
        Some(data) => {
            let read = OpenData::open(&subject, &data).and_then(|data| data.read(&subject));
            context.figures = read.map(|data| figures(&subject, &found, &data)).unwrap_or_default();
        }
        None if matches!(subject, Subject::Equations(_)) => output.note(format!(
            "{}: the data of this discovery were moved or changed, so figures that need them are left out",
            args.folder.display()
        )),
        None => {}
    }
    let figures = page(&context, &subject, &found).into_figures();
    let names = figure_names(&figures);
    let Some(wanted) = &args.figure else {
        let listed = Listed { figures: names, written: None };
        output.result(&listed, || listed.figures.join("\n"))?;
        return Ok(Outcome::Done);
    };
    let Some(place) = names.iter().position(|name| name == wanted) else {
        let (folder, name) = (args.folder.clone(), wanted.clone());
        return Err(Usage::Unknown(UnknownName::Figure { folder, name, known: names }).into());
    };
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{wanted}.svg")));
    if out.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("svg")) {
        return Err(Usage::path(&out, PathFault::NoFigureEnding).into());
    }
    check_file(&out, &[args.folder.as_path()])?;
    folders::make(folders::parent_of(&out))?;
    let svg = figures[place].svg_document(args.width);
    atomic_write(&out, |w| w.write_all(svg.as_bytes()))?;
    let listed = Listed { figures: vec![wanted.clone()], written: Some(out.clone()) };
    output.result(&listed, || format!("figure: {}", out.display()))?;
    Ok(Outcome::Done)
}

/// Data that the discovery in `folder` used; `None` where a file was changed or moved.
fn data_of(folder: &Path) -> Option<DataFrom> {
    let record = Record::read(folder).ok().flatten()?;
    let names = |name: &&String| *name == "data" || name.starts_with("data-");
    let mut names: Vec<&String> = record.inputs.keys().filter(names).collect();
    // `data-10` comes after `data-9`.
    names.sort_by_key(|name| (name.len(), (*name).clone()));
    let path = |name: &String| -> Option<PathBuf> {
        let path = folder.join(record.paths.get(name)?);
        (record.inputs.get(name) == Some(&fingerprint(&path))).then_some(path)
    };
    let paths: Vec<PathBuf> = names.into_iter().map(path).collect::<Option<_>>()?;
    (!paths.is_empty()).then(|| DataFrom::of_paths(&paths, record.settings.get("time").map(String::as_str)))
}
