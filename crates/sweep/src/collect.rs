//! `sweep collect`: collects the results of a plan in a table, a JSON file and a report.
//!
//! The files depend on the tasks and results only, not on who ran them, when, or in which order.

use super::collected::Collected;
use super::curves::curves;
use super::file::Value;
use super::inputs::sha256;
use super::page::page;
use super::plan::{Plan, TASKS};
use super::row::{Row, State};
use super::scores::{Score, scores};
use super::store::Store;
use super::task::Task;
use anyhow::Context;
use augsim_data::escape_control_characters;
use augsim_terminal::Outcome;
use augsim_terminal::destination::{REPORT, RESULT, Results};
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Name of the file with the table of results.
const TABLE: &str = "table.csv";
/// Maximum number of tasks without a result that an error message lists.
const MAX_SHOWN_TASKS: usize = 10;

#[derive(Serialize)]
struct Summary<'a> {
    out: &'a Path,
    tasks: usize,
    done: usize,
    criterion_not_met: usize,
    failed: usize,
    missing: usize,
}

/// Collects the results of a plan in a table, a JSON file and a report.
///
/// # Errors
/// The path of a score selects several values, or the output folder must not be written.
pub fn collect(
    plan: &Path,
    out: Option<&Path>,
    partial: bool,
    force: bool,
    output: &Output,
) -> anyhow::Result<Outcome> {
    let plan = Plan::open(plan)?;
    let default = plan.folder.join("collected");
    let out = out.unwrap_or(&default);
    let (collected, tasks) = collect_results(&plan)?;
    let (failed, missing) = (collected.count(State::Failed), collected.count(State::Missing));
    if failed + missing > 0 {
        output.notice(escape_control_characters(&without_result(&collected, partial)));
        if !partial {
            return Ok(Outcome::CriterionNotMet);
        }
    }
    let table = table(&collected)?;
    let read = [plan.folder.join(TASKS)];
    let inputs: Vec<&Path> = read.iter().map(|path| path.as_path()).collect();
    // More results or other scores of the same tasks may overwrite earlier files, so the record names
    // the tasks only.
    let record = Record::new("sweep collect").setting("tasks", tasks);
    let claim =
        Results { folder: out, files: &[RESULT, TABLE, REPORT], inputs: &inputs, record, force }.claim()?;
    claim.begin()?;
    claim.write(RESULT, &serde_json::to_string_pretty(&collected)?)?;
    claim.write(TABLE, &table)?;
    let report = claim.write(REPORT, &page(&collected).render())?;
    let criterion_not_met = collected.count(State::CriterionNotMet);
    let done = collected.count(State::Done) + criterion_not_met;
    let summary = Summary { out, tasks: collected.tasks.len(), done, criterion_not_met, failed, missing };
    output.result(&summary, || {
        format!(
            "{done} of {} tasks, {} scores: {}\nreport: {}",
            collected.tasks.len(),
            collected.scores.len(),
            out.join(TABLE).display(),
            report.display()
        )
    })?;
    Ok(Outcome::Done)
}

/// Reads the results of all tasks; returns them with the SHA-256 of all task ids.
fn collect_results(plan: &Plan) -> anyhow::Result<(Collected, String)> {
    let shared = &plan.shared;
    let requested: Vec<Score> =
        shared.scores.iter().map(|(column, path)| Score::new(column, path)).collect::<Result<_, _>>()?;
    let store = Store::for_plan(&plan.folder);
    let (mut rows, mut inputs, mut ids) = (Vec::with_capacity(shared.tasks), BTreeMap::new(), String::new());
    let mut columns: BTreeSet<String> = shared.scores.keys().cloned().collect();
    plan.each_task(|index, task| {
        ids.push_str(&task.id);
        for input in task.content.inputs.values() {
            inputs.entry(input.path.clone()).or_insert_with(|| input.sha256.clone());
        }
        let row =
            row(index, &task, &store, &requested).with_context(|| format!("task {index} ({})", task.id))?;
        columns.extend(row.scores.keys().cloned());
        rows.push(row);
        Ok(true)
    })?;
    let scores: Vec<String> = columns.into_iter().collect();
    let curves = curves(&rows, &shared.crossed, &scores);
    let collected = Collected {
        schema: "augsim.sweep/1",
        command: shared.command.clone(),
        crossed: shared.crossed.clone(),
        scores,
        inputs,
        tasks: rows,
        curves,
    };
    Ok((collected, sha256(ids.as_bytes())))
}

fn row(index: usize, task: &Task, store: &Store, requested: &[Score]) -> anyhow::Result<Row> {
    let content = &task.content;
    let names = content.settings.keys().chain(content.inputs.keys()).map(String::as_str).chain(["seed"]);
    let settings: BTreeMap<String, Value> =
        names.filter_map(|name| Some((name.to_owned(), task.value(name)?))).collect();
    let (mut error, mut found) = (None, BTreeMap::new());
    let state = match store.result(&task.id) {
        Some(result) => {
            found = scores(requested, &result.result)?;
            // Values that repeat a setting, such as the seed, are already in the table.
            found.retain(|name, _| !settings.contains_key(name));
            if result.criterion_met { State::Done } else { State::CriterionNotMet }
        }
        None => match store.failure(&task.id) {
            Some(failure) => {
                error = Some(failure.error);
                State::Failed
            }
            None => State::Missing,
        },
    };
    Ok(Row { index, id: task.id.clone(), state, settings, scores: found, error })
}

/// Formats the table as CSV: one row per task with its settings and scores.
fn table(collected: &Collected) -> anyhow::Result<String> {
    let settings: BTreeSet<&String> = collected.tasks.iter().flat_map(|row| row.settings.keys()).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = ["task", "id", "state"].into_iter();
    writer.write_record(
        head.chain(settings.iter().map(|s| s.as_str())).chain(collected.scores.iter().map(String::as_str)),
    )?;
    for row in &collected.tasks {
        let mut cells = vec![row.index.to_string(), row.id.clone(), row.state.name().to_owned()];
        cells.extend(
            settings.iter().map(|name| row.settings.get(*name).map_or(String::new(), ToString::to_string)),
        );
        cells.extend(collected.scores.iter().map(|name| match row.scores.get(name) {
            Some(serde_json::Value::String(text)) => text.clone(),
            Some(value) => value.to_string(),
            None => String::new(),
        }));
        writer.write_record(&cells)?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// Formats the message about tasks that have no result.
fn without_result(collected: &Collected, partial: bool) -> String {
    let rows: Vec<&Row> =
        collected.tasks.iter().filter(|row| matches!(row.state, State::Failed | State::Missing)).collect();
    let mut text = format!("{} of {} tasks have no result", rows.len(), collected.tasks.len());
    for row in rows.iter().take(MAX_SHOWN_TASKS) {
        let why = row.error.as_ref().map_or("was not completed".to_owned(), |e| format!("failed: {e}"));
        text.push_str(&format!("\n  task {} {why}", row.index));
    }
    if rows.len() > MAX_SHOWN_TASKS {
        text.push_str(&format!("\n  and {} more", rows.len() - MAX_SHOWN_TASKS));
    }
    if !partial {
        text.push_str("\nrun them, or add --partial to collect the other results");
    }
    text
}
