//! The GRU and linear kernels at the extents of the ball's nets, on one thread: one tile of 16
//! trajectories, 400 steps, 16 hidden units.
//!
//! Throughput is in floating-point operations: criterion's `Gelem/s` are GFLOP/s. A multiply-add counts as
//! two; activations are not counted (they take time, so these are lower bounds). Forward: two products
//! of W and x and of W and h. Backward: four products, data and weight gradient of each.

use augsim_tensor::kernels::{
    GruBackward, GruDims, GruForward, GruWeights, LinearBackward, LinearDims, LinearForward, gru_simd,
    linear_simd,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

/// Values between -0.5 and 0.5 without a generator: a low-discrepancy sequence.
fn values(n: usize) -> Vec<f32> {
    (0..n).map(|i| (i as f32 * 0.618_034).fract() - 0.5).collect()
}

fn gru(c: &mut Criterion) {
    // Inputs of the hybrid encoder (x, u, eps) and of a second layer.
    for input in [10, 16] {
        let dims = GruDims { time: 400, input, hidden: 16, batch: 16 };
        let GruDims { time, hidden, batch, .. } = dims;
        let (w_ih, w_hh) = (values(3 * hidden * input), values(3 * hidden * hidden));
        let (b_ih, b_hh) = (values(3 * hidden), values(3 * hidden));
        let weights = GruWeights { w_ih: &w_ih, w_hh: &w_hh, b_ih: &b_ih, b_hh: &b_hh };
        let (x, dy) = (values(time * input * batch), values(time * hidden * batch));
        let (mut y, mut saved) = (vec![0.0; time * hidden * batch], vec![0.0; 4 * time * hidden * batch]);
        let mut scratch = vec![0.0; gru_simd::scratch(input, hidden)];
        let (mut dx, mut dw_ih, mut dw_hh) =
            (vec![0.0; x.len()], vec![0.0; w_ih.len()], vec![0.0; w_hh.len()]);
        let (mut db_ih, mut db_hh) = (vec![0.0; b_ih.len()], vec![0.0; b_hh.len()]);
        let products = (2 * time * batch * 3 * hidden * (input + hidden)) as u64;

        let mut group = c.benchmark_group(format!("gru/400x{input}x16, hidden 16"));
        group.throughput(Throughput::Elements(products));
        group.bench_function("forward", |b| {
            b.iter(|| {
                let (y, saved) = (&mut y, &mut saved);
                let args = GruForward { dims, weights, x: black_box(&x), h0: &[], y, saved };
                gru_simd::forward(args, &mut scratch);
            });
        });
        group.throughput(Throughput::Elements(2 * products));
        group.bench_function("backward", |b| {
            b.iter(|| {
                let args = GruBackward {
                    dims,
                    weights,
                    x: black_box(&x),
                    h0: &[],
                    y: &y,
                    saved: &saved,
                    dy: &dy,
                    dx: &mut dx,
                    dx_fresh: false,
                    dh0: &mut [],
                    dw_ih: &mut dw_ih,
                    dw_hh: &mut dw_hh,
                    db_ih: &mut db_ih,
                    db_hh: &mut db_hh,
                };
                gru_simd::backward(args, &mut scratch);
            });
        });
        group.finish();
    }
}

fn linear(c: &mut Criterion) {
    let dims = LinearDims { time: 400, input: 16, output: 4, batch: 16 };
    let LinearDims { time, input, output, batch } = dims;
    let (w, bias) = (values(output * input), values(output));
    let (x, dy) = (values(time * input * batch), values(time * output * batch));
    let mut y = vec![0.0; dy.len()];
    let (mut dx, mut dw, mut db) = (vec![0.0; x.len()], vec![0.0; w.len()], vec![0.0; bias.len()]);
    let mut scratch = vec![0.0; linear_simd::scratch(input, output)];
    let products = (2 * time * batch * input * output) as u64;

    let mut group = c.benchmark_group("linear/400x16x16 to 4");
    group.throughput(Throughput::Elements(products));
    group.bench_function("forward", |b| {
        b.iter(|| {
            let args = LinearForward { dims, w: &w, b: &bias, x: black_box(&x), y: &mut y };
            linear_simd::forward(args, &mut scratch);
        });
    });
    group.throughput(Throughput::Elements(2 * products));
    group.bench_function("backward", |b| {
        b.iter(|| {
            let (dx, dw, db) = (&mut dx, &mut dw, &mut db);
            linear_simd::backward(
                LinearBackward { dims, w: &w, x: black_box(&x), dy: &dy, dx, dx_fresh: false, dw, db },
                &mut scratch,
            );
        });
    });
    group.finish();
}

criterion_group!(kernels, gru, linear);
criterion_main!(kernels);
