//! GRU and linear kernels at the sizes of the nets: a batch of 16 trajectories, 400 steps, one thread.
//!
//! The throughput is in floating-point operations, so criterion's `Gelem/s` are GFLOP/s. A multiply-add
//! counts as two. Activations take time but are not counted, so these are lower bounds. For shares of the
//! machine's peak run `cargo run --release -p augsim-benches --bin roofline`.

use augsim_benches::kernels::{Gru, Linear, Product};
use augsim_tensor::kernels::{GruDims, LinearDims};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn gru(c: &mut Criterion) {
    // Input sizes of the hybrid encoder (x, u, eps), of a second layer, and of wider layers.
    for (input, hidden) in [(10, 16), (16, 16), (32, 32), (64, 64)] {
        let mut gru = Gru::new(GruDims { time: 400, input, hidden, batch: 16 }, input == hidden);
        let mut group = c.benchmark_group(format!("gru/400x{input}x16, hidden {hidden}"));
        group.throughput(Throughput::Elements(gru.forward_flops() as u64));
        group.bench_function("forward", |b| b.iter(|| gru.forward(true)));
        group.bench_function("forward, inference", |b| b.iter(|| gru.forward(false)));
        group.throughput(Throughput::Elements(gru.backward_flops() as u64));
        group.bench_function("backward", |b| b.iter(|| gru.backward()));
        group.finish();
    }
}

fn linear(c: &mut Criterion) {
    let mut linear = Linear::new(LinearDims { time: 400, input: 16, output: 4, batch: 16 });
    let mut group = c.benchmark_group("linear/400x16x16 to 4");
    group.throughput(Throughput::Elements(linear.forward_flops() as u64));
    group.bench_function("forward", |b| b.iter(|| linear.forward()));
    group.throughput(Throughput::Elements(2 * linear.forward_flops() as u64));
    group.bench_function("backward", |b| b.iter(|| linear.backward()));
    group.finish();
}

fn peak(c: &mut Criterion) {
    let mut product = Product::new(1024);
    let mut group = c.benchmark_group("matrix product");
    group.throughput(Throughput::Elements(product.flops() as u64));
    group.bench_function("1024^3", |b| b.iter(|| product.run()));
    group.finish();
}

criterion_group!(kernels, gru, linear, peak);
criterion_main!(kernels);
