//! Checkpoint files: a value serialised by bincode, with version, length and checksum.
//!
//! The layout is: magic number (8 bytes), format version (u32), length of the body (u64), CRC-32 of the body
//! (u32), all little-endian, then the body. The caller writes the bytes of [`encode`] to a file and must do
//! so atomically.

use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// First bytes of every checkpoint file, by which it is recognised.
const MAGIC: [u8; 8] = *b"AUGSIMCK";
/// Version of the checkpoint format; it is increased whenever older files become unreadable.
pub const VERSION: u32 = 3;
/// Length of the header of a checkpoint file in bytes.
const HEADER: usize = 8 + 4 + 8 + 4;
/// Maximum number of bytes of the body of a checkpoint file.
///
/// Checkpoints are far smaller; a larger length means that the file is damaged.
const MAX_BODY: usize = 1 << 30;

/// Errors of writing or reading a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The checkpoint file cannot be read.
    #[error("{}: cannot read the checkpoint: {source}", path.display())]
    Io {
        /// Path of the checkpoint file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The value cannot be serialised for a checkpoint.
    #[error("the training state cannot be serialised: {source}")]
    Encode {
        /// Error of the serialiser.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The file is no checkpoint: it does not begin with the magic number.
    #[error("{}: not an augsim checkpoint; give the checkpoint.bin of a run directory", path.display())]
    NotACheckpoint {
        /// Path of the file.
        path: PathBuf,
    },
    /// The checkpoint file has another format version than this program reads.
    #[error(
        "{}: checkpoint format version {found}, but this augsim reads version {VERSION}; train again, or use the \
         augsim that wrote it",
        path.display()
    )]
    Version {
        /// Path of the checkpoint file.
        path: PathBuf,
        /// Format version in the checkpoint file.
        found: u32,
    },
    /// The checkpoint file is truncated, too long or modified.
    #[error("{}: the checkpoint is damaged ({damage}); use an older checkpoint or train again", path.display())]
    Damaged {
        /// Path of the checkpoint file.
        path: PathBuf,
        /// How the checkpoint file is damaged.
        damage: Damage,
    },
}

/// How a checkpoint file is damaged.
#[derive(Debug, thiserror::Error)]
pub enum Damage {
    /// The file is shorter than a header.
    #[error("the file ends within the header")]
    EndsInHeader,
    /// The number of bytes in the body differs from that in the header.
    #[error("it should hold {expected} bytes but holds {found}")]
    Length {
        /// Number of bytes of the body according to the header.
        expected: u64,
        /// Number of bytes of the body in the file.
        found: u64,
    },
    /// The CRC-32 of the body differs from that in the header.
    #[error("the checksum does not match")]
    Checksum,
    /// The body of the file cannot be decoded as a value of the expected type.
    #[error(transparent)]
    Body(Box<dyn std::error::Error + Send + Sync>),
    /// The body continues after the end of the value.
    #[error("there are {bytes} bytes after the end of the data")]
    LeftOver {
        /// Number of superfluous bytes after the value.
        bytes: usize,
    },
}

/// Encodes `value` as the bytes of a checkpoint file.
///
/// # Errors
/// [`CheckpointError::Encode`].
pub fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, CheckpointError> {
    let body = bincode::serde::encode_to_vec(value, bincode::config::standard())
        .map_err(|e| CheckpointError::Encode { source: e.into() })?;
    let mut file = Vec::with_capacity(HEADER + body.len());
    file.extend(MAGIC);
    file.extend(VERSION.to_le_bytes());
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(crc32fast::hash(&body).to_le_bytes());
    file.extend(body);
    Ok(file)
}

/// Reads the value of a checkpoint file.
///
/// # Errors
/// [`CheckpointError`] with the path and the kind of damage.
pub fn load<T: DeserializeOwned>(path: &Path) -> Result<T, CheckpointError> {
    let owned = || path.to_owned();
    let bytes = std::fs::read(path).map_err(|source| CheckpointError::Io { path: owned(), source })?;
    let damaged = |damage: Damage| CheckpointError::Damaged { path: owned(), damage };
    if !bytes.starts_with(&MAGIC) {
        return Err(CheckpointError::NotACheckpoint { path: owned() });
    }
    let Some((header, body)) = bytes.split_at_checked(HEADER) else {
        return Err(damaged(Damage::EndsInHeader));
    };
    let field = |offset: usize, n: usize| -> u64 {
        header[offset..offset + n].iter().rev().fold(0, |v, b| (v << 8) | u64::from(*b))
    };
    let (version, length, checksum) = (field(8, 4) as u32, field(12, 8), field(20, 4) as u32);
    if version != VERSION {
        return Err(CheckpointError::Version { path: owned(), found: version });
    }
    if body.len() as u64 != length {
        return Err(damaged(Damage::Length { expected: length, found: body.len() as u64 }));
    }
    if crc32fast::hash(body) != checksum {
        return Err(damaged(Damage::Checksum));
    }
    let config = bincode::config::standard().with_limit::<MAX_BODY>();
    let (value, used) =
        bincode::serde::decode_from_slice(body, config).map_err(|e| damaged(Damage::Body(e.into())))?;
    if used != body.len() {
        return Err(damaged(Damage::LeftOver { bytes: body.len() - used }));
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    //! Contract: a saved value is restored; every kind of damage is an error and never a value.
    use super::*;

    fn saved_checkpoint() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("checkpoint.bin");
        let value = (7_u64, vec![1.5_f32, -2.0], "name".to_owned());
        std::fs::write(&path, encode(&value).unwrap()).unwrap();
        (dir, path)
    }

    fn reload(path: &Path) -> Result<(u64, Vec<f32>, String), CheckpointError> {
        load(path)
    }

    #[test]
    fn a_saved_value_is_restored() {
        let (_dir, path) = saved_checkpoint();
        assert_eq!(reload(&path).unwrap(), (7, vec![1.5, -2.0], "name".into()));
    }

    #[test]
    fn every_truncated_file_is_an_error() {
        let (_dir, path) = saved_checkpoint();
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
    fn errors_name_a_flipped_bit_and_another_version() {
        let (_dir, path) = saved_checkpoint();
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
