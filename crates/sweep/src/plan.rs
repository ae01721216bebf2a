//! `sweep plan`: writes the tasks of a sweep into a folder, and reads such a folder.

use super::clap_options::{Program, SweptCommand};
use super::fault::{OptionFault, SweepDataError, SweepFault};
use super::file::{SweepFile, Value, dashed, value};
use super::inputs::{Hasher, Input, expand, sha256};
use super::scores::Score;
use super::task::{Content, Task};
use anyhow::Context;
use augsim_session::folders;
use augsim_terminal::Outcome;
use augsim_terminal::destination::Results;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Name of the task file, one task per line.
pub const TASKS: &str = "tasks.jsonl";
/// Name of the file with the data that all tasks share.
const SWEEP: &str = "sweep.json";
/// Maximum number of tasks of a sweep. A longer list is probably a mistake.
const MAX_TASKS: usize = 1_000_000;

/// Data that all tasks of a plan share: content of `sweep.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shared {
    /// Folder to which the tasks' paths are relative: that of the sweep file.
    pub folder: PathBuf,
    /// Command that all tasks run, such as `reproduce push`.
    pub command: String,
    /// Number of tasks of the plan.
    pub tasks: usize,
    /// Names of the options that have several values.
    pub crossed: Vec<String>,
    /// JSONPath of each score, by column name.
    pub scores: BTreeMap<String, String>,
}

/// A plan that was written to a folder.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Absolute path of the plan folder.
    pub folder: PathBuf,
    /// Data that all tasks share.
    pub shared: Shared,
}

#[derive(Serialize)]
struct Planned<'a> {
    plan: &'a Path,
    tasks: usize,
    inputs: usize,
}

/// Writes the tasks of a sweep file into the folder `out`.
///
/// # Errors
/// The file has options that the command does not have, an input is missing, or the folder must not be
/// written. In these cases nothing is written.
pub fn write_plan(
    sweep: &Path,
    out: &Path,
    force: bool,
    program: Program,
    output: &Output,
) -> anyhow::Result<Outcome> {
    let file = SweepFile::read(sweep)?;
    let folder = std::path::absolute(folders::parent_of(sweep))
        .and_then(std::fs::canonicalize)
        .with_context(|| format!("{}: cannot find its folder", sweep.display()))?;
    let Crossed { tasks, shared, inputs } =
        cross(&file, folder, program).map_err(|e| match e.downcast::<SweepFault>() {
            Ok(fault) => SweepFault::InFile { file: sweep.to_owned(), fault: Box::new(fault) }.into(),
            Err(e) => e,
        })?;
    // The record contains the tasks only, because scores are evaluated when results are collected and
    // may change later.
    let record = Record::new("sweep plan").setting("tasks", sha256(tasks.as_bytes()));
    let claim = Results { folder: out, files: &[TASKS, SWEEP], inputs: &[sweep], record, force }.claim()?;
    claim.begin()?;
    claim.write(TASKS, &tasks)?;
    claim.write(SWEEP, &serde_json::to_string_pretty(&shared)?)?;
    let planned = Planned { plan: out, tasks: shared.tasks, inputs };
    output.result(&planned, || {
        let s = |n: usize| if n == 1 { "" } else { "s" };
        let plan = out.display();
        format!(
            "{} task{} of `augsim {}` that read {inputs} input{}: {plan}\nrun them: augsim sweep run {plan} --all, or \
             augsim sweep submit {plan}",
            shared.tasks,
            s(shared.tasks),
            shared.command,
            s(inputs)
        )
    })?;
    Ok(Outcome::Done)
}

/// The tasks of a sweep: all combinations of its lists of values.
struct Crossed {
    /// Text of the file `tasks.jsonl`, one task per line.
    tasks: String,
    shared: Shared,
    /// Number of input files and folders of all tasks.
    inputs: usize,
}

fn cross(file: &SweepFile, folder: PathBuf, program: Program) -> anyhow::Result<Crossed> {
    let mut command = SweptCommand::named(&file.command, program)?;
    for (column, path) in &file.scores {
        Score::new(column, path)?;
    }
    let axes = axes(file, &command, &folder)?;
    let count = axes.iter().try_fold(1, |n: usize, axis| n.checked_mul(axis.values.len()));
    let Some(count) = count.filter(|n| *n <= MAX_TASKS) else {
        return Err(SweepFault::TooManyTasks { most: MAX_TASKS }.into());
    };
    let known: BTreeSet<&str> = axes.iter().map(|axis| axis.name.as_str()).collect();
    if let Some(column) = file.scores.keys().find(|column| known.contains(column.as_str())) {
        return Err(SweepFault::ScoreName { column: column.clone() }.into());
    }
    let hasher = Hasher::default();
    let mut inputs: BTreeMap<&str, Input> = BTreeMap::new();
    for axis in axes.iter().filter(|axis| axis.is_input) {
        for path in &axis.values {
            if let Value::Text(path) = path {
                let input = Input { path: path.clone(), sha256: hasher.hash(&folder.join(path))? };
                inputs.insert(path, input);
            }
        }
    }
    let (mut tasks, mut ids) = (String::new(), BTreeSet::new());
    let mut accepted = AcceptedValues::default();
    for index in 0..count {
        let value_indices = value_indices(index, &axes);
        let task = Task::new(content(&value_indices, &axes, &command, &inputs)?)?;
        if accepted.is_new(&value_indices, &axes) {
            let Content { settings, seed, .. } = &task.content;
            command.check(&command.arguments(settings, &task.paths(), *seed, "DIR", false))?;
        }
        tasks.push_str(&serde_json::to_string(&task)?);
        tasks.push('\n');
        if !ids.insert(task.id) {
            return Err(SweepFault::TaskTwice { index }.into());
        }
    }
    let crossed = axes.iter().filter(|axis| axis.is_crossed).map(|axis| axis.name.clone()).collect();
    let shared = Shared {
        folder,
        command: command.words.join(" "),
        tasks: count,
        crossed,
        scores: file.scores.clone(),
    };
    Ok(Crossed { tasks, shared, inputs: inputs.len() })
}

/// An option of a sweep and its values: one fixed value or a list.
struct Axis {
    name: String,
    values: Vec<Value>,
    is_input: bool,
    is_crossed: bool,
}

/// Reads the options of a sweep: fixed options first, each group in the order of names.
fn axes(file: &SweepFile, command: &SweptCommand, folder: &Path) -> Result<Vec<Axis>, SweepFault> {
    let mut axes: Vec<Axis> = Vec::new();
    let fixed = file.options.iter().map(|option| ("options", option));
    for (section, (name, given)) in fixed.chain(file.cross.iter().map(|list| ("cross", list))) {
        let bad = |fault: OptionFault| SweepFault::Option { section, option: name.clone(), fault };
        let is_crossed = section == "cross";
        let option_name = dashed(name);
        let is_input = match option_name.as_str() {
            "seed" => false,
            _ => command.option(&option_name).map_err(bad)?.is_input,
        };
        if axes.iter().any(|axis| axis.name == option_name) {
            return Err(bad(OptionFault::Twice));
        }
        let values = match (is_crossed, given) {
            (false, one) => vec![value(one).map_err(bad)?],
            (true, toml::Value::Array(all)) if all.is_empty() => {
                return Err(bad(OptionFault::NoValue));
            }
            (true, toml::Value::Array(all)) => {
                all.iter().map(value).collect::<Result<_, _>>().map_err(bad)?
            }
            (true, toml::Value::Table(range)) => whole_numbers(range).map_err(bad)?,
            (true, _) => return Err(bad(OptionFault::Single)),
        };
        let values = if is_input { paths(values, is_crossed, folder).map_err(bad)? } else { values };
        let mut seen = BTreeSet::new();
        if let Some(twice) = values.iter().find(|value| !seen.insert(value.to_string())) {
            return Err(bad(OptionFault::ValueTwice { value: twice.to_string() }));
        }
        axes.push(Axis { name: option_name, values, is_input, is_crossed });
    }
    Ok(axes)
}

/// Expands the range `{ from = 1, to = 5 }` to its whole numbers, both ends included.
fn whole_numbers(range: &toml::Table) -> Result<Vec<Value>, OptionFault> {
    let end = |name: &str| range.get(name).and_then(toml::Value::as_integer);
    match (end("from"), end("to"), range.len()) {
        (Some(from), Some(to), 2) if from <= to && to.saturating_sub(from) < MAX_TASKS as i64 => {
            Ok((from..=to).map(Value::Integer).collect())
        }
        _ => Err(OptionFault::Range { most: MAX_TASKS }),
    }
}

/// Checks that values are path texts, and expands glob patterns.
fn paths(values: Vec<Value>, is_crossed: bool, folder: &Path) -> Result<Vec<Value>, OptionFault> {
    let mut paths = Vec::new();
    for value in values {
        let Value::Text(text) = value else {
            return Err(OptionFault::NoPath { value: value.to_string() });
        };
        paths.extend(expand(folder, &text).map_err(OptionFault::Input)?.into_iter().map(Value::Text));
    }
    match is_crossed || paths.len() == 1 {
        true => Ok(paths),
        false => Err(OptionFault::SeveralFiles { count: paths.len() }),
    }
}

/// Returns, for task number `index`, the index of its value in each list; the last list varies fastest.
fn value_indices(index: usize, axes: &[Axis]) -> Vec<usize> {
    let mut remaining = index;
    let mut value_indices: Vec<usize> = (axes.iter().rev())
        .map(|axis| {
            let place = remaining % axis.values.len();
            remaining /= axis.values.len();
            place
        })
        .collect();
    value_indices.reverse();
    value_indices
}

/// Values and combinations of flags that the command's parser has already accepted.
///
/// The parser checks single values and combinations of flags, so other combinations of accepted values need
/// not be parsed again. For 100,000 tasks this saves most of the time.
#[derive(Default)]
struct AcceptedValues {
    values: BTreeSet<(usize, usize)>,
    flags: BTreeSet<Vec<usize>>,
}

impl AcceptedValues {
    /// Whether a task has a value or a combination of flags that no earlier task had; stores them.
    fn is_new(&mut self, value_indices: &[usize], axes: &[Axis]) -> bool {
        let is_flag = |axis: &Axis| axis.values.iter().any(|value| matches!(value, Value::Flag(_)));
        let flags = value_indices.iter().zip(axes).filter(|(_, axis)| is_flag(axis)).map(|(place, _)| *place);
        let mut is_new = self.flags.insert(flags.collect());
        for (axis, place) in value_indices.iter().enumerate() {
            is_new |= self.values.insert((axis, *place));
        }
        is_new
    }
}

/// Makes the content of the task with these list values.
fn content(
    value_indices: &[usize],
    axes: &[Axis],
    command: &SweptCommand,
    known: &BTreeMap<&str, Input>,
) -> Result<Content, SweepFault> {
    let (mut settings, mut inputs, mut seed) = (BTreeMap::new(), BTreeMap::new(), 1);
    for (axis, place) in axes.iter().zip(value_indices) {
        let value = &axis.values[*place];
        match value {
            value if axis.name == "seed" => seed = parse_seed(value)?,
            Value::Text(path) if axis.is_input => {
                if let Some(input) = known.get(path.as_str()) {
                    inputs.insert(axis.name.clone(), input.clone());
                }
            }
            value => {
                settings.insert(axis.name.clone(), value.clone());
            }
        }
    }
    let augsim = env!("CARGO_PKG_VERSION").to_owned();
    Ok(Content { augsim, command: command.words.clone(), settings, seed, inputs })
}

fn parse_seed(value: &Value) -> Result<u64, SweepFault> {
    match value {
        Value::Integer(v) => u64::try_from(*v).ok(),
        _ => None,
    }
    .ok_or_else(|| SweepFault::Seed { value: value.to_string() })
}

impl Plan {
    /// Opens the plan in `folder`.
    ///
    /// # Errors
    /// The folder contains no plan, or one that cannot be parsed.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(SWEEP);
        let file = || path.clone();
        let text =
            std::fs::read_to_string(&path).map_err(|cause| SweepFault::NoPlan { file: file(), cause })?;
        let shared =
            serde_json::from_str(&text).map_err(|cause| SweepFault::ForeignPlan { file: file(), cause })?;
        let folder =
            std::path::absolute(folder).with_context(|| format!("{}: cannot find it", folder.display()))?;
        Ok(Plan { folder, shared })
    }

    /// Calls `each` with the index and content of each task in order, until it returns `false`.
    ///
    /// # Errors
    /// The file cannot be read, or the id of a task does not match its content.
    pub fn each_task(&self, mut each: impl FnMut(usize, Task) -> anyhow::Result<bool>) -> anyhow::Result<()> {
        self.each_line(|index, line| each(index, parse_task(index, line, &self.folder)?))
    }

    /// Reads all tasks of the plan.
    ///
    /// # Errors
    /// Those of [`Plan::each_task`].
    pub fn tasks(&self) -> anyhow::Result<Vec<Task>> {
        let mut tasks = Vec::with_capacity(self.shared.tasks);
        self.each_task(|_, task| {
            tasks.push(task);
            Ok(true)
        })?;
        Ok(tasks)
    }

    /// Returns `count` tasks from the index `first` on, or fewer at the end of the plan.
    ///
    /// # Errors
    /// No task has this index, or an error of [`Plan::each_task`].
    pub fn tasks_from(&self, first: usize, count: usize) -> anyhow::Result<Vec<(usize, Task)>> {
        let mut found = Vec::new();
        let last = first.saturating_add(count);
        self.each_line(|index, line| {
            if (first..last).contains(&index) {
                found.push((index, parse_task(index, line, &self.folder)?));
            }
            Ok(index + 1 < last)
        })?;
        if found.is_empty() {
            let (plan, tasks) = (self.folder.clone(), self.shared.tasks);
            return Err(SweepFault::NoTask { plan, index: first, tasks }.into());
        }
        Ok(found)
    }

    fn each_line(&self, mut each: impl FnMut(usize, &str) -> anyhow::Result<bool>) -> anyhow::Result<()> {
        let path = self.folder.join(TASKS);
        let unreadable = || format!("{}: cannot read it", path.display());
        let mut reader = BufReader::new(File::open(&path).with_context(unreadable)?);
        let mut line = String::new();
        for index in 0.. {
            line.clear();
            if reader.read_line(&mut line).with_context(unreadable)? == 0 || !each(index, &line)? {
                break;
            }
        }
        Ok(())
    }
}

fn parse_task(index: usize, line: &str, folder: &Path) -> anyhow::Result<Task> {
    let (plan, at) = (folder.join(TASKS), index + 1);
    let task: Task =
        serde_json::from_str(line).with_context(|| format!("{}: line {at}: not a task", plan.display()))?;
    let named = Task::new(task.content.clone())?;
    match named.id == task.id {
        true => Ok(task),
        false => Err(SweepDataError::Task { plan, line: at, id: task.id }.into()),
    }
}
