//! The element types `f32` and `f64`, and the functions and kernels that each of them uses.

use crate::kernels::{self, GruBackward, GruForward, LinearBackward, LinearForward};
use std::fmt::{Debug, Display};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// Element type of a tensor: `f32` for training, `f64` for gradient checks.
///
/// `f64` uses the reference kernels and the functions of the standard library; `f32` uses the SIMD kernels
/// and the branch-free approximations of [`crate::kernels::activation`].
pub trait Scalar:
    Copy
    + Default
    + PartialOrd
    + Debug
    + Display
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + Sum
{
    /// Additive identity, 0.
    const ZERO: Self;
    /// Multiplicative identity, 1.
    const ONE: Self;
    /// Converts `x` to the nearest value of this type.
    fn from_f64(x: f64) -> Self;
    /// Converts the value to double precision.
    fn to_f64(self) -> f64;
    /// Whether the value is neither NaN nor infinite.
    fn is_finite(self) -> bool;
    /// Exponential function of the value.
    fn exp(self) -> Self;
    /// Natural logarithm of the value.
    fn ln(self) -> Self;
    /// Square root of the value.
    fn sqrt(self) -> Self;
    /// Hyperbolic tangent of the value.
    fn tanh(self) -> Self;
    /// Logistic function 1 / (1 + exp(-x)) of the value.
    fn sigmoid(self) -> Self;
    /// Softplus ln(1 + exp(x)) of the value, without overflow.
    fn softplus(self) -> Self;
    /// Matrix product `out (m x n) = a (m x k) b (k x n)`, or `out += a b` if `accumulate`.
    fn matmul(dims: kernels::MatmulDims, a: &[Self], b: &[Self], out: &mut [Self], accumulate: bool);
    /// Runs one GRU layer over a sequence: [`crate::kernels::gru_reference::forward`] or the SIMD kernel.
    fn gru_forward(args: GruForward<'_, Self>, scratch: &mut [Self]);
    /// Computes the vector-Jacobian product of [`Scalar::gru_forward`].
    fn gru_backward(args: GruBackward<'_, Self>, scratch: &mut [Self]);
    /// Number of scratch elements that the two GRU kernels need for a layer.
    fn gru_scratch(input: usize, hidden: usize) -> usize;
    /// Softplus `y = ln(1 + exp(x))`, element by element.
    fn softplus_forward(x: &[Self], y: &mut [Self]);
    /// Computes `y = tanh x`, element by element.
    fn tanh_forward(x: &[Self], y: &mut [Self]);
    /// Gradient of softplus: `dx += g sigmoid(x)`, or `dx = g sigmoid(x)` if `fresh`.
    fn softplus_backward(x: &[Self], g: &[Self], dx: &mut [Self], fresh: bool);
    /// Computes the Kullback-Leibler divergence KL(q
    /// p) of Gaussians, from `[mean_q, sd_q, mean_p, sd_p]`.
    fn kl_forward(operands: [&[Self]; 4], y: &mut [Self]);
    /// Adds the gradients of the operands of [`Scalar::kl_forward`]; overwrites those marked in `fresh`.
    fn kl_backward(operands: [&[Self]; 4], g: &[Self], grads: [&mut [Self]; 4], fresh: [bool; 4]);
    /// Computes the Gaussian negative log-likelihood, element by element, from `[x, mean, sd]`.
    fn nll_forward(operands: [&[Self]; 3], y: &mut [Self]);
    /// Adds the gradients of the operands of [`Scalar::nll_forward`]; overwrites those marked in `fresh`.
    fn nll_backward(operands: [&[Self]; 3], g: &[Self], grads: [&mut [Self]; 3], fresh: [bool; 3]);
    /// Runs an affine map over the feature axis of a sequence.
    fn linear_forward(args: LinearForward<'_, Self>, scratch: &mut [Self]);
    /// Computes the vector-Jacobian product of [`Scalar::linear_forward`].
    fn linear_backward(args: LinearBackward<'_, Self>, scratch: &mut [Self]);
    /// Number of scratch elements that the two linear kernels need for a layer.
    fn linear_scratch(input: usize, output: usize) -> usize;
}

/// Fills the gradients marked in `fresh` with zeros, because the reference kernels only add.
fn zero_fresh<const N: usize>(mut grads: [&mut [f64]; N], fresh: [bool; N]) -> [&mut [f64]; N] {
    for (grad, fresh) in grads.iter_mut().zip(fresh) {
        if fresh {
            grad.fill(0.0);
        }
    }
    grads
}

impl Scalar for f64 {
    const ZERO: f64 = 0.0;
    const ONE: f64 = 1.0;
    fn from_f64(x: f64) -> f64 {
        x
    }
    fn to_f64(self) -> f64 {
        self
    }
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
    fn exp(self) -> f64 {
        f64::exp(self)
    }
    fn ln(self) -> f64 {
        f64::ln(self)
    }
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    fn tanh(self) -> f64 {
        f64::tanh(self)
    }
    fn sigmoid(self) -> f64 {
        1.0 / (1.0 + f64::exp(-self))
    }
    fn softplus(self) -> f64 {
        self.max(0.0) + (-self.abs()).exp().ln_1p()
    }
    fn matmul(dims: kernels::MatmulDims, a: &[f64], b: &[f64], out: &mut [f64], accumulate: bool) {
        kernels::matmul(dims, a, b, out, accumulate);
    }
    fn gru_forward(args: GruForward<'_, f64>, scratch: &mut [f64]) {
        kernels::gru_reference::forward(args, scratch);
    }
    fn gru_backward(args: GruBackward<'_, f64>, scratch: &mut [f64]) {
        kernels::gru_reference::backward(args, scratch);
    }
    fn gru_scratch(input: usize, hidden: usize) -> usize {
        kernels::gru_reference::scratch(input, hidden)
    }
    fn softplus_forward(x: &[f64], y: &mut [f64]) {
        kernels::pointwise_reference::softplus(x, y);
    }
    fn tanh_forward(x: &[f64], y: &mut [f64]) {
        kernels::pointwise_reference::tanh(x, y);
    }
    fn softplus_backward(x: &[f64], g: &[f64], dx: &mut [f64], fresh: bool) {
        zero_fresh([dx], [fresh])
            .into_iter()
            .for_each(|dx| kernels::pointwise_reference::softplus_vjp(x, g, dx));
    }
    fn kl_forward(operands: [&[f64]; 4], y: &mut [f64]) {
        kernels::pointwise_reference::gaussian_kl(operands, y);
    }
    fn kl_backward(operands: [&[f64]; 4], g: &[f64], grads: [&mut [f64]; 4], fresh: [bool; 4]) {
        kernels::pointwise_reference::gaussian_kl_vjp(operands, g, zero_fresh(grads, fresh));
    }
    fn nll_forward(operands: [&[f64]; 3], y: &mut [f64]) {
        kernels::pointwise_reference::gaussian_nll(operands, y);
    }
    fn nll_backward(operands: [&[f64]; 3], g: &[f64], grads: [&mut [f64]; 3], fresh: [bool; 3]) {
        kernels::pointwise_reference::gaussian_nll_vjp(operands, g, zero_fresh(grads, fresh));
    }
    fn linear_forward(args: LinearForward<'_, f64>, _: &mut [f64]) {
        kernels::linear_reference::forward(args);
    }
    fn linear_backward(args: LinearBackward<'_, f64>, _: &mut [f64]) {
        kernels::linear_reference::backward(args);
    }
    fn linear_scratch(_: usize, _: usize) -> usize {
        0
    }
}

impl Scalar for f32 {
    const ZERO: f32 = 0.0;
    const ONE: f32 = 1.0;
    fn from_f64(x: f64) -> f32 {
        x as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
    fn exp(self) -> f32 {
        f32::exp(self)
    }
    fn ln(self) -> f32 {
        f32::ln(self)
    }
    fn sqrt(self) -> f32 {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn tanh(self) -> f32 {
        kernels::activation::tanh(self)
    }
    #[inline(always)]
    fn sigmoid(self) -> f32 {
        kernels::activation::sigmoid(self)
    }
    #[inline(always)]
    fn softplus(self) -> f32 {
        kernels::activation::softplus(self)
    }
    fn matmul(dims: kernels::MatmulDims, a: &[f32], b: &[f32], out: &mut [f32], accumulate: bool) {
        kernels::matmul(dims, a, b, out, accumulate);
    }
    fn gru_forward(args: GruForward<'_, f32>, scratch: &mut [f32]) {
        kernels::gru_simd::forward(args, scratch);
    }
    fn gru_backward(args: GruBackward<'_, f32>, scratch: &mut [f32]) {
        kernels::gru_simd::backward(args, scratch);
    }
    fn gru_scratch(input: usize, hidden: usize) -> usize {
        kernels::gru_simd::scratch(input, hidden)
    }
    fn softplus_forward(x: &[f32], y: &mut [f32]) {
        kernels::pointwise::softplus(x, y);
    }
    fn tanh_forward(x: &[f32], y: &mut [f32]) {
        kernels::pointwise::tanh(x, y);
    }
    fn softplus_backward(x: &[f32], g: &[f32], dx: &mut [f32], fresh: bool) {
        kernels::pointwise::softplus_vjp(x, g, dx, fresh);
    }
    fn kl_forward(operands: [&[f32]; 4], y: &mut [f32]) {
        kernels::pointwise::gaussian_kl(operands, y);
    }
    fn kl_backward(operands: [&[f32]; 4], g: &[f32], grads: [&mut [f32]; 4], fresh: [bool; 4]) {
        kernels::pointwise::gaussian_kl_vjp(operands, g, grads, fresh);
    }
    fn nll_forward(operands: [&[f32]; 3], y: &mut [f32]) {
        kernels::pointwise::gaussian_nll(operands, y);
    }
    fn nll_backward(operands: [&[f32]; 3], g: &[f32], grads: [&mut [f32]; 3], fresh: [bool; 3]) {
        kernels::pointwise::gaussian_nll_vjp(operands, g, grads, fresh);
    }
    fn linear_forward(args: LinearForward<'_, f32>, scratch: &mut [f32]) {
        kernels::linear_simd::forward(args, scratch);
    }
    fn linear_backward(args: LinearBackward<'_, f32>, scratch: &mut [f32]) {
        kernels::linear_simd::backward(args, scratch);
    }
    fn linear_scratch(input: usize, output: usize) -> usize {
        kernels::linear_simd::scratch(input, output)
    }
}
