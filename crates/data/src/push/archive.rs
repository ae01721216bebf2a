//! Zip archives, read from memory: the published push files and NPZ come in them.

use super::error::PushError;
use super::fault::FilePart;
use crate::limits::Limit;
use crate::whole_file::within;
use std::io::Cursor;
use std::path::Path;
use zip::ZipArchive;
use zip::result::ZipError;

/// Longest name of a member, bytes: as long as a file's name on most systems. It becomes part of paths in messages.
const LONGEST_NAME: usize = 255;

/// Whether the bytes begin as a zip archive does.
pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06")
}

/// Names of the files in the archive, in its order.
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

/// Unpacks the members in `names`, one after another.
pub(crate) fn unpack(
    path: &Path,
    bytes: &[u8],
    names: &[String],
    mut each: impl FnMut(&str, Vec<u8>) -> Result<(), crate::DataError>,
) -> Result<(), crate::DataError> {
    let mut archive = open(path, bytes)?;
    for name in names {
        if name.len() > LONGEST_NAME || name.chars().any(char::is_control) {
            return Err(PushError::MemberName { path: path.to_owned(), member: name.clone() }.into());
        }
        let damaged = |cause: ZipError| damaged(path, Some(name.clone()), cause);
        let member = archive.by_name(name).map_err(damaged)?;
        // The size that the archive states may be a lie: what counts is how much comes out.
        let content = within(member, Limit::Bytes).map_err(|e| damaged(e.into()))?;
        let content = content.ok_or_else(|| PushError::Limit {
            path: path.to_owned(),
            part: FilePart::Member(name.clone()),
            cause: Limit::Bytes.exceeded(),
        })?;
        each(name, content)?;
    }
    Ok(())
}

fn open<'a>(path: &Path, bytes: &'a [u8]) -> Result<ZipArchive<Cursor<&'a [u8]>>, PushError> {
    ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(path, None, e))
}

fn damaged(path: &Path, member: Option<String>, cause: ZipError) -> PushError {
    PushError::Zip { path: path.to_owned(), member, cause: Box::new(cause) }
}
