//! Rows of numbers, one for each lane, on cache lines: a vector of the widest instruction set fills a line, and one that lies across
//! two lines is read and written twice.

use aligned_vec::{AVec, ConstAlign};

/// Bytes of a cache line, and of the widest vector.
const LINE: usize = 64;

/// A list that begins on a cache line.
pub(crate) type OnLines<T> = AVec<T, ConstAlign<LINE>>;

/// Rows of `L` lanes.
pub(crate) type Rows<const L: usize> = OnLines<[f64; L]>;

/// So many equal elements.
pub(crate) fn filled<T: Copy>(count: usize, value: T) -> OnLines<T> {
    AVec::from_iter(LINE, std::iter::repeat_n(value, count))
}

/// One row.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Row<const L: usize>(pub(crate) [f64; L]);
