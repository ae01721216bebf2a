//! Report page of `reproduce rigs`.

use super::{Errors, ResultFile, SetRow};
use crate::reproduction::{how_to_reproduce, provenance};
use augsim_data::with_significant;
use augsim_report::page::{Block, Cell, Column, Page, Row, Section, Table};
use std::path::Path;

/// Makes the report page; `command` is the command line that repeats the run.
pub fn page(result: &ResultFile, data: &Path, command: &str) -> Page {
    let mut sections: Vec<Section> = result.sets.iter().map(section).collect();
    sections.push(how_to_reproduce(command));
    Page {
        overline: "systems of equations".to_owned(),
        title: "Rigs with several units, repeated runs or hidden states".to_owned(),
        summary: "Each textbook model was calibrated and augmented. Errors are those of free runs over recordings that were held \
                  out, or, where there are none, of forecasts of left-out parts of the recordings."
            .to_owned(),
        sections,
        provenance: provenance(result.seed, Some(data)),
        ..Default::default()
    }
}

/// Makes the section of one rig: errors by output, the sentence, and what the model is known to lack.
fn section(set: &SetRow) -> Section {
    let table = Table {
        caption: "Root mean square error".to_owned(),
        columns: ["output", "on", "as declared", "calibrated", "augmented", "scatter of repeated runs"]
            .iter()
            .map(|title| Column::text(title))
            .collect(),
        rows: set.errors.iter().map(row).collect(),
        ..Default::default()
    };
    let about = [
        ("found", set.sentence.clone()),
        ("known to lack", format!("{}.", set.lacks)),
        ("data", format!("{}.", set.source)),
        ("report", format!("`{}`", set.report.display())),
    ];
    let about = about.map(|(name, text)| (name.to_owned(), text)).to_vec();
    Section::new(set.set, vec![Block::Table(table), Block::Definitions(about)])
}

fn row(errors: &Errors) -> Row {
    let shown = |error: Option<f64>, absent: &str| {
        let text = error.map_or_else(
            || absent.to_owned(),
            |e| format!("{} {}", with_significant(e, 3), errors.unit).trim_end().to_owned(),
        );
        Cell::text(text)
    };
    let on = if errors.held_out_recordings { "held-out recordings" } else { "left-out parts" };
    Row::from(vec![
        Cell::text(&errors.output),
        Cell::text(on),
        shown(errors.declared, "diverged"),
        shown(errors.calibrated, "diverged"),
        shown(errors.augmented, "diverged"),
        shown(errors.repeats, "no repeats"),
    ])
}
