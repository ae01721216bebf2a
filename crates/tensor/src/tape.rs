//! The tape: records operations on tensors and differentiates a scalar in reverse mode.

use crate::ops::{self, Op};
use crate::pool::{Buffer, Pool};
use crate::{Scalar, Shape, TensorError};

/// Index of a tensor on a [`Tape`]; valid only for the tape that recorded it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Var(u32);

impl Var {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// A position on a [`Tape`], between two recorded tensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mark {
    nodes: usize,
    args: usize,
}

/// A recorded tensor without its values: shape, operation, and whether it needs a gradient.
#[derive(Debug, Clone, Copy)]
struct Node {
    shape: Shape,
    op: Op,
    needs_grad: bool,
}

/// Records operations and differentiates a scalar with respect to every variable (reverse mode).
///
/// Buffers come from a pool inside the tape and go back to it on [`Tape::reset`].
#[derive(Debug)]
pub struct Tape<T> {
    nodes: Vec<Node>,
    values: Vec<Buffer<T>>,
    grads: Vec<Buffer<T>>,
    /// Intermediate results that the forward pass of an operation keeps for its vector-Jacobian product.
    saved: Vec<Buffer<T>>,
    /// Operands of those operations that have a variable number of operands.
    pub(crate) args: Vec<Var>,
    pub(crate) pool: Pool<T>,
    check_finite: bool,
}

impl<T: Scalar> Default for Tape<T> {
    fn default() -> Self {
        Tape {
            nodes: Vec::new(),
            values: Vec::new(),
            grads: Vec::new(),
            saved: Vec::new(),
            args: Vec::new(),
            pool: Pool::default(),
            check_finite: cfg!(debug_assertions),
        }
    }
}

impl<T: Scalar> Tape<T> {
    /// Creates an empty tape.
    ///
    /// In debug builds every operation checks that its output is finite.
    pub fn new() -> Self {
        Self::default()
    }

    /// Turns the check for NaN and infinity after every operation on or off.
    pub fn check_finite(&mut self, on: bool) {
        self.check_finite = on;
    }

    /// Removes all recorded tensors; their buffers go back to the pool.
    pub fn reset(&mut self) {
        self.nodes.clear();
        self.args.clear();
        for buffers in [&mut self.values, &mut self.grads, &mut self.saved] {
            for buffer in buffers.drain(..) {
                self.pool.give(buffer);
            }
        }
    }

    /// Records a constant: no gradient is computed for it.
    ///
    /// # Errors
    /// [`TensorError::WrongLength`] or [`TensorError::RankTooHigh`].
    pub fn constant(&mut self, dims: &[usize], values: &[T]) -> Result<Var, TensorError> {
        self.leaf(dims, values, false)
    }

    /// Records a variable: [`Tape::backward`] computes its gradient.
    ///
    /// # Errors
    /// [`TensorError::WrongLength`] or [`TensorError::RankTooHigh`].
    pub fn variable(&mut self, dims: &[usize], values: &[T]) -> Result<Var, TensorError> {
        self.leaf(dims, values, true)
    }

    fn leaf(&mut self, dims: &[usize], values: &[T], needs_grad: bool) -> Result<Var, TensorError> {
        let shape = Shape::new(dims)?;
        if shape.len() != values.len() {
            let (expected, found) = (shape.len(), values.len());
            return Err(TensorError::WrongLength { shape, expected, found });
        }
        let mut buffer = self.pool.take(values.len());
        buffer.copy_from_slice(values);
        self.push(Op::Leaf, shape, needs_grad, buffer)
    }

    /// Shape of a recorded tensor.
    pub fn shape(&self, v: Var) -> Shape {
        self.nodes[v.index()].shape
    }

    /// The operation that produced the tensor `v`, with its operands.
    pub(crate) fn op(&self, v: Var) -> Op {
        self.nodes[v.index()].op
    }

    /// Name of the operation that produced a tensor: one of [`crate::OPERATIONS`].
    pub fn operation(&self, v: Var) -> &'static str {
        self.nodes[v.index()].op.name()
    }

    /// Values of a recorded tensor, in row-major order.
    pub fn value(&self, v: Var) -> &[T] {
        &self.values[v.index()]
    }

    /// Gradient of a variable, row-major; empty for constants, and before [`Tape::backward`].
    pub fn grad(&self, v: Var) -> &[T] {
        &self.grads[v.index()]
    }

    /// Differentiates `loss`, which must have one element, with respect to every variable.
    ///
    /// Gradients of variables stay until [`Tape::reset`]; those of intermediate results are recycled.
    ///
    /// # Errors
    /// [`TensorError::BadShape`] if `loss` has more or fewer than one element.
    pub fn backward(&mut self, loss: Var) -> Result<(), TensorError> {
        for grad in &mut self.grads {
            grad.fill(T::ZERO);
        }
        self.seed_gradient(loss)?;
        self.sweep(0, loss.index() + 1);
        self.fill_missing_grads();
        Ok(())
    }

    /// Position after the last recorded tensor.
    pub fn mark(&self) -> Mark {
        Mark { nodes: self.nodes.len(), args: self.args.len() }
    }

    /// Differentiates one term of a loss and removes the tensors recorded after `mark`.
    ///
    /// The gradient of `loss` is propagated to the tensors recorded before `mark`, where the gradients of
    /// several terms add up; [`Tape::finish_backward`] then propagates them to the variables. The memory of a
    /// term is reused by the next one, so it stays in cache.
    ///
    /// # Errors
    /// [`TensorError::BadShape`] if `loss` has more or fewer than one element.
    pub fn backward_to(&mut self, mark: Mark, loss: Var) -> Result<(), TensorError> {
        self.seed_gradient(loss)?;
        self.sweep(mark.nodes, self.nodes.len());
        self.nodes.truncate(mark.nodes);
        self.args.truncate(mark.args);
        for buffers in [&mut self.values, &mut self.grads, &mut self.saved] {
            for buffer in buffers.drain(mark.nodes..) {
                self.pool.give(buffer);
            }
        }
        Ok(())
    }

    /// Propagates the gradients that [`Tape::backward_to`] has accumulated to every variable.
    pub fn finish_backward(&mut self) {
        self.sweep(0, self.nodes.len());
        self.fill_missing_grads();
    }

    /// Sets the gradient of `loss` with respect to itself to 1.
    fn seed_gradient(&mut self, loss: Var) -> Result<(), TensorError> {
        let shape = self.shape(loss);
        if shape.len() != 1 {
            let rule = "only a tensor of one element can be differentiated";
            return Err(TensorError::BadShape { op: "backward", shape, rule });
        }
        self.accumulate(loss, |grad, _| grad[0] += T::ONE);
        Ok(())
    }

    /// Propagates the gradients of the recorded tensors `first..end` to their operands, the last tensor first.
    fn sweep(&mut self, first: usize, end: usize) {
        for i in (first..end).rev() {
            if matches!(self.nodes[i].op, Op::Leaf) || self.grads[i].is_empty() {
                continue;
            }
            // The gradient of this node is complete: all nodes that use it come later on the tape and have
            // been processed. Its buffer can be recycled after this step.
            let grad = std::mem::take(&mut self.grads[i]);
            ops::vjp(self, self.nodes[i].op, Var(i as u32), &grad);
            self.pool.give(grad);
        }
    }

    /// Sets the gradients of variables on which the loss does not depend to zero.
    fn fill_missing_grads(&mut self) {
        for (node, grad) in self.nodes.iter().zip(&mut self.grads) {
            if node.needs_grad && matches!(node.op, Op::Leaf) && grad.is_empty() {
                *grad = self.pool.take_zeroed(node.shape.len());
            }
        }
    }

    /// Appends a recorded tensor with its values to the tape.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub(crate) fn push(
        &mut self,
        op: Op,
        shape: Shape,
        needs_grad: bool,
        value: Buffer<T>,
    ) -> Result<Var, TensorError> {
        if self.check_finite
            && let Some(index) = value.iter().position(|v| !v.is_finite())
        {
            let v = value[index].to_f64();
            let value = match v {
                _ if v.is_nan() => "NaN",
                _ if v > 0.0 => "inf",
                _ => "-inf",
            };
            return Err(TensorError::NotFinite { op: op.name(), value, index, shape });
        }
        self.nodes.push(Node { shape, op, needs_grad });
        self.values.push(value);
        self.grads.push(Buffer::default());
        self.saved.push(Buffer::default());
        Ok(Var((self.nodes.len() - 1) as u32))
    }

    /// Stores an intermediate result of the operation that produced `v`, for its vector-Jacobian product.
    pub(crate) fn save(&mut self, v: Var, buffer: Buffer<T>) {
        self.saved[v.index()] = buffer;
    }

    /// Intermediate result that [`Tape::save`] stored for `v`.
    pub(crate) fn saved(&self, v: Var) -> &[T] {
        &self.saved[v.index()]
    }

    /// Whether any of the operands depends on a variable.
    pub(crate) fn needs_grad(&self, vars: &[Var]) -> bool {
        vars.iter().any(|v| self.nodes[v.index()].needs_grad)
    }

    /// Takes the gradient buffer of `v` off the tape, to add to it; empty if `v` needs no gradient.
    pub(crate) fn take_grad(&mut self, v: Var) -> Buffer<T> {
        let i = v.index();
        if !self.nodes[i].needs_grad {
            return Buffer::default();
        }
        let grad = std::mem::take(&mut self.grads[i]);
        if grad.is_empty() { self.pool.take_zeroed(self.nodes[i].shape.len()) } else { grad }
    }

    /// Takes the gradient buffer of `v` off the tape, for a kernel that writes every element.
    ///
    /// Returns `(buffer, fresh)`: a `fresh` buffer is undefined and must be overwritten, another must be
    /// added to. The buffer is empty if `v` needs no gradient.
    pub(crate) fn take_grad_to_write(&mut self, v: Var) -> (Buffer<T>, bool) {
        let i = v.index();
        if !self.nodes[i].needs_grad {
            return (Buffer::default(), false);
        }
        let grad = std::mem::take(&mut self.grads[i]);
        if grad.is_empty() { (self.pool.take(self.nodes[i].shape.len()), true) } else { (grad, false) }
    }

    /// Puts the gradient buffer of `v` back on the tape.
    ///
    /// If an operand occurs twice in one operation (tied weights), two buffers have been taken; they are
    /// added.
    pub(crate) fn put_grad(&mut self, v: Var, grad: Buffer<T>) {
        let slot = &mut self.grads[v.index()];
        if slot.is_empty() {
            *slot = grad;
            return;
        }
        slot.iter_mut().zip(grad.iter()).for_each(|(s, g)| *s += *g);
        self.pool.give(grad);
    }

    /// Calls `f(gradient, fresh, tape)` with the gradient of `v`, if `v` needs one.
    ///
    /// `f` overwrites every element of a `fresh` gradient, and adds to another.
    pub(crate) fn contribute(&mut self, v: Var, f: impl FnOnce(&mut [T], bool, &Tape<T>)) {
        if self.nodes[v.index()].needs_grad {
            let (mut grad, fresh) = self.take_grad_to_write(v);
            f(&mut grad, fresh, self);
            self.put_grad(v, grad);
        }
    }

    /// Calls `f(gradient, tape)`, which adds to the gradient of `v`, if `v` needs one.
    pub(crate) fn accumulate(&mut self, v: Var, f: impl FnOnce(&mut [T], &Tape<T>)) {
        if self.nodes[v.index()].needs_grad {
            let mut grad = self.take_grad(v);
            f(&mut grad, self);
            self.put_grad(v, grad);
        }
    }

    /// Takes a gradient buffer as [`Tape::take_grad`], for kernels that need a buffer for every operand.
    ///
    /// Returns `(buffer, wanted)`. If `v` needs no gradient the buffer is scratch memory filled with zeros.
    pub(crate) fn take_grad_or_scratch(&mut self, v: Var) -> (Buffer<T>, bool) {
        let wanted = self.nodes[v.index()].needs_grad;
        let grad = if wanted { self.take_grad(v) } else { self.pool.take_zeroed(self.shape(v).len()) };
        (grad, wanted)
    }

    /// Takes a buffer as [`Tape::take_grad_to_write`], for kernels that need a buffer for every operand.
    ///
    /// Returns `(buffer, fresh, wanted)`. If `v` needs no gradient the buffer is `fresh` scratch memory.
    pub(crate) fn take_grad_or_scratch_to_write(&mut self, v: Var) -> (Buffer<T>, bool, bool) {
        if self.nodes[v.index()].needs_grad {
            let (grad, fresh) = self.take_grad_to_write(v);
            return (grad, fresh, true);
        }
        (self.pool.take(self.shape(v).len()), true, false)
    }

    /// Puts back a buffer of [`Tape::take_grad_or_scratch`], or recycles it if it was scratch memory.
    pub(crate) fn put_grad_or_scratch(&mut self, v: Var, grad: Buffer<T>, wanted: bool) {
        if wanted {
            self.put_grad(v, grad);
        } else {
            self.pool.give(grad);
        }
    }
}
