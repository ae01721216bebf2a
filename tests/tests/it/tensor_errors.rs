//! Contract: an invalid tensor operation returns the error text of this file, with its name, both shapes and
//! the rule. A NaN or infinity is reported with the operation that made it, in debug builds and on request.
//! Only a tensor with one element can be differentiated. After an error the tape can still be used.

use augsim_tensor::{GruVars, Shape, Tape, TensorError, Var};

/// Makes a tape that checks for non-finite values, with one variable of ones for each shape.
fn tape(shapes: &[&[usize]]) -> (Tape<f64>, Vec<Var>) {
    let mut tape = Tape::new();
    tape.check_finite(true);
    let vars = shapes.iter().map(|d| ok(tape.variable(d, &vec![1.0; d.iter().product()]))).collect();
    (tape, vars)
}

fn ok<R>(result: Result<R, TensorError>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

/// Asserts that `f` fails with the error `text`, and that the tape can still differentiate.
fn refused(shapes: &[&[usize]], f: impl Fn(&mut Tape<f64>, &[Var]) -> Result<Var, TensorError>, text: &str) {
    let (mut tape, v) = tape(shapes);
    match f(&mut tape, &v) {
        Ok(out) => panic!("no error, but shape {}; expected: {text}", tape.shape(out)),
        Err(error) => assert_eq!(error.to_string(), text),
    }
    let x = ok(tape.variable(&[], &[3.0]));
    let y = ok(tape.mul(x, x));
    ok(tape.backward(y));
    assert_eq!(tape.grad(x), [6.0]);
}

#[test]
fn leaves_say_how_many_values_they_need() {
    let none = &[];
    let text = "a tensor of shape [2, 3] holds 6 values, but 5 were given";
    refused(none, |t, _| t.constant(&[2, 3], &[0.0; 5]), text);
    refused(none, |t, _| t.variable(&[2, 3], &[0.0; 5]), text);
    refused(none, |t, _| t.constant(&[1; 5], &[0.0]), "tensors have at most 4 axes, but 5 were given");
}

#[test]
fn broadcasting_names_both_shapes() {
    let rule = "extents must be equal or 1, aligned at the last axis";
    let shapes: &[&[usize]] = &[&[2, 3], &[2]];
    refused(shapes, |t, v| t.add(v[0], v[1]), &format!("add: shapes [2, 3] and [2] do not fit: {rule}"));
    refused(shapes, |t, v| t.sub(v[1], v[0]), &format!("sub: shapes [2] and [2, 3] do not fit: {rule}"));
    refused(shapes, |t, v| t.mul(v[0], v[1]), &format!("mul: shapes [2, 3] and [2] do not fit: {rule}"));
    refused(shapes, |t, v| t.div(v[0], v[1]), &format!("div: shapes [2, 3] and [2] do not fit: {rule}"));
    refused(&[&[0], &[2]], |t, v| t.add(v[0], v[1]), &format!("add: shapes [0] and [2] do not fit: {rule}"));
    refused(
        shapes,
        |t, v| t.broadcast_to(v[1], Shape::new(&[2, 3])?),
        &format!("broadcast_to: shapes [2] and [2, 3] do not fit: {rule}"),
    );
    refused(
        &[&[2, 3]],
        |t, v| t.broadcast_to(v[0], Shape::new(&[1, 3])?),
        "broadcast_to: shapes [2, 3] and [1, 3] do not fit: only axes of extent 1 can be broadcast",
    );
}

#[test]
fn matmul_and_reshape_name_both_shapes() {
    refused(
        &[&[2, 3], &[2, 3]],
        |t, v| t.matmul(v[0], v[1]),
        "matmul: shapes [2, 3] and [2, 3] do not fit: columns of the first must equal rows of the second",
    );
    refused(
        &[&[2, 3], &[3]],
        |t, v| t.matmul(v[0], v[1]),
        "matmul: shapes [2, 3] and [3] do not fit: both operands must be matrices",
    );
    refused(
        &[&[2, 3]],
        |t, v| t.reshape(v[0], &[4]),
        "reshape: shapes [2, 3] and [4] do not fit: both must have the same number of elements",
    );
}

#[test]
fn axes_and_ranges_are_named() {
    let shapes: &[&[usize]] = &[&[2, 3]];
    refused(shapes, |t, v| t.slice(v[0], 1, 1, 4), "slice: 1..4 on axis 1 is outside shape [2, 3]");
    refused(shapes, |t, v| t.slice(v[0], 1, 2, 1), "slice: 2..1 on axis 1 is outside shape [2, 3]");
    refused(shapes, |t, v| t.slice(v[0], 2, 0, 0), "slice: 0..0 on axis 2 is outside shape [2, 3]");
    refused(
        shapes,
        |t, v| t.sum(v[0], 2),
        "sum: shape [2, 3] is not usable: the axis to reduce does not exist",
    );
    refused(
        shapes,
        |t, v| t.mean(v[0], 7),
        "mean: shape [2, 3] is not usable: the axis to reduce does not exist",
    );
    let rule = "the mean of no elements is undefined";
    refused(&[&[0]], |t, v| t.mean(v[0], 0), &format!("mean: shape [0] is not usable: {rule}"));
    refused(&[&[2, 0]], |t, v| t.mean_all(v[0]), &format!("mean_all: shape [2, 0] is not usable: {rule}"));
}

#[test]
fn joining_names_both_shapes() {
    refused(
        &[&[2, 3], &[2, 4]],
        |t, v| t.concat(v, 0),
        "concat: shapes [2, 3] and [2, 4] do not fit: the shapes may differ only on the axis to join along",
    );
    refused(
        &[&[2, 3], &[3]],
        |t, v| t.concat(v, 0),
        "concat: shapes [2, 3] and [3] do not fit: the shapes may differ only on the axis to join along",
    );
    refused(
        &[&[2, 3]],
        |t, v| t.concat(v, 2),
        "concat: shape [2, 3] is not usable: the axis to join along does not exist",
    );
    refused(&[], |t, v| t.concat(v, 0), "concat: shape [] is not usable: there must be at least one part");
    refused(
        &[&[2, 3], &[3, 2]],
        |t, v| t.stack_time(v),
        "stack_time: shapes [2, 3] and [3, 2] do not fit: the shapes must be equal",
    );
    refused(
        &[],
        |t, v| t.stack_time(v),
        "stack_time: shape [] is not usable: there must be at least one step",
    );
    refused(&[&[1; 4]], |t, v| t.stack_time(v), "tensors have at most 4 axes, but 5 were given");
}

#[test]
fn fused_losses_ask_for_equal_shapes() {
    let shapes: &[&[usize]] = &[&[2, 3], &[2, 3], &[2, 1]];
    let rest = "shapes [2, 3] and [2, 1] do not fit: the shapes must be equal";
    refused(shapes, |t, v| t.squared_error(v[0], v[2]), &format!("squared_error: {rest}"));
    refused(shapes, |t, v| t.gaussian_nll(v[0], v[2], v[1]), &format!("gaussian_nll: {rest}"));
    refused(shapes, |t, v| t.gaussian_nll(v[0], v[1], v[2]), &format!("gaussian_nll: {rest}"));
    refused(shapes, |t, v| t.gaussian_kl((v[0], v[2]), (v[1], v[1])), &format!("gaussian_kl: {rest}"));
    refused(shapes, |t, v| t.gaussian_kl((v[0], v[1]), (v[2], v[1])), &format!("gaussian_kl: {rest}"));
    refused(shapes, |t, v| t.gaussian_kl((v[0], v[1]), (v[1], v[2])), &format!("gaussian_kl: {rest}"));
}

#[test]
fn layers_name_the_shape_that_does_not_fit() {
    let x: &[usize] = &[7, 2, 5];
    refused(
        &[&[7, 2], &[3, 2], &[3]],
        |t, v| t.linear(v[0], v[1], v[2]),
        "linear: shape [7, 2] is not usable: a sequence is [time, feature, batch]",
    );
    let rule = "w must be [out, in] for x [time, in, batch]";
    refused(
        &[x, &[2, 3], &[2]],
        |t, v| t.linear(v[0], v[1], v[2]),
        &format!("linear: shapes [7, 2, 5] and [2, 3] do not fit: {rule}"),
    );
    refused(
        &[x, &[3, 2], &[2]],
        |t, v| t.linear(v[0], v[1], v[2]),
        "linear: shapes [3, 2] and [2] do not fit: the bias must be [out] for w [out, in]",
    );

    let gru = |shapes: &[&[usize]; 6], text: &str| {
        let weights = |v: &[Var]| GruVars { w_ih: v[2], w_hh: v[3], b_ih: v[4], b_hh: v[5] };
        let text = format!("gru_sequence: {text}");
        refused(shapes, |t, v| t.gru_sequence(v[0], Some(v[1]), weights(v)), &text);
        refused(shapes, |t, v| t.gru_composed(v[0], Some(v[1]), weights(v)), &text);
    };
    let (h0, w_ih, w_hh, b): (&[usize], &[usize], &[usize], &[usize]) = (&[4, 5], &[12, 2], &[12, 4], &[12]);
    let input = "w_ih must be [3 hidden, input] for x [time, input, batch]";
    gru(&[&[7, 2], h0, w_ih, w_hh, b, b], "shape [7, 2] is not usable: a sequence is [time, feature, batch]");
    gru(&[x, h0, b, w_hh, b, b], &format!("shapes [7, 2, 5] and [12] do not fit: {input}"));
    gru(&[x, h0, &[12, 3], w_hh, b, b], &format!("shapes [7, 2, 5] and [12, 3] do not fit: {input}"));
    gru(&[x, h0, &[11, 2], w_hh, b, b], &format!("shapes [7, 2, 5] and [11, 2] do not fit: {input}"));
    gru(
        &[x, h0, w_ih, &[12, 3], b, b],
        "shapes [12, 2] and [12, 3] do not fit: w_hh must be [3 hidden, hidden] for w_ih [3 hidden, input]",
    );
    for shapes in [[x, h0, w_ih, w_hh, &[4], b], [x, h0, w_ih, w_hh, b, &[4]]] {
        gru(
            &shapes,
            "shapes [12, 2] and [4] do not fit: biases must be [3 hidden] for w_ih [3 hidden, input]",
        );
    }
    gru(
        &[x, &[4, 6], w_ih, w_hh, b, b],
        "shapes [7, 2, 5] and [4, 6] do not fit: h0 must be [hidden, batch] for x [time, input, batch]",
    );
}

#[test]
fn a_composed_gru_needs_a_step() {
    refused(
        &[&[0, 2, 1], &[3, 2], &[3, 1], &[3]],
        |t, v| t.gru_composed(v[0], None, GruVars { w_ih: v[1], w_hh: v[2], b_ih: v[3], b_hh: v[3] }),
        "stack_time: shape [] is not usable: there must be at least one step",
    );
}

#[test]
fn only_one_element_can_be_differentiated() {
    let (mut tape, v) = tape(&[&[2, 1], &[0], &[1, 1]]);
    for (var, shape) in [(v[0], "[2, 1]"), (v[1], "[0]")] {
        let text = match tape.backward(var) {
            Ok(()) => String::new(),
            Err(e) => e.to_string(),
        };
        let rule = "only a tensor of one element can be differentiated";
        assert_eq!(text, format!("backward: shape {shape} is not usable: {rule}"));
    }
    ok(tape.backward(v[2]));
    assert_eq!(tape.grad(v[2]), [1.0]);
}

#[test]
fn what_is_not_finite_names_the_operation_that_made_it() {
    let at = |x: f64, f: fn(&mut Tape<f64>, Var) -> Result<Var, TensorError>| {
        let (mut tape, _) = tape(&[]);
        let x = ok(tape.variable(&[1, 2], &[1.0, x]));
        match f(&mut tape, x) {
            Ok(out) => panic!("{:?} passed", tape.value(out)),
            Err(e) => e.to_string(),
        }
    };
    let made = |op: &str, value: &str| {
        format!("{op} produced {value} at flat index 1 of its output of shape [1, 2]")
    };
    assert_eq!(at(-1.0, |t, x| t.ln(x)), made("ln", "NaN"));
    assert_eq!(at(0.0, |t, x| t.ln(x)), made("ln", "-inf"));
    assert_eq!(at(-1.0, |t, x| t.sqrt(x)), made("sqrt", "NaN"));
    assert_eq!(at(1e3, |t, x| t.exp(x)), made("exp", "inf"));
    assert_eq!(at(1e200, |t, x| t.mul(x, x)), made("mul", "inf"));
    assert_eq!(at(0.0, |t, x| t.div(x, x)), made("div", "NaN"));
    assert_eq!(at(1e200, |t, x| t.scale(x, -1e200)), made("scale", "-inf"));
    assert_eq!(at(0.0, |t, x| t.gaussian_nll(x, x, x)), made("gaussian_nll", "NaN"));
    assert_eq!(at(0.0, |t, x| t.gaussian_kl((x, x), (x, x))), made("gaussian_kl", "NaN"));
    assert_eq!(
        at(1e200, |t, x| {
            let zero = t.sub(x, x)?;
            t.squared_error(x, zero)
        }),
        made("squared_error", "inf")
    );
    let (mut tape, _) = tape(&[]);
    let text = tape.constant(&[1], &[f64::NAN]).map_or_else(|e| e.to_string(), |_| String::new());
    assert_eq!(text, "leaf produced NaN at flat index 0 of its output of shape [1]");
}

#[test]
fn the_check_is_on_in_debug_builds_and_off_in_release() {
    let mut tape = Tape::<f64>::new();
    assert_eq!(tape.constant(&[1], &[f64::NAN]).is_err(), cfg!(debug_assertions));
    tape.check_finite(false);
    let x = ok(tape.constant(&[1], &[-1.0]));
    let y = ok(tape.ln(x));
    assert!(tape.value(y)[0].is_nan());
}
