//! Reading a file once and whole, within the limit on its size.
//!
//! Readers tell the layout from the bytes they hold. Nothing is opened twice: what was read of standard input, a
//! FIFO or a process substitution cannot be read again.

use crate::error::DataError;
use crate::limits::Limit;
use crate::source::Source;
use flate2::bufread::GzDecoder;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Name of standard input on the command line.
const STANDARD_INPUT: &str = "-";
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// All bytes of `path`; `-` is standard input.
pub(crate) fn read_whole(path: &Path) -> Result<Vec<u8>, DataError> {
    let bytes = match path == Path::new(STANDARD_INPUT) {
        true => within(io::stdin().lock(), Limit::Bytes),
        false => File::open(path).and_then(|file| within(file, Limit::Bytes)),
    };
    match bytes {
        Ok(Some(bytes)) => Ok(bytes),
        Ok(None) => Err(too_large(path)),
        Err(_) if path.is_dir() => Err(DataError::Folder { path: path.to_owned() }),
        Err(cause) => Err(DataError::Unreadable { path: path.to_owned(), cause }),
    }
}

/// Text of a model file, a configuration or a log, in UTF-8.
///
/// # Errors
/// [`io::Error`] of the system; of kind `InvalidData` where the bytes are no UTF-8 text and `FileTooLarge` beyond
/// [`Limit::TextBytes`], with a message for people.
pub fn read_text(path: &Path) -> io::Result<String> {
    let bytes = File::open(path).and_then(|file| within(file, Limit::TextBytes))?;
    let bytes = bytes.ok_or_else(|| {
        io::Error::new(io::ErrorKind::FileTooLarge, format!("it {}", Limit::TextBytes.exceeded()))
    })?;
    String::from_utf8(bytes).map_err(|_| not_utf8())
}

/// Text of a data file in UTF-8.
pub(crate) fn read_log(path: &Path) -> Result<String, DataError> {
    let broken = |_| DataError::Unreadable { path: path.to_owned(), cause: not_utf8() };
    String::from_utf8(read_whole(path)?).map_err(broken)
}

fn not_utf8() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text; save it as UTF-8")
}

/// The bytes of `source`; `None` where it goes on beyond the limit.
pub(crate) fn within(source: impl Read, limit: Limit) -> io::Result<Option<Vec<u8>>> {
    let most = limit.value();
    let mut bytes = Vec::new();
    source.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= most).then_some(bytes))
}

/// Whether the bytes begin as gzip does; told by content, not by the name.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&GZIP_MAGIC)
}

/// The content of one or several gzip members. Zeros after the last one are padding, anything else is refused: it
/// may be data that would be lost.
pub(crate) fn gunzip(path: &Path, packed: &[u8]) -> Result<Vec<u8>, DataError> {
    let most = Limit::Bytes.value();
    let mut content = Vec::new();
    let mut rest = packed;
    while is_gzip(rest) {
        let mut member = GzDecoder::new(rest);
        let room = most.saturating_add(1).saturating_sub(content.len() as u64);
        let outcome = member.by_ref().take(room).read_to_end(&mut content);
        match outcome {
            Ok(_) if content.len() as u64 > most => return Err(too_large(path)),
            Ok(_) => {}
            Err(cause) if cause.kind() == io::ErrorKind::UnexpectedEof => {
                return Err(DataError::TruncatedGzip { path: path.to_owned(), line: line(&content) });
            }
            Err(cause) => {
                let (path, line) = (path.to_owned(), line(&content));
                return Err(DataError::DamagedGzip { path, line, cause });
            }
        }
        rest = member.into_inner();
    }
    match rest.iter().all(|&byte| byte == 0) {
        true => Ok(content),
        false => Err(DataError::AfterGzip { path: path.to_owned(), bytes: rest.len() }),
    }
}

/// Line, from 1, on which reading `content` stopped.
fn line(content: &[u8]) -> u64 {
    content.iter().filter(|&&byte| byte == b'\n').count() as u64 + 1
}

fn too_large(path: &Path) -> DataError {
    DataError::Limit { origin: Source::File(path.to_owned()), cause: Limit::Bytes.exceeded() }
}
