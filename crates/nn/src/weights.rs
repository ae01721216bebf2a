//! Import and export of weights as safetensors files, with PyTorch's names and layouts.

use crate::Params;
use augsim_tensor::Scalar;
use safetensors::SafeTensorError;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::path::{Path, PathBuf};

/// Errors of importing or exporting weights.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// The weights file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the weights file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The parameters cannot be encoded as safetensors.
    #[error("the weights cannot be written as safetensors: {source}")]
    Encode {
        /// Error of the safetensors writer.
        source: SafeTensorError,
    },
    /// The file is no valid safetensors file.
    #[error("{}: not a usable safetensors file: {}", path.display(), escape_control_characters(&source.to_string(), MAX_REASON_CHARS))]
    Format {
        /// Path of the weights file.
        path: PathBuf,
        /// Error of the safetensors reader.
        source: SafeTensorError,
    },
    /// A parameter of the net is missing in the file.
    #[error("{}: parameter `{name}` is missing; the file holds {}", path.display(), list_names(available))]
    Missing {
        /// Path of the weights file.
        path: PathBuf,
        /// Name of the missing parameter.
        name: String,
        /// Names of the tensors in the file, in alphabetical order.
        available: Vec<String>,
    },
    /// A tensor of the file is not a parameter of the net.
    #[error("{}: tensor `{}` does not belong to this net", path.display(), escape_control_characters(name, MAX_NAME_CHARS))]
    Unknown {
        /// Path of the weights file.
        path: PathBuf,
        /// Name of the unknown tensor.
        name: String,
    },
    /// A tensor differs from the parameter in its extents, or has an unsupported element type.
    #[error("{}: `{name}` is {found:?} of {dtype:?}, but the net needs {expected:?} of F32 or F64", path.display())]
    Mismatch {
        /// Path of the weights file.
        path: PathBuf,
        /// Name of the parameter that does not match.
        name: String,
        /// Extents of the tensor in the file.
        found: Vec<usize>,
        /// Element type of the tensor in the file.
        dtype: Dtype,
        /// Extents that the net's parameter has.
        expected: Vec<usize>,
    },
}

/// Maximum number of characters of a tensor name in an error message.
const MAX_NAME_CHARS: usize = 60;
/// Maximum number of characters of the safetensors reader's error in an error message.
const MAX_REASON_CHARS: usize = 300;
/// Maximum number of tensor names in an error message.
const MAX_LISTED_NAMES: usize = 20;

/// Returns the first `max_chars` characters of a text from a file, with control characters escaped.
fn escape_control_characters(text: &str, max_chars: usize) -> String {
    let mut out = String::new();
    for c in text.chars().take(max_chars) {
        if c.is_control() { out.extend(c.escape_unicode()) } else { out.push(c) }
    }
    out
}

/// Joins the first names of a list for an error message.
fn list_names(names: &[String]) -> String {
    let first: Vec<String> =
        names.iter().take(MAX_LISTED_NAMES).map(|n| escape_control_characters(n, MAX_NAME_CHARS)).collect();
    first.join(", ")
}

/// Encodes all parameters as the bytes of a safetensors file of 32-bit floats.
///
/// # Errors
/// [`WeightsError::Encode`].
pub fn encode<T: Scalar>(params: &Params<T>) -> Result<Vec<u8>, WeightsError> {
    let failed = |source: SafeTensorError| WeightsError::Encode { source };
    let bytes: Vec<(String, Vec<usize>, Vec<u8>)> = params
        .iter()
        .map(|(name, dims, values)| {
            let data = values.iter().flat_map(|v| (v.to_f64() as f32).to_le_bytes()).collect();
            (name.to_owned(), dims.to_vec(), data)
        })
        .collect();
    let views = bytes
        .iter()
        .map(|(name, dims, data)| Ok((name, TensorView::new(Dtype::F32, dims.clone(), data)?)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(failed)?;
    safetensors::serialize(views, None).map_err(failed)
}

/// Reads all parameters from a safetensors file of 32- or 64-bit floats.
///
/// Names and extents must match exactly.
///
/// # Errors
/// [`WeightsError`] with the name of the tensor; the parameters are then unchanged.
pub fn import<T: Scalar>(path: &Path, params: &mut Params<T>) -> Result<(), WeightsError> {
    let bytes = std::fs::read(path).map_err(|source| WeightsError::Io { path: path.to_owned(), source })?;
    let file = SafeTensors::deserialize(&bytes)
        .map_err(|source| WeightsError::Format { path: path.to_owned(), source })?;
    let mut imported = params.clone();
    // The reader keeps names in a hash map, on whose order messages must not depend.
    let mut names_in_file = file.names();
    names_in_file.sort_unstable();
    for &name in &names_in_file {
        if imported.get_mut(name).is_none() {
            return Err(WeightsError::Unknown { path: path.to_owned(), name: name.to_owned() });
        }
    }
    let names: Vec<String> = params.iter().map(|(name, ..)| name.to_owned()).collect();
    for name in names {
        let Ok(view) = file.tensor(&name) else {
            let available = names_in_file.iter().map(|name| (*name).to_owned()).collect();
            return Err(WeightsError::Missing { path: path.to_owned(), name, available });
        };
        let Some((dims, values)) = imported.get_mut(&name) else { continue };
        let decoded: Option<Vec<f64>> = match view.dtype() {
            Dtype::F32 => {
                let (chunks, _) = view.data().as_chunks::<4>();
                Some(chunks.iter().map(|c| f64::from(f32::from_le_bytes(*c))).collect())
            }
            Dtype::F64 => {
                let (chunks, _) = view.data().as_chunks::<8>();
                Some(chunks.iter().map(|c| f64::from_le_bytes(*c)).collect())
            }
            _ => None,
        };
        match decoded {
            Some(data) if view.shape() == dims => {
                values.iter_mut().zip(data).for_each(|(v, d)| *v = T::from_f64(d));
            }
            _ => {
                return Err(WeightsError::Mismatch {
                    path: path.to_owned(),
                    found: view.shape().to_vec(),
                    dtype: view.dtype(),
                    expected: dims.to_vec(),
                    name,
                });
            }
        }
    }
    *params = imported;
    Ok(())
}
