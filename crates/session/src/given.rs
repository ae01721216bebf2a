//! An argument that may be a model or a run: a model file, the folder of a discovery, a trained net.

use crate::Usage;
use crate::residual::MODEL;
use crate::run_dir::{CHECKPOINT, CONFIG};
use crate::usage::PathFault;
use augsim_discovery::Discovery;
use std::path::{Path, PathBuf};

/// The result in the folder of a discovery.
const RESULT: &str = "result.json";

/// The model or run that an argument names.
#[derive(Debug)]
pub enum Given {
    /// The run directory of a trained net.
    Net,
    /// A model file, and the folder of the discovery or fit that it lies in, where the folder was given.
    Model {
        /// The file.
        file: PathBuf,
        /// The folder.
        folder: Option<PathBuf>,
    },
}

impl Given {
    /// Looks at what was given.
    ///
    /// # Errors
    /// A folder without a trained net or a model in it.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        if !path.is_dir() {
            return Ok(Given::Model { file: path.to_owned(), folder: None });
        }
        if path.join(CONFIG).exists() {
            return Ok(Given::Net);
        }
        let file = path.join(MODEL);
        if file.is_file() {
            return Ok(Given::Model { file, folder: Some(path.to_owned()) });
        }
        // A run directory that was begun and lost its configuration is best told by its own reader.
        if path.join(CHECKPOINT).exists() {
            return Ok(Given::Net);
        }
        let fault = PathFault::NeitherRunNorModel { config: CONFIG, model: MODEL };
        Err(Usage::path(path, fault).into())
    }
}

/// The result in the folder of a discovery; none where the folder is none of one, or of one of an earlier version.
pub fn discovery_in(folder: &Path) -> Option<Discovery> {
    let text = std::fs::read_to_string(folder.join(RESULT)).ok()?;
    let found: Discovery = serde_json::from_str(&text).ok()?;
    Some(found).filter(|d| !d.models.declared_toml.is_empty())
}
