//! Shapes of tensors with at most four axes, stored inline.

use crate::TensorError;

/// Largest number of axes of a tensor.
pub const MAX_RANK: usize = 4;

/// The extents of a tensor along its axes, row-major: the last axis is contiguous.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shape {
    dims: [usize; MAX_RANK],
    rank: usize,
}

impl Shape {
    /// The shape of a scalar: no axes, one element.
    pub const SCALAR: Shape = Shape { dims: [1; MAX_RANK], rank: 0 };

    /// Creates a shape from its extents.
    ///
    /// # Errors
    /// [`TensorError::RankTooHigh`] for more than [`MAX_RANK`] axes.
    pub fn new(dims: &[usize]) -> Result<Self, TensorError> {
        if dims.len() > MAX_RANK {
            return Err(TensorError::RankTooHigh { max: MAX_RANK, found: dims.len() });
        }
        let mut out = Shape { dims: [1; MAX_RANK], rank: dims.len() };
        out.dims[..dims.len()].copy_from_slice(dims);
        Ok(out)
    }

    /// Extents of the tensor along its axes.
    pub fn dims(&self) -> &[usize] {
        &self.dims[..self.rank]
    }

    /// Number of axes of the tensor.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Number of elements of the tensor.
    pub fn len(&self) -> usize {
        self.dims().iter().product()
    }

    /// Whether the tensor has no elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Splits the extents at `axis`: elements before it, its extent, and elements after it.
    ///
    /// These are the bounds of the three nested loops of an operation along one axis.
    pub(crate) fn split_at_axis(&self, axis: usize) -> (usize, usize, usize) {
        let d = self.dims();
        (d[..axis].iter().product(), d[axis], d[axis + 1..].iter().product())
    }

    /// Returns the shape with another extent on `axis`.
    pub(crate) fn with(mut self, axis: usize, extent: usize) -> Self {
        self.dims[axis] = extent;
        self
    }

    /// Returns the extents `(time, feature, batch)` of a sequence.
    ///
    /// # Errors
    /// [`TensorError::BadShape`] unless there are three axes.
    pub(crate) fn sequence(&self, op: &'static str) -> Result<(usize, usize, usize), TensorError> {
        match *self.dims() {
            [t, f, b] => Ok((t, f, b)),
            _ => {
                Err(TensorError::BadShape { op, shape: *self, rule: "a sequence is [time, feature, batch]" })
            }
        }
    }

    /// Shape to which two operands broadcast, by NumPy's rule: axes are aligned at the last one.
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if two aligned extents differ and neither is 1.
    pub(crate) fn broadcast(op: &'static str, a: Shape, b: Shape) -> Result<Shape, TensorError> {
        let rank = a.rank.max(b.rank);
        let mut out = Shape { dims: [1; MAX_RANK], rank };
        let extent = |s: &Shape, i: usize| if i + s.rank >= rank { s.dims[i + s.rank - rank] } else { 1 };
        for i in 0..rank {
            let (x, y) = (extent(&a, i), extent(&b, i));
            out.dims[i] = match (x, y) {
                _ if x == y => x,
                (1, _) => y,
                (_, 1) => x,
                _ => {
                    let rule = "extents must be equal or 1, aligned at the last axis";
                    return Err(TensorError::ShapeMismatch { op, left: a, right: b, rule });
                }
            };
        }
        Ok(out)
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.dims())
    }
}

impl std::fmt::Debug for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.dims())
    }
}
