//! Gradient checks in f64 (after JAX's `check_grads`): along a random direction v, the central
//! difference of f(x + h v) must equal the inner product of the gradient with v; and for a vector output,
//! the inner products <J v, w> and <v, J^T w> must agree.

use crate::random::normals;
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Central differences with step h = 1e-6 on values of order 1 have a truncation error of about h^2
/// and a rounding error of about eps / h = 2e-10, times the size of f; 1e-7 leaves two decades.
const STEP: f64 = 1e-6;
const TOLERANCE: f64 = 1e-7;

/// One input of the function under test: extents and values.
#[derive(Debug, Clone)]
pub struct Input {
    /// Extents.
    pub dims: Vec<usize>,
    /// Values, row-major.
    pub values: Vec<f64>,
}

impl Input {
    /// Standard normal values.
    pub fn normal(seed: u64, dims: &[usize]) -> Self {
        Input { dims: dims.to_vec(), values: normals(seed, dims.iter().product()) }
    }

    /// Values in about 0.5 to 3, for operations that need positive operands.
    pub fn positive(seed: u64, dims: &[usize]) -> Self {
        let mut input = Self::normal(seed, dims);
        input.values.iter_mut().for_each(|v| *v = 0.5 + v.abs());
        input
    }
}

/// A function of some inputs recorded on a tape; its output may have any shape.
pub type Function<'a, T = f64> = dyn Fn(&mut Tape<T>, &[Var]) -> Result<Var, TensorError> + 'a;

/// Output and gradients of a function for some inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome<T> {
    /// The output, row-major.
    pub output: Vec<T>,
    /// Operation that made the output.
    pub operation: &'static str,
    /// J^T w for the cotangent w, one for each input; empty for inputs that are constants.
    pub gradients: Vec<Vec<T>>,
}

/// Records `f` on `tape`, with inputs that are `variable` or constant, and pulls the cotangent that
/// `seed` draws back through it.
///
/// # Panics
/// If the tape refuses.
pub fn pull_back<T: Scalar>(
    tape: &mut Tape<T>,
    f: &Function<'_, T>,
    inputs: &[Input],
    variable: impl Fn(usize) -> bool,
    seed: u64,
) -> Outcome<T> {
    let narrow = |v: &[f64]| v.iter().map(|v| T::of(*v)).collect::<Vec<T>>();
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

/// A random weighted sum of the output, its value and the gradients of the inputs.
fn evaluate(f: &Function<'_>, inputs: &[Input]) -> (f64, Vec<Vec<f64>>) {
    let got = pull_back(&mut Tape::new(), f, inputs, |_| true, 99);
    (dot(&got.output, &normals(99, got.output.len())), got.gradients)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The inputs moved by `h` along random `steps`.
fn moved(inputs: &[Input], steps: &[Vec<f64>], h: f64) -> Vec<Input> {
    let mut at = inputs.to_vec();
    for (input, step) in at.iter_mut().zip(steps) {
        input.values.iter_mut().zip(step).for_each(|(v, s)| *v += h * s);
    }
    at
}

fn directions(inputs: &[Input], k: u64) -> Vec<Vec<f64>> {
    inputs
        .iter()
        .enumerate()
        .map(|(i, input)| normals(1000 * (k + 1) + i as u64, input.values.len()))
        .collect()
}

fn fail<R>(e: TensorError) -> R {
    panic!("{e}")
}

/// Asserts that the tape's gradient of `f` agrees with central differences in three random directions.
///
/// # Panics
/// If it does not, naming both numbers.
pub fn check(name: &str, inputs: &[Input], f: &Function<'_>) {
    let (_, grads) = evaluate(f, inputs);
    for direction in 0..3_u64 {
        let steps = directions(inputs, direction);
        let at = |h: f64| evaluate(f, &moved(inputs, &steps, h)).0;
        let numeric = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        let analytic: f64 = grads.iter().zip(&steps).map(|(g, s)| dot(g, s)).sum();
        let scale = 1.0_f64.max(numeric.abs()).max(analytic.abs());
        assert!(
            (numeric - analytic).abs() <= TOLERANCE * scale,
            "{name}: central difference {numeric}, gradient {analytic}"
        );
    }
}

/// Asserts <J v, w> = <v, J^T w> for three random directions v and three random cotangents w, where J v is
/// the central difference of the whole output and J^T w comes from the tape.
///
/// The difference is off by rounding, eps |f| / h, and by truncation, h^2 times the third derivative; w multiplies both. So
/// the tolerance is `TOLERANCE` times |w| (1 + |J v| + |f|), the 1 for what cancels inside f, which an error in one element of a small output
/// exceeds by far.
///
/// # Panics
/// If they differ, naming both numbers.
pub fn check_inner_product(name: &str, inputs: &[Input], f: &Function<'_>) {
    let output = |at: &[Input], w: u64| pull_back(&mut Tape::new(), f, at, |_| true, w);
    let norm = |a: &[f64]| dot(a, a).sqrt();
    for v in 0..3_u64 {
        let steps = directions(inputs, v + 10);
        let [up, down] = [STEP, -STEP].map(|h| output(&moved(inputs, &steps, h), 0).output);
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
