//! Numeric arrays to and from numpy through the buffer protocol.

use pyo3::buffer::{Element, PyBuffer};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

/// Values of a contiguous numeric array of any shape, in row-major order.
pub struct Numbers(Vec<f64>);

impl Numbers {
    /// Returns the values in row-major order.
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

/// Type of number that can be written as bytes.
pub trait Bytes: Copy + Element {
    /// Writes the number to `to` in native byte order.
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

/// Copies values into a new `bytearray`, from which Python makes an array by `numpy.frombuffer`.
pub fn memory<'py, T: Bytes>(py: Python<'py>, values: &[T]) -> PyResult<Bound<'py, PyByteArray>> {
    let size = size_of::<T>();
    PyByteArray::new_with(py, size_of_val(values), |bytes| {
        bytes.chunks_exact_mut(size).zip(values).for_each(|(to, value)| value.put(to));
        Ok(())
    })
}
