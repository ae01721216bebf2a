//! `sweep status`: what is done, what runs, what failed, when it will end.

use super::plan::Plan;
use super::store::Store;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Failures that the text shows; `--json` has all.
const SHOWN: usize = 20;

#[derive(Serialize)]
struct Status {
    tasks: usize,
    done: usize,
    running: usize,
    failed: Vec<FailedTask>,
    /// Begun and stopped: they go on from what they have.
    stopped: usize,
    /// Not begun.
    waiting: usize,
    /// Mean of the tasks that were done last.
    seconds_per_task: Option<f64>,
    /// Seconds until all others are done, with as many at a time as run now.
    seconds_left: Option<f64>,
    /// The same as a time of the clock, seconds since 1970.
    expected_end_unix_s: Option<u64>,
}

#[derive(Serialize)]
struct FailedTask {
    index: usize,
    id: String,
    code: u8,
    error: String,
}

/// Says how far a sweep is.
///
/// # Errors
/// There is no plan.
pub fn status(plan: &Path, output: &Output) -> anyhow::Result<Outcome> {
    let plan = Plan::open(plan)?;
    let status = look(&plan)?;
    output.result(&status, || text(&status))?;
    Ok(Outcome::Done)
}

fn look(plan: &Plan) -> anyhow::Result<Status> {
    let store = Store::of(&plan.folder);
    let (with_result, with_failure, begun) = (store.with_result(), store.with_failure(), store.begun());
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
        // Nothing ends while nothing runs.
        status.expected_end_unix_s = (status.running > 0).then_some(now + seconds as u64);
    }
    Ok(status)
}

fn text(s: &Status) -> String {
    let mut out = format!(
        "{} of {} tasks are done; {} run, {} failed, {} stopped on the way, {} wait",
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
            out.push_str(&format!("\nnothing runs; the rest takes one worker {}{}", duration(left), each()));
        }
        _ => {}
    }
    for f in s.failed.iter().take(SHOWN) {
        out.push_str(&format!("\n  task {} failed (code {}): {}", f.index, f.code, f.error));
    }
    if s.failed.len() > SHOWN {
        out.push_str(&format!("\n  and {} more; --json has all", s.failed.len() - SHOWN));
    }
    out
}

/// A duration for people.
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
    //! Contract: durations are rounded to what a reader plans with.
    use super::*;

    #[test]
    fn durations_have_the_unit_of_their_size() {
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
