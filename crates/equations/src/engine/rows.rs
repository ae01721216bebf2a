//! Rows of numbers, one number per lane (simulated window), aligned to cache lines.
//!
//! A vector of the widest instruction set fills a cache line; one that crosses two lines is read and written
//! twice.

use aligned_vec::{AVec, ConstAlign};

/// Size of a cache line and of the widest vector, bytes.
const LINE_BYTES: usize = 64;

/// A list of numbers or rows that starts on a cache line.
pub(crate) type CacheAligned<T> = AVec<T, ConstAlign<LINE_BYTES>>;

/// A list of rows with one number per lane, `L` lanes wide.
pub(crate) type Rows<const L: usize> = CacheAligned<[f64; L]>;

/// Creates a list of `count` equal elements.
pub(crate) fn filled<T: Copy>(count: usize, value: T) -> CacheAligned<T> {
    AVec::from_iter(LINE_BYTES, std::iter::repeat_n(value, count))
}

/// One row with a number per lane, aligned to a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Row<const L: usize>(pub(crate) [f64; L]);
