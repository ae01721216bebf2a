//! Runs discoveries on generated data sets of seeds FIRST, FIRST + 1, …; prints the scores and a summary.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a tool for the terminal")]

use augsim_tests::battery::{Battery, Row, Summary, run, run_with_gaps};
use augsim_tests::{fleets, measured_pushes, push_battery, sealed_memory, sealed_systems, traps};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Runs a battery of sealed data sets and scores the answers of the discovery loop
#[derive(Debug, Parser)]
struct Cli {
    #[command(subcommand)]
    kind: Kind,
}

/// Seeds of the sets
#[derive(Debug, Clone, Copy, Args)]
struct Seeds {
    /// Seed of the first set
    #[arg(default_value_t = 1)]
    first: u64,
    /// Number of sets
    #[arg(default_value_t = 20)]
    count: u64,
}

/// Options of ball data
#[derive(Debug, Clone, Copy, Args)]
struct BallOptions {
    #[command(flatten)]
    seeds: Seeds,
    /// Also print sets with a right answer
    #[arg(long)]
    verbose: bool,
    /// Leave some cells empty
    #[arg(long)]
    gaps: bool,
}

/// Options of systems of equations
#[derive(Debug, Clone, Copy, Args)]
struct SystemOptions {
    #[command(flatten)]
    seeds: Seeds,
    /// One long recording per set, with process noise
    #[arg(long)]
    long: bool,
}

/// Options of pushes
#[derive(Debug, Clone, Copy, Args)]
struct PushOptions {
    #[command(flatten)]
    seeds: Seeds,
    /// Pushes per set
    #[arg(default_value_t = 150)]
    pushes: usize,
}

#[derive(Debug, Clone, Subcommand)]
enum Kind {
    /// A ball without an effect
    Null(BallOptions),
    /// A ball with one effect of the library
    Single(BallOptions),
    /// A ball with two effects of the library
    Pair(BallOptions),
    /// A ball with an effect that the library does not have
    Unlisted(BallOptions),
    /// A ball with unusual noise
    Noise(BallOptions),
    /// A ball with one effect and a smooth residual that differs in each record
    Misfit(BallOptions),
    /// A ball with such a smooth residual and no effect
    MisfitNull(BallOptions),
    /// Pushes without an effect
    PushNull(PushOptions),
    /// Pushes with one effect
    PushSingle(PushOptions),
    /// Checks the answer on measured runs of two days against what is known of them
    PushMeasured {
        /// Folder of the runs (`mit-pusher-slider-runs`)
        folder: PathBuf,
    },
    /// Systems of equations without an effect; the binary `augsim` must be in the same folder as this one
    SystemsNull(SystemOptions),
    /// Systems with one effect of the library
    SystemsSingle(SystemOptions),
    /// Systems with two effects of the library
    SystemsPair(SystemOptions),
    /// Systems with a formula of the search grammar, and an empty library
    SystemsInside(SystemOptions),
    /// Systems with an effect outside library and grammar
    SystemsOutside(SystemOptions),
    /// Fleets of equal units; the binary `augsim` must be in the same folder as this one
    FleetsEqual(Seeds),
    /// Fleets in which one or two parameters differ from unit to unit
    FleetsIndividual(Seeds),
    /// Fleets in which a parameter differs and the model lacks an effect that all units share
    FleetsEffect(Seeds),
    /// Systems with unusual noise, logging faults or unmodelled defects
    ///
    /// Set I takes plant I mod 3 and kind I / 3, so that 165 sets are all kinds and 120 the first 40. The
    /// binary `augsim` must be in the same folder as this one
    Traps(Seeds),
    /// Systems with a hidden state or a delay that the model lacks: lags, second masses, friction with memory
    ///
    /// Set I takes case I mod 25. The binary `augsim` must be in the same folder as this one
    Memory(Seeds),
    /// Systems without a hidden state: complete models, and models that lack a static law
    ///
    /// Set I takes case I mod 20. The binary `augsim` must be in the same folder as this one
    MemoryNull(Seeds),
}

/// Runs ball sets with complete data or with empty cells: `(family, first seed, count, on_row) -> counts`.
type BatteryRunner = fn(Battery, u64, u64, &mut dyn FnMut(&Row)) -> Summary;

/// Runs and scores generated sets of ball data, and prints wrong answers and the counts.
fn ball(kind: Battery, BallOptions { seeds, verbose, gaps }: BallOptions) {
    let runner: BatteryRunner = if gaps { run_with_gaps } else { run };
    let summary = runner(kind, seeds.first, seeds.count, &mut |row| {
        if verbose || !row.right {
            println!("{}", row.line);
        }
    });
    println!("{summary}");
}

/// Runs and scores generated sets of pushes, with one effect or none, and prints all rows and the counts.
fn pushes(has_effect: bool, PushOptions { seeds, pushes }: PushOptions) {
    let show = &mut |row: &Row| println!("{}", row.line);
    println!("{}", push_battery::run(has_effect, seeds.first, seeds.count, pushes, show));
}

/// Path of the program `augsim` in the folder of this program, and a temporary folder for the data sets.
fn binary_and_folder() -> std::io::Result<(PathBuf, PathBuf)> {
    let augsim = std::env::current_exe()?.with_file_name("augsim");
    Ok((augsim, std::env::temp_dir().join(format!("augsim-battery-{}", std::process::id()))))
}

/// Generates data sets of systems of equations, runs `augsim` on them, and prints scores and counts.
fn systems(kind: sealed_systems::Kind, SystemOptions { seeds, long }: SystemOptions) -> std::io::Result<()> {
    let (augsim, folder) = binary_and_folder()?;
    let summary =
        sealed_systems::run(kind, (seeds.first, seeds.count), long, &augsim, &folder, &mut |row| {
            println!("{} {}", if row.right { " " } else { "!" }, row.line)
        })?;
    println!("{summary}");
    std::fs::remove_dir_all(folder)
}

/// Runs `augsim` on sets with odd noise, logging faults or unmodelled defects; prints scores and counts.
fn run_traps(Seeds { first, count }: Seeds) -> std::io::Result<()> {
    let (augsim, folder) = binary_and_folder()?;
    let summary = traps::run((first, count), &augsim, &folder, &mut |row| {
        println!("{} {}", if row.is_right { " " } else { "!" }, row.line)
    })?;
    println!("{summary}");
    std::fs::remove_dir_all(folder)
}

/// Runs `augsim` on sets with or without a hidden state; prints scores and counts.
fn run_memory(has_memory: bool, Seeds { first, count }: Seeds) -> std::io::Result<()> {
    let (augsim, folder) = binary_and_folder()?;
    let summary = sealed_memory::run(has_memory, (first, count), &augsim, &folder, &mut |row| {
        println!("{} {}", if row.is_right { " " } else { "!" }, row.line)
    })?;
    println!("{summary}");
    std::fs::remove_dir_all(folder)
}

/// Runs `augsim` on generated fleets; prints scores and counts.
fn run_fleets(kind: fleets::Kind, Seeds { first, count }: Seeds) -> std::io::Result<()> {
    let (augsim, folder) = binary_and_folder()?;
    let summary = fleets::run(kind, (first, count), &augsim, &folder, &mut |row| {
        println!("{} {}", if row.is_right { " " } else { "!" }, row.line)
    })?;
    println!("{summary}");
    std::fs::remove_dir_all(folder)
}

fn main() -> ExitCode {
    let exit_code = |outcome: std::io::Result<()>| match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!(
                "{error}; the binary `augsim` must be in the same folder as this one (`cargo build --release`)"
            );
            ExitCode::FAILURE
        }
    };
    let run_systems = |kind, options| exit_code(systems(kind, options));
    match Cli::parse().kind {
        Kind::Null(options) => ball(Battery::Null, options),
        Kind::Single(options) => ball(Battery::Single, options),
        Kind::Pair(options) => ball(Battery::Pair, options),
        Kind::Unlisted(options) => ball(Battery::Unlisted, options),
        Kind::Noise(options) => ball(Battery::Noise, options),
        Kind::Misfit(options) => ball(Battery::Misfit, options),
        Kind::MisfitNull(options) => ball(Battery::MisfitNull, options),
        Kind::PushNull(options) => pushes(false, options),
        Kind::PushSingle(options) => pushes(true, options),
        Kind::PushMeasured { folder } => println!("{}", measured_pushes::runs_of_two_days(&folder)),
        Kind::SystemsNull(options) => return run_systems(sealed_systems::Kind::Null, options),
        Kind::SystemsSingle(options) => return run_systems(sealed_systems::Kind::Single, options),
        Kind::SystemsPair(options) => return run_systems(sealed_systems::Kind::Pair, options),
        Kind::SystemsInside(options) => return run_systems(sealed_systems::Kind::Inside, options),
        Kind::SystemsOutside(options) => return run_systems(sealed_systems::Kind::Outside, options),
        Kind::FleetsEqual(seeds) => return exit_code(run_fleets(fleets::Kind::Equal, seeds)),
        Kind::FleetsIndividual(seeds) => return exit_code(run_fleets(fleets::Kind::Individual, seeds)),
        Kind::FleetsEffect(seeds) => return exit_code(run_fleets(fleets::Kind::Effect, seeds)),
        Kind::Traps(seeds) => return exit_code(run_traps(seeds)),
        Kind::Memory(seeds) => return exit_code(run_memory(true, seeds)),
        Kind::MemoryNull(seeds) => return exit_code(run_memory(false, seeds)),
    }
    ExitCode::SUCCESS
}
