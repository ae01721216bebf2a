//! Writes sample reports with invented content, to be viewed in a browser.
//!
//! `cargo run -p augsim-report --example sample_report -- training out/training.html`
//! (or `empty`).

#[path = "sample_report/training.rs"]
mod training;

use augsim_report::{BenchmarkReport, benchmark_report};

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, path] = arguments.as_slice() else {
        return Err(std::io::Error::other("usage: sample_report training|empty PATH"));
    };
    let html = match kind.as_str() {
        "training" => benchmark_report(&training::sample()),
        "empty" => benchmark_report(&BenchmarkReport::default()),
        other => return Err(std::io::Error::other(format!("unknown kind `{other}`"))),
    };
    std::fs::write(path, html)
}
