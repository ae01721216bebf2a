//! Reads zip archives in memory, for the published push files and NPZ.

use super::error::PushError;
use super::fault::FilePart;
use crate::limits::Limit;
use crate::whole_file::read_within;
use std::io::Cursor;
use std::path::Path;
use zip::ZipArchive;
use zip::result::ZipError;

/// Maximum length of the name of an archive member, bytes; it is the limit of most file systems.
const MAX_NAME_BYTES: usize = 255;

/// Whether the bytes begin with the magic number of a zip archive.
pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06")
}

/// Names of the files in a zip archive, in the order of the archive.
pub(crate) fn members(path: &Path, bytes: &[u8]) -> Result<Vec<String>, PushError> {
    let archive = open(path, bytes)?;
    let mut names = Vec::new();
    for name in archive.file_names() {
        let name = name.map_err(|e| damaged(path, None, e))?;
        if !name.ends_with('/') {
            names.push(name.into_owned());
        }
    }
    Ok(names)
}

/// Unpacks the archive members in `names` one after another and passes each to `read_member`.
pub(crate) fn unpack(
    path: &Path,
    bytes: &[u8],
    names: &[String],
    mut read_member: impl FnMut(&str, Vec<u8>) -> Result<(), crate::DataError>,
) -> Result<(), crate::DataError> {
    let mut archive = open(path, bytes)?;
    for name in names {
        if name.len() > MAX_NAME_BYTES || name.chars().any(char::is_control) {
            return Err(PushError::MemberName { path: path.to_owned(), member: name.clone() }.into());
        }
        let damaged = |cause: ZipError| damaged(path, Some(name.clone()), cause);
        let member = archive.by_name(name).map_err(damaged)?;
        // The size that the archive states may be wrong, so the limit applies to the unpacked bytes.
        let content = read_within(member, Limit::Bytes).map_err(|e| damaged(e.into()))?;
        let content = content.ok_or_else(|| PushError::Limit {
            path: path.to_owned(),
            part: FilePart::Member(name.clone()),
            cause: Limit::Bytes.exceeded(),
        })?;
        read_member(name, content)?;
    }
    Ok(())
}

fn open<'a>(path: &Path, bytes: &'a [u8]) -> Result<ZipArchive<Cursor<&'a [u8]>>, PushError> {
    ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(path, None, e))
}

fn damaged(path: &Path, member: Option<String>, cause: ZipError) -> PushError {
    PushError::Zip { path: path.to_owned(), member, cause: Box::new(cause) }
}
