//! Random mutations of bytes; some change whole numbers, words or lines of text files.

use crate::limits::MAX_INPUT_BYTES;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::Range;

/// Texts of numbers that often break parsers or arithmetic, inserted by mutations.
const NUMBERS: [&str; 22] = [
    "0",
    "-0",
    "-1",
    "1e308",
    "-1e308",
    "1e309",
    "1e155",
    "1e-320",
    "5e-324",
    "nan",
    "NaN",
    "inf",
    "-Infinity",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551615",
    "4294967296",
    "2147483648",
    "65536",
    "0,5",
    "1_000",
    "0x10",
];

/// Words with a meaning in some file formats, and characters with a meaning for terminals and text tools.
const WORDS: [&str; 30] = [
    "trajectory",
    "t_s",
    "height_m",
    "group",
    "nominal",
    "min",
    "max",
    "frozen",
    "per = \"group\"",
    "[[effect]]",
    "kind",
    "scenario = \"push\"",
    "true",
    "null",
    "\u{a0}",
    "\u{1b}[31m",
    "\u{feff}",
    "\u{202e}",
    "\"",
    "\"\"",
    ",",
    ";",
    "\t",
    "\r\n",
    "\n\n",
    "[",
    "{",
    "(",
    "|S9223372036854775807",
    "<f8",
];

/// Integers at the limits of their widths (8, 16, 32, 64 bits), inserted by mutations.
const BOUNDARY_INTEGERS: [u64; 12] =
    [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 1 << 40, i64::MAX as u64, u64::MAX];

/// Returns `bytes` after one to six random changes.
///
/// `donor` is a file of the same format, parts of which may be inserted.
pub fn mutate(rng: &mut Xoshiro256PlusPlus, bytes: &[u8], donor: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    let changes = 1 + (rng.random_range(0..4u32) * rng.random_range(0..3u32)).min(5);
    for _ in 0..changes {
        change(rng, &mut out, donor);
        out.truncate(MAX_INPUT_BYTES);
    }
    out
}

/// Makes one random change to `out`; parts of `donor` may be inserted.
fn change(rng: &mut Xoshiro256PlusPlus, out: &mut Vec<u8>, donor: &[u8]) {
    match rng.random_range(0..15u32) {
        0 => {
            if let Some(position) = random_position(rng, out) {
                out[position] ^= 1 << rng.random_range(0..8u32);
            }
        }
        1 => {
            if let Some(position) = random_position(rng, out) {
                out[position] = rng.random();
            }
        }
        2 => overwrite_number(rng, out),
        3 => drop(out.drain(range(rng, out.len()))),
        4 => {
            let piece = out[range(rng, out.len())].to_vec();
            insert(rng, out, &piece);
        }
        5 => {
            // Repetition makes deep nesting and long rows.
            let piece = out[range(rng, out.len().min(64))].to_vec();
            let times = 1 << rng.random_range(0..12u32);
            insert(rng, out, &piece.repeat(times.min(MAX_INPUT_BYTES / piece.len().max(1))));
        }
        6 => {
            let piece = donor[range(rng, donor.len())].to_vec();
            insert(rng, out, &piece);
        }
        7 => {
            let end = rng.random_range(0..=out.len());
            out.truncate(end);
        }
        8 | 9 => replace_token(rng, out, |b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+'), &NUMBERS),
        10 => replace_token(rng, out, |b| b.is_ascii_alphanumeric() || b == b'_', &WORDS),
        11 => {
            let word = WORDS[rng.random_range(0..WORDS.len())].as_bytes();
            insert(rng, out, word);
        }
        12 => {
            let line = line(rng, out);
            out.drain(line);
        }
        13 => {
            let line = out[line(rng, out)].to_vec();
            insert(rng, out, &line);
        }
        _ => {
            let bracket = b"[{(\"<"[rng.random_range(0..5usize)];
            let deep = vec![bracket; 1 << rng.random_range(0..14u32)];
            insert(rng, out, &deep);
        }
    }
}

/// Draws a random position within `bytes`; `None` if there are no bytes.
fn random_position(rng: &mut Xoshiro256PlusPlus, bytes: &[u8]) -> Option<usize> {
    (!bytes.is_empty()).then(|| rng.random_range(0..bytes.len()))
}

/// Draws a random range within `0..len`; short ranges are more frequent.
fn range(rng: &mut Xoshiro256PlusPlus, len: usize) -> Range<usize> {
    let start = rng.random_range(0..=len);
    let longest = (len - start).min(1 << rng.random_range(0..14u32));
    start..start + rng.random_range(0..=longest)
}

/// Inserts the bytes `piece` at a random position.
fn insert(rng: &mut Xoshiro256PlusPlus, out: &mut Vec<u8>, piece: &[u8]) {
    let position = rng.random_range(0..=out.len());
    out.splice(position..position, piece.iter().copied());
}

/// Overwrites 1, 2, 4 or 8 bytes at a random position with a boundary integer.
fn overwrite_number(rng: &mut Xoshiro256PlusPlus, out: &mut [u8]) {
    let width = 1 << rng.random_range(0..4u32);
    if out.len() < width {
        return;
    }
    let position = rng.random_range(0..=out.len() - width);
    let value = BOUNDARY_INTEGERS[rng.random_range(0..BOUNDARY_INTEGERS.len())];
    let bytes =
        if rng.random() { value.to_le_bytes() } else { value.rotate_right(8 * width as u32).to_be_bytes() };
    out[position..position + width].copy_from_slice(&bytes[..width]);
}

/// Replaces the first token after a random position, a run of bytes of class `kind`, by one of `by`.
fn replace_token(rng: &mut Xoshiro256PlusPlus, out: &mut Vec<u8>, kind: impl Fn(u8) -> bool, by: &[&str]) {
    let from = rng.random_range(0..=out.len());
    let Some(start) = out[from..].iter().position(|b| kind(*b)).map(|k| from + k) else { return };
    let end = out[start..].iter().position(|b| !kind(*b)).map_or(out.len(), |k| start + k);
    let token = by[rng.random_range(0..by.len())];
    out.splice(start..end, token.bytes());
}

/// Range of the line around a random position, with its line end.
fn line(rng: &mut Xoshiro256PlusPlus, bytes: &[u8]) -> Range<usize> {
    let position = rng.random_range(0..=bytes.len());
    let start = bytes[..position].iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
    let end = bytes[position..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |k| position + k + 1);
    start..end
}
