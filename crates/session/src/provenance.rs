//! Which inputs a result came from, in a few characters.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Stands for the content of a pipe, which cannot be looked at twice.
pub const STREAM: &str = "a stream";

/// The content of a file in a few characters (CRC-32 and size); of a folder, the names and sizes of its files. A file that
/// cannot be read gets its sentence from the reader of its format.
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

/// Collects the files below `folder` by their path from `top`; links to folders are not followed, so that no circle is.
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

/// The fingerprint of bytes in memory, as [`fingerprint`] has it of the file that holds them.
pub fn fingerprint_of_bytes(bytes: &[u8]) -> String {
    format!("crc32:{:08x} of {} bytes", crc32fast::hash(bytes), bytes.len())
}

/// A path of a page: one inside the folder of the results does not depend on where that is.
pub fn shown(path: &Path, out: &Path) -> String {
    let inside = path.strip_prefix(out);
    inside.map_or_else(|_| path.display().to_string(), |inside| format!("DIR/{}", inside.display()))
}
