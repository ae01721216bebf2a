//! Export of a system of equations as a Functional Mock-up Unit (FMI 2.0, model exchange and co-simulation).

mod compile;
mod description;
mod xml;

use super::number;
use super::program::{CFiles, c_files, has_events};
use super::routine::Names;
use super::words::{comment, fill, with_prefix};
use anyhow::Context;
use augsim_equations::Model;
use augsim_equations::listing::Listing;
use augsim_equations::model::FirstSamples;
use compile::{PLATFORM, compile};
use description::Described;
use sha2::{Digest, Sha256};
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;
use zip::{DateTime, ZipWriter};

const FMI_HEADER: &str = include_str!("fmi2.h.txt");
const FMI: &str = include_str!("fmi2.c.txt");
const MODEL_EXCHANGE: &str = include_str!("model_exchange.c.txt");
const CO_SIMULATION: &str = include_str!("co_simulation.c.txt");
const EVENTS: &str = include_str!("events.c.txt");
const EVENTLESS: &str = include_str!("eventless.c.txt");
const DELAYED: &str = include_str!("delays.c.txt");
const UNDELAYED: &str = include_str!("undelayed.c.txt");

/// A Functional Mock-up Unit.
pub(super) struct Fmu {
    /// Bytes of the file: a ZIP archive.
    pub archive: Vec<u8>,
    /// Why the unit has no compiled library; `None` if it has one.
    pub without_library: Option<String>,
}

/// Exports an equation model as a unit with the identifier `name`.
///
/// # Errors
/// The model cannot be compiled, or the files for the C compiler cannot be written.
pub(super) fn fmu(model: &Model, name: &str) -> anyhow::Result<Fmu> {
    // The files of the interface are called fmi2.
    let name = if name == "fmi2" { "model_fmi2" } else { name };
    let listing = Listing::new(model)?;
    let CFiles { header, source } = c_files(model, name)?;
    let start = initial_states(model);
    let described = Described {
        model,
        listing: &listing,
        name,
        indicators: indicators(model),
        jumps: has_events(model),
        start: &start,
    };
    let guid = guid(&[&header, &source, &described.document("")]);
    let unit = with_prefix(&unit_source(model, name, &guid, &start), name);
    let sources = [
        ("fmi2.c", unit),
        ("fmi2.h", FMI_HEADER.to_owned()),
        (&format!("{name}.c"), source),
        (&format!("{name}.h"), header),
    ];
    let (library, without_library) = match library(&sources, name)? {
        Ok(bytes) => (Some(bytes), None),
        Err(reason) => (None, Some(reason)),
    };
    let mut files = vec![("modelDescription.xml".to_owned(), described.document(&guid).into_bytes())];
    files.extend(sources.into_iter().map(|(file, text)| (format!("sources/{file}"), text.into_bytes())));
    let (folder, ending) = PLATFORM;
    files.extend(library.map(|bytes| (format!("binaries/{folder}/{name}.{ending}"), bytes)));
    Ok(Fmu { archive: archive(&files)?, without_library })
}

/// Source code of the functions of FMI for a model.
fn unit_source(model: &Model, name: &str, guid: &str, start: &[f64]) -> String {
    let names = Names::new(model);
    let cases = names.parameters.iter().enumerate();
    let has_delays = model.inputs.iter().any(|input| input.delay.is_some());
    let indicators = ("INDICATORS", indicators(model).to_string());
    fill(
        FMI,
        &[
            ("TITLE", comment(&model.name)),
            ("NAME", name.to_owned()),
            ("GUID", guid.to_owned()),
            ("PARAMETERS", names.parameters.len().to_string()),
            (
                "PARAMETER_CASES",
                cases.map(|(i, field)| format!("    case {i}: return &p->{field};\n")).collect(),
            ),
            ("START", start.iter().map(|x| number(*x) + ", ").collect()),
            ("DELAY_CODE", (if has_delays { DELAYED } else { UNDELAYED }).to_owned()),
            (
                "EVENT_CODE",
                if has_events(model) { fill(EVENTS, &[indicators]) } else { EVENTLESS.to_owned() },
            ),
            ("MODEL_EXCHANGE", MODEL_EXCHANGE.to_owned()),
            ("CO_SIMULATION", CO_SIMULATION.to_owned()),
        ],
    )
}

/// Number of event indicators: one for each event, and one for each bound of a state.
fn indicators(model: &Model) -> usize {
    let bounds = model.states.iter().map(|s| usize::from(s.min.is_some()) + usize::from(s.max.is_some()));
    model.events.len() + bounds.sum::<usize>()
}

/// Initial states where nothing is measured yet: as the model file says for outputs that are 0.
///
/// Without inputs an output of 0 would often be an equilibrium, so 0.5 is used, as in `augsim simulate`.
fn initial_states(model: &Model) -> Vec<f64> {
    let output = [if model.inputs.is_empty() { 0.5 } else { 0.0 }];
    let outputs = vec![&output[..]; model.outputs.len()];
    let (inputs, parameters) = (vec![0.0; model.inputs.len()], model.nominals());
    let samples = FirstSamples { times: &[0.0], outputs: &outputs, inputs: &inputs, parameters: &parameters };
    let inside = |(x, state): (f64, &augsim_equations::model::State)| {
        let x = if x.is_finite() { x } else { 0.0 };
        x.max(state.min.unwrap_or(f64::NEG_INFINITY)).min(state.max.unwrap_or(f64::INFINITY))
    };
    model.guess_start(&samples).into_iter().zip(&model.states).map(inside).collect()
}

/// Identifier of a unit, from a checksum of its contents: equal models have equal files.
fn guid(contents: &[&str]) -> String {
    let mut hasher = Sha256::new();
    contents.iter().for_each(|text| hasher.update(text.as_bytes()));
    let hex: String = hasher.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

/// Bytes of the shared library, or the reason why there is none.
fn library(sources: &[(&str, String)], name: &str) -> anyhow::Result<Result<Vec<u8>, String>> {
    let folder = tempfile::tempdir().context("a temporary folder for the C compiler")?;
    for (file, text) in sources {
        std::fs::write(folder.path().join(file), text).context("a source file for the C compiler")?;
    }
    let library = format!("{name}.{}", PLATFORM.1);
    match compile(folder.path(), "fmi2.c", &library) {
        Ok(()) => {
            Ok(Ok(std::fs::read(folder.path().join(&library)).context("the library from the C compiler")?))
        }
        Err(reason) => Ok(Err(reason)),
    }
}

/// ZIP archive of files, which has the same bytes at any time.
fn archive(files: &[(String, Vec<u8>)]) -> anyhow::Result<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().last_modified_time(DateTime::default());
    for (name, bytes) in files {
        zip.start_file(name.as_str(), options)?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}
