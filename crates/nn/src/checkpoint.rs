//! Checkpoint files, and the only place that knows bincode.
//!
//! Layout: magic (8 bytes), format version (u32), length of the body (u64), CRC-32 of the body (u32),
//! all little-endian, then the body: a value serialised by bincode. Who writes the bytes of [`encode`] to a file takes
//! care that the file is whole or absent.

use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

const MAGIC: [u8; 8] = *b"AUGSIMCK";
/// Version of the layout and of what is stored; changes whenever an older file can no longer be read.
pub const VERSION: u32 = 3;
const HEADER: usize = 8 + 4 + 8 + 4;
/// Largest body that is decoded: no net of this kind comes near it, so a larger length is damage.
const MAX_BODY: usize = 1 << 30;

/// Why a checkpoint could not be made or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file system refused.
    #[error("{}: cannot read the checkpoint: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The value cannot be stored.
    #[error("the state of training cannot be stored: {source}")]
    Encode {
        /// Error of the encoder.
        source: Box<dyn std::error::Error + Send + Sync>,
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
    #[error("{}: the checkpoint is damaged ({damage}); use an older checkpoint or train again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The part of the file that does not fit.
        damage: Damage,
    },
}

/// The way in which a checkpoint file is damaged.
#[derive(Debug, thiserror::Error)]
pub enum Damage {
    /// The file is shorter than a header.
    #[error("the file ends within the header")]
    EndsInHeader,
    /// The body has another length than the header says.
    #[error("it should hold {expected} bytes but holds {found}")]
    Length {
        /// Bytes by the header.
        expected: u64,
        /// Bytes in the file.
        found: u64,
    },
    /// The body has another CRC-32 than the header says.
    #[error("the checksum does not match")]
    Checksum,
    /// The body is no such value.
    #[error(transparent)]
    Body(Box<dyn std::error::Error + Send + Sync>),
    /// The body goes on behind the value.
    #[error("{bytes} bytes are left over")]
    LeftOver {
        /// Bytes behind the value.
        bytes: usize,
    },
}

/// The bytes of a checkpoint file that holds `value`.
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

/// Reads a value back.
///
/// # Errors
/// [`CheckpointError`], naming the file and what is wrong with it.
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
    let field = |at: usize, n: usize| -> u64 {
        header[at..at + n].iter().rev().fold(0, |v, b| (v << 8) | u64::from(*b))
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
    //! Contract: what was saved comes back; every kind of damage gives its own error and never a value.
    use super::*;

    fn saved() -> (tempfile::TempDir, PathBuf) {
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
