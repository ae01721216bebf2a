//! Tells whether an argument names a model file, the folder of a discovery or a trained net.

use crate::Usage;
use crate::residual::MODEL;
use crate::run_dir::{CHECKPOINT, CONFIG};
use crate::usage::PathFault;
use augsim_discovery::Discovery;
use std::path::{Path, PathBuf};

/// Name of the result file in the folder of a discovery.
const RESULT: &str = "result.json";

/// What an argument that names a model or a run refers to.
#[derive(Debug)]
pub enum ModelOrRun {
    /// The argument is the run directory of a trained net.
    Net,
    /// The argument is a model file, or a folder that contains one.
    Model {
        /// Path of the model file.
        file: PathBuf,
        /// Folder of the discovery or fit, if the user gave it instead of the file.
        folder: Option<PathBuf>,
    },
}

impl ModelOrRun {
    /// Determines whether a path is a model file, a folder with one, or a run directory.
    ///
    /// # Errors
    /// A folder without a trained net or a model in it.
    pub fn from_path(path: &Path) -> anyhow::Result<Self> {
        if !path.is_dir() {
            return Ok(ModelOrRun::Model { file: path.to_owned(), folder: None });
        }
        if path.join(CONFIG).exists() {
            return Ok(ModelOrRun::Net);
        }
        let file = path.join(MODEL);
        if file.is_file() {
            return Ok(ModelOrRun::Model { file, folder: Some(path.to_owned()) });
        }
        // A run directory without its configuration: the reader of run directories reports what is missing.
        if path.join(CHECKPOINT).exists() {
            return Ok(ModelOrRun::Net);
        }
        let fault = PathFault::NeitherRunNorModel { config: CONFIG, model: MODEL };
        Err(Usage::path(path, fault).into())
    }
}

/// Reads the result in the folder of a discovery.
///
/// `None` if the folder has no readable result or one of an earlier version.
pub fn discovery_in(folder: &Path) -> Option<Discovery> {
    let text = std::fs::read_to_string(folder.join(RESULT)).ok()?;
    let found: Discovery = serde_json::from_str(&text).ok()?;
    Some(found).filter(|d| !d.models.declared_toml.is_empty())
}
