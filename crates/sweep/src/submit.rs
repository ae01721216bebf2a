//! `sweep submit`: submits the remaining tasks of a plan to Slurm.
//!
//! Slurm runs the sweep: an array job runs the remaining tasks, one or several per job, and a second job
//! collects the results after the first has ended. The script contains all commands.

use super::fault::{SweepDataError, SweepFault};
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

/// Default of Slurm's setting `MaxArraySize`; array indices must be smaller.
const DEFAULT_MAX_ARRAY_SIZE: usize = 1001;
/// Maximum number of times that Slurm requeues a killed job.
const MAX_RESTARTS: u32 = 3;

/// Options of `sweep submit` for the cluster.
#[derive(Debug, Clone, Copy)]
pub struct SubmitOptions<'a> {
    /// Maximum number of jobs that run at the same time; no limit if `None`.
    pub max_parallel: Option<u32>,
    /// Name of the Slurm partition; that of the cluster's default if `None`.
    pub partition: Option<&'a str>,
    /// Time limit of a job in the format of `sbatch`; that of the partition if `None`.
    pub time: Option<&'a str>,
    /// Number of tasks that each job runs; as few as the array limit allows if `None`.
    pub tasks_per_job: Option<u32>,
    /// Number of threads, and so of cores, per task; 1 if `None`.
    pub threads: Option<u16>,
}

#[derive(Serialize)]
struct Submitted {
    tasks: usize,
    jobs: usize,
    array_job: Option<String>,
    collecting_job: Option<String>,
}

/// Submits the tasks without a result to Slurm, or prints the script.
///
/// # Errors
/// The plan or Slurm is missing, or Slurm rejects the jobs.
pub fn submit(
    plan: &Path,
    wishes: &SubmitOptions<'_>,
    dry_run: bool,
    output: &Output,
) -> anyhow::Result<Outcome> {
    let plan = Plan::open(plan)?;
    let slurm = is_installed("sbatch");
    let left = remaining_tasks(&plan)?;
    if left.is_empty() {
        let submitted = Submitted { tasks: 0, jobs: 0, array_job: None, collecting_job: None };
        let folder = plan.folder.display();
        output.result(&submitted, || {
            format!("all tasks are done; collect the results with: augsim sweep collect {folder}")
        })?;
        return Ok(Outcome::Done);
    }
    let limit = slurm.then(largest_array).flatten().unwrap_or(DEFAULT_MAX_ARRAY_SIZE);
    let array = Array::new(&left, plan.shared.tasks, limit, wishes.tasks_per_job)?;
    let script = script(&plan, &array, left.len(), wishes)?;
    if dry_run {
        write!(std::io::stdout(), "{script}").context("standard output: cannot write the script")?;
        return Ok(Outcome::Done);
    }
    if !slurm {
        return Err(SweepFault::NoSlurm.into());
    }
    let path = plan.folder.join("submit.sh");
    atomic_write(&path, |w| w.write_all(script.as_bytes()))?;
    let run = Command::new("sh").arg(&path).output().context("cannot start `sh`")?;
    let (said, told) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    if !run.status.success() {
        return Err(SweepDataError::Refused { script: path, stderr: told.into_owned() }.into());
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
            "{} tasks in {} jobs of array {}; job {} collects into {}\nprogress: augsim sweep status {}",
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

/// Returns the indices of the tasks that have no result.
fn remaining_tasks(plan: &Plan) -> anyhow::Result<Vec<usize>> {
    let done = Store::for_plan(&plan.folder).with_result();
    let mut left = Vec::new();
    plan.each_task(|index, task| {
        if !done.contains(&task.id) {
            left.push(index);
        }
        Ok(true)
    })?;
    Ok(left)
}

/// Array job of Slurm: its indices and the number of tasks per job.
struct Array {
    /// Number of tasks that each job runs.
    tasks_per_job: usize,
    /// Array indices of the jobs, ascending.
    places: Vec<usize>,
}

impl Array {
    /// Distributes the tasks with indices `left`, of `tasks` in total, over jobs with indices below `limit`.
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

    /// Formats the array indices for Slurm's option `--array`: `0-3,7`.
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

/// Makes the shell script that submits the array job and the collecting job.
fn script(plan: &Plan, array: &Array, left: usize, wishes: &SubmitOptions<'_>) -> anyhow::Result<String> {
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
    // Slurm expands patterns after a per cent sign in log paths.
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
# A sweep of `augsim {command}`: {left} of its {tasks} tasks remain, {per_job} in each job of the array.
# Made by `augsim sweep submit`; you can edit it and run it with `sh`. Completed tasks are skipped.
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
# A killed task, for example because of its memory, is requeued and resumes from its checkpoint.
if [ "$code" -eq 137 ] && [ "${{SLURM_RESTART_COUNT:-0}}" -lt {MAX_RESTARTS} ]; then
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

/// Quotes a word for the shell.
fn quoted(word: &str) -> anyhow::Result<String> {
    Ok(shlex::try_quote(word)?.into_owned())
}

fn is_installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// Reads the setting `MaxArraySize` of the cluster; `None` if it is not available.
fn largest_array() -> Option<usize> {
    let shown = Command::new("scontrol").args(["show", "config"]).output().ok()?;
    let text = String::from_utf8_lossy(&shown.stdout).into_owned();
    let line = text.lines().find_map(|line| line.trim_start().strip_prefix("MaxArraySize"))?;
    line.split_whitespace().last()?.parse().ok()
}

#[cfg(test)]
mod tests {
    //! Contract: the array runs all remaining tasks with indices below the limit of the cluster.
    use super::*;

    #[test]
    fn formats_remaining_tasks_as_ranges() {
        let array = Array::new(&[0, 1, 2, 5, 7, 8], 10, DEFAULT_MAX_ARRAY_SIZE, None).unwrap();
        assert_eq!((array.tasks_per_job, array.spelled().as_str()), (1, "0-2,5,7-8"));
    }

    #[test]
    fn distributes_more_tasks_than_the_array_limit_over_jobs() {
        let left: Vec<usize> = (0..100_000).collect();
        let array = Array::new(&left, 100_000, 1001, None).unwrap();
        assert_eq!(array.tasks_per_job, 100);
        assert_eq!(array.spelled(), "0-999");
        let some = Array::new(&[99_999], 100_000, 1001, Some(1000)).unwrap();
        assert_eq!(some.spelled(), "99");
        assert!(Array::new(&left, 100_000, 1001, Some(99)).is_err());
    }
}
