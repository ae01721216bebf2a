//! Recycled buffers: a tape that records the same shapes again allocates nothing.

use std::ops::{Deref, DerefMut};

/// Bytes that a buffer starts on: a cache line, and the widest vector. A vector that crosses a line costs
/// two accesses.
const ALIGNMENT: usize = 64;

/// Values on a cache line boundary.
#[derive(Debug)]
pub(crate) struct Buffer<T> {
    memory: Vec<T>,
    start: usize,
    len: usize,
}

impl<T> Default for Buffer<T> {
    fn default() -> Self {
        Buffer { memory: Vec::new(), start: 0, len: 0 }
    }
}

impl<T: Copy + Default> Buffer<T> {
    fn new(len: usize) -> Self {
        let spare = ALIGNMENT / size_of::<T>();
        let memory = vec![T::default(); len + spare];
        // An offset that cannot be had costs speed and nothing else.
        let start = memory.as_ptr().align_offset(ALIGNMENT).min(spare);
        Buffer { memory, start, len }
    }
}

impl<T> Deref for Buffer<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.memory[self.start..self.start + self.len]
    }
}

impl<T> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.memory[self.start..self.start + self.len]
    }
}

/// Free buffers, kept by their exact length.
#[derive(Debug, Default)]
pub(crate) struct Pool<T> {
    /// `(length, buffers of that length)`, sorted by length.
    free: Vec<(usize, Vec<Buffer<T>>)>,
}

impl<T: Copy + Default> Pool<T> {
    /// A buffer of `len` elements whose contents are arbitrary (left by an earlier use).
    pub(crate) fn take(&mut self, len: usize) -> Buffer<T> {
        if len == 0 {
            return Buffer::default();
        }
        if let Ok(i) = self.free.binary_search_by_key(&len, |e| e.0)
            && let Some(buffer) = self.free[i].1.pop()
        {
            return buffer;
        }
        Buffer::new(len)
    }

    /// A buffer of `len` zeros.
    pub(crate) fn take_zeroed(&mut self, len: usize) -> Buffer<T> {
        let mut buffer = self.take(len);
        buffer.fill(T::default());
        buffer
    }

    /// Hands a buffer back.
    pub(crate) fn give(&mut self, buffer: Buffer<T>) {
        if buffer.is_empty() {
            return;
        }
        let len = buffer.len();
        match self.free.binary_search_by_key(&len, |e| e.0) {
            Ok(i) => self.free[i].1.push(buffer),
            Err(i) => self.free.insert(i, (len, vec![buffer])),
        }
    }
}
