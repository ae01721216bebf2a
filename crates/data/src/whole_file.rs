//! Reads a whole file into memory once, within the limit on its size.
//!
//! The readers recognise the layout from the bytes in memory. No file is opened twice, because standard
//! input, a FIFO or a process substitution can be read only once.

use crate::error::DataError;
use crate::limits::Limit;
use crate::source::Source;
use flate2::bufread::GzDecoder;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// File name that stands for standard input on the command line.
const STANDARD_INPUT: &str = "-";
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Reads all bytes of the file `path`; `-` is standard input.
pub(crate) fn read_whole(path: &Path) -> Result<Vec<u8>, DataError> {
    let bytes = match path == Path::new(STANDARD_INPUT) {
        true => read_within(io::stdin().lock(), Limit::Bytes),
        false => File::open(path).and_then(|file| read_within(file, Limit::Bytes)),
    };
    match bytes {
        Ok(Some(bytes)) => Ok(bytes),
        Ok(None) => Err(too_large(path)),
        Err(_) if path.is_dir() => Err(DataError::Folder { path: path.to_owned() }),
        Err(cause) => Err(DataError::Unreadable { path: path.to_owned(), cause }),
    }
}

/// Reads the UTF-8 text of a model file, a configuration or a log.
///
/// # Errors
/// [`io::Error`] of the system; of kind `InvalidData` where the bytes are not UTF-8 text and of kind
/// `FileTooLarge` above [`Limit::TextBytes`], with a message for users.
pub fn read_text(path: &Path) -> io::Result<String> {
    let bytes = File::open(path).and_then(|file| read_within(file, Limit::TextBytes))?;
    let bytes = bytes.ok_or_else(|| {
        io::Error::new(io::ErrorKind::FileTooLarge, format!("the file {}", Limit::TextBytes.exceeded()))
    })?;
    String::from_utf8(bytes).map_err(|_| not_utf8())
}

/// Reads all of a data file as UTF-8 text.
pub(crate) fn read_log(path: &Path) -> Result<String, DataError> {
    let error = |_| DataError::Unreadable { path: path.to_owned(), cause: not_utf8() };
    String::from_utf8(read_whole(path)?).map_err(error)
}

fn not_utf8() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "the file is not UTF-8 text; save it as UTF-8")
}

/// Reads all bytes of `source`; `None` where there are more than the limit allows.
pub(crate) fn read_within(source: impl Read, limit: Limit) -> io::Result<Option<Vec<u8>>> {
    let max_bytes = limit.value();
    let mut bytes = Vec::new();
    source.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= max_bytes).then_some(bytes))
}

/// Whether the bytes begin with the magic number of gzip; the file name does not count.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&GZIP_MAGIC)
}

/// Decompresses a gzip file of one or several members.
///
/// Zeros after the last member are padding. Other bytes are an error, because they may be data that would be
/// lost.
pub(crate) fn gunzip(path: &Path, packed: &[u8]) -> Result<Vec<u8>, DataError> {
    let max_bytes = Limit::Bytes.value();
    let mut content = Vec::new();
    let mut remaining = packed;
    while is_gzip(remaining) {
        let mut member = GzDecoder::new(remaining);
        let room = max_bytes.saturating_add(1).saturating_sub(content.len() as u64);
        let outcome = member.by_ref().take(room).read_to_end(&mut content);
        match outcome {
            Ok(_) if content.len() as u64 > max_bytes => return Err(too_large(path)),
            Ok(_) => {}
            Err(cause) if cause.kind() == io::ErrorKind::UnexpectedEof => {
                return Err(DataError::TruncatedGzip { path: path.to_owned(), line: line(&content) });
            }
            Err(cause) => {
                let (path, line) = (path.to_owned(), line(&content));
                return Err(DataError::DamagedGzip { path, line, cause });
            }
        }
        remaining = member.into_inner();
    }
    match remaining.iter().all(|&byte| byte == 0) {
        true => Ok(content),
        false => Err(DataError::TrailingBytes { path: path.to_owned(), bytes: remaining.len() }),
    }
}

/// Number of the line, from 1, at which decompression stopped; `content` is the text so far.
fn line(content: &[u8]) -> u64 {
    content.iter().filter(|&&byte| byte == b'\n').count() as u64 + 1
}

fn too_large(path: &Path) -> DataError {
    DataError::Limit { origin: Source::File(path.to_owned()), cause: Limit::Bytes.exceeded() }
}
