//! Reads the numeric arrays of MATLAB files of level 5 (versions 5 to 7, plain or compressed).
//!
//! The format: a header of 128 bytes, then elements with a tag of type and size, padded to 8 bytes. An
//! element of type 15 is compressed with zlib; type 14 is an array with the sub-elements flags, dimensions,
//! name and values. MathWorks, *MAT-File Format*, chapter 1.

use super::{NamedVectors, check_cells, damaged};
use crate::error::DataError;
use crate::limits::Limit;
use crate::whole_file::read_within;
use flate2::read::ZlibDecoder;
use std::path::Path;

const FORMAT: &str = "a MATLAB file";
const HEADER_BYTES: usize = 128;
const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;
const STRUCT_CLASS: u8 = 2;
/// Class codes of numeric MATLAB arrays: double, single, and the integers.
const NUMERIC_CLASSES: std::ops::RangeInclusive<u8> = 6..=15;
/// Maximum depth of nested MATLAB structures that are read.
const MAX_DEPTH: usize = 8;

/// Whether the file is a MATLAB file of level 5.
pub(super) fn is_mat(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB 5.0 MAT-file") && bytes.len() > HEADER_BYTES
}

/// Converts vectors, columns of matrices and fields of structures of a MATLAB file to CSV text.
///
/// # Errors
/// The file is damaged or has no vectors of numbers.
pub(super) fn text(path: &Path, bytes: &[u8]) -> Result<Vec<u8>, DataError> {
    let cut_off = || damaged(path, FORMAT, "it is damaged or cut off");
    let big_endian = &bytes[126..128] == b"MI";
    let mut out = NamedVectors::default();
    let mut elements = Elements { bytes: &bytes[HEADER_BYTES..], big_endian };
    while let Some((kind, content)) = elements.next().ok_or_else(cut_off)? {
        let unpacked;
        let (kind, content) = if kind == COMPRESSED {
            let inflated = read_within(ZlibDecoder::new(content), Limit::Bytes).map_err(|_| cut_off())?;
            unpacked = inflated.ok_or_else(|| damaged(path, FORMAT, Limit::Bytes.exceeded()))?;
            let mut inner = Elements { bytes: &unpacked, big_endian };
            inner.next().flatten().ok_or_else(cut_off)?
        } else {
            (kind, content)
        };
        if kind == MATRIX {
            matrix(path, Elements { bytes: content, big_endian }, "", 0, &mut out)?.ok_or_else(cut_off)?;
        }
    }
    out.text(path, FORMAT)
}

/// Iterator over the data elements in a part of a MATLAB file.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Option<u32> {
        let word: [u8; 4] = self.bytes.get(at..at + 4)?.try_into().ok()?;
        Some(if self.big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    /// Type code and content of the next element; `Some(None)` at the end, `None` where the element is cut off.
    fn next(&mut self) -> Option<Option<(u32, &'a [u8])>> {
        if self.bytes.len() < 8 {
            return Some(None);
        }
        let tag = self.word(0)?;
        // A small element has its size in the upper half of the tag and its content in the next four bytes.
        let (kind, begin, size): (u32, usize, usize) = match tag >> 16 {
            0 => (tag, 8, self.word(4)? as usize),
            small => (tag & 0xffff, 4, small as usize),
        };
        let content = self.bytes.get(begin..begin.checked_add(size)?)?;
        let padded = if begin == 4 {
            8
        } else if kind == COMPRESSED {
            8 + size
        } else {
            8 + size.div_ceil(8) * 8
        };
        self.bytes = &self.bytes[padded.min(self.bytes.len())..];
        Some(Some((kind, content)))
    }

    fn required(&mut self) -> Option<(u32, &'a [u8])> {
        self.next().flatten()
    }

    /// Decodes the content of an element with the type code `kind` as numbers; `None` for other types.
    fn numbers(&self, kind: u32, content: &[u8]) -> Option<Vec<f64>> {
        macro_rules! values {
            ($type:ty) => {{
                let convert = |chunk: &[u8]| {
                    let bytes = chunk.try_into().unwrap_or_default();
                    if self.big_endian {
                        <$type>::from_be_bytes(bytes)
                    } else {
                        <$type>::from_le_bytes(bytes)
                    }
                };
                content.chunks_exact(size_of::<$type>()).map(|chunk| convert(chunk) as f64).collect()
            }};
        }
        Some(match kind {
            1 => values!(i8),
            2 => values!(u8),
            3 => values!(i16),
            4 => values!(u16),
            5 => values!(i32),
            6 => values!(u32),
            7 => values!(f32),
            9 => values!(f64),
            12 => values!(i64),
            13 => values!(u64),
            _ => return None,
        })
    }
}

/// Adds the MATLAB array or structure in `elements` to `out`; `Ok(None)` where it is cut off.
fn matrix(
    path: &Path,
    mut elements: Elements<'_>,
    field: &str,
    depth: usize,
    out: &mut NamedVectors,
) -> Result<Option<()>, DataError> {
    let mut head = || -> Option<(u8, Vec<f64>, String)> {
        let (_, flags) = elements.required()?;
        let class = *if elements.big_endian { flags.get(3)? } else { flags.first()? };
        let (kind, dimensions) = elements.required()?;
        let dimensions = elements.numbers(kind, dimensions)?;
        let (_, name) = elements.required()?;
        let printable = name.iter().map(|b| char::from(*b)).filter(|c| !c.is_control());
        Some((class, dimensions, printable.collect()))
    };
    let Some((class, dimensions, name)) = head() else { return Ok(None) };
    let name = if field.is_empty() { name } else { field.to_owned() };
    check_cells(path, dimensions.iter().product::<f64>() as u64)?;
    let [rows, columns] = dimensions[..] else { return Ok(Some(())) };
    if NUMERIC_CLASSES.contains(&class) {
        let Some((kind, content)) = elements.required() else { return Ok(None) };
        let Some(values) = elements.numbers(kind, content) else { return Ok(None) };
        if values.len() as f64 != rows * columns {
            return Ok(None);
        }
        out.add(&name, rows as usize, columns as usize, &values);
    } else if class == STRUCT_CLASS && rows * columns == 1.0 && depth < MAX_DEPTH {
        return structure(path, elements, &name, depth, out);
    }
    Ok(Some(()))
}

/// Adds the fields of a MATLAB structure to `out`; `Ok(None)` where it is cut off.
fn structure(
    path: &Path,
    mut elements: Elements<'_>,
    name: &str,
    depth: usize,
    out: &mut NamedVectors,
) -> Result<Option<()>, DataError> {
    let Some((kind, length)) = elements.required() else { return Ok(None) };
    let length = elements.numbers(kind, length).and_then(|v| v.first().copied()).unwrap_or(0.0) as usize;
    let Some((_, names)) = elements.required().filter(|_| length > 0) else { return Ok(None) };
    for field in names.chunks(length) {
        let field: String = field.iter().take_while(|b| **b != 0).map(|b| char::from(*b)).collect();
        let Some((kind, content)) = elements.required() else { return Ok(None) };
        let part = Elements { bytes: content, ..elements };
        if kind == MATRIX
            && !content.is_empty()
            && matrix(path, part, &format!("{name}_{field}"), depth + 1, out)?.is_none()
        {
            return Ok(None);
        }
    }
    Ok(Some(()))
}
