//! Table of all operations of the autodiff tape with inputs that exercise them, for the gradient checks.

use crate::gradient::Input;
use augsim_tensor::{GruVars, Scalar, Shape, Tape, TensorError, Var};

/// A function that records operations on inputs on a tape; its output may have any shape.
pub type Recorded<T> = fn(&mut Tape<T>, &[Var]) -> Result<Var, TensorError>;

/// One operation of the tape with one choice of operands.
#[derive(Debug, Clone)]
pub struct Case {
    /// Operation that produces the output: one of [`augsim_tensor::OPERATIONS`].
    pub operation: &'static str,
    /// Name of the case: operation, special feature, and dimensions of the inputs.
    pub label: String,
    /// Values of the operands of the operation.
    pub inputs: Vec<Input>,
    /// Function that records the operation in double precision.
    pub double: Recorded<f64>,
    /// Function that records the operation in single precision.
    pub single: Recorded<f32>,
}

/// Adds one case per list of inputs to `cases`: `operation, note, inputs, |tape, operands| output`.
macro_rules! case {
    ($cases:ident, $operation:literal, $note:literal, $inputs:expr, |$t:ident, $v:ident| $body:expr) => {
        for inputs in $inputs {
            let dims: Vec<_> = inputs.iter().map(|i: &Input| &i.dims).collect();
            $cases.push(Case {
                operation: $operation,
                label: format!("{} {} {dims:?}", $operation, $note),
                inputs,
                double: |$t, $v| $body,
                single: |$t, $v| $body,
            });
        }
    };
}

/// Dimensions of single operands: a matrix, a vector with a SIMD remainder, scalar, ones and zeros.
const SHAPES: [&[usize]; 7] = [&[2, 3], &[131], &[], &[1], &[1, 1, 1, 1], &[0], &[2, 0, 3]];

/// Pairs of dimensions that broadcast in both ways, with sizes 0 and 1 and with unequal ranks.
const PAIRS: [[&[usize]; 2]; 9] = [
    [&[3, 4], &[3, 4]],
    [&[3, 4], &[4]],
    [&[4], &[3, 4]],
    [&[5, 1, 3], &[1, 2, 1]],
    [&[2, 3], &[]],
    [&[], &[2, 3]],
    [&[1], &[0]],
    [&[0, 3], &[1, 3]],
    [&[1, 1], &[1]],
];

/// Standard normal inputs with dimensions `shapes`, one input per shape.
fn normal(shapes: &[&[usize]]) -> Vec<Input> {
    shapes.iter().enumerate().map(|(i, dims)| Input::normal(i as u64 + 1, dims)).collect()
}

/// Makes one case of a single standard normal input per shape.
fn each(shapes: &[&[usize]]) -> Vec<Vec<Input>> {
    shapes.iter().map(|dims| normal(&[dims])).collect()
}

/// Makes one case of a single positive input per shape.
fn each_positive(shapes: &[&[usize]]) -> Vec<Vec<Input>> {
    shapes.iter().map(|dims| vec![Input::positive(7, dims)]).collect()
}

/// Operand pairs of the shapes [`PAIRS`]: a standard normal numerator and a positive denominator.
fn quotients() -> Vec<Vec<Input>> {
    PAIRS.iter().map(|[a, b]| vec![Input::normal(1, a), Input::positive(2, b)]).collect()
}

/// Pairs of standard normal operands of the shapes [`PAIRS`].
fn pairs() -> Vec<Vec<Input>> {
    PAIRS.iter().map(|pair| normal(pair)).collect()
}

/// Operands of equal dimensions, for each of [`SHAPES`]: `normals` of any sign, then `positives` positive ones.
fn gaussians(normals: u64, positives: u64) -> Vec<Vec<Input>> {
    let operands = |dims: &[usize]| {
        let free = (0..normals).map(|k| Input::normal(k + 1, dims));
        free.chain((0..positives).map(|k| Input::positive(k + 20, dims))).collect()
    };
    SHAPES.iter().map(|dims| operands(dims)).collect()
}

/// Inputs `x`, `h0`, `w_ih`, `w_hh`, `b_ih`, `b_hh` of a GRU for sizes `[time, input, hidden, batch]`.
fn gru(sizes: &[[usize; 4]]) -> Vec<Vec<Input>> {
    let operands = |&[t, i, h, b]: &[usize; 4]| {
        normal(&[&[t, i, b], &[h, b], &[3 * h, i], &[3 * h, h], &[3 * h], &[3 * h]])
    };
    sizes.iter().map(operands).collect()
}

/// Picks the weights of a GRU from its inputs, in the order of [`gru`].
fn weights(v: &[Var]) -> GruVars {
    GruVars { w_ih: v[2], w_hh: v[3], b_ih: v[4], b_hh: v[5] }
}

/// Two functions of three features, sin(a) b and a b c, with their Jacobian, computed outside the tape.
fn external<T: Scalar>(tape: &mut Tape<T>, x: Var) -> Result<Var, TensorError> {
    let (time, batch) = (tape.shape(x).dims()[0], tape.shape(x).dims()[2]);
    let feature = |t: usize, k: usize, b: usize| tape.value(x)[(t * 3 + k) * batch + b].to_f64();
    let mut values = vec![T::ZERO; time * 2 * batch];
    let mut jacobian = vec![T::ZERO; time * 6 * batch];
    for t in 0..time {
        for lane in 0..batch {
            let [a, b, c] = [0, 1, 2].map(|k| feature(t, k, lane));
            let rows = [(a.sin() * b, [a.cos() * b, a.sin(), 0.0]), (a * b * c, [b * c, a * c, a * b])];
            for (o, (value, derivatives)) in rows.into_iter().enumerate() {
                values[(t * 2 + o) * batch + lane] = T::from_f64(value);
                for (i, derivative) in derivatives.into_iter().enumerate() {
                    jacobian[((t * 2 + o) * 3 + i) * batch + lane] = T::from_f64(derivative);
                }
            }
        }
    }
    tape.external(x, 2, &values, &jacobian)
}

/// Gradient-check cases of all operations.
pub fn cases() -> Vec<Case> {
    let mut cases = elementwise();
    cases.extend(structural());
    cases.extend(networks());
    cases
}

/// Gradient-check cases of elementwise operations.
fn elementwise() -> Vec<Case> {
    let mut cases = Vec::new();
    case!(cases, "add", "", pairs(), |t, v| t.add(v[0], v[1]));
    case!(cases, "sub", "", pairs(), |t, v| t.sub(v[0], v[1]));
    case!(cases, "mul", "", pairs(), |t, v| t.mul(v[0], v[1]));
    case!(cases, "div", "", quotients(), |t, v| t.div(v[0], v[1]));
    case!(cases, "add", "with itself", each(&SHAPES), |t, v| t.add(v[0], v[0]));
    case!(cases, "sub", "with itself", each(&SHAPES), |t, v| t.sub(v[0], v[0]));
    case!(cases, "mul", "with itself", each(&SHAPES), |t, v| t.mul(v[0], v[0]));
    case!(cases, "div", "with itself", each_positive(&SHAPES), |t, v| t.div(v[0], v[0]));
    case!(cases, "neg", "", each(&SHAPES), |t, v| t.neg(v[0]));
    case!(cases, "scale", "", each(&SHAPES), |t, v| t.scale(v[0], -1.7));
    case!(cases, "shift", "", each(&SHAPES), |t, v| t.shift(v[0], 0.3));
    case!(cases, "exp", "", each(&SHAPES), |t, v| t.exp(v[0]));
    case!(cases, "ln", "", each_positive(&SHAPES), |t, v| t.ln(v[0]));
    case!(cases, "sqrt", "", each_positive(&SHAPES), |t, v| t.sqrt(v[0]));
    case!(cases, "tanh", "", each(&SHAPES), |t, v| t.tanh(v[0]));
    case!(cases, "sigmoid", "", each(&SHAPES), |t, v| t.sigmoid(v[0]));
    case!(cases, "softplus", "", each(&SHAPES), |t, v| t.softplus(v[0]));
    case!(
        cases,
        "external",
        "",
        each(&[&[2, 3, 4], &[1, 3, 1], &[5, 3, 17], &[0, 3, 2], &[2, 3, 0]]),
        |t, v| external(t, v[0])
    );
    case!(cases, "squared_error", "", gaussians(2, 0), |t, v| t.squared_error(v[0], v[1]));
    case!(cases, "squared_error", "with itself", gaussians(1, 0), |t, v| t.squared_error(v[0], v[0]));
    case!(cases, "gaussian_nll", "", gaussians(2, 1), |t, v| t.gaussian_nll(v[0], v[1], v[2]));
    case!(cases, "gaussian_nll", "x = mean", gaussians(1, 1), |t, v| t.gaussian_nll(v[0], v[0], v[1]));
    case!(cases, "gaussian_nll", "mean = sd", gaussians(1, 1), |t, v| t.gaussian_nll(v[0], v[1], v[1]));
    case!(cases, "gaussian_kl", "", gaussians(2, 2), |t, v| t.gaussian_kl((v[0], v[2]), (v[1], v[3])));
    case!(cases, "gaussian_kl", "q = p", gaussians(1, 1), |t, v| t.gaussian_kl((v[0], v[1]), (v[0], v[1])));
    case!(cases, "gaussian_kl", "one sd", gaussians(2, 1), |t, v| t.gaussian_kl((v[0], v[2]), (v[1], v[2])));
    cases
}

/// Gradient-check cases of operations on shapes and axes.
fn structural() -> Vec<Case> {
    let mut cases = Vec::new();
    let cubes: [&[usize]; 4] = [&[2, 3, 4], &[1, 1, 1], &[2, 0, 3], &[3, 1, 2]];
    let stretched: [&[usize]; 4] = [&[3, 1], &[1], &[], &[3, 4]];
    case!(cases, "broadcast_to", "[2, 3, 4]", each(&stretched[..3]), |t, v| {
        t.broadcast_to(v[0], Shape::new(&[2, 3, 4])?)
    });
    case!(cases, "broadcast_to", "[3, 0]", each(&stretched[..3]), |t, v| {
        t.broadcast_to(v[0], Shape::new(&[3, 0])?)
    });
    case!(cases, "reshape", "[6]", each(&[&[2, 3], &[6], &[1, 3, 2, 1]]), |t, v| t.reshape(v[0], &[6]));
    case!(cases, "reshape", "[0, 5]", each(&[&[0], &[2, 0, 3]]), |t, v| t.reshape(v[0], &[0, 5]));
    case!(cases, "reshape", "[]", each(&[&[1], &[1, 1]]), |t, v| t.reshape(v[0], &[]));
    case!(cases, "sum_all", "", each(&SHAPES), |t, v| t.sum_all(v[0]));
    case!(cases, "mean_all", "", each(&SHAPES[..5]), |t, v| t.mean_all(v[0]));
    case!(cases, "sum", "axis 0", each(&cubes), |t, v| t.sum(v[0], 0));
    case!(cases, "sum", "axis 1", each(&cubes), |t, v| t.sum(v[0], 1));
    case!(cases, "sum", "axis 2", each(&cubes), |t, v| t.sum(v[0], 2));
    case!(cases, "mean", "axis 0", each(&cubes), |t, v| t.mean(v[0], 0));
    case!(cases, "mean", "axis 1", each(&[&[2, 3, 4], &[2, 3, 0], &[3, 1]]), |t, v| t.mean(v[0], 1));
    case!(cases, "mean", "axis 2", each(&cubes), |t, v| t.mean(v[0], 2));
    case!(cases, "slice", "axis 0", each(&[&[3, 2], &[3], &[3, 0]]), |t, v| t.slice(v[0], 0, 1, 3));
    case!(cases, "slice", "axis 1", each(&[&[2, 4, 3], &[1, 4]]), |t, v| t.slice(v[0], 1, 1, 3));
    case!(cases, "slice", "axis 2", each(&cubes), |t, v| t.slice(v[0], 2, 0, 1));
    case!(cases, "slice", "nothing", each(&[&[2, 3]]), |t, v| t.slice(v[0], 1, 2, 2));
    let joined: [[&[usize]; 3]; 3] = [
        [&[1, 2, 3], &[4, 2, 3], &[0, 2, 3]],
        [&[2, 1, 3], &[2, 3, 3], &[2, 0, 3]],
        [&[2, 3, 1], &[2, 3, 2], &[2, 3, 0]],
    ];
    case!(cases, "concat", "axis 0", [normal(&joined[0])], |t, v| t.concat(v, 0));
    case!(cases, "concat", "axis 1", [normal(&joined[1])], |t, v| t.concat(v, 1));
    case!(cases, "concat", "axis 2", [normal(&joined[2])], |t, v| t.concat(v, 2));
    case!(cases, "concat", "with itself", each(&cubes), |t, v| t.concat(&[v[0], v[0], v[0]], 1));
    let steps = [normal(&[&[2, 3], &[2, 3]]), normal(&[&[]]), normal(&[&[1], &[1]]), normal(&[&[0, 2]])];
    case!(cases, "stack_time", "", steps, |t, v| t.stack_time(v));
    case!(cases, "stack_time", "of itself", each(&[&[2, 3]]), |t, v| t.stack_time(&[v[0], v[0]]));
    cases
}

/// Gradient-check cases of matrix products and network layers.
fn networks() -> Vec<Case> {
    let mut cases = Vec::new();
    let products: [[&[usize]; 2]; 5] = [
        [&[3, 4], &[4, 5]],
        [&[1, 1], &[1, 1]],
        [&[2, 0], &[0, 3]],
        [&[0, 2], &[2, 3]],
        [&[17, 33], &[33, 9]],
    ];
    case!(cases, "matmul", "", products.iter().map(|p| normal(p)), |t, v| t.matmul(v[0], v[1]));
    case!(cases, "matmul", "with itself", each(&[&[4, 4], &[1, 1]]), |t, v| t.matmul(v[0], v[0]));
    let maps: [[usize; 4]; 5] = [[5, 3, 4, 2], [1, 1, 1, 1], [0, 2, 3, 2], [2, 0, 3, 2], [3, 2, 2, 0]];
    let maps = maps.map(|[t, i, o, b]| normal(&[&[t, i, b], &[o, i], &[o]]));
    case!(cases, "linear", "", maps.clone(), |t, v| t.linear(v[0], v[1], v[2]));
    case!(cases, "linear_tanh", "", maps, |t, v| t.linear_tanh(v[0], v[1], v[2]));
    let sizes = [[6, 3, 4, 2], [1, 1, 1, 1], [0, 2, 3, 2], [3, 0, 2, 2], [2, 3, 2, 0], [2, 3, 0, 2]];
    case!(cases, "gru_sequence", "with h0", gru(&sizes), |t, v| t.gru_sequence(v[0], Some(v[1]), weights(v)));
    case!(cases, "gru_sequence", "without h0", gru(&sizes), |t, v| t.gru_sequence(v[0], None, weights(v)));
    let square = [[5, 3, 3, 2], [1, 1, 1, 1]];
    case!(cases, "gru_sequence", "tied weights", gru(&square), |t, v| {
        let w = GruVars { w_ih: v[2], w_hh: v[2], b_ih: v[4], b_hh: v[4] };
        t.gru_sequence(v[0], Some(v[1]), w)
    });
    case!(cases, "gru_sequence", "two layers, one set of weights", gru(&square), |t, v| {
        let below = t.gru_sequence(v[0], None, weights(v))?;
        t.gru_sequence(below, Some(v[1]), weights(v))
    });
    let steps = [sizes[0], sizes[1], sizes[3], sizes[4], sizes[5]];
    // The composed implementation ends by stacking its steps.
    case!(cases, "stack_time", "gru_composed", gru(&steps), |t, v| {
        t.gru_composed(v[0], Some(v[1]), weights(v))
    });
    case!(cases, "stack_time", "gru_composed from zero", gru(&steps), |t, v| {
        t.gru_composed(v[0], None, weights(v))
    });
    cases
}
