//! `sweep status`: shows completed, running and failed tasks and the expected end.

use super::plan::Plan;
use super::store::Store;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Maximum number of failures that the text lists; `--json` lists all.
const MAX_SHOWN_FAILURES: usize = 20;

#[derive(Serialize)]
struct Status {
    tasks: usize,
    done: usize,
    running: usize,
    failed: Vec<FailedTask>,
    /// Number of tasks that were stopped and can be resumed.
    stopped: usize,
    /// Number of tasks that were not started.
    waiting: usize,
    /// Mean run time of the latest completed tasks, s; `None` if none has a run time.
    seconds_per_task: Option<f64>,
    /// Time until all tasks are done, s, with as many running tasks as now, or one; `None` if unknown.
    seconds_left: Option<f64>,
    /// Expected end of the sweep, seconds since 1970; `None` if no task runs or no run time is known.
    expected_end_unix_s: Option<u64>,
}

#[derive(Serialize)]
struct FailedTask {
    index: usize,
    id: String,
    code: u8,
    error: String,
}

/// Prints the progress of a sweep.
///
/// # Errors
/// The folder has no plan.
pub fn status(plan: &Path, output: &Output) -> anyhow::Result<Outcome> {
    let plan = Plan::open(plan)?;
    let status = read_status(&plan)?;
    output.result(&status, || text(&status))?;
    Ok(Outcome::Done)
}

fn read_status(plan: &Plan) -> anyhow::Result<Status> {
    let store = Store::for_plan(&plan.folder);
    let (with_result, with_failure, begun) = (store.with_result(), store.with_failure(), store.started());
    let mut status = Status {
        tasks: plan.shared.tasks,
        done: 0,
        running: 0,
        failed: Vec::new(),
        stopped: 0,
        waiting: 0,
        seconds_per_task: store.mean_seconds(),
        seconds_left: None,
        expected_end_unix_s: None,
    };
    plan.each_task(|index, task| {
        let id = task.id;
        if with_result.contains(&id) {
            status.done += 1;
        } else if !begun.contains(&id) {
            status.waiting += 1;
        } else if store.is_running(&id) {
            status.running += 1;
        } else if let Some(failure) = with_failure.contains(&id).then(|| store.failure(&id)).flatten() {
            status.failed.push(FailedTask { index, id, code: failure.code, error: failure.error });
        } else {
            status.stopped += 1;
        }
        Ok(true)
    })?;
    let left = status.running + status.stopped + status.waiting;
    if let Some(each) = status.seconds_per_task.filter(|_| left > 0) {
        let seconds = each * left as f64 / status.running.max(1) as f64;
        status.seconds_left = Some(seconds);
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
        // Without a running task the end is unknown.
        status.expected_end_unix_s = (status.running > 0).then_some(now + seconds as u64);
    }
    Ok(status)
}

fn text(s: &Status) -> String {
    let mut out = format!(
        "{} of {} tasks are done; {} running, {} failed, {} stopped, {} waiting",
        s.done,
        s.tasks,
        s.running,
        s.failed.len(),
        s.stopped,
        s.waiting
    );
    let each = || s.seconds_per_task.map_or(String::new(), |each| format!(" ({} each)", duration(each)));
    match (s.seconds_left, s.expected_end_unix_s) {
        (Some(left), Some(end)) => {
            let (hour, minute) = (end % 86_400 / 3600, end % 3600 / 60);
            let left = duration(left);
            out.push_str(&format!("\nexpected end: in {left}{}, at {hour:02}:{minute:02} UTC", each()));
        }
        (Some(left), None) => {
            out.push_str(&format!(
                "\nno task is running; the remaining tasks take one worker {}{}",
                duration(left),
                each()
            ));
        }
        _ => {}
    }
    for f in s.failed.iter().take(MAX_SHOWN_FAILURES) {
        out.push_str(&format!("\n  task {} failed (code {}): {}", f.index, f.code, f.error));
    }
    if s.failed.len() > MAX_SHOWN_FAILURES {
        out.push_str(&format!("\n  and {} more; --json has all", s.failed.len() - MAX_SHOWN_FAILURES));
    }
    out
}

/// Formats a duration, given in seconds, with a suitable unit.
fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..120 => format!("{whole} s"),
        120..7200 => format!("{} min", whole.div_ceil(60)),
        7200..172_800 => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
        _ => format!("{} days {} h", whole / 86_400, whole % 86_400 / 3600),
    }
}

#[cfg(test)]
mod tests {
    //! Contract: durations have a unit that suits their size.
    use super::*;

    #[test]
    fn formats_durations_with_a_suitable_unit() {
        for (seconds, text) in [
            (0.42, "0.4 s"),
            (59.6, "60 s"),
            (119.0, "119 s"),
            (121.0, "3 min"),
            (7200.0, "2 h 0 min"),
            (200_000.0, "2 days 7 h"),
        ] {
            assert_eq!(duration(seconds), text);
        }
    }
}
