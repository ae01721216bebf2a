//! Wrappers around what is worth mutating: a checksum or a compressed stream would otherwise refuse nearly every
//! mutated file before its content is looked at.

use crate::mutation::mutate;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::io::{self, Cursor, Read, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Bytes of a checkpoint's header: magic (8), version (4), length of the body (8), CRC-32 of the body (4).
const CHECKPOINT_HEADER: usize = 24;

/// Bytes of an array file before the length of its header (version 1.0), and with it.
const ARRAY_BEGIN: (usize, usize) = (8, 10);

/// Layers of a format that a mutation may pass through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Envelope {
    /// None.
    Plain,
    /// One gzip member.
    Gzip,
    /// A zip archive; one of its members is mutated.
    Zip,
    /// A zip archive of arrays; the header of one of them is mutated and its length mended, or its data.
    Arrays,
    /// A checkpoint, whose length and checksum are mended.
    Checkpoint,
}

impl Envelope {
    /// `file` mutated, half of the time inside the envelope.
    pub fn mutate(self, rng: &mut Xoshiro256PlusPlus, file: &[u8], donor: &[u8]) -> Vec<u8> {
        let inside = if rng.random() { self.inside(rng, file, donor) } else { None };
        inside.unwrap_or_else(|| mutate(rng, file, donor))
    }

    fn inside(self, rng: &mut Xoshiro256PlusPlus, file: &[u8], donor: &[u8]) -> Option<Vec<u8>> {
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
                let at = rng.random_range(0..members.len());
                let other = &donors[rng.random_range(0..donors.len())].1;
                match rng.random_range(0..8u32) {
                    0 => {
                        let name = mutate(rng, members[at].0.as_bytes(), b"t_s.npy");
                        members[at].0 = String::from_utf8_lossy(&name).into_owned();
                    }
                    1 => members[at].1 = other.clone(),
                    _ if self == Envelope::Arrays => members[at].1 = array(rng, &members[at].1, other),
                    _ => members[at].1 = mutate(rng, &members[at].1, other),
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

/// An array file with a mutated header whose length is right, or with mutated data.
fn array(rng: &mut Xoshiro256PlusPlus, file: &[u8], donor: &[u8]) -> Vec<u8> {
    let (length_at, header_at) = ARRAY_BEGIN;
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

/// The content of a gzip stream.
pub fn inflated(file: &[u8]) -> Option<Vec<u8>> {
    let mut content = Vec::new();
    GzDecoder::new(file).read_to_end(&mut content).ok()?;
    Some(content)
}

/// Content as a gzip stream.
///
/// # Errors
/// None in practice: the bytes go to memory.
pub fn gzipped(content: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(content)?;
    encoder.finish()
}

/// Names and contents of a zip archive's members.
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

/// A zip archive of these members, which are not compressed.
///
/// # Errors
/// Two members of one name.
pub fn zipped(members: &[(String, Vec<u8>)]) -> io::Result<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in members {
        archive.start_file(name.as_str(), options).map_err(io::Error::other)?;
        archive.write_all(content)?;
    }
    Ok(archive.finish().map_err(io::Error::other)?.into_inner())
}
