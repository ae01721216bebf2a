//! CPU time of training iterations, one figure a line: for comparing builds.
use augsim_physics::ball::paper_law::{PaperLaw, paper_engine};
use augsim_trainer::{EngineSpec, Recipe, Sequences, Settings, Training};
use std::time::Instant;

fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = text.rsplit(')').next().unwrap().split_whitespace().collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}

fn main() {
    let arg = |i: usize, d: usize| std::env::args().nth(i).map_or(d, |a| a.parse().unwrap());
    let (n, threads, which) = (arg(1, 20), arg(2, 1), arg(3, 1));
    let recipe = [Recipe::Neural, Recipe::Hybrid, Recipe::HybridPlus][which];
    let data = Sequences::new(&PaperLaw::default().generate(200, 1).unwrap().0, &["height_m", "velocity_m_s"]).unwrap();
    let settings = Settings::ball(recipe, 10_000, 1, EngineSpec::PybulletBall(paper_engine()));
    let mut training = Training::new(settings, &data).unwrap();
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
        for _ in 0..3 { training.step().unwrap(); }
        let mut v = vec![];
        let c = cpu();
        let mut last = 0.0;
        for _ in 0..n {
            let t = Instant::now();
            last = training.step().unwrap().loss;
            v.push(t.elapsed().as_secs_f64() * 1e3);
        }
        let c = (cpu() - c) / n as f64 * 1e3;
        v.sort_by(f64::total_cmp);
        println!("threads {threads}: min {:.2} ms, median {:.2} ms wall, {c:.2} ms cpu; loss {last:.4}", v[0], v[n / 2]);
    });
}
