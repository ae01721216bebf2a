//! Report page of `reproduce loop`.

use super::ResultFile;
use super::sets::SetRow;
use crate::experiment::rows::{self, results};
use crate::reproduction::{how_to_reproduce, provenance};
use augsim_discovery::Rmse;
use augsim_report::page::{Block, Cell, Column, Page, Row, Section, Table};
use std::path::Path;

/// Makes the report page; `command` is the command line that repeats the run.
pub fn page(result: &ResultFile, data: &Path, command: &str) -> Page {
    let mut sections = vec![found("Measured sets", &result.sets)];
    if !result.chain.is_empty() {
        let title = "The ball: declared, calibrated and augmented physics, and networks";
        sections.push(chain(title, &result.chain, "Forecasts from the first state, test_1000"));
    }
    sections.push(found("Pushes of the virtual laboratory", std::slice::from_ref(&result.pushing.set)));
    let title = "Pushing: declared, calibrated and augmented physics, and networks";
    sections.push(chain(title, &result.pushing.chain, ""));
    sections.push(how_to_reproduce(command));
    Page {
        overline: "closing the loop".to_owned(),
        title: "Discovery on measured data sets".to_owned(),
        summary: format!(
            "{} measured sets, and pushes of the virtual laboratory; each has a report in its folder.",
            result.sets.len()
        ),
        sections,
        provenance: provenance(result.seed, Some(data)),
        ..Default::default()
    }
}

/// Makes the section about the effects that the discovery found in each data set.
fn found(title: &str, sets: &[SetRow]) -> Section {
    let millimetres = |r: Rmse| Cell::estimate(1e3 * r.rmse, Some(r.ci95.map(|v| 1e3 * v)));
    let table = Table {
        caption: "Root mean square error on held-out trajectories, with 95 % intervals over trajectories. Of a ball the \
                  start is fitted to the part before the first impact and the rest is forecast; a push is forecast from \
                  its first pose."
            .to_owned(),
        columns: vec![
            Column::text("set"),
            Column::text("verdict"),
            Column::number("declared", "mm").decimals(1),
            Column::number("calibrated", "mm").decimals(1),
            Column::number("augmented", "mm").decimals(1),
            Column::number("reduction", "mm").decimals(1),
            Column::number("noise floor", "mm").decimals(1),
        ],
        rows: sets
            .iter()
            .map(|s| {
                let e = &s.found.error;
                let verdict = serde_json::to_value(s.found.verdict).unwrap_or_default();
                let mut cells =
                    vec![Cell::text(&s.set), Cell::text(verdict.as_str().unwrap_or_default())];
                let errors = [e.declared, e.calibrated, e.augmented, e.reduction, e.noise_floor];
                cells.extend(errors.map(millimetres));
                Row { cells, ..Default::default() }
            })
            .collect(),
        ..Default::default()
    };
    let sentences = sets.iter().map(|s| (s.set.clone(), s.found.sentence.clone())).collect();
    Section { title: title.to_owned(), blocks: vec![Block::Table(table), Block::Definitions(sentences)] }
}

/// Makes the section with the scores of the models; `set` names the test set if the rows do not.
fn chain(title: &str, rows: &[rows::Row], set: &str) -> Section {
    let tables = results(rows, set).iter().flat_map(|r| r.tables()).map(Block::Table).collect();
    Section { title: title.to_owned(), blocks: tables }
}
