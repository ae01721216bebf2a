//! Weights to and from safetensors files, under PyTorch's names and layouts.

use crate::Params;
use augsim_tensor::Scalar;
use safetensors::SafeTensorError;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::path::{Path, PathBuf};

/// Why weights could not be exchanged.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The parameters make no safetensors file.
    #[error("the weights cannot be written as safetensors: {source}")]
    Encode {
        /// Error of the safetensors writer.
        source: SafeTensorError,
    },
    /// Not a safetensors file.
    #[error("{}: not a usable safetensors file: {}", path.display(), printable(&source.to_string(), MOST_OF_A_REASON))]
    Format {
        /// The file.
        path: PathBuf,
        /// Error of the safetensors reader.
        source: SafeTensorError,
    },
    /// A parameter of the net is not in the file.
    #[error("{}: parameter `{name}` is missing; the file holds {}", path.display(), listed(available))]
    Missing {
        /// The file.
        path: PathBuf,
        /// The parameter.
        name: String,
        /// Names in the file, in the order of the alphabet.
        available: Vec<String>,
    },
    /// A tensor of the file does not belong to the net.
    #[error("{}: tensor `{}` does not belong to this net", path.display(), printable(name, MOST_OF_A_NAME))]
    Unknown {
        /// The file.
        path: PathBuf,
        /// The tensor.
        name: String,
    },
    /// A tensor has other extents or another element type than the parameter.
    #[error("{}: `{name}` is {found:?} of {dtype:?}, but the net needs {expected:?} of F32 or F64", path.display())]
    Mismatch {
        /// The file.
        path: PathBuf,
        /// The parameter.
        name: String,
        /// Extents in the file.
        found: Vec<usize>,
        /// Element type in the file.
        dtype: Dtype,
        /// Extents that the net needs.
        expected: Vec<usize>,
    },
}

/// Characters of a name, and of a sentence of the reader's, that a message has room for.
const MOST_OF_A_NAME: usize = 60;
const MOST_OF_A_REASON: usize = 300;
/// Names of a list that a message has room for.
const MOST_NAMES: usize = 20;

/// The first `most` characters of a text from a file, those that a terminal would obey written out.
fn printable(text: &str, most: usize) -> String {
    let mut out = String::new();
    for c in text.chars().take(most) {
        if c.is_control() { out.extend(c.escape_unicode()) } else { out.push(c) }
    }
    out
}

/// The first names of a list, as a message has room for them.
fn listed(names: &[String]) -> String {
    let first: Vec<String> = names.iter().take(MOST_NAMES).map(|n| printable(n, MOST_OF_A_NAME)).collect();
    first.join(", ")
}

/// The bytes of a safetensors file of all parameters, as 32-bit floats.
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

/// Reads all parameters from 32- or 64-bit floats. Names and extents must match exactly.
///
/// # Errors
/// [`WeightsError`] naming the tensor; the parameters are unchanged then.
pub fn import<T: Scalar>(path: &Path, params: &mut Params<T>) -> Result<(), WeightsError> {
    let bytes = std::fs::read(path).map_err(|source| WeightsError::Io { path: path.to_owned(), source })?;
    let file = SafeTensors::deserialize(&bytes)
        .map_err(|source| WeightsError::Format { path: path.to_owned(), source })?;
    let mut fresh = params.clone();
    // The reader keeps names in a hash map; messages must not depend on its order.
    let mut found = file.names();
    found.sort_unstable();
    for &name in &found {
        if fresh.get_mut(name).is_none() {
            return Err(WeightsError::Unknown { path: path.to_owned(), name: name.to_owned() });
        }
    }
    let names: Vec<String> = params.iter().map(|(name, ..)| name.to_owned()).collect();
    for name in names {
        let Ok(view) = file.tensor(&name) else {
            let available = found.iter().map(|name| (*name).to_owned()).collect();
            return Err(WeightsError::Missing { path: path.to_owned(), name, available });
        };
        let Some((dims, values)) = fresh.get_mut(&name) else { continue };
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
                values.iter_mut().zip(data).for_each(|(v, d)| *v = T::of(d));
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
    *params = fresh;
    Ok(())
}
