//! Measures how the time of a training iteration scales.
//!
//! Varies the batch from 10 to 10,000, hidden units from 8 to 128 and steps from 50 to 5,000, each around the
//! ball's configuration, with one and two threads. Writes `scaling.csv` and one SVG per variable, in which a
//! dashed line shows a cost proportional to the number of operations. Wall times are meaningful only on an
//! idle machine.
//!
//! `cargo run --release -p augsim-benches --bin scaling -- out/scaling`
#![expect(clippy::print_stdout, reason = "it prints what it measures")]

use augsim_benches::flops::BALL;
use augsim_benches::{clock, ok, synthetic::Synthetic};
use augsim_data::random_stream;
use augsim_nn::Params;
use augsim_report::figure::{Axis, Figure, Line, Mark, Series, Tone};
use augsim_trainer::nets::{Dcvrnn, DcvrnnSizes, Decoder};
use std::fmt::Write;
use std::path::Path;

/// Scaled variables: name, fixed part of the configuration, and values of the variable.
const VARIED: [(&str, &str, &[usize]); 3] = [
    ("batch", "16 units, 400 steps", &[10, 30, 100, 300, 1000, 3000, 10_000]),
    ("hidden", "batch 100, 400 steps", &[8, 16, 32, 64, 128]),
    ("steps", "batch 100, 16 units", &[50, 100, 200, 400, 1000, 2000, 5000]),
];
/// Numbers of threads with which each configuration is measured.
const THREADS: [usize; 2] = [1, 2];
/// Configuration of the ball: batch size, hidden units and time steps.
const CENTRE: [usize; 3] = [100, 16, 400];

/// Number of floating-point operations of one training iteration in this configuration.
fn operations([batch, hidden, steps]: [usize; 3]) -> f64 {
    augsim_benches::flops::Extents { hidden, ..BALL }.training(batch, steps)
}

/// Shortest wall time and CPU time of a training iteration, s, and its rate per core, GFLOP/s.
///
/// The CPU time is the wall time if the system does not report it.
fn measure([batch, hidden, steps]: [usize; 3], threads: usize) -> (f64, f64, f64) {
    let (extents, decoder) = (augsim_benches::flops::Extents { hidden, ..BALL }, Decoder::Fixed);
    let (state, condition, latent) = (extents.state, extents.condition, extents.latent);
    let mut params = Params::new(random_stream(1, "init", 0));
    let sizes = DcvrnnSizes { state, condition, latent, hidden, layers: 2, sd_floor: 1e-6, decoder };
    let net = Dcvrnn::new(&mut params, sizes);
    let mut training = Synthetic::new(net, params, batch, steps);
    let pool = ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build());
    pool.install(|| {
        training.step();
        // The CPU clock of the system advances every few milliseconds, so a measurement takes at least 0.2 s.
        let calls = (0.2 / clock::time(|| training.step()).0).ceil().max(1.0);
        let (mut wall, mut cpu) = (f64::MAX, f64::MAX);
        for _ in 0..3 {
            let (w, c) = clock::time(|| (0..calls as usize).for_each(|_| training.step()));
            (wall, cpu) = (wall.min(w / calls), cpu.min(c.unwrap_or(w) / calls));
        }
        (wall, cpu, operations([batch, hidden, steps]) / cpu / 1e9)
    })
}

fn main() {
    let out = std::env::args().nth(1).unwrap_or_else(|| "out/scaling".to_owned());
    ok(std::fs::create_dir_all(&out));
    let mut csv = String::from("varied,batch,hidden,steps,threads,wall_s,cpu_s,gflop_s_per_core\n");
    for (axis, (varied, fixed, values)) in VARIED.into_iter().enumerate() {
        let title = format!("Training iteration, ball's net, {fixed}");
        let x: Vec<f64> = values.iter().map(|v| *v as f64).collect();
        let mut figure = Line::new(&title, Axis::log(varied, ""), Axis::log("wall time", "s"));
        for threads in THREADS {
            let mut seconds = Vec::new();
            for &value in values {
                let mut extents = CENTRE;
                extents[axis] = value;
                let (wall, cpu, rate) = measure(extents, threads);
                let [batch, hidden, steps] = extents;
                ok(writeln!(csv, "{varied},{batch},{hidden},{steps},{threads},{wall},{cpu},{rate}"));
                println!(
                    "{varied} {value}, {threads} threads: {wall:.4} s wall, {cpu:.4} s CPU, {rate:.1} GFLOP/s"
                );
                seconds.push(wall);
            }
            let name = if threads == 1 { "1 thread".to_owned() } else { format!("{threads} threads") };
            if threads == 1 {
                // The dashed line passes through the time of the ball's configuration.
                let at_centre = values.iter().zip(&seconds).find(|(v, _)| **v == CENTRE[axis]);
                let rate = at_centre.map_or(f64::NAN, |(_, s)| s / operations(CENTRE));
                let times = values.iter().map(|&value| {
                    let mut extents = CENTRE;
                    extents[axis] = value;
                    rate * operations(extents)
                });
                let times = times.collect();
                figure =
                    figure.with(Series::line("proportional to operations", Tone::Muted, x.clone(), times));
            }
            let series = Series::line(&name, Tone::Series(threads as u8 - 1), x.clone(), seconds);
            figure = figure.with(series.with_mark(Mark::LinePoints));
        }
        let svg = Figure::Line(figure).svg_document(640.0);
        ok(std::fs::write(Path::new(&out).join(format!("{varied}.svg")), svg));
    }
    ok(std::fs::write(Path::new(&out).join("scaling.csv"), csv));
}
