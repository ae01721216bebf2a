//! Gradient checks in f64 (after JAX's `check_grads`): along a random direction v, the central
//! difference of f(x + h v) must equal the inner product of the gradient with v.

use crate::random::normals;
use augsim_tensor::{Tape, TensorError, Var};

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
pub type Function<'a> = dyn Fn(&mut Tape<f64>, &[Var]) -> Result<Var, TensorError> + 'a;

/// A random weighted sum of the output, its value and (on request) the gradients of the inputs.
fn evaluate(f: &Function<'_>, inputs: &[Input], gradients: bool) -> (f64, Vec<Vec<f64>>) {
    let mut tape = Tape::<f64>::new();
    let vars: Vec<Var> =
        inputs.iter().map(|i| tape.variable(&i.dims, &i.values).unwrap_or_else(fail)).collect();
    let out = f(&mut tape, &vars).unwrap_or_else(fail);
    let shape = tape.shape(out);
    let weights = tape.constant(shape.dims(), &normals(99, shape.len())).unwrap_or_else(fail);
    let weighted = tape.mul(out, weights).unwrap_or_else(fail);
    let loss = tape.sum_all(weighted).unwrap_or_else(fail);
    let value = tape.value(loss)[0];
    if !gradients {
        return (value, Vec::new());
    }
    tape.backward(loss).unwrap_or_else(fail);
    (value, vars.iter().map(|v| tape.grad(*v).to_vec()).collect())
}

fn fail<R>(e: TensorError) -> R {
    panic!("{e}")
}

/// Asserts that the tape's gradient of `f` agrees with central differences in three random directions.
///
/// # Panics
/// If it does not, naming both numbers.
pub fn check(name: &str, inputs: &[Input], f: &Function<'_>) {
    let (_, grads) = evaluate(f, inputs, true);
    for direction in 0..3_u64 {
        let steps: Vec<Vec<f64>> = inputs
            .iter()
            .enumerate()
            .map(|(i, input)| normals(1000 * (direction + 1) + i as u64, input.values.len()))
            .collect();
        let moved = |h: f64| {
            let mut at = inputs.to_vec();
            for (input, step) in at.iter_mut().zip(&steps) {
                input.values.iter_mut().zip(step).for_each(|(v, s)| *v += h * s);
            }
            evaluate(f, &at, false).0
        };
        let numeric = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
        let analytic: f64 =
            grads.iter().zip(&steps).flat_map(|(g, s)| g.iter().zip(s)).map(|(g, s)| g * s).sum();
        let scale = 1.0_f64.max(numeric.abs()).max(analytic.abs());
        assert!(
            (numeric - analytic).abs() <= TOLERANCE * scale,
            "{name}: central difference {numeric}, gradient {analytic}"
        );
    }
}
