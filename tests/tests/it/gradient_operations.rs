//! Contract: every operation of the autodiff tape has the right derivative for all shapes (sizes 0 and 1
//! too), whichever operands are constants, and however often an operand is used. Five computations of the
//! same numbers must agree: reverse-mode gradients, central differences along random directions, the
//! inner-product identity, single precision (which uses other kernels), and the compositions of elementary
//! operations that fused ones replace. The table of cases is complete, because the tape lists its operations
//! and says which of them made a tensor.

use augsim_tensor::{GruVars, OPERATIONS, Tape, Var};
use augsim_tests::gradient::{Function, Input, Outcome, check, check_inner_product, pull_back};
use augsim_tests::operations::{Case, cases};
use std::collections::BTreeSet;

#[test]
fn every_operation_of_the_tape_has_a_case_and_every_case_tests_what_it_says() {
    let mut seen = BTreeSet::from(["leaf"]);
    for case in cases() {
        let outcome = pull_back(&mut Tape::new(), &case.double, &case.inputs, |_| true, 1);
        assert_eq!(outcome.operation, case.operation, "{}", case.label);
        seen.insert(outcome.operation);
    }
    assert_eq!(seen, OPERATIONS.iter().copied().collect());
}

#[test]
fn gradients_agree_with_central_differences() {
    cases().iter().for_each(|c| check(&c.label, &c.inputs, &c.double));
}

#[test]
fn pushing_forward_and_pulling_back_are_adjoint() {
    cases().iter().for_each(|c| check_inner_product(&c.label, &c.inputs, &c.double));
}

#[test]
fn a_constant_operand_gets_no_gradient_and_changes_no_other() {
    for Case { label, inputs, double, .. } in cases() {
        let all = pull_back(&mut Tape::new(), &double, &inputs, |_| true, 1);
        for constant in 0..inputs.len() {
            let some = pull_back(&mut Tape::new(), &double, &inputs, |i| i != constant, 1);
            assert_eq!(some.output, all.output, "{label}");
            for (i, (some, all)) in some.gradients.iter().zip(&all.gradients).enumerate() {
                let want: &[f64] = if i == constant { &[] } else { all };
                assert_eq!(some, want, "{label}: operand {i} with operand {constant} constant");
            }
        }
    }
}

#[test]
fn what_a_recycled_buffer_held_never_shows() {
    for Case { label, inputs, double, single, .. } in cases() {
        let mut poisoned = inputs.clone();
        poisoned.iter_mut().for_each(|i| i.values.fill(f64::NAN));
        let mut tape = Tape::<f64>::new();
        tape.check_finite(false);
        pull_back(&mut tape, &double, &poisoned, |_| true, 1);
        tape.reset();
        let fresh = pull_back(&mut Tape::new(), &double, &inputs, |_| true, 1);
        assert_eq!(pull_back(&mut tape, &double, &inputs, |_| true, 1), fresh, "{label} in f64");
        let mut tape = Tape::<f32>::new();
        tape.check_finite(false);
        pull_back(&mut tape, &single, &poisoned, |_| true, 1);
        tape.reset();
        let fresh = pull_back(&mut Tape::new(), &single, &inputs, |_| true, 1);
        assert_eq!(pull_back(&mut tape, &single, &inputs, |_| true, 1), fresh, "{label} in f32");
    }
}

/// Largest difference of outputs and gradients, relative to the larger of 1 and the tensor's largest value.
fn distance<A: augsim_tensor::Scalar, B: augsim_tensor::Scalar>(a: &Outcome<A>, b: &Outcome<B>) -> f64 {
    let tensors = [(&a.output, &b.output)].into_iter().chain(a.gradients.iter().zip(&b.gradients));
    let mut worst = 0.0_f64;
    for (a, b) in tensors {
        assert_eq!(a.len(), b.len());
        let largest = b.iter().fold(1.0_f64, |m, v| m.max(v.to_f64().abs()));
        for (a, b) in a.iter().zip(b) {
            worst = worst.max((a.to_f64() - b.to_f64()).abs() / largest);
        }
    }
    worst
}

#[test]
fn single_precision_agrees_with_double() {
    // The inputs are rounded to f32 (6e-8), sums run over at most 131 values of order 1, and quotients
    // by sd^3 with sd as small as 0.5 multiply a rounding error by up to 10: 1e-5 in all.
    for Case { label, inputs, double, single, .. } in cases() {
        let single = pull_back(&mut Tape::new(), &single, &inputs, |_| true, 1);
        let double = pull_back(&mut Tape::new(), &double, &inputs, |_| true, 1);
        let off = distance(&single, &double);
        assert!(off <= 1e-5, "{label}: f32 is off by {off:e}");
    }
}

/// Asserts that a fused and a composed operation have the same output and gradients in f64.
///
/// They differ in the order of sums of at most 300 terms, so by a few hundred eps at most; the tolerance of
/// 1e-12 leaves a decade.
fn assert_twins(label: &str, inputs: &[Input], fused: &Function<'_>, composed: &Function<'_>) {
    let [a, b] = [fused, composed].map(|f| pull_back(&mut Tape::new(), f, inputs, |_| true, 3));
    let off = distance(&a, &b);
    assert!(off <= 1e-12, "{label}: fused and composed differ by {off:e}");
}

#[test]
fn fused_gru_is_its_composed_twin() {
    for (time, input, hidden, batch) in [(1, 1, 1, 1), (7, 3, 5, 4), (60, 8, 16, 3), (20, 2, 3, 17)] {
        let mut inputs: Vec<Input> = [
            vec![time, input, batch],
            vec![hidden, batch],
            vec![3 * hidden, input],
            vec![3 * hidden, hidden],
            vec![3 * hidden],
            vec![3 * hidden],
        ]
        .iter()
        .enumerate()
        .map(|(i, dims)| Input::normal(i as u64 + 60, dims))
        .collect();
        // Weights of a trained net's size: with normal ones the recurrence is chaotic.
        inputs[2..].iter_mut().flat_map(|i| &mut i.values).for_each(|v| *v *= 0.4);
        let w = |v: &[Var]| GruVars { w_ih: v[2], w_hh: v[3], b_ih: v[4], b_hh: v[5] };
        let label = format!("GRU {time} {input} {hidden} {batch}");
        assert_twins(&label, &inputs, &|t, v| t.gru_sequence(v[0], Some(v[1]), w(v)), &|t, v| {
            t.gru_composed(v[0], Some(v[1]), w(v))
        });
        assert_twins(&label, &inputs, &|t, v| t.gru_sequence(v[0], None, w(v)), &|t, v| {
            t.gru_composed(v[0], None, w(v))
        });
    }
}

#[test]
fn fused_linear_is_matrix_products_step_by_step() {
    let dims: [&[usize]; 3] = [&[7, 5, 3], &[4, 5], &[4]];
    let inputs: Vec<Input> = dims.iter().zip(1..).map(|(d, seed)| Input::normal(seed, d)).collect();
    assert_twins("linear", &inputs, &|t, v| t.linear(v[0], v[1], v[2]), &|t, v| {
        let bias = t.reshape(v[2], &[4, 1])?;
        let mut steps = Vec::new();
        for i in 0..7 {
            let x = t.slice(v[0], 0, i, i + 1)?;
            let x = t.reshape(x, &[5, 3])?;
            let y = t.matmul(v[1], x)?;
            steps.push(t.add(y, bias)?);
        }
        t.stack_time(&steps)
    });
}

fn gaussian_operands() -> [Input; 4] {
    let d = [6, 2, 5];
    [Input::normal(1, &d), Input::normal(2, &d), Input::positive(3, &d), Input::positive(4, &d)]
}

#[test]
fn fused_divergence_is_its_formula() {
    let fused: &Function<'_> = &|t, v| t.gaussian_kl((v[0], v[2]), (v[1], v[3]));
    assert_twins("gaussian_kl", &gaussian_operands(), fused, &|t, v| {
        let ratio = t.div(v[3], v[2])?;
        let ln = t.ln(ratio)?;
        let gap = t.sub(v[0], v[1])?;
        let gap = t.mul(gap, gap)?;
        let var_q = t.mul(v[2], v[2])?;
        let var_p = t.mul(v[3], v[3])?;
        let top = t.add(var_q, gap)?;
        let quotient = t.div(top, var_p)?;
        let half = t.scale(quotient, 0.5)?;
        let sum = t.add(ln, half)?;
        t.shift(sum, -0.5)
    });
}

#[test]
fn fused_likelihoods_are_their_formulas() {
    let [x, mean, sd, _] = gaussian_operands();
    let inputs = [x, mean, sd];
    assert_twins("gaussian_nll", &inputs, &|t, v| t.gaussian_nll(v[0], v[1], v[2]), &|t, v| {
        let ln = t.ln(v[2])?;
        let gap = t.sub(v[0], v[1])?;
        let gap = t.div(gap, v[2])?;
        let square = t.mul(gap, gap)?;
        let half = t.scale(square, 0.5)?;
        t.add(ln, half)
    });
    assert_twins("squared_error", &inputs[..2], &|t, v| t.squared_error(v[0], v[1]), &|t, v| {
        let gap = t.sub(v[0], v[1])?;
        let square = t.mul(gap, gap)?;
        t.scale(square, 0.5)
    });
}

#[test]
fn a_gradient_is_the_sum_over_all_paths_and_backward_can_be_repeated() {
    let mut tape = Tape::<f64>::new();
    let x = tape.variable(&[], &[3.0]).unwrap_or_else(|e| panic!("{e}"));
    let unused = tape.variable(&[2], &[1.0, 1.0]).unwrap_or_else(|e| panic!("{e}"));
    let mut loss = || {
        let square = tape.mul(x, x)?;
        let product = tape.mul(square, x)?;
        tape.add(product, square)
    };
    let loss = loss().unwrap_or_else(|e| panic!("{e}"));
    for _ in 0..2 {
        tape.backward(loss).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(tape.grad(x), [3.0 * 9.0 + 2.0 * 3.0]);
        assert_eq!(tape.grad(unused), [0.0, 0.0]);
        assert_eq!(tape.grad(loss), [0.0; 0]);
    }
}
