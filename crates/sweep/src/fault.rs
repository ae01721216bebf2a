//! Errors of planning, running and submitting a sweep.
//!
//! Each variant carries the values of its message. [`SweepFault`] is a usage error with exit code 2.

use augsim_session::Usage;
use serde_json_path::JsonPath;
use std::fmt;
use std::path::PathBuf;
use thiserror::Error;

/// Usage error of a sweep: wrong sweep file, options, plan or index (exit code 2).
#[derive(Debug, Error)]
pub enum SweepFault {
    /// The sweep file cannot be read.
    #[error("{}: cannot read it: {cause}", file.display())]
    Unreadable { file: PathBuf, cause: std::io::Error },
    /// The sweep file is not valid TOML, or has unknown keys.
    #[error("{}: line {line}: {}; the grammar is in docs/sweeps.md", file.display(), one_line(cause.message()))]
    Grammar { file: PathBuf, line: usize, cause: Box<toml::de::Error> },
    /// The sweep file has the error `fault`; names the file.
    #[error("{}: {fault}", file.display())]
    InFile { file: PathBuf, fault: Box<SweepFault> },
    /// The command of the sweep file is not one that can be swept.
    #[error("command = \"{line}\": cannot be swept; use one of {}", known.join(", "))]
    UnknownCommand { line: String, known: &'static [&'static str] },
    /// An option in the sweep file, or its list of values, is invalid.
    #[error("[{section}] {option}: {fault}")]
    Option { section: &'static str, option: String, fault: OptionFault },
    /// The JSONPath of a score is invalid.
    #[error("[scores] {column} = \"{path}\": not a valid JSONPath (RFC 9535): {cause}")]
    ScorePath { column: String, path: String, cause: serde_json_path::ParseError },
    /// A score has the same name as an option, which is already a column of the table.
    #[error("[scores] `{column}` is the name of an option; rename the score")]
    ScoreName { column: String },
    /// The value of the seed is not an integer of at least 0.
    #[error("seed: {value} is not an integer of at least 0")]
    Seed { value: String },
    /// The sweep has more tasks than the maximum.
    #[error("the lists combine to more than {most} tasks; split the sweep")]
    TooManyTasks { most: usize },
    /// Two tasks of the sweep are identical.
    #[error("task {index} is given twice")]
    TaskTwice { index: usize },
    /// The clap parser of the command rejects the options of a task.
    #[error("{}", clap_message(cause))]
    CommandLine { cause: clap::Error },
    /// A check of the command beyond its parser rejects the options of a task.
    #[error(transparent)]
    Request(#[from] Usage),
    /// An input file or folder of a task is invalid.
    #[error("{0}")]
    Input(InputFault),
    /// The folder contains no plan.
    #[error("{}: cannot read it ({cause}); give the folder of `sweep plan`", file.display())]
    NoPlan { file: PathBuf, cause: std::io::Error },
    /// The plan file cannot be parsed.
    #[error("{}: not a valid plan of augsim: {cause}", file.display())]
    ForeignPlan { file: PathBuf, cause: serde_json::Error },
    /// The plan was made by another version of augsim.
    #[error("the sweep was planned for augsim {planned}, but this is {here}; plan the sweep again")]
    OtherVersion { planned: String, here: &'static str },
    /// The plan has no task with this index.
    #[error("{}: has no task {index}; its {tasks} tasks are 0 to {}", plan.display(), tasks.saturating_sub(1))]
    NoTask { plan: PathBuf, index: usize, tasks: usize },
    /// The environment variable of a scheduler does not hold a task index.
    #[error("{variable}={value}: not a task index")]
    NoPlace { variable: &'static str, value: String },
    /// No task index was given on the command line or by a scheduler.
    #[error("no task is given; use --index N, set {}, or run all of them with --all", variables.join(" or "))]
    NoIndex { variables: &'static [&'static str] },
    /// `sbatch`, the command of Slurm that submits jobs, is not installed.
    #[error(
        "`sbatch` was not found; submit from a machine of the cluster, print the script with --dry-run, or run the tasks here with \
         `augsim sweep run PLAN --all`"
    )]
    NoSlurm,
    /// The number of tasks per job is too small for the array limit of the cluster.
    #[error(
        "--tasks-per-job {asked}: the cluster's array indices must be below {limit} (MaxArraySize), so {tasks} tasks need at least {least} \
         in a job"
    )]
    TasksPerJob { asked: usize, limit: usize, tasks: usize, least: usize },
    /// The name of the Slurm partition or the time limit is invalid.
    #[error("--{option} {value}: not a valid value for Slurm")]
    SlurmName { option: &'static str, value: String },
    /// The path cannot be written in a shell script.
    #[error("{}: this path cannot be written in a script; move the folder", path.display())]
    ScriptPath { path: PathBuf },
}

/// Invalid content of a plan, its inputs or its results, or a rejection by the cluster: exit code 3.
#[derive(Debug, Error)]
pub enum SweepDataError {
    /// An input of a task has changed since the plan was made.
    #[error(
        "{}: the input {name} has changed since the sweep was planned (SHA-256 {} then, {} now); restore it, or plan the \
         sweep again", path.display(), short(planned), short(found)
    )]
    Input { path: PathBuf, name: String, planned: String, found: String },
    /// The id of a task in the plan does not match its content.
    #[error("{}: line {line}: task {id} was edited, so its id does not match its content; plan the sweep again", plan.display())]
    Task { plan: PathBuf, line: usize, id: String },
    /// The JSONPath of a score selects a list or an object.
    #[error("[scores] {column}: {path} selects a list or an object, not a single value")]
    ScoreOfMany { column: String, path: JsonPath },
    /// The JSONPath of a score selects several values.
    #[error("[scores] {column}: {path} selects {values} values; make it more specific")]
    ScoreTwice { column: String, path: JsonPath, values: usize },
    /// Slurm rejects the submitted jobs.
    #[error("{}: Slurm refused the jobs: {}; edit the script and run it with `sh`", script.display(), one_line(stderr))]
    Refused { script: PathBuf, stderr: String },
}

/// Shortens a SHA-256 hash to 12 digits for display.
fn short(sha256: &str) -> &str {
    sha256.get(..12).unwrap_or(sha256)
}

/// Error of one option in a sweep file; the message does not name the option.
#[derive(Debug)]
pub enum OptionFault {
    /// The sweep itself sets the option, so the file must not.
    NotForSweeps { name: String },
    /// The command has no option of this name.
    Unknown { name: String, command: String, known: Vec<String> },
    /// The sweep file gives the option twice.
    Twice,
    /// The list of an option contains a value twice.
    ValueTwice { value: String },
    /// The list of an option's values is empty.
    NoValue,
    /// One of an option's values is an empty list.
    EmptyList,
    /// An option in `[cross]` has a single value instead of a list.
    Single,
    /// The range of whole numbers is invalid or has too many numbers.
    Range { most: usize },
    /// The number given for an option is not finite.
    NotFinite { value: f64 },
    /// The lists of an option's values are nested too deeply.
    Nested,
    /// The value of an option is a date or a table.
    NoValueOfOption,
    /// The value of an option that needs a path is not text.
    NoPath { value: String },
    /// Several files match the value of an option that takes one.
    SeveralFiles { count: usize },
    /// The input file or folder given for an option is invalid.
    Input(InputFault),
}

impl fmt::Display for OptionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use OptionFault as Fault;
        match self {
            Fault::NotForSweeps { name } => {
                write!(f, "`{name}` cannot be set in a sweep, which sets folders, threads and outputs itself")
            }
            Fault::Unknown { name, command, known } => {
                write!(f, "`augsim {command}` has no option `{name}`; it has {}", known.join(", "))
            }
            Fault::Twice => f.write_str("is given twice"),
            Fault::ValueTwice { value } => write!(f, "has {value} twice"),
            Fault::NoValue => f.write_str("the list is empty, so there would be no task; remove it"),
            Fault::EmptyList => f.write_str("the list is empty; remove the option"),
            Fault::Single => f.write_str("give a list; move a single value to [options]"),
            Fault::Range { most } => {
                write!(f, "give a list, or {{ from = 1, to = 5 }} with at most {most} whole numbers")
            }
            Fault::NotFinite { value } => write!(f, "{value} is not a finite number"),
            Fault::Nested => f.write_str("lists must not be nested more than twice"),
            Fault::NoValueOfOption => f.write_str("give a number, a text, true or false, or a list of these"),
            Fault::NoPath { value } => write!(f, "{value} is not a path"),
            Fault::SeveralFiles { count } => {
                write!(f, "{count} files match; move the pattern to [cross]")
            }
            Fault::Input(fault) => write!(f, "{fault}"),
        }
    }
}

/// Error of an input file or folder of a task.
#[derive(Debug)]
pub enum InputFault {
    /// The input is standard input, which only one task could read.
    StandardInput,
    /// The path of the input does not exist.
    Absent { path: PathBuf },
    /// The glob pattern of the input is invalid.
    Pattern { path: PathBuf, cause: glob::PatternError },
    /// A folder cannot be read while files are matched with a glob pattern.
    Unreadable { path: PathBuf, cause: glob::GlobError },
    /// The name of a matching file is not UTF-8.
    NotUtf8 { pattern: PathBuf, path: PathBuf },
    /// No file matches the glob pattern.
    NoMatch { path: PathBuf },
    /// The path of the input is neither a file nor a folder.
    Special { path: PathBuf },
}

impl fmt::Display for InputFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            InputFault::StandardInput => {
                f.write_str("`-` (standard input) cannot be read by many tasks; name a file")
            }
            InputFault::Absent { path } => write!(f, "{}: the input does not exist", path.display()),
            InputFault::Pattern { path, cause } => {
                write!(f, "{}: not a valid pattern: {cause}", path.display())
            }
            InputFault::Unreadable { path, cause } => write!(f, "{}: {cause}", path.display()),
            InputFault::NotUtf8 { pattern, path } => {
                write!(f, "{}: the file name {} is not UTF-8", pattern.display(), path.display())
            }
            InputFault::NoMatch { path } => write!(f, "{}: no file matches", path.display()),
            InputFault::Special { path } => {
                write!(f, "{}: is a device, pipe or socket; a task needs a file or a folder", path.display())
            }
        }
    }
}

/// Returns the message of a clap error without its usage text.
fn clap_message(cause: &clap::Error) -> String {
    let text = cause.to_string();
    let said = text.split("\n\nUsage").next().unwrap_or(&text);
    let said = said.split("\n\nFor more").next().unwrap_or(said);
    one_line(said).trim_start_matches("error: ").to_owned()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
