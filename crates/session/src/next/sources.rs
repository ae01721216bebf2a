//! Where explanations come from: discoveries, fits, earlier plans, and model files.

use super::fault::NextFault;
use super::state::State;
use crate::{ModelOrRun, Subject, Usage, discovery_in};
use augsim_equations::Model;
use std::collections::BTreeMap;
use std::path::Path;

/// Difference of log weights below which an explanation is no longer alive: odds of 1000 to 1 against it.
const MAX_LOG_RATIO: f64 = 6.907_755_278_982_137;

/// A live explanation before it is compiled.
#[derive(Debug, Clone)]
pub struct Source {
    /// Name of the explanation.
    pub name: String,
    /// Fitted model.
    pub model: Model,
    /// Logarithm of its weight by all earlier data, up to a constant.
    pub log_weight: f64,
    /// Widths of smoothed jumps that an earlier plan has chosen, by the text of their argument; empty without one.
    pub widths: BTreeMap<String, f64>,
}

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
        return Ok(vec![Source { name, model: *model, log_weight: 0.0, widths: BTreeMap::new() }]);
    };
    let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    let name = if kinds.is_empty() { "calibrated model".to_owned() } else { kinds.join(" + ") };
    let mut list = vec![Source { name, model: *model, log_weight: 0.0, widths: BTreeMap::new() }];
    for rival in found.models.rivals.iter().filter(|r| r.over_chosen > -MAX_LOG_RATIO) {
        let model = list[0].model.parse_changed(&rival.model_toml)?;
        let name =
            if rival.kinds.is_empty() { "calibrated model".to_owned() } else { rival.kinds.join(" + ") };
        if list.iter().all(|s| s.name != name) {
            list.push(Source { name, model, log_weight: rival.over_chosen, widths: BTreeMap::new() });
        }
    }
    Ok(list)
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
