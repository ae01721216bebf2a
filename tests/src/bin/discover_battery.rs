//! A large battery of sealed sets: `discover_battery KIND FIRST COUNT [verbose]` (pushes: `[PUSHES-PER-SET]`), KIND one of null, single, pair, unlisted,
//! noise, push-null, push-single; the first five also as null-gaps, …, with empty cells;
//! systems-null, systems-single, systems-pair, systems-inside and systems-outside run the binary `augsim` that lies beside this one on systems of equations.
//! Seeds are FIRST, FIRST + 1, …; rows go to standard output. `discover_battery push-measured FOLDER` holds the answer on measured runs of two days
//! (`mit-pusher-slider-runs`) to what is known of them.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a tool for the terminal")]

use augsim_tests::battery::{Battery, Row, Summary, run, run_with_gaps};
use augsim_tests::{measured_pushes, push_battery, sealed_systems};
use std::path::Path;
use std::process::ExitCode;

/// How a battery is run: complete, or with empty cells.
type Family = fn(Battery, u64, u64, &mut dyn FnMut(&Row)) -> Summary;

/// Runs a battery of systems of equations.
fn systems(kind: sealed_systems::Kind, seeds: (u64, u64)) -> std::io::Result<()> {
    let mut augsim = std::env::current_exe()?;
    augsim.set_file_name("augsim");
    let folder = std::env::temp_dir().join(format!("augsim-battery-{}", std::process::id()));
    let summary = sealed_systems::run(kind, seeds, &augsim, &folder, &mut |row| {
        println!("{} {}", if row.right { " " } else { "!" }, row.line)
    })?;
    println!("{summary}");
    std::fs::remove_dir_all(folder)
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().collect();
    let number = |i: usize, default: u64| args.get(i).and_then(|s| s.parse().ok()).unwrap_or(default);
    let of_systems = args.get(1).and_then(|name| name.strip_prefix("systems-"));
    if let Some(kind) = of_systems.and_then(sealed_systems::Kind::from_name) {
        return match systems(kind, (number(2, 0), number(3, 8))) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{error}; the binary `augsim` has to lie beside this one");
                ExitCode::FAILURE
            }
        };
    }
    if let [_, name, folder] = &args[..]
        && name == "push-measured"
    {
        println!("{}", measured_pushes::runs_of_two_days(Path::new(folder)));
        return ExitCode::SUCCESS;
    }
    if let Some(single) = match args.get(1).map(String::as_str) {
        Some("push-null") => Some(false),
        Some("push-single") => Some(true),
        _ => None,
    } {
        let pushes = number(4, 150) as usize;
        let summary = push_battery::run(single, number(2, 1), number(3, 10), pushes, &mut |row| {
            println!("{}", row.line)
        });
        println!("{summary}");
        return ExitCode::SUCCESS;
    }
    let name = args.get(1).map_or("null", String::as_str);
    let (name, family) = name.strip_suffix("-gaps").map_or((name, run as Family), |n| (n, run_with_gaps));
    let kind = Battery::from_name(name).unwrap_or(Battery::Null);
    let verbose = args.len() > 4;
    let summary = family(kind, number(2, 1), number(3, 20), &mut |row| {
        if verbose || !row.right {
            println!("{}", row.line);
        }
    });
    println!("{summary}");
    ExitCode::SUCCESS
}
