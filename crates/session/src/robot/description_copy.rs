//! Copy of a robot's description beside a model file that is written into another folder.

use crate::Subject;
use crate::folders::parent_of;
use augsim_discovery::Discovery;
use augsim_equations::model::with_description_file;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Endings of the result files of all commands. A description with one of them is copied under another name.
const RESULT_ENDINGS: [&str; 3] = ["toml", "json", "html"];

/// Copy of a robot's description in an output folder, which makes the model file there complete.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionCopy {
    /// Name of the copy in the output folder.
    pub name: String,
    /// Path of the description file that the model was read with.
    pub source: PathBuf,
    /// Text of the description file.
    pub text: Arc<str>,
    /// Whether the description file is already in the output folder under this name, so that nothing is written.
    pub is_in_place: bool,
}

impl DescriptionCopy {
    /// The copy that the model files of a subject need in `folder`; `None` for a model without `[robot]`.
    pub fn new(subject: &Subject, folder: &Path) -> Option<Self> {
        let Subject::Equations(model) = subject else { return None };
        let robot = model.robot.as_ref()?;
        let source = parent_of(Path::new(&model.file)).join(&robot.file);
        let base = Path::new(&robot.file).file_name()?.to_string_lossy();
        let has_result_ending = Path::new(&*base)
            .extension()
            .is_some_and(|ending| RESULT_ENDINGS.iter().any(|other| ending.eq_ignore_ascii_case(other)));
        let name = if has_result_ending { format!("robot-{base}") } else { base.into_owned() };
        let canonical = |path: &Path| std::fs::canonicalize(path).ok();
        let there = canonical(&folder.join(&name));
        let is_in_place = there.is_some() && there == canonical(&source);
        Some(Self { name, source, text: robot.text.clone(), is_in_place })
    }

    /// The text of a model file, changed so that it names the copy.
    ///
    /// # Errors
    /// The text is no TOML.
    pub fn refer(&self, model: &str) -> anyhow::Result<String> {
        Ok(with_description_file(model, "model.toml", &self.name)?)
    }

    /// Changes the model files in the result of a discovery so that they name the copy.
    ///
    /// # Errors
    /// As [`DescriptionCopy::refer`].
    pub fn refer_in(&self, found: &mut Discovery) -> anyhow::Result<()> {
        let models = &mut found.models;
        let rivals = models.rivals.iter_mut().map(|rival| &mut rival.model_toml);
        let texts = [&mut found.model_toml, &mut models.declared_toml, &mut models.calibrated_toml];
        for text in texts.into_iter().chain(rivals) {
            *text = self.refer(text)?;
        }
        Ok(())
    }
}
