//! Checkpoint files, and the only place that knows bincode.
//!
//! Layout: magic (8 bytes), format version (u32), length of the body (u64), CRC-32 of the body (u32),
//! all little-endian, then the body: a value serialised by bincode. A file is written to a temporary
//! name in the same folder, synced and renamed, so that a checkpoint is whole or absent.

use serde::{Serialize, de::DeserializeOwned};
use std::io::Write;
use std::path::{Path, PathBuf};

const MAGIC: [u8; 8] = *b"AUGSIMCK";
/// Version of the layout and of what is stored; changes whenever an older file can no longer be read.
pub const VERSION: u32 = 2;
const HEADER: usize = 8 + 4 + 8 + 4;
/// Largest body that is decoded: no net of this kind comes near it, so a larger length is damage.
const MAX_BODY: usize = 1 << 30;

/// Why a checkpoint could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file system refused.
    #[error("{}: cannot {action} the checkpoint: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// `read` or `write`.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file does not begin as a checkpoint does.
    #[error("{}: not an augsim checkpoint; give the checkpoint.bin of a run directory", path.display())]
    NotACheckpoint {
        /// The file.
        path: PathBuf,
    },
    /// The file is of another version of the format.
    #[error(
        "{}: checkpoint format version {found}, but this augsim reads version {VERSION}; train again, or use the \
         augsim that wrote it",
        path.display()
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Version in the file.
        found: u32,
    },
    /// The file is cut short, too long or changed.
    #[error("{}: the checkpoint is damaged ({what}); use an older checkpoint or train again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        what: String,
    },
}

/// Writes `value` atomically.
///
/// # Errors
/// [`CheckpointError::Io`]; a previous file of that name stays as it was.
pub fn save<T: Serialize>(path: &Path, value: &T) -> Result<(), CheckpointError> {
    let io = |source| CheckpointError::Io { path: path.to_owned(), action: "write", source };
    let body = bincode::serde::encode_to_vec(value, bincode::config::standard())
        .map_err(|e| io(std::io::Error::other(e)))?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(io)?;
    let mut header = Vec::with_capacity(HEADER);
    header.extend(MAGIC);
    header.extend(VERSION.to_le_bytes());
    header.extend((body.len() as u64).to_le_bytes());
    header.extend(crc32fast::hash(&body).to_le_bytes());
    file.write_all(&header).and_then(|()| file.write_all(&body)).map_err(io)?;
    file.as_file().sync_all().map_err(io)?;
    file.persist(path).map_err(|e| io(e.error))?;
    Ok(())
}

/// Reads a value back.
///
/// # Errors
/// [`CheckpointError`], naming the file and what is wrong with it.
pub fn load<T: DeserializeOwned>(path: &Path) -> Result<T, CheckpointError> {
    let owned = || path.to_owned();
    let bytes = std::fs::read(path).map_err(|source| CheckpointError::Io {
        path: owned(),
        action: "read",
        source,
    })?;
    let damaged = |what: String| CheckpointError::Damaged { path: owned(), what };
    if !bytes.starts_with(&MAGIC) {
        return Err(CheckpointError::NotACheckpoint { path: owned() });
    }
    let Some((header, body)) = bytes.split_at_checked(HEADER) else {
        return Err(damaged("the file ends within the header".into()));
    };
    let field = |at: usize, n: usize| -> u64 {
        header[at..at + n].iter().rev().fold(0, |v, b| (v << 8) | u64::from(*b))
    };
    let (version, length, checksum) = (field(8, 4) as u32, field(12, 8), field(20, 4) as u32);
    if version != VERSION {
        return Err(CheckpointError::Version { path: owned(), found: version });
    }
    if body.len() as u64 != length {
        return Err(damaged(format!("it should hold {length} bytes but holds {}", body.len())));
    }
    if crc32fast::hash(body) != checksum {
        return Err(damaged("the checksum does not match".into()));
    }
    let config = bincode::config::standard().with_limit::<MAX_BODY>();
    let (value, used) =
        bincode::serde::decode_from_slice(body, config).map_err(|e| damaged(e.to_string()))?;
    if used != body.len() {
        return Err(damaged(format!("{} bytes are left over", body.len() - used)));
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    //! Contract: what was saved comes back; every kind of damage gives its own error and never a value.
    use super::*;

    fn saved() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("checkpoint.bin");
        save(&path, &(7_u64, vec![1.5_f32, -2.0], "name".to_owned())).unwrap();
        (dir, path)
    }

    fn reload(path: &Path) -> Result<(u64, Vec<f32>, String), CheckpointError> {
        load(path)
    }

    #[test]
    fn round_trip() {
        let (_dir, path) = saved();
        assert_eq!(reload(&path).unwrap(), (7, vec![1.5, -2.0], "name".into()));
    }

    #[test]
    fn every_truncation_is_an_error() {
        let (_dir, path) = saved();
        let whole = std::fs::read(&path).unwrap();
        for n in 0..whole.len() {
            std::fs::write(&path, &whole[..n]).unwrap();
            let error = reload(&path).unwrap_err();
            match n {
                0..8 => assert!(matches!(error, CheckpointError::NotACheckpoint { .. }), "{n}: {error}"),
                _ => assert!(matches!(error, CheckpointError::Damaged { .. }), "{n}: {error}"),
            }
        }
    }

    #[test]
    fn a_flipped_bit_and_another_version_are_named() {
        let (_dir, path) = saved();
        let whole = std::fs::read(&path).unwrap();
        let mut flipped = whole.clone();
        flipped[HEADER + 3] ^= 1;
        std::fs::write(&path, &flipped).unwrap();
        assert!(reload(&path).unwrap_err().to_string().contains("checksum"));
        let mut newer = whole;
        newer[8] = 99;
        std::fs::write(&path, &newer).unwrap();
        let text = reload(&path).unwrap_err().to_string();
        assert!(text.contains("version 99") && text.contains(&format!("version {VERSION}")), "{text}");
    }
}
