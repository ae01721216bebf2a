//! Whether a model is applied to the data that it was fitted to.

use augsim_session::discovery_in;
use augsim_session::provenance::fingerprint;
use augsim_terminal::record::Record;
use std::collections::BTreeSet;
use std::path::Path;

/// The data of a command are those that the model was found on.
#[derive(Debug)]
pub(super) struct OwnData {
    /// Trajectories that no fit has used; empty if all were used.
    pub held_out: BTreeSet<String>,
}

impl OwnData {
    /// Compares `data` with the data from which the folder of the model file was made; `None` if they differ.
    pub fn find(model: &Path, data: &Path) -> Option<Self> {
        let folder = if model.is_dir() { model } else { model.parent()? };
        let record = Record::read(folder).ok().flatten()?;
        if record.inputs.get("data") != Some(&fingerprint(data)) {
            return None;
        }
        let held_out = discovery_in(folder).map_or_else(Vec::new, |found| found.heldout);
        Some(Self { held_out: held_out.into_iter().collect() })
    }

    /// Warning that errors on these data are not errors on new data.
    pub fn sentence(&self, command: &str) -> String {
        match self.held_out.len() {
            0 => {
                format!("{command}: the model was fitted to these data, so its errors on new data are larger")
            }
            n => format!(
                "{command}: the model was fitted to these data except for {n} held-out trajectories; `augsim evaluate` scores these alone"
            ),
        }
    }
}
