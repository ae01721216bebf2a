//! Numbers in from and out to numpy, by the buffer protocol.

use pyo3::buffer::{Element, PyBuffer};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

/// Numbers of a contiguous array of any shape, in the order of its rows.
pub struct Numbers(Vec<f64>);

impl Numbers {
    /// The numbers.
    pub fn into_vec(self) -> Vec<f64> {
        self.0
    }
}

impl<'py> FromPyObject<'_, 'py> for Numbers {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let py = object.py();
        PyBuffer::<f64>::get(&object)?.to_vec(py).map(Numbers)
    }
}

/// A number with bytes.
pub trait Bytes: Copy + Element {
    /// Writes it where an array of numpy's reads it.
    fn put(self, to: &mut [u8]);
}

impl Bytes for f64 {
    fn put(self, to: &mut [u8]) {
        to.copy_from_slice(&self.to_ne_bytes());
    }
}

impl Bytes for f32 {
    fn put(self, to: &mut [u8]) {
        to.copy_from_slice(&self.to_ne_bytes());
    }
}

/// Memory of the interpreter's that holds these numbers, for `numpy.frombuffer`.
pub fn memory<'py, T: Bytes>(py: Python<'py>, values: &[T]) -> PyResult<Bound<'py, PyByteArray>> {
    let size = size_of::<T>();
    PyByteArray::new_with(py, size_of_val(values), |bytes| {
        bytes.chunks_exact_mut(size).zip(values).for_each(|(to, value)| value.put(to));
        Ok(())
    })
}
