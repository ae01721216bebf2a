//! Tests whether a model is applied to the data that it was fitted to.

use augsim_session::discovery_in;
use augsim_session::provenance::fingerprint;
use augsim_terminal::record::Record;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Result of the test whether the data of a command are those that the model was fitted to.
#[derive(Debug)]
pub(super) struct OwnData {
    /// Names of the trajectories that no fit has used; empty if all were used.
    pub held_out: BTreeSet<String>,
}

impl OwnData {
    /// Compares `data` with the data that `model` was fitted to; `None` if no file or folder is the same.
    ///
    /// The fitted data are those that the record in the model's folder lists. The held-out trajectories are known only
    /// if all data are the same: their names depend on the set.
    pub fn find(model: &Path, data: &[PathBuf]) -> Option<Self> {
        let folder = if model.is_dir() { model } else { model.parent()? };
        let record = Record::read(folder).ok().flatten()?;
        let is_data = |name: &str| name == "data" || name.starts_with("data-");
        let own: BTreeSet<&String> =
            record.inputs.iter().filter(|(name, _)| is_data(name)).map(|(_, print)| print).collect();
        let given: BTreeSet<String> = data.iter().map(|path| fingerprint(path)).collect();
        if !given.iter().any(|print| own.contains(print)) {
            return None;
        }
        let is_same = own.into_iter().eq(&given);
        let held_out = discovery_in(folder).filter(|_| is_same).map_or_else(Vec::new, |found| found.heldout);
        Some(Self { held_out: held_out.into_iter().collect() })
    }

    /// Warning that the model was fitted to the given data, so that its errors on new data are larger.
    pub fn sentence(&self, command: &str) -> String {
        match self.held_out.len() {
            0 => {
                format!(
                    "{command}: the model was fitted to these data, or to a part of them, so its errors on new data are larger"
                )
            }
            n => format!(
                "{command}: the model was fitted to these data except for {n} held-out trajectories; `augsim evaluate` scores these alone"
            ),
        }
    }
}

/// The trajectories that a command scores, given the data that its models were fitted to.
#[derive(Debug)]
pub(super) struct ScoredPart {
    /// Names of the trajectories to score, to which none of the models was fitted; `None` to score all.
    pub only: Option<BTreeSet<String>>,
    /// Whether a model was fitted to the scored trajectories.
    pub fitted: bool,
}

impl ScoredPart {
    /// Selects the trajectories to which none of the models was fitted, or all if there are none. `own` has an entry
    /// for each model.
    pub fn of(own: impl IntoIterator<Item = Option<OwnData>>) -> Self {
        let held_out = own.into_iter().flatten().map(|own| own.held_out).reduce(|a, b| &a & &b);
        let fitted = held_out.as_ref().is_some_and(BTreeSet::is_empty);
        Self { only: held_out.filter(|ids| !ids.is_empty()), fitted }
    }
}
