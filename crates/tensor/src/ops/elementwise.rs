//! Loops shared by the elementwise operations.

use super::Op;
use crate::simd::Level;
use crate::{Scalar, Shape, Tape, TensorError, Var};

/// Runs a plain loop, which the compiler vectorises for the instruction set of this process.
#[inline(always)]
pub(crate) fn vectorised<R>(f: impl FnOnce() -> R) -> R {
    Level::current().vectorised(f)
}

impl<T: Scalar> Tape<T> {
    /// Records a tensor with `f` applied to every element of `a`.
    pub(crate) fn map(&mut self, op: Op, a: Var, f: impl Fn(T) -> T) -> Result<Var, TensorError> {
        let mut out = self.pool.take(self.shape(a).len());
        let x = self.value(a);
        vectorised(|| {
            for (o, x) in out.iter_mut().zip(x) {
                *o = f(*x);
            }
        });
        self.push(op, self.shape(a), self.needs_grad(&[a]), out)
    }

    /// Records a tensor with `f` applied to every pair of elements of `a` and `b`, after broadcasting both.
    pub(crate) fn zip(
        &mut self,
        op: fn(Var, Var) -> Op,
        a: Var,
        b: Var,
        f: impl Fn(T, T) -> T,
    ) -> Result<Var, TensorError> {
        let shape = Shape::broadcast(op(a, b).name(), self.shape(a), self.shape(b))?;
        let a = self.broadcast_to(a, shape)?;
        let b = self.broadcast_to(b, shape)?;
        let mut out = self.pool.take(shape.len());
        let (x, y) = (self.value(a), self.value(b));
        vectorised(|| {
            for ((o, x), y) in out.iter_mut().zip(x).zip(y) {
                *o = f(*x, *y);
            }
        });
        self.push(op(a, b), shape, self.needs_grad(&[a, b]), out)
    }

    /// Adds the gradient of `a`, `grad * f(x)`, where `x` are the values of `argument`.
    pub(crate) fn map_vjp(&mut self, a: Var, argument: Var, grad: &[T], f: impl Fn(T) -> T) {
        let (mut da, fresh) = self.take_grad_to_write(a);
        if da.is_empty() {
            return;
        }
        let x = self.value(argument);
        if fresh {
            vectorised(|| da.iter_mut().zip(grad).zip(x).for_each(|((da, g), x)| *da = *g * f(*x)));
        } else {
            vectorised(|| da.iter_mut().zip(grad).zip(x).for_each(|((da, g), x)| *da += *g * f(*x)));
        }
        self.put_grad(a, da);
    }
}

/// Checks that two shapes are equal.
///
/// # Errors
/// [`TensorError::ShapeMismatch`].
pub(crate) fn same_shape(op: &'static str, left: Shape, right: Shape) -> Result<(), TensorError> {
    if left == right {
        return Ok(());
    }
    Err(TensorError::ShapeMismatch { op, left, right, rule: "the shapes must be equal" })
}
