//! Gradient checks in f64, after JAX's `check_grads`.
//!
//! Along a random direction v, the central difference of f(x + h v) must equal the inner product of the
//! gradient with v. For a vector output, the inner products <J v, w> and <v, J^T w> must agree.

use crate::random::normals;
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Step h of the central differences.
const STEP: f64 = 1e-6;
/// Relative tolerance of the gradient checks.
///
/// For values of order 1, central differences with h = 1e-6 have a truncation error of about h^2 and a
/// rounding error of about eps / h = 2e-10, times the size of f. The tolerance leaves a margin of two
/// decades.
const TOLERANCE: f64 = 1e-7;

/// One input tensor of the function under test.
#[derive(Debug, Clone)]
pub struct Input {
    /// Dimensions of the input.
    pub dims: Vec<usize>,
    /// Values of the input, row-major.
    pub values: Vec<f64>,
}

impl Input {
    /// Makes an input with standard normal values.
    pub fn normal(seed: u64, dims: &[usize]) -> Self {
        Input { dims: dims.to_vec(), values: normals(seed, dims.iter().product()) }
    }

    /// Makes an input with values of about 0.5 to 3, for operations that need positive operands.
    pub fn positive(seed: u64, dims: &[usize]) -> Self {
        let mut input = Self::normal(seed, dims);
        input.values.iter_mut().for_each(|v| *v = 0.5 + v.abs());
        input
    }
}

/// A function that records operations on inputs on an autodiff tape; its output may have any shape.
pub type Function<'a, T = f64> = dyn Fn(&mut Tape<T>, &[Var]) -> Result<Var, TensorError> + 'a;

/// Output of a function for some inputs, and its gradients with respect to them.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome<T> {
    /// Output of the function, row-major.
    pub output: Vec<T>,
    /// Operation that produced the output.
    pub operation: &'static str,
    /// J^T w for the random cotangent w, one vector per input; empty for constant inputs.
    pub gradients: Vec<Vec<T>>,
}

/// Records `f` on `tape` and computes J^T w for a random cotangent w.
///
/// `variable` says which inputs are variables; the others are constants. `seed` selects the cotangent.
///
/// # Panics
/// If the tape returns an error.
pub fn pull_back<T: Scalar>(
    tape: &mut Tape<T>,
    f: &Function<'_, T>,
    inputs: &[Input],
    variable: impl Fn(usize) -> bool,
    seed: u64,
) -> Outcome<T> {
    let narrow = |v: &[f64]| v.iter().map(|v| T::from_f64(*v)).collect::<Vec<T>>();
    let vars: Vec<Var> = inputs
        .iter()
        .enumerate()
        .map(|(i, input)| {
            let values = narrow(&input.values);
            let leaf = if variable(i) { Tape::variable } else { Tape::constant };
            leaf(tape, &input.dims, &values).unwrap_or_else(fail)
        })
        .collect();
    let out = f(tape, &vars).unwrap_or_else(fail);
    let shape = tape.shape(out);
    let cotangent = narrow(&normals(seed, shape.len()));
    let cotangent = tape.constant(shape.dims(), &cotangent).unwrap_or_else(fail);
    let weighted = tape.mul(out, cotangent).unwrap_or_else(fail);
    let loss = tape.sum_all(weighted).unwrap_or_else(fail);
    tape.backward(loss).unwrap_or_else(fail);
    Outcome {
        output: tape.value(out).to_vec(),
        operation: tape.operation(out),
        gradients: vars.iter().map(|v| tape.grad(*v).to_vec()).collect(),
    }
}

/// Random weighted sum of the output of `f`, and its gradient with respect to each input.
fn evaluate(f: &Function<'_>, inputs: &[Input]) -> (f64, Vec<Vec<f64>>) {
    let outcome = pull_back(&mut Tape::new(), f, inputs, |_| true, 99);
    (dot(&outcome.output, &normals(99, outcome.output.len())), outcome.gradients)
}

/// Inner product of two vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds `h` times `steps` to the inputs.
fn shifted(inputs: &[Input], steps: &[Vec<f64>], h: f64) -> Vec<Input> {
    let mut shifted_inputs = inputs.to_vec();
    for (input, step) in shifted_inputs.iter_mut().zip(steps) {
        input.values.iter_mut().zip(step).for_each(|(v, s)| *v += h * s);
    }
    shifted_inputs
}

/// Random direction number `k` in the space of all inputs, one vector per input.
fn directions(inputs: &[Input], k: u64) -> Vec<Vec<f64>> {
    inputs
        .iter()
        .enumerate()
        .map(|(i, input)| normals(1000 * (k + 1) + i as u64, input.values.len()))
        .collect()
}

/// Panics with the tensor error as message, which fails the test.
fn fail<R>(e: TensorError) -> R {
    panic!("{e}")
}

/// Asserts that the tape's gradient of `f` agrees with central differences in three random directions.
///
/// # Panics
/// If they disagree; the message has both numbers.
pub fn check(name: &str, inputs: &[Input], f: &Function<'_>) {
    let (_, grads) = evaluate(f, inputs);
    for direction in 0..3_u64 {
        let steps = directions(inputs, direction);
        let value_at = |h: f64| evaluate(f, &shifted(inputs, &steps, h)).0;
        let numeric = (value_at(STEP) - value_at(-STEP)) / (2.0 * STEP);
        let analytic: f64 = grads.iter().zip(&steps).map(|(g, s)| dot(g, s)).sum();
        let scale = 1.0_f64.max(numeric.abs()).max(analytic.abs());
        assert!(
            (numeric - analytic).abs() <= TOLERANCE * scale,
            "{name}: central difference {numeric}, gradient {analytic}"
        );
    }
}

/// Asserts <J v, w> = <v, J^T w> for three random directions v and three random cotangents w.
///
/// J v is the central difference of the whole output, and J^T w comes from the tape.
///
/// The difference has a rounding error of eps |f| / h and a truncation error of h^2 times the third
/// derivative, both multiplied by w. The tolerance is therefore `TOLERANCE` times |w| (1 + |J v| + |f|),
/// where the 1 covers terms that cancel inside f. An error in one element of a small output exceeds it by
/// far.
///
/// # Panics
/// If they differ; the message has both numbers.
pub fn check_inner_product(name: &str, inputs: &[Input], f: &Function<'_>) {
    let output = |at: &[Input], w: u64| pull_back(&mut Tape::new(), f, at, |_| true, w);
    let norm = |a: &[f64]| dot(a, a).sqrt();
    for v in 0..3_u64 {
        let steps = directions(inputs, v + 10);
        let [up, down] = [STEP, -STEP].map(|h| output(&shifted(inputs, &steps, h), 0).output);
        let jv: Vec<f64> = up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * STEP)).collect();
        for seed in 50..53_u64 {
            let w = normals(seed, jv.len());
            let pulled: f64 = output(inputs, seed).gradients.iter().zip(&steps).map(|(g, s)| dot(g, s)).sum();
            let pushed = dot(&jv, &w);
            let scale = norm(&w) * (1.0 + norm(&jv) + norm(&up));
            assert!(
                (pushed - pulled).abs() <= TOLERANCE * scale,
                "{name}: <J v, w> = {pushed}, <v, J^T w> = {pulled}"
            );
        }
    }
}
