//! `run.toml`: the command, settings and inputs that made the results in a folder.

use anyhow::Context;
use augsim_data::atomic_write;
use augsim_session::provenance::{STREAM, fingerprint};
use augsim_session::usage::Difference;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Name of the file with the record of a run.
pub const RECORD: &str = "run.toml";

/// Record of a run: command, settings and inputs that determine the results in a folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of augsim that made the results; other versions may give other results.
    pub augsim: String,
    /// Name of the command.
    pub command: String,
    /// Settings of the command by name.
    pub settings: BTreeMap<String, String>,
    /// Fingerprint of the content of each input by name, independent of its path.
    pub inputs: BTreeMap<String, String>,
    /// Path of each input relative to the folder of the record, to recognise an input that was edited since.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub paths: BTreeMap<String, String>,
    /// Path of each input as the user gave it.
    #[serde(skip)]
    given: BTreeMap<String, PathBuf>,
}

impl Record {
    /// Makes the record of a command without settings and inputs.
    pub fn new(command: &str) -> Self {
        Record {
            augsim: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            settings: BTreeMap::new(),
            inputs: BTreeMap::new(),
            paths: BTreeMap::new(),
            given: BTreeMap::new(),
        }
    }

    /// Adds a setting of the command to the record.
    pub fn setting(mut self, name: &str, value: impl ToString) -> Self {
        self.settings.insert(name.to_owned(), value.to_string());
        self
    }

    /// Adds an input (file or folder) and the fingerprint of its content to the record.
    pub fn input(mut self, name: &str, path: &Path) -> Self {
        self.inputs.insert(name.to_owned(), fingerprint(path));
        self.given.insert(name.to_owned(), path.to_owned());
        self
    }

    /// Adds inputs of one kind to the record: `name` for one, `name-1`, `name-2` and so on for several.
    pub fn inputs(self, name: &str, paths: &[PathBuf]) -> Self {
        match paths {
            [one] => self.input(name, one),
            several => {
                let numbered = several.iter().enumerate();
                numbered.fold(self, |record, (i, path)| record.input(&format!("{name}-{}", i + 1), path))
            }
        }
    }

    /// Fingerprint of an input when it was added, or its present one if it is not in the record.
    pub fn fingerprint_of(&self, path: &Path) -> String {
        let name = self.given.iter().find(|(_, given)| *given == path).map(|(name, _)| name);
        let found = name.and_then(|name| self.inputs.get(name));
        found.cloned().unwrap_or_else(|| fingerprint(path))
    }

    /// Reads the record of the results in a folder; `None` if there is none.
    ///
    /// # Errors
    /// The file cannot be read or is not a record.
    pub fn read(folder: &Path) -> anyhow::Result<Option<Self>> {
        let path = folder.join(RECORD);
        match std::fs::read_to_string(&path) {
            Ok(text) => toml::from_str(&text)
                .map(Some)
                .with_context(|| format!("{}: not the record of a run of augsim", path.display())),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e).with_context(|| format!("{}: cannot read it", path.display())),
        }
    }

    /// Writes the record of a run into a folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let relative = |(name, path): (&String, &PathBuf)| Some((name.clone(), relative_path(folder, path)?));
        let record = Record { paths: self.given.iter().filter_map(relative).collect(), ..self.clone() };
        let text = toml::to_string_pretty(&record)?;
        atomic_write(&folder.join(RECORD), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// Whether the input `name` is the same file or folder in this record and in `there` of `folder`.
    fn is_same_input(&self, there: &Self, name: &str, folder: &Path) -> bool {
        let canonical = |path: &Path| std::fs::canonicalize(path).ok();
        let here = self.given.get(name).and_then(|path| canonical(path));
        here.is_some() && here == there.paths.get(name).and_then(|path| canonical(&folder.join(path)))
    }

    /// First difference of this record from the existing one in `folder`; `None` if there is none.
    ///
    /// Without a difference the results in the folder may be replaced.
    ///
    /// An input that was edited since is no difference.
    pub fn difference(&self, there: &Self, folder: &Path) -> Option<Difference> {
        let differ = |name: &str, there: &str, here: &str| Difference {
            key: name.to_owned(),
            there: there.to_owned(),
            here: here.to_owned(),
        };
        if self.command != there.command {
            return Some(differ("the command", &there.command, &self.command));
        }
        let none = "absent".to_owned();
        for (ours, theirs, kind) in
            [(&self.settings, &there.settings, ""), (&self.inputs, &there.inputs, "the content of ")]
        {
            let mut names: Vec<&String> = ours.keys().chain(theirs.keys()).collect();
            names.sort_unstable();
            for name in names {
                let is_input = !kind.is_empty();
                if is_input && self.is_same_input(there, name, folder) {
                    continue;
                }
                let [here, there] = [ours, theirs].map(|map| map.get(name).unwrap_or(&none));
                if here != there || here == STREAM {
                    return Some(differ(&format!("{kind}{name}"), there, here));
                }
            }
        }
        (self.augsim != there.augsim).then(|| differ("the version of augsim", &there.augsim, &self.augsim))
    }
}

/// Path of a file or folder relative to `folder`; `None` if one of them does not exist.
fn relative_path(folder: &Path, path: &Path) -> Option<String> {
    let (folder, path) = (std::fs::canonicalize(folder).ok()?, std::fs::canonicalize(path).ok()?);
    let common = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| "..".to_owned());
    let down = path.components().skip(common).map(|c| c.as_os_str().to_string_lossy().into_owned());
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}
