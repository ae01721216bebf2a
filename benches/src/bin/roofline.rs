//! Prints the roofline table: rates of kernels and of whole training iterations relative to the peak.
//!
//! The peak is the rate of a large matrix product on the same core in the same run. Everything runs on one
//! thread, and the shortest of many calls counts.
//!
//! `cargo run --release -p augsim-benches --bin roofline`
#![expect(clippy::print_stdout, reason = "it prints a table")]

use augsim_benches::clock::shortest_time;
use augsim_benches::flops::{BALL, PUSH_TRAINING};
use augsim_benches::kernels::{Gru, Linear, Product};
use augsim_benches::{ok, push::push_net, synthetic::Synthetic};
use augsim_data::random_stream;
use augsim_nn::Params;
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_tensor::kernels::{GruDims, LinearDims};
use augsim_tensor::simd::Level;
use augsim_trainer::{Engine, Recipe, Sequences, Settings, Training};

/// Measured rows of the roofline table, and the matrix product that defines the peak.
struct Table {
    product: Product,
    /// Highest rate of the matrix product so far, GFLOP/s.
    peak: f64,
    /// Rows of the table: name of the kernel, time per call, s, and rate, GFLOP/s.
    rows: Vec<(String, f64, f64)>,
}

impl Table {
    /// Measures `f` and adds a row to the table.
    ///
    /// The matrix product is measured again, since other processes may have slowed it down before.
    fn measure(&mut self, name: &str, flops: f64, mut f: impl FnMut()) {
        let seconds = shortest_time(1.0, &mut f);
        self.rows.push((name.to_owned(), seconds, flops / seconds / 1e9));
        let product = shortest_time(0.3, || self.product.run());
        self.peak = self.peak.max(self.product.flops() / product / 1e9);
    }

    fn print(&self) {
        println!("{:<44} {:>9} {:>9} {:>8}", "", "us", "GFLOP/s", "of peak");
        for (name, seconds, rate) in &self.rows {
            println!("{name:<44} {:>9.1} {rate:>9.1} {:>6.0} %", seconds * 1e6, 100.0 * rate / self.peak);
        }
        println!("{:<44} {:>9} {:>9.1}", "matrix product 512^3 (the peak)", "", self.peak);
    }
}

fn main() {
    let pool = ok(rayon::ThreadPoolBuilder::new().num_threads(1).build());
    pool.install(run);
}

fn run() {
    println!("level {}; one thread", Level::current().name());
    let mut table = Table { product: Product::new(512), peak: 0.0, rows: Vec::new() };
    let time = 400;
    for (input, hidden, needs_input_gradient) in
        [(10, 16, false), (8, 16, false), (4, 16, true), (16, 16, true), (32, 32, true), (64, 64, true)]
    {
        let mut gru = Gru::new(GruDims { time, input, hidden, batch: 16 }, needs_input_gradient);
        let name = format!("GRU {input} to {hidden}, 16 x {time}");
        let (forward, backward) = (gru.forward_flops(), gru.backward_flops());
        table.measure(&format!("{name}: forward, inference"), forward, || gru.forward(false));
        table.measure(&format!("{name}: forward"), forward, || gru.forward(true));
        table.measure(&format!("{name}: backward"), backward, || gru.backward());
    }
    let mut linear = Linear::new(LinearDims { time, input: 16, output: 4, batch: 16 });
    let flops = linear.forward_flops();
    table.measure("linear 16 to 4, 16 x 400: forward", flops, || linear.forward());
    table.measure("linear 16 to 4, 16 x 400: backward", 2.0 * flops, || linear.backward());

    let (dataset, _) = ok(DropDistribution::default().generate(200, 1));
    let data = ok(Sequences::new(&dataset, &["height_m", "velocity_m_s"]));
    let settings = Settings::new(Recipe::Hybrid, 10_000, 1, Engine::PybulletBall(published_predictor()));
    let mut training = ok(Training::new(settings, &data));
    table.measure("ball: whole iteration, batch 100", BALL.training(100, 400), || {
        ok(training.step());
    });
    let mut params = Params::new(random_stream(1, "init", 0));
    let mut push = Synthetic::new(push_net(&mut params), params, 100, 300);
    table.measure("push: whole iteration, batch 100", PUSH_TRAINING, || push.step());
    table.print();
}
