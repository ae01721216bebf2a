//! A large battery of sealed sets: `discover_battery KIND FIRST COUNT [verbose]`, KIND one of null, single, pair, unlisted,
//! noise. Seeds are FIRST, FIRST + 1, …; rows go to standard output.
#![expect(clippy::print_stdout, reason = "a tool for the terminal")]

use augsim_tests::battery::{Battery, run};

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let kind = args.get(1).and_then(|k| Battery::from_name(k)).unwrap_or(Battery::Null);
    let number = |i: usize, default: u64| args.get(i).and_then(|s| s.parse().ok()).unwrap_or(default);
    let verbose = args.len() > 4;
    let summary = run(kind, number(2, 1), number(3, 20), &mut |row| {
        if verbose || !row.right {
            println!("{}", row.line);
        }
    });
    println!("{summary}");
}
