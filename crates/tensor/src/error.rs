//! Errors of the tensor crate.

use crate::Shape;

/// Errors of recording or differentiating an operation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TensorError {
    /// Two operands have incompatible shapes.
    #[error("{op}: shapes {left} and {right} do not fit: {rule}")]
    ShapeMismatch {
        /// Name of the operation.
        op: &'static str,
        /// Shape of the first operand.
        left: Shape,
        /// Shape of the second operand.
        right: Shape,
        /// Rule of the operation that the shapes break.
        rule: &'static str,
    },
    /// An operand has a shape that the operation does not accept.
    #[error("{op}: shape {shape} is not usable: {rule}")]
    BadShape {
        /// Name of the operation.
        op: &'static str,
        /// Shape of the operand.
        shape: Shape,
        /// Rule of the operation that the shape breaks.
        rule: &'static str,
    },
    /// The number of values given does not match the shape.
    #[error("a tensor of shape {shape} holds {expected} values, but {found} were given")]
    WrongLength {
        /// Declared shape.
        shape: Shape,
        /// Number of elements of that shape.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// More than [`crate::MAX_RANK`] axes.
    #[error("tensors have at most {max} axes, but {found} were given")]
    RankTooHigh {
        /// Largest rank supported.
        max: usize,
        /// Rank given.
        found: usize,
    },
    /// An axis or a range on it lies outside the tensor.
    #[error("{op}: {start}..{end} on axis {axis} is outside shape {shape}")]
    OutOfRange {
        /// Name of the operation.
        op: &'static str,
        /// Shape of the operand.
        shape: Shape,
        /// Axis asked for.
        axis: usize,
        /// Start of the range.
        start: usize,
        /// End of the range, exclusive.
        end: usize,
    },
    /// An operation produced a non-finite value (checked in debug builds, or on request).
    #[error("{op} produced {value} at flat index {index} of its output of shape {shape}")]
    NotFinite {
        /// Name of the operation.
        op: &'static str,
        /// `NaN`, `inf` or `-inf`.
        value: &'static str,
        /// Flat index in the output.
        index: usize,
        /// Shape of the output.
        shape: Shape,
    },
    /// The environment variable `AUGSIM_SIMD` requests an instruction set that this machine does not have.
    #[error("AUGSIM_SIMD={found} is not an instruction set of this machine; set it to one of: {}", available.join(", "))]
    Simd {
        /// Value of the environment variable.
        found: String,
        /// Names of the levels of this machine.
        available: Vec<&'static str>,
    },
}
