//! Why a sweep cannot be planned, run or submitted as it was asked for.
//!
//! Every variant carries the values of its message. All of these are mistakes of use, with exit code 2.

use augsim_session::Usage;
use serde_json_path::JsonPath;
use std::fmt;
use std::path::PathBuf;
use thiserror::Error;

/// A sweep that makes no sense, or not together with what is on disk.
#[derive(Debug, Error)]
pub enum SweepFault {
    /// The file of the sweep cannot be read.
    #[error("{}: cannot read it: {cause}", file.display())]
    Unreadable { file: PathBuf, cause: std::io::Error },
    /// The file of the sweep is no TOML, or has other keys.
    #[error("{}: line {line}: {}; docs/sweeps.md has the grammar", file.display(), one_line(cause.message()))]
    Grammar { file: PathBuf, line: usize, cause: Box<toml::de::Error> },
    /// Something in the file of the sweep is wrong.
    #[error("{}: {fault}", file.display())]
    InFile { file: PathBuf, fault: Box<SweepFault> },
    /// The command cannot be swept.
    #[error("command = \"{line}\": sweeps are made of {}", known.join(", "))]
    UnknownCommand { line: String, known: &'static [&'static str] },
    /// The value of an option, or a list of values, cannot be.
    #[error("[{section}] {option}: {fault}")]
    Option { section: &'static str, option: String, fault: OptionFault },
    /// The path of a score is none.
    #[error("[scores] {column} = \"{path}\": no JSONPath (RFC 9535): {cause}")]
    ScorePath { column: String, path: String, cause: serde_json_path::ParseError },
    /// A score has the name of an option, whose column it would take.
    #[error("[scores] `{column}` is an option's name; give the score another")]
    ScoreName { column: String },
    /// A seed that is none.
    #[error("seed: {value} is no whole number of at least 0")]
    Seed { value: String },
    /// More tasks than a sweep may have.
    #[error("the lists cross to more than {most} tasks; make several sweeps")]
    TooManyTasks { most: usize },
    /// Two tasks that are the same.
    #[error("task {index} is there twice")]
    TaskTwice { index: usize },
    /// The command itself refuses the options of a task.
    #[error("{}", said(cause))]
    CommandLine { cause: clap::Error },
    /// The command itself refuses the request of a task.
    #[error(transparent)]
    Request(#[from] Usage),
    /// An input of a task cannot be found out.
    #[error("{0}")]
    Input(InputFault),
    /// The folder of a plan has no plan.
    #[error("{}: cannot read it ({cause}); give the folder of `sweep plan`", file.display())]
    NoPlan { file: PathBuf, cause: std::io::Error },
    /// The plan is not one of this program.
    #[error("{}: not of a plan of augsim: {cause}", file.display())]
    ForeignPlan { file: PathBuf, cause: serde_json::Error },
    /// The plan was made by another version.
    #[error("was planned for augsim {planned} and this is {here}; plan the sweep again")]
    OtherVersion { planned: String, here: &'static str },
    /// The plan has no task at a place.
    #[error("{}: has no task {index}; its {tasks} tasks are 0 to {}", plan.display(), tasks.saturating_sub(1))]
    NoTask { plan: PathBuf, index: usize, tasks: usize },
    /// A scheduler's variable says no place.
    #[error("{variable}={value}: is no place of a task")]
    NoPlace { variable: &'static str, value: String },
    /// Nothing says which task is to be run.
    #[error("which task? give --index N, set {}, or run all of them with --all", variables.join(" or "))]
    NoIndex { variables: &'static [&'static str] },
    /// This machine has no Slurm.
    #[error(
        "`sbatch` is not here; submit from a machine of the cluster, see the script with --dry-run, or run the tasks here with \
         `augsim sweep run PLAN --all`"
    )]
    NoSlurm,
    /// Too few tasks in a job for the cluster's arrays.
    #[error(
        "--tasks-per-job {asked}: the cluster's arrays end below {limit} (MaxArraySize), so {tasks} tasks need at least {least} \
         in a job"
    )]
    TasksPerJob { asked: usize, limit: usize, tasks: usize, least: usize },
    /// A partition or a time that no cluster can have.
    #[error("--{option} {value}: Slurm knows no such name")]
    SlurmName { option: &'static str, value: String },
    /// A path that no line of a script can hold.
    #[error("{}: no path for a script; move it", path.display())]
    ScriptPath { path: PathBuf },
}

/// Something that a plan, its inputs, its results or the cluster hold, and that keeps a sweep from going on: exit code 3.
#[derive(Debug, Error)]
pub enum Spoilt {
    /// An input has changed since the plan was made.
    #[error(
        "{}: the input {name} is not what it was when the sweep was planned (SHA-256 {} then, {} now); restore it, or plan the \
         sweep again", path.display(), short(planned), short(found)
    )]
    Input { path: PathBuf, name: String, planned: String, found: String },
    /// A task whose content does not belong to its name.
    #[error("{}: line {line}: task {id} was edited; its name follows from its content, so plan again", plan.display())]
    Task { plan: PathBuf, line: usize, id: String },
    /// A score that is no number, text or truth value.
    #[error("[scores] {column}: {path} leads to a list or an object, not to a number")]
    ScoreOfMany { column: String, path: JsonPath },
    /// A score with several values.
    #[error("[scores] {column}: {path} leads to {values} values; make it narrower")]
    ScoreTwice { column: String, path: JsonPath, values: usize },
    /// The cluster takes no job of the script.
    #[error("{}: Slurm refused the jobs: {}; edit the script and run it with `sh`", script.display(), one_line(stderr))]
    Refused { script: PathBuf, stderr: String },
}

/// Digits that tell one content from another to a reader.
fn short(sha256: &str) -> &str {
    sha256.get(..12).unwrap_or(sha256)
}

/// A mistake in an option of a sweep, without the name of the option.
#[derive(Debug)]
pub enum OptionFault {
    /// The sweep itself sets it.
    NotForSweeps { name: String },
    /// The command has none of this name.
    Unknown { name: String, command: String, known: Vec<String> },
    /// It stands in two places.
    Twice,
    /// One of its values stands in two places.
    ValueTwice { value: String },
    /// An empty list of values to cross.
    NoValue,
    /// An empty list as the value of one option.
    EmptyList,
    /// One value where values are crossed.
    Single,
    /// A range of whole numbers that is none, or too long.
    Range { most: usize },
    /// A number that is not finite.
    NotFinite { value: f64 },
    /// Lists that are too deep.
    Nested,
    /// A date or a table.
    NoValueOfOption,
    /// A number where a path is needed.
    NoPath { value: String },
    /// Several files for the same task.
    SeveralFiles { count: usize },
    /// An input that cannot be found.
    Input(InputFault),
}

impl fmt::Display for OptionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use OptionFault as Fault;
        match self {
            Fault::NotForSweeps { name } => {
                write!(f, "`{name}` is not for a sweep: it sets folders, threads and outputs itself")
            }
            Fault::Unknown { name, command, known } => {
                write!(f, "`augsim {command}` has no option `{name}`; it has {}", known.join(", "))
            }
            Fault::Twice => f.write_str("is given twice"),
            Fault::ValueTwice { value } => write!(f, "has {value} twice"),
            Fault::NoValue => f.write_str("the list is empty, so there would be no task; leave it out"),
            Fault::EmptyList => f.write_str("the list is empty; leave the option out"),
            Fault::Single => f.write_str("give a list; a single value stands in [options]"),
            Fault::Range { most } => {
                write!(f, "give a list, or {{ from = 1, to = 5 }} with at most {most} whole numbers")
            }
            Fault::NotFinite { value } => write!(f, "{value} is no number that a task can have"),
            Fault::Nested => f.write_str("lists within lists within lists mean nothing"),
            Fault::NoValueOfOption => f.write_str("give a number, a text, true or false, or a list of these"),
            Fault::NoPath { value } => write!(f, "{value} is no path"),
            Fault::SeveralFiles { count } => {
                write!(f, "{count} files match; patterns stand in [cross]")
            }
            Fault::Input(fault) => write!(f, "{fault}"),
        }
    }
}

/// Why an input of a task cannot be found.
#[derive(Debug)]
pub enum InputFault {
    /// Standard input, which only one task could read.
    StandardInput,
    /// Nothing is there.
    Absent { path: PathBuf },
    /// The pattern is none.
    Pattern { path: PathBuf, cause: glob::PatternError },
    /// A folder on the way cannot be read.
    Unreadable { path: PathBuf, cause: glob::GlobError },
    /// A name that no task can hold.
    NotUtf8 { pattern: PathBuf, path: PathBuf },
    /// No file matches the pattern.
    NoMatch { path: PathBuf },
    /// Neither file nor folder.
    Special { path: PathBuf },
}

impl fmt::Display for InputFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            InputFault::StandardInput => {
                f.write_str("`-` (standard input) cannot be read by many tasks; name a file")
            }
            InputFault::Absent { path } => write!(f, "{}: there is no such input", path.display()),
            InputFault::Pattern { path, cause } => write!(f, "{}: no pattern: {cause}", path.display()),
            InputFault::Unreadable { path, cause } => write!(f, "{}: {cause}", path.display()),
            InputFault::NotUtf8 { pattern, path } => {
                write!(f, "{}: {} is not UTF-8, which a task needs", pattern.display(), path.display())
            }
            InputFault::NoMatch { path } => write!(f, "{}: no file matches", path.display()),
            InputFault::Special { path } => {
                write!(f, "{}: is a device, pipe or socket; a task needs a file or a folder", path.display())
            }
        }
    }
}

/// The sentence of a parser of command lines, without the usage that it adds.
fn said(cause: &clap::Error) -> String {
    let text = cause.to_string();
    let said = text.split("\n\nUsage").next().unwrap_or(&text);
    let said = said.split("\n\nFor more").next().unwrap_or(said);
    one_line(said).trim_start_matches("error: ").to_owned()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
