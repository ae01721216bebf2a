//! A large battery of sealed sets: `discover_battery KIND FIRST COUNT [verbose]` (pushes: `[PUSHES-PER-SET]`), KIND one of null, single, pair, unlisted,
//! noise, push-null, push-single (these two also with `-one-loop`: through the loop of all systems); the first five also as null-gaps, …, with empty cells. Seeds are FIRST, FIRST + 1, …; rows go to standard output.
#![expect(clippy::print_stdout, reason = "a tool for the terminal")]

use augsim_tests::battery::{Battery, Row, Summary, run, run_with_gaps};
use augsim_tests::push_battery;

/// How a battery is run: complete, or with empty cells.
type Family = fn(Battery, u64, u64, &mut dyn FnMut(&Row)) -> Summary;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    if let Some((single, one_loop)) = match args.get(1).map(String::as_str) {
        Some("push-null") => Some((false, false)),
        Some("push-single") => Some((true, false)),
        Some("push-null-one-loop") => Some((false, true)),
        Some("push-single-one-loop") => Some((true, true)),
        _ => None,
    } {
        let number = |i: usize, default: u64| args.get(i).and_then(|s| s.parse().ok()).unwrap_or(default);
        let pushes = number(4, 150) as usize;
        let summary = push_battery::run(single, one_loop, number(2, 1), number(3, 10), pushes, &mut |row| {
            println!("{}", row.line)
        });
        println!("{summary}");
        return;
    }
    let name = args.get(1).map_or("null", String::as_str);
    let (name, family) = name.strip_suffix("-gaps").map_or((name, run as Family), |n| (n, run_with_gaps));
    let kind = Battery::from_name(name).unwrap_or(Battery::Null);
    let number = |i: usize, default: u64| args.get(i).and_then(|s| s.parse().ok()).unwrap_or(default);
    let verbose = args.len() > 4;
    let summary = family(kind, number(2, 1), number(3, 20), &mut |row| {
        if verbose || !row.right {
            println!("{}", row.line);
        }
    });
    println!("{summary}");
}
