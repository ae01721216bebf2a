//! The augsim side of the comparison with PyTorch and JAX, driven by `benches/peers/compare.py`.
//!
//! Arguments are the case and the number of threads. Each line on standard input is a number of calls; the
//! answer is a JSON line with wall and CPU time per call and the peak resident memory.
#![expect(clippy::print_stdout, reason = "it answers on standard output")]

use augsim_benches::{clock, ok, push::push_net, synthetic::Synthetic};
use augsim_data::random_stream;
use augsim_nn::Params;
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_tensor::kernels::normal::NormalLanes;
use augsim_trainer::nets::{Dcvrnn, DcvrnnSampler, DcvrnnSizes, Decoder};
use augsim_trainer::{Engine, Recipe, Sequences, Settings, TILE, Training};
use rayon::prelude::*;
use std::hint::black_box;
use std::io::BufRead;

/// Number of time steps that a sampler takes per call.
const BLOCK: usize = 32;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let case = arguments.next().unwrap_or_default();
    let threads = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(2);
    let pool = ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build());
    pool.install(|| match case.as_str() {
        "train_ball" => {
            let (dataset, _) = ok(DropDistribution::default().generate(200, 1));
            let data = ok(Sequences::new(&dataset, &["height_m", "velocity_m_s"]));
            let engine = Engine::PybulletBall(published_predictor());
            let mut training = ok(Training::new(Settings::new(Recipe::Hybrid, 10_000, 1, engine), &data));
            serve(|| {
                ok(training.step());
            });
        }
        "train_push" => {
            let mut params = Params::new(random_stream(1, "init", 0));
            let mut push = Synthetic::new(push_net(&mut params), params, 100, 300);
            serve(|| push.step());
        }
        "sample" => {
            let (net, params) = ball_net();
            let (count, time) = (2000, 400);
            let u = augsim_benches::kernels::values(BLOCK * net.sizes().condition * TILE);
            let mut samplers: Vec<_> = (0..count / TILE)
                .map(|_| (DcvrnnSampler::new(&net, &params, TILE, BLOCK), vec![0.0; time * 2 * TILE]))
                .collect();
            let mut seed = 0;
            serve(|| {
                seed += 1;
                samplers.par_iter_mut().with_max_len(4).enumerate().for_each(|(tile, (sampler, out))| {
                    sampler.reset();
                    let lanes = (0..TILE as u64).map(|lane| [seed, (tile * TILE) as u64 + lane]);
                    let mut noise = NormalLanes::new(lanes);
                    let mut eps = [0.0; BLOCK * 4 * TILE];
                    for out in out.chunks_mut(BLOCK * 2 * TILE) {
                        let steps = out.len() / (2 * TILE);
                        let eps = &mut eps[..steps * 4 * TILE];
                        noise.fill(eps);
                        let u = &u[..steps * net.sizes().condition * TILE];
                        out.copy_from_slice(sampler.advance(u, eps).mean);
                    }
                });
            });
        }
        "step" => {
            let (net, params) = ball_net();
            let mut sampler = DcvrnnSampler::new(&net, &params, 1, 1);
            let mut noise = NormalLanes::new([[1, 2]]);
            let (u, mut eps) = ([0.1; 4], [0.0; 4]);
            serve(|| {
                noise.fill(&mut eps);
                black_box(sampler.advance(&u, &eps));
            });
        }
        other => panic!("there is no case `{other}`; choose train_ball, train_push, sample or step"),
    });
}

/// The Hybrid net for the ball, and its initial weights.
fn ball_net() -> (Dcvrnn, Params<f32>) {
    let mut params = Params::new(random_stream(1, "init", 0));
    let decoder = Decoder::Fixed;
    let sizes =
        DcvrnnSizes { state: 2, condition: 4, latent: 4, hidden: 16, layers: 2, sd_floor: 1e-6, decoder };
    (Dcvrnn::new(&mut params, sizes), params)
}

/// Reads numbers of calls from standard input; for each, prints the time per call of `f`.
fn serve(mut f: impl FnMut()) {
    (0..3).for_each(|_| f());
    println!("ready");
    for line in std::io::stdin().lock().lines() {
        let calls: u32 = ok(ok(line).trim().parse());
        let (wall, cpu) = clock::time(|| (0..calls).for_each(|_| f()));
        let per_call = |seconds: f64| seconds / f64::from(calls);
        let (cpu, memory) = (cpu.map_or(-1.0, per_call), clock::peak_resident_mb().unwrap_or(-1.0));
        println!("{{\"wall_s\": {}, \"cpu_s\": {cpu}, \"rss_mb\": {memory}}}", per_call(wall));
    }
}
