//! Container formats (gzip, zip, checkpoint) whose content is mutated before they are packed again.
//!
//! Without this, a checksum or a compressed stream would reject nearly every mutated file before its content
//! is read.

use crate::mutation::mutate;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::io::{self, Cursor, Read, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Length of a checkpoint's header, bytes: magic (8), version (4), body length (8), CRC-32 of the body (4).
const CHECKPOINT_HEADER: usize = 24;

/// Offsets in an NPY array file (version 1.0), bytes: of the header's length, and of the header.
const ARRAY_HEADER_OFFSETS: (usize, usize) = (8, 10);

/// Container format of a file, through which its content is mutated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Envelope {
    /// No container: the bytes of the file are mutated.
    Plain,
    /// One gzip member, whose content is mutated.
    Gzip,
    /// A zip archive, one of whose members is mutated.
    Zip,
    /// A zip archive of NPY arrays; in one of them the data or the header (with corrected length) is mutated.
    Arrays,
    /// A checkpoint, whose body is mutated and whose length and checksum are corrected.
    Checkpoint,
}

impl Envelope {
    /// Mutates `file`, with probability 0.5 inside its container; `donor` is another file of the format.
    pub fn mutate(self, rng: &mut Xoshiro256PlusPlus, file: &[u8], donor: &[u8]) -> Vec<u8> {
        let mutated = if rng.random() { self.mutate_content(rng, file, donor) } else { None };
        mutated.unwrap_or_else(|| mutate(rng, file, donor))
    }

    /// Mutates the content of a container; `None` if the file cannot be unpacked.
    fn mutate_content(self, rng: &mut Xoshiro256PlusPlus, file: &[u8], donor: &[u8]) -> Option<Vec<u8>> {
        match self {
            Envelope::Plain => None,
            Envelope::Gzip => {
                let content = mutate(rng, &inflated(file)?, &inflated(donor)?);
                gzipped(&content).ok()
            }
            Envelope::Zip | Envelope::Arrays => {
                let mut members = unzipped(file)?;
                let donors = unzipped(donor)?;
                if members.is_empty() || donors.is_empty() {
                    return None;
                }
                let index = rng.random_range(0..members.len());
                let other = &donors[rng.random_range(0..donors.len())].1;
                match rng.random_range(0..8u32) {
                    0 => {
                        let name = mutate(rng, members[index].0.as_bytes(), b"t_s.npy");
                        members[index].0 = String::from_utf8_lossy(&name).into_owned();
                    }
                    1 => members[index].1 = other.clone(),
                    _ if self == Envelope::Arrays => {
                        members[index].1 = mutate_array(rng, &members[index].1, other)
                    }
                    _ => members[index].1 = mutate(rng, &members[index].1, other),
                }
                zipped(&members).ok()
            }
            Envelope::Checkpoint => {
                let mut out = file.get(..CHECKPOINT_HEADER)?.to_vec();
                let body = mutate(rng, &file[CHECKPOINT_HEADER..], donor.get(CHECKPOINT_HEADER..)?);
                out[12..20].copy_from_slice(&(body.len() as u64).to_le_bytes());
                out[20..24].copy_from_slice(&crc32fast::hash(&body).to_le_bytes());
                out.extend(body);
                Some(out)
            }
        }
    }
}

/// Mutates the header of an NPY array file and corrects its length, or mutates its data.
fn mutate_array(rng: &mut Xoshiro256PlusPlus, file: &[u8], donor: &[u8]) -> Vec<u8> {
    let (length_at, header_at) = ARRAY_HEADER_OFFSETS;
    let Some([low, high]) = file.get(length_at..header_at) else { return mutate(rng, file, donor) };
    let header_end = (header_at + usize::from(u16::from_le_bytes([*low, *high]))).min(file.len());
    let (mut header, mut data) = (file[header_at..header_end].to_vec(), file[header_end..].to_vec());
    if rng.random_range(0..4u32) > 0 {
        header = mutate(rng, &header, donor);
    } else {
        data = mutate(rng, &data, donor);
    }
    let length = header.len().min(usize::from(u16::MAX)) as u16;
    [&file[..length_at], &length.to_le_bytes(), &header, &data].concat()
}

/// Unpacks a gzip stream; `None` if it is invalid.
pub fn inflated(file: &[u8]) -> Option<Vec<u8>> {
    let mut content = Vec::new();
    GzDecoder::new(file).read_to_end(&mut content).ok()?;
    Some(content)
}

/// Packs content as a gzip stream.
///
/// # Errors
/// None in practice: the bytes are written to memory.
pub fn gzipped(content: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(content)?;
    encoder.finish()
}

/// Names and contents of the members of a zip archive; `None` if the archive is invalid.
pub fn unzipped(file: &[u8]) -> Option<Vec<(String, Vec<u8>)>> {
    let mut archive = ZipArchive::new(Cursor::new(file)).ok()?;
    let mut members = Vec::new();
    for k in 0..archive.len() {
        let mut member = archive.by_index(k).ok()?;
        let mut content = Vec::new();
        member.read_to_end(&mut content).ok()?;
        members.push((member.name().ok()?.into_owned(), content));
    }
    Some(members)
}

/// Packs members into a zip archive without compression.
///
/// # Errors
/// Two members have the same name.
pub fn zipped(members: &[(String, Vec<u8>)]) -> io::Result<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in members {
        archive.start_file(name.as_str(), options).map_err(io::Error::other)?;
        archive.write_all(content)?;
    }
    Ok(archive.finish().map_err(io::Error::other)?.into_inner())
}
