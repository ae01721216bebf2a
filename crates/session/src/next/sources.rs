//! Where explanations come from: discoveries, fits, earlier plans, and model files.

use super::fault::NextFault;
use super::source::Source;
use super::state::State;
use crate::{ModelOrRun, Subject, Usage, discovery_in};
use augsim_equations::Model;
use std::path::Path;

/// Reads the live explanations of folders and model files.
///
/// The folder of a discovery has the named model and its live rivals, that of a plan the explanations that are not rejected.
///
/// # Errors
/// A path is not a model of equations or a folder with one; names or columns do not agree.
pub fn sources(paths: &[std::path::PathBuf]) -> anyhow::Result<Vec<Source>> {
    let mut all: Vec<Source> = Vec::new();
    for path in paths {
        all.extend(of_path(path)?);
    }
    for (k, source) in all.iter().enumerate() {
        if all[..k].iter().any(|other| other.name == source.name) {
            let fault = NextFault::SameName { name: source.name.clone() };
            return Err(Usage::model(&source.model.file, crate::usage::ModelFault::Next(fault)).into());
        }
        check_columns(&all[0], source)?;
    }
    Ok(all)
}

fn of_path(path: &Path) -> anyhow::Result<Vec<Source>> {
    if let Some(state) = State::read_if_there(path)? {
        return state.live_sources();
    }
    let ModelOrRun::Model { file, folder } = ModelOrRun::from_path(path)? else {
        return Err(Usage::model(path.display(), crate::usage::ModelFault::NetSimulated).into());
    };
    let Subject::Equations(model) = Subject::read(&file)? else {
        return Err(Usage::model(file.display(), crate::usage::ModelFault::Next(NextFault::BuiltIn)).into());
    };
    let found = folder.as_deref().and_then(discovery_in);
    let Some(found) = found else {
        let stem = match &folder {
            Some(folder) => folder.file_name(),
            None => file.file_stem(),
        };
        let name = stem.map_or_else(|| model.name.clone(), |s| s.to_string_lossy().into_owned());
        return Ok(vec![Source::new(name, *model)]);
    };
    // A force without a known law is in the model as a table, which is no effect of the result.
    let kinds: Vec<String> = match found.effects.is_empty() {
        true => model.additions.iter().map(|a| a.kind.clone()).collect(),
        false => found.effects.iter().map(|e| e.kind.clone()).collect(),
    };
    let name = name_of(&kinds);
    let mut list = vec![Source::new(name, *model)];
    for rival in &found.models.rivals {
        let model = list[0].model.parse_changed(&rival.model_toml)?;
        let name = name_of(&rival.kinds);
        if list.iter().all(|s| s.name != name) {
            list.push(Source { log_weight: rival.over_chosen, ..Source::new(name, model) });
        }
    }
    Ok(list)
}

/// Name of the explanation with these effects.
fn name_of(kinds: &[String]) -> String {
    if kinds.is_empty() { "calibrated model".to_owned() } else { kinds.join(" + ") }
}

/// Names of the inputs and outputs of a model.
pub(super) fn columns(model: &Model) -> Vec<String> {
    model.inputs.iter().map(|i| i.name.clone()).chain(model.outputs.iter().map(|o| o.name.clone())).collect()
}

fn check_columns(first: &Source, other: &Source) -> Result<(), Usage> {
    if columns(&first.model) == columns(&other.model) {
        return Ok(());
    }
    let fault = NextFault::OtherColumns { first: first.name.clone(), columns: columns(&first.model) };
    Err(Usage::model(&other.model.file, crate::usage::ModelFault::Next(fault)))
}
