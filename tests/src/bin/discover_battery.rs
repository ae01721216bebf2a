//! A large battery of sealed sets. Seeds are FIRST, FIRST + 1, …; rows and a summary go to standard output.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a tool for the terminal")]

use augsim_tests::battery::{Battery, Row, Summary, run, run_with_gaps};
use augsim_tests::{measured_pushes, push_battery, sealed_systems, traps};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Runs a battery of sealed sets and counts what the loop makes of them.
#[derive(Debug, Parser)]
struct Cli {
    #[command(subcommand)]
    kind: Kind,
}

/// Seeds of the sets.
#[derive(Debug, Clone, Copy, Args)]
struct Seeds {
    /// Seed of the first set
    #[arg(default_value_t = 1)]
    first: u64,
    /// Sets
    #[arg(default_value_t = 20)]
    count: u64,
}

/// Sets of a ball.
#[derive(Debug, Clone, Copy, Args)]
struct OfBall {
    #[command(flatten)]
    seeds: Seeds,
    /// Print the sets that were told rightly, too
    #[arg(long)]
    verbose: bool,
    /// Empty some cells
    #[arg(long)]
    gaps: bool,
}

/// Sets of systems of equations.
#[derive(Debug, Clone, Copy, Args)]
struct OfSystems {
    #[command(flatten)]
    seeds: Seeds,
    /// One long recording a set, of a motion that is shaken
    #[arg(long)]
    long: bool,
}

/// Sets of pushes.
#[derive(Debug, Clone, Copy, Args)]
struct OfPushes {
    #[command(flatten)]
    seeds: Seeds,
    /// Pushes in a set
    #[arg(default_value_t = 150)]
    pushes: usize,
}

#[derive(Debug, Clone, Subcommand)]
enum Kind {
    /// A ball and nothing else
    Null(OfBall),
    /// A ball with one effect of the library
    Single(OfBall),
    /// A ball with two effects
    Pair(OfBall),
    /// A ball with a law that the library does not have
    Unlisted(OfBall),
    /// A ball with unusual noise
    Noise(OfBall),
    /// A ball with one effect beside smooth misfit that each record has of its own
    Misfit(OfBall),
    /// A ball with such misfit alone
    MisfitNull(OfBall),
    /// Pushes and nothing else
    PushNull(OfPushes),
    /// Pushes with one effect
    PushSingle(OfPushes),
    /// The answer on measured runs of two days, held to what is known of them
    PushMeasured {
        /// Folder of the runs (`mit-pusher-slider-runs`)
        folder: PathBuf,
    },
    /// Systems of equations and nothing else; the binary `augsim` has to lie beside this one
    SystemsNull(OfSystems),
    /// Systems with one candidate of the library
    SystemsSingle(OfSystems),
    /// Systems with two
    SystemsPair(OfSystems),
    /// Systems with a formula inside the grammar, and no library
    SystemsInside(OfSystems),
    /// Systems with a law outside the grammar
    SystemsOutside(OfSystems),
    /// Systems whose peculiarity is noise, logging, or a defect outside the library; set I takes plant I mod 3 and kind I / 3, so that
    /// 165 sets are all kinds and 120 the first 40. The binary `augsim` has to lie beside this one
    Traps(Seeds),
}

/// A battery of a ball: complete, or with empty cells.
type Family = fn(Battery, u64, u64, &mut dyn FnMut(&Row)) -> Summary;

fn ball(kind: Battery, OfBall { seeds, verbose, gaps }: OfBall) {
    let family: Family = if gaps { run_with_gaps } else { run };
    let summary = family(kind, seeds.first, seeds.count, &mut |row| {
        if verbose || !row.right {
            println!("{}", row.line);
        }
    });
    println!("{summary}");
}

fn pushes(has_effect: bool, OfPushes { seeds, pushes }: OfPushes) {
    let show = &mut |row: &Row| println!("{}", row.line);
    println!("{}", push_battery::run(has_effect, seeds.first, seeds.count, pushes, show));
}

/// The binary `augsim` beside this one, and a folder for the sets.
fn binary_and_folder() -> std::io::Result<(PathBuf, PathBuf)> {
    let augsim = std::env::current_exe()?.with_file_name("augsim");
    Ok((augsim, std::env::temp_dir().join(format!("augsim-battery-{}", std::process::id()))))
}

/// Runs a battery of systems of equations.
fn systems(kind: sealed_systems::Kind, OfSystems { seeds, long }: OfSystems) -> std::io::Result<()> {
    let (augsim, folder) = binary_and_folder()?;
    let summary =
        sealed_systems::run(kind, (seeds.first, seeds.count), long, &augsim, &folder, &mut |row| {
            println!("{} {}", if row.right { " " } else { "!" }, row.line)
        })?;
    println!("{summary}");
    std::fs::remove_dir_all(folder)
}

/// Runs the battery of traps.
fn run_traps(Seeds { first, count }: Seeds) -> std::io::Result<()> {
    let (augsim, folder) = binary_and_folder()?;
    let summary = traps::run((first, count), &augsim, &folder, &mut |row| {
        println!("{} {}", if row.is_right { " " } else { "!" }, row.line)
    })?;
    println!("{summary}");
    std::fs::remove_dir_all(folder)
}

fn main() -> ExitCode {
    let ended = |outcome: std::io::Result<()>| match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}; the binary `augsim` has to lie beside this one");
            ExitCode::FAILURE
        }
    };
    let of_systems = |kind, of| ended(systems(kind, of));
    match Cli::parse().kind {
        Kind::Null(of) => ball(Battery::Null, of),
        Kind::Single(of) => ball(Battery::Single, of),
        Kind::Pair(of) => ball(Battery::Pair, of),
        Kind::Unlisted(of) => ball(Battery::Unlisted, of),
        Kind::Noise(of) => ball(Battery::Noise, of),
        Kind::Misfit(of) => ball(Battery::Misfit, of),
        Kind::MisfitNull(of) => ball(Battery::MisfitNull, of),
        Kind::PushNull(of) => pushes(false, of),
        Kind::PushSingle(of) => pushes(true, of),
        Kind::PushMeasured { folder } => println!("{}", measured_pushes::runs_of_two_days(&folder)),
        Kind::SystemsNull(of) => return of_systems(sealed_systems::Kind::Null, of),
        Kind::SystemsSingle(of) => return of_systems(sealed_systems::Kind::Single, of),
        Kind::SystemsPair(of) => return of_systems(sealed_systems::Kind::Pair, of),
        Kind::SystemsInside(of) => return of_systems(sealed_systems::Kind::Inside, of),
        Kind::SystemsOutside(of) => return of_systems(sealed_systems::Kind::Outside, of),
        Kind::Traps(seeds) => return ended(run_traps(seeds)),
    }
    ExitCode::SUCCESS
}
