//! Report page of `reproduce robots`.

use super::published::Compared;
use super::{Found, ResultFile, SetRow, mean_percent};
use crate::reproduction::{how_to_reproduce, provenance};
use augsim_report::page::{Block, Cell, Column, Page, Row, Section, Table};
use augsim_session::joints::JointResult;
use std::path::Path;

/// Makes the report page; `command` is the command line that repeats the run.
pub fn page(result: &ResultFile, data: &Path, command: &str) -> Page {
    let mut sections = vec![Section::new("All arms", vec![Block::Table(overview(&result.sets))])];
    let found = result.sets.iter().filter_map(|row| Some((row, row.found.as_ref()?)));
    sections.extend(found.map(|(row, found)| section(row, found)));
    sections.push(how_to_reproduce(command));
    Page {
        overline: "robots".to_owned(),
        title: "Arms with rigid-body models from their description files".to_owned(),
        summary: "Each arm was declared from its description file and a log of its joints, calibrated and augmented. Errors are those of \
                  the joint torques on data that no fit used, in % of the standard deviation of the measured torque."
            .to_owned(),
        sections,
        provenance: provenance(result.seed, Some(data)),
        ..Default::default()
    }
}

/// Table with one row for each arm, also for those that cannot be declared.
fn overview(sets: &[SetRow]) -> Table {
    let row = |row: &SetRow| {
        let name = Cell::text(row.set);
        let Some(found) = &row.found else {
            let reason = format!("left out: {}", row.left_out.as_deref().unwrap_or("no result"));
            let blank = [Cell::Missing, Cell::Missing, Cell::Missing, Cell::Missing];
            return Row::from(
                std::iter::once(name).chain(blank).chain([Cell::text(reason)]).collect::<Vec<_>>(),
            );
        };
        let error =
            |of: fn(&JointResult) -> augsim_discovery::Rmse| Cell::number(mean_percent(&found.joints, of));
        let kinds = if found.kinds.is_empty() { "none".to_owned() } else { found.kinds.join(", ") };
        Row::from(vec![
            name,
            Cell::Number(found.joints.len() as f64),
            error(|j| j.declared),
            error(|j| j.calibrated),
            error(|j| j.augmented),
            Cell::text(kinds),
        ])
    };
    Table {
        caption: "Error of the joint torques, mean of the joints, held out".to_owned(),
        columns: vec![
            Column::text("arm"),
            Column::number("joints", "").decimals(0),
            Column::number("declared", "% of sd").decimals(1),
            Column::number("calibrated", "% of sd").decimals(1),
            Column::number("augmented", "% of sd").decimals(1),
            Column::text("effects found"),
        ],
        rows: sets.iter().map(row).collect(),
        ..Default::default()
    }
}

/// Section of one arm: errors by joint, published values, and the sentence of the discovery.
fn section(row: &SetRow, found: &Found) -> Section {
    let joint = |j: &JointResult| {
        let percent = [j.declared, j.calibrated, j.augmented].map(|error| Cell::number(j.percent(error)));
        let names: Vec<&str> = j.effects.iter().map(|effect| effect.kind.as_str()).collect();
        let last = [Cell::Number(j.augmented.rmse), Cell::text(&j.unit), Cell::text(names.join(", "))];
        let name = Cell::text(format!("`{}`", j.joint));
        Row::from(std::iter::once(name).chain(percent).chain(last).collect::<Vec<_>>())
    };
    let errors = Table {
        caption: "Errors of the joints on held-out data".to_owned(),
        columns: vec![
            Column::text("joint"),
            Column::number("declared", "% of sd").decimals(1),
            Column::number("calibrated", "% of sd").decimals(1),
            Column::number("augmented", "% of sd").decimals(1),
            Column::number("augmented", ""),
            Column::text("unit"),
            Column::text("effects"),
        ],
        rows: found.joints.iter().map(joint).collect(),
        ..Default::default()
    };
    let mut blocks = vec![Block::Table(errors)];
    if !found.compared.is_empty() {
        blocks.push(Block::Table(compared(&found.compared)));
    }
    let report = format!("{} Report: `{}`.", found.sentence, found.report.display());
    blocks.extend([Block::Prose(report), Block::Prose(format!("Source: {}.", row.source))]);
    Section::new(row.set, blocks)
}

/// Table of the published values beside the found ones.
fn compared(list: &[Compared]) -> Table {
    let row = |c: &Compared| {
        let found = c.found.map_or(Cell::Missing, |(value, ci95)| Cell::estimate(value, Some(ci95)));
        Row::from(vec![
            Cell::text(format!("`{}`", c.joint)),
            Cell::text(c.property.words().0),
            Cell::Number(c.published),
            found,
            Cell::text(c.unit),
        ])
    };
    Table {
        caption: "Published values beside those found".to_owned(),
        columns: vec![
            Column::text("joint"),
            Column::text("property"),
            Column::number("published", ""),
            Column::number("found [95 %]", ""),
            Column::text("unit"),
        ],
        rows: list.iter().map(row).collect(),
        footnotes: vec!["A dash: not found, or not determined by the data.".to_owned()],
    }
}
