//! `sweep submit`: the script that hands a plan to Slurm.
//!
//! The scheduler runs the sweep, not this program: an array job runs the tasks that are not done, one or a few each, and a
//! second job, which waits until the first has ended in whatever way, collects. The script says all of it.

use super::fault::{Spoilt, SweepFault};
use super::plan::Plan;
use super::store::Store;
use anyhow::Context;
use augsim_data::atomic_write;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

/// Slurm's default of `MaxArraySize`: places of an array end below it.
const ARRAY_SIZE: usize = 1001;
/// Times that Slurm begins a job again that was killed.
const RESTARTS: u32 = 3;

/// Wishes of the user for the cluster.
#[derive(Debug, Clone, Copy)]
pub struct Wishes<'a> {
    /// Jobs that may run at a time.
    pub max_parallel: Option<u32>,
    /// Partition.
    pub partition: Option<&'a str>,
    /// Time limit of a job.
    pub time: Option<&'a str>,
    /// Tasks that a job runs.
    pub tasks_per_job: Option<u32>,
    /// Threads, so cores, of a task.
    pub threads: Option<u16>,
}

#[derive(Serialize)]
struct Submitted {
    tasks: usize,
    jobs: usize,
    array_job: Option<String>,
    collecting_job: Option<String>,
}

/// Submits the tasks that are not done, or prints the script that would.
///
/// # Errors
/// There is no plan, no Slurm, or it refuses.
pub fn submit(plan: &Path, wishes: &Wishes<'_>, dry_run: bool, output: &Output) -> anyhow::Result<Outcome> {
    let plan = Plan::open(plan)?;
    let slurm = is_there("sbatch");
    let left = not_done(&plan)?;
    if left.is_empty() {
        let submitted = Submitted { tasks: 0, jobs: 0, array_job: None, collecting_job: None };
        let folder = plan.folder.display();
        output.result(&submitted, || {
            format!("all tasks are done; put them together: augsim sweep collect {folder}")
        })?;
        return Ok(Outcome::Done);
    }
    let limit = slurm.then(largest_array).flatten().unwrap_or(ARRAY_SIZE);
    let array = Array::new(&left, plan.shared.tasks, limit, wishes.tasks_per_job)?;
    let script = script(&plan, &array, left.len(), wishes)?;
    if dry_run {
        write!(std::io::stdout(), "{script}").context("standard output: cannot write the script")?;
        return Ok(Outcome::Done);
    }
    if !slurm && !dry_run {
        return Err(SweepFault::NoSlurm.into());
    }
    let path = plan.folder.join("submit.sh");
    atomic_write(&path, |w| w.write_all(script.as_bytes()))?;
    let run = Command::new("sh").arg(&path).output().context("cannot start `sh`")?;
    let (said, told) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    if !run.status.success() {
        return Err(Spoilt::Refused { script: path, stderr: told.into_owned() }.into());
    }
    output.note(told.trim());
    let job = |name: &str| {
        let line = said.lines().find_map(|line| line.strip_prefix(name));
        line.map(|id| id.trim().to_owned())
    };
    let submitted = Submitted {
        tasks: left.len(),
        jobs: array.places.len(),
        array_job: job("tasks"),
        collecting_job: job("collect"),
    };
    output.result(&submitted, || {
        let id = |job: &Option<String>| job.clone().unwrap_or_default();
        format!(
            "{} tasks in {} jobs of array {}; job {} collects into {}\nhow far it is: augsim sweep status {}",
            submitted.tasks,
            submitted.jobs,
            id(&submitted.array_job),
            id(&submitted.collecting_job),
            plan.folder.join("collected").display(),
            plan.folder.display()
        )
    })?;
    Ok(Outcome::Done)
}

/// Places of tasks without a result.
fn not_done(plan: &Plan) -> anyhow::Result<Vec<usize>> {
    let done = Store::of(&plan.folder).with_result();
    let mut left = Vec::new();
    plan.each_task(|index, task| {
        if !done.contains(&task.id) {
            left.push(index);
        }
        Ok(true)
    })?;
    Ok(left)
}

/// The jobs of an array, and the tasks that a job runs.
struct Array {
    /// Tasks of each job.
    tasks_per_job: usize,
    /// Places of the array, ascending.
    places: Vec<usize>,
}

impl Array {
    /// Shares the tasks at `left` among `tasks` out to jobs, on a cluster whose arrays end below `limit`.
    fn new(left: &[usize], tasks: usize, limit: usize, wish: Option<u32>) -> Result<Self, SweepFault> {
        let least = tasks.div_ceil(limit).max(1);
        let tasks_per_job = wish.map_or(least, |n| n as usize);
        if tasks_per_job < least {
            return Err(SweepFault::TasksPerJob { asked: tasks_per_job, limit, tasks, least });
        }
        let mut places: Vec<usize> = left.iter().map(|index| index / tasks_per_job).collect();
        places.dedup();
        Ok(Array { tasks_per_job, places })
    }

    /// The places in the form of `--array`: `0-3,7`.
    fn spelled(&self) -> String {
        let mut ranges: Vec<(usize, usize)> = Vec::new();
        for &place in &self.places {
            match ranges.last_mut() {
                Some((_, last)) if *last + 1 == place => *last = place,
                _ => ranges.push((place, place)),
            }
        }
        let one = |(a, b): (usize, usize)| if a == b { a.to_string() } else { format!("{a}-{b}") };
        ranges.into_iter().map(one).collect::<Vec<_>>().join(",")
    }
}

/// The script: readable, to be edited, run by `sh`.
fn script(plan: &Plan, array: &Array, left: usize, wishes: &Wishes<'_>) -> anyhow::Result<String> {
    let program = std::env::current_exe().context("cannot find the program itself")?;
    let (program, folder) = (path_text(&program)?, path_text(&plan.folder)?);
    let name: String = (plan.folder.file_name().unwrap_or_default().to_string_lossy().chars())
        .map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' })
        .collect();
    let mut options = String::new();
    for (option, value) in [("partition", wishes.partition), ("time", wishes.time)] {
        let Some(value) = value else { continue };
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:+@".contains(c);
        if value.is_empty() || !value.chars().all(plain) {
            return Err(SweepFault::SlurmName { option, value: value.to_owned() }.into());
        }
        writeln!(options, "#SBATCH --{option}={value}")?;
    }
    let parallel = wishes.max_parallel.map_or(String::new(), |n| format!("%{n}"));
    let logs = plan.folder.join("slurm");
    // Slurm replaces what follows a per cent sign.
    let log_text = path_text(&logs)?.replace('%', "%%").replace('\\', "\\\\").replace('"', "\\\"");
    let (program, folder, logs) = (quoted(&program)?, quoted(&folder)?, quoted(&path_text(&logs)?)?);
    let (tasks, command, spelled) = (plan.shared.tasks, &plan.shared.command, array.spelled());
    let per_job = array.tasks_per_job;
    let which = match per_job {
        1 => "--index \"$SLURM_ARRAY_TASK_ID\"".to_owned(),
        n => format!("--index \"$((SLURM_ARRAY_TASK_ID * {n}))\" --count {n}"),
    };
    let threads = wishes.threads.unwrap_or(1);
    Ok(format!(
        r#"#!/bin/sh
# A sweep of `augsim {command}`: {left} of its {tasks} tasks are to do, {per_job} in each job of the array.
# Made by `augsim sweep submit`; edit it as you like and run it with `sh`. A task that is done is not run again.
set -eu
mkdir -p {logs}

tasks=$(sbatch --parsable <<'TASKS'
#!/bin/bash
#SBATCH --job-name=augsim-{name}
#SBATCH --array={spelled}{parallel}
#SBATCH --cpus-per-task={threads}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output="{log_text}/%A_%a.log"
{options}
{program} sweep run {folder} {which} --threads "$SLURM_CPUS_PER_TASK"
code=$?
# What was killed, for its memory for example, begins again and goes on from its checkpoint.
if [ "$code" -eq 137 ] && [ "${{SLURM_RESTART_COUNT:-0}}" -lt {RESTARTS} ]; then
    scontrol requeue "$SLURM_JOB_ID"
fi
exit "$code"
TASKS
)
tasks=${{tasks%%;*}}

collect=$(sbatch --parsable --dependency=afterany:"$tasks" <<'COLLECT'
#!/bin/bash
#SBATCH --job-name=augsim-{name}-collect
#SBATCH --output="{log_text}/collect.log"
{options}
exec {program} sweep collect {folder} --partial
COLLECT
)
echo "tasks $tasks"
echo "collect ${{collect%%;*}}"
"#
    ))
}

fn path_text(path: &Path) -> Result<String, SweepFault> {
    match path.to_str().filter(|text| !text.contains('\n')) {
        Some(text) => Ok(text.to_owned()),
        None => Err(SweepFault::ScriptPath { path: path.to_owned() }),
    }
}

/// A word of a shell.
fn quoted(word: &str) -> anyhow::Result<String> {
    Ok(shlex::try_quote(word)?.into_owned())
}

fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// `MaxArraySize` of the cluster, where it says so.
fn largest_array() -> Option<usize> {
    let shown = Command::new("scontrol").args(["show", "config"]).output().ok()?;
    let text = String::from_utf8_lossy(&shown.stdout).into_owned();
    let line = text.lines().find_map(|line| line.trim_start().strip_prefix("MaxArraySize"))?;
    line.split_whitespace().last()?.parse().ok()
}

#[cfg(test)]
mod tests {
    //! Contract: the array runs every task that is left and none beyond the cluster's largest place.
    use super::*;

    #[test]
    fn an_array_names_what_is_left_in_ranges() {
        let array = Array::new(&[0, 1, 2, 5, 7, 8], 10, ARRAY_SIZE, None).unwrap();
        assert_eq!((array.tasks_per_job, array.spelled().as_str()), (1, "0-2,5,7-8"));
    }

    #[test]
    fn more_tasks_than_an_array_holds_are_shared_among_its_jobs() {
        let left: Vec<usize> = (0..100_000).collect();
        let array = Array::new(&left, 100_000, 1001, None).unwrap();
        assert_eq!(array.tasks_per_job, 100);
        assert_eq!(array.spelled(), "0-999");
        let some = Array::new(&[99_999], 100_000, 1001, Some(1000)).unwrap();
        assert_eq!(some.spelled(), "99");
        assert!(Array::new(&left, 100_000, 1001, Some(99)).is_err());
    }
}
