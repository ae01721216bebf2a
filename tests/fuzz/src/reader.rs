//! File readers under test, and the input files that they read.

use crate::envelope::Envelope;
use crate::verdict::Verdict;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Names and contents of the files that a reader reads together: one file, or a folder of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Files(pub Vec<(String, Vec<u8>)>);

impl Files {
    /// Makes the input of a reader of a single file.
    pub fn one(name: &str, content: impl Into<Vec<u8>>) -> Self {
        Files(vec![(name.to_owned(), content.into())])
    }

    /// Empties `folder` and writes the files to it.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        match fs::remove_dir_all(folder) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(e),
            _ => fs::create_dir_all(folder)?,
        }
        for (name, content) in &self.0 {
            fs::write(folder.join(name), content)?;
        }
        Ok(())
    }

    /// Reads the files in `folder`, in the order of their names.
    ///
    /// # Errors
    /// The folder cannot be read, or a file name is not Unicode.
    pub fn read(folder: &Path) -> io::Result<Self> {
        let mut files = Vec::new();
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let name = entry.file_name().into_string();
            let name = name.map_err(|name| {
                io::Error::other(format!("the file name {} is not valid Unicode", name.display()))
            })?;
            files.push((name, fs::read(entry.path())?));
        }
        files.sort_unstable();
        Ok(Files(files))
    }
}

/// A file reader of augsim under test.
#[derive(Debug, Clone, Copy)]
pub struct Reader {
    /// Name of the reader in reports and in the corpus.
    pub name: &'static str,
    /// Container format of the reader's files.
    pub envelope: Envelope,
    /// Whether the reader takes the folder of the files instead of the first file.
    pub takes_folder: bool,
    /// Reads the file or folder at the path and checks the result.
    pub read: fn(&Path) -> Verdict,
}

impl Reader {
    /// Path to pass to the reader for `files` in `folder`.
    pub fn path(&self, folder: &Path, files: &Files) -> PathBuf {
        match files.0.first() {
            Some((name, _)) if !self.takes_folder => folder.join(name),
            _ => folder.to_owned(),
        }
    }
}
