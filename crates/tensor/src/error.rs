//! Errors of the tensor crate.

use crate::Shape;

/// Errors of recording or differentiating an operation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TensorError {
    /// Two operands have incompatible shapes.
    #[error("{op}: shapes {left} and {right} do not fit: {rule}")]
    ShapeMismatch {
        /// Name of the operation whose operands do not match.
        op: &'static str,
        /// Shape of the operation's first operand.
        left: Shape,
        /// Shape of the operation's second operand.
        right: Shape,
        /// Rule of the operation that the two shapes break.
        rule: &'static str,
    },
    /// An operand has a shape that the operation does not accept.
    #[error("{op}: shape {shape} is not usable: {rule}")]
    BadShape {
        /// Name of the operation that rejects the shape.
        op: &'static str,
        /// Shape of the rejected operand.
        shape: Shape,
        /// Rule of the operation that the operand's shape breaks.
        rule: &'static str,
    },
    /// The number of values given for a tensor does not match its shape.
    #[error("a tensor of shape {shape} holds {expected} values, but {found} were given")]
    WrongLength {
        /// Declared shape of the tensor.
        shape: Shape,
        /// Number of elements of the declared shape.
        expected: usize,
        /// Number of values given for the tensor.
        found: usize,
    },
    /// A tensor has more than [`crate::MAX_RANK`] axes.
    #[error("tensors have at most {max} axes, but {found} were given")]
    RankTooHigh {
        /// Largest number of axes supported.
        max: usize,
        /// Number of axes given.
        found: usize,
    },
    /// An axis or a range on it lies outside the tensor.
    #[error("{op}: {start}..{end} on axis {axis} is outside shape {shape}")]
    OutOfRange {
        /// Name of the operation that was asked for the axis or range.
        op: &'static str,
        /// Shape of the operand that was asked for the axis or range.
        shape: Shape,
        /// Axis that was asked for.
        axis: usize,
        /// Start of the range that was asked for.
        start: usize,
        /// End of the range that was asked for, exclusive.
        end: usize,
    },
    /// An operation produced a non-finite value (checked in debug builds, or on request).
    #[error("{op} produced {value} at flat index {index} of its output of shape {shape}")]
    NotFinite {
        /// Name of the operation that produced the value.
        op: &'static str,
        /// The non-finite value: `NaN`, `inf` or `-inf`.
        value: &'static str,
        /// Flat index of the non-finite value in the output.
        index: usize,
        /// Shape of the operation's output.
        shape: Shape,
    },
    /// The environment variable `AUGSIM_SIMD` requests an instruction set that this machine does not have.
    #[error("AUGSIM_SIMD={found} is not an instruction set of this machine; set it to one of: {}", available.join(", "))]
    Simd {
        /// Value of the environment variable `AUGSIM_SIMD`.
        found: String,
        /// Names of the instruction sets that this machine has.
        available: Vec<&'static str>,
    },
}
