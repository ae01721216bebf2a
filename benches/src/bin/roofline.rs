//! The roofline table: rates of the kernels, and of whole training iterations, as shares of what a large
//! matrix product reaches on the same core in the same run. All on one thread; least of many calls.
//!
//! `cargo run --release -p augsim-benches --bin roofline`
#![expect(clippy::print_stdout, reason = "it prints a table")]

use augsim_benches::clock::least;
use augsim_benches::flops::{BALL, PUSH_TRAINING};
use augsim_benches::kernels::{Gru, Linear, Product};
use augsim_benches::{ok, push::push_net, synthetic::Synthetic};
use augsim_data::random_stream;
use augsim_nn::Params;
use augsim_physics::ball::paper_law::{PaperLaw, paper_engine};
use augsim_tensor::kernels::{GruDims, LinearDims};
use augsim_tensor::simd::Level;
use augsim_trainer::{Engine, Recipe, Sequences, Settings, Training};

struct Table {
    product: Product,
    /// Best rate of the product so far, GFLOP/s.
    peak: f64,
    /// Name of the kernel, seconds, GFLOP/s.
    rows: Vec<(String, f64, f64)>,
}

impl Table {
    /// Measures `f`, and the product once more: others may be using the machine, so the best counts.
    fn row(&mut self, what: &str, flops: f64, mut f: impl FnMut()) {
        let seconds = least(1.0, &mut f);
        self.rows.push((what.to_owned(), seconds, flops / seconds / 1e9));
        let product = least(0.3, || self.product.run());
        self.peak = self.peak.max(self.product.flops() / product / 1e9);
    }

    fn print(&self) {
        println!("{:<44} {:>9} {:>9} {:>8}", "", "us", "GFLOP/s", "of peak");
        for (what, seconds, rate) in &self.rows {
            println!("{what:<44} {:>9.1} {rate:>9.1} {:>6.0} %", seconds * 1e6, 100.0 * rate / self.peak);
        }
        println!("{:<44} {:>9} {:>9.1}", "matrix product 512^3 (the peak)", "", self.peak);
    }
}

fn main() {
    let one = ok(rayon::ThreadPoolBuilder::new().num_threads(1).build());
    one.install(run);
}

fn run() {
    println!("level {}; one thread", Level::current().name());
    let mut table = Table { product: Product::new(512), peak: 0.0, rows: Vec::new() };
    let time = 400;
    for (input, hidden, wants_dx) in
        [(10, 16, false), (8, 16, false), (4, 16, true), (16, 16, true), (32, 32, true), (64, 64, true)]
    {
        let mut gru = Gru::new(GruDims { time, input, hidden, batch: 16 }, wants_dx);
        let what = format!("GRU {input} to {hidden}, 16 x {time}");
        let (forward, backward) = (gru.forward_flops(), gru.backward_flops());
        table.row(&format!("{what}: forward, inference"), forward, || gru.forward(false));
        table.row(&format!("{what}: forward"), forward, || gru.forward(true));
        table.row(&format!("{what}: backward"), backward, || gru.backward());
    }
    let mut linear = Linear::new(LinearDims { time, input: 16, output: 4, batch: 16 });
    let flops = linear.forward_flops();
    table.row("linear 16 to 4, 16 x 400: forward", flops, || linear.forward());
    table.row("linear 16 to 4, 16 x 400: backward", 2.0 * flops, || linear.backward());

    let (dataset, _) = ok(PaperLaw::default().generate(200, 1));
    let data = ok(Sequences::new(&dataset, &["height_m", "velocity_m_s"]));
    let settings = Settings::new(Recipe::Hybrid, 10_000, 1, Engine::PybulletBall(paper_engine()));
    let mut training = ok(Training::new(settings, &data));
    table.row("ball: whole iteration, batch 100", BALL.training(100, 400), || {
        ok(training.step());
    });
    let mut params = Params::new(random_stream(1, "init", 0));
    let mut push = Synthetic::new(push_net(&mut params), params, 100, 300);
    table.row("push: whole iteration, batch 100", PUSH_TRAINING, || push.step());
    table.print();
}
