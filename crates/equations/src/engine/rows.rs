//! Rows of numbers, one per lane, aligned to cache lines.
//!
//! A vector of the widest instruction set fills a cache line; one that crosses two lines is read and written
//! twice.

use aligned_vec::{AVec, ConstAlign};

/// Bytes of a cache line, and of the widest vector.
const LINE_BYTES: usize = 64;

/// A list that starts on a cache line.
pub(crate) type CacheAligned<T> = AVec<T, ConstAlign<LINE_BYTES>>;

/// Rows of `L` lanes.
pub(crate) type Rows<const L: usize> = CacheAligned<[f64; L]>;

/// A list of `count` equal elements.
pub(crate) fn filled<T: Copy>(count: usize, value: T) -> CacheAligned<T> {
    AVec::from_iter(LINE_BYTES, std::iter::repeat_n(value, count))
}

/// One row, aligned to a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Row<const L: usize>(pub(crate) [f64; L]);
