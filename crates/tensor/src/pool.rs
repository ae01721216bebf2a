//! Recycled buffers: a tape that records the same shapes again allocates nothing.

/// Free buffers, kept by their exact length.
#[derive(Debug, Default)]
pub(crate) struct Pool<T> {
    /// `(length, buffers of that length)`, sorted by length.
    free: Vec<(usize, Vec<Vec<T>>)>,
}

impl<T: Copy + Default> Pool<T> {
    /// A buffer of `len` elements whose contents are arbitrary (left by an earlier use).
    pub(crate) fn take(&mut self, len: usize) -> Vec<T> {
        if let Ok(i) = self.free.binary_search_by_key(&len, |e| e.0)
            && let Some(buffer) = self.free[i].1.pop()
        {
            return buffer;
        }
        vec![T::default(); len]
    }

    /// A buffer of `len` zeros.
    pub(crate) fn take_zeroed(&mut self, len: usize) -> Vec<T> {
        let mut buffer = self.take(len);
        buffer.fill(T::default());
        buffer
    }

    /// Hands a buffer back.
    pub(crate) fn give(&mut self, buffer: Vec<T>) {
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
