//! Fingerprints (checksum and size) of the inputs of a result.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Text that stands for the fingerprint of a pipe, which can be read only once.
pub const STREAM: &str = "a stream";

/// Computes CRC-32 and size of a file; for a folder, CRC-32 of the names and sizes of its files.
///
/// An unreadable file is no error here: the reader of its format reports it.
pub fn fingerprint(path: &Path) -> String {
    match std::fs::metadata(path) {
        Ok(found) if found.is_file() => match checksum(path) {
            Ok((hash, bytes)) => format!("crc32:{hash:08x} of {bytes} bytes"),
            Err(_) => "unreadable".to_owned(),
        },
        Ok(found) if found.is_dir() => {
            let mut files = Vec::new();
            list(path, path, &mut files);
            files.sort_unstable();
            let mut hasher = crc32fast::Hasher::new();
            for (name, bytes) in &files {
                hasher.update(name.as_bytes());
                hasher.update(&bytes.to_le_bytes());
            }
            format!("crc32:{:08x} of the names and sizes of {} files", hasher.finalize(), files.len())
        }
        Ok(_) => STREAM.to_owned(),
        Err(_) => "unreadable".to_owned(),
    }
}

fn checksum(path: &Path) -> std::io::Result<(u32, u64)> {
    let mut reader = BufReader::with_capacity(1 << 16, File::open(path)?);
    let mut hasher = crc32fast::Hasher::new();
    let mut bytes = 0;
    loop {
        let chunk = reader.fill_buf()?;
        if chunk.is_empty() {
            return Ok((hasher.finalize(), bytes));
        }
        hasher.update(chunk);
        let length = chunk.len();
        bytes += length as u64;
        reader.consume(length);
    }
}

/// Collects the paths, relative to `top`, and the sizes of the files below `folder`.
///
/// Links to folders are not followed, which avoids cycles.
fn list(top: &Path, folder: &Path, files: &mut Vec<(String, u64)>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => list(top, &path, files),
            _ => {
                let name = path.strip_prefix(top).unwrap_or(&path).to_string_lossy().into_owned();
                files.push((name, std::fs::metadata(&path).map_or(0, |m| m.len())));
            }
        }
    }
}

/// Computes the fingerprint of bytes in memory, equal to that of a file with this content.
pub fn fingerprint_of_bytes(bytes: &[u8]) -> String {
    format!("crc32:{:08x} of {} bytes", crc32fast::hash(bytes), bytes.len())
}

/// Shortens a path for display: one inside the results folder `out` is shown relative to `DIR`.
pub fn display_path(path: &Path, out: &Path) -> String {
    let inside = path.strip_prefix(out);
    inside.map_or_else(|_| path.display().to_string(), |inside| format!("DIR/{}", inside.display()))
}
