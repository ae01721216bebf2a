//! A pool of recycled buffers: recording the same shapes again allocates nothing.

use std::ops::{Deref, DerefMut};

/// Alignment of a buffer in bytes: a cache line, which is also the widest vector.
///
/// A vector that crosses a cache line costs two memory accesses.
const ALIGNMENT: usize = 64;

/// A buffer whose memory starts at a cache line.
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
        // If no aligned offset is found the buffer is correct all the same, only slower.
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

/// A pool of free buffers, found by their exact length.
#[derive(Debug, Default)]
pub(crate) struct Pool<T> {
    /// Free buffers as `(length, buffers of that length)`, sorted by length.
    free: Vec<(usize, Vec<Buffer<T>>)>,
}

impl<T: Copy + Default> Pool<T> {
    /// Takes a buffer of `len` elements with undefined contents from the pool.
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

    /// Takes a buffer of `len` zeros from the pool.
    pub(crate) fn take_zeroed(&mut self, len: usize) -> Buffer<T> {
        let mut buffer = self.take(len);
        buffer.fill(T::default());
        buffer
    }

    /// Returns a buffer to the pool.
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
