//! Report page of `reproduce systems`.

use super::{ResultFile, Scored, SetRow};
use crate::reproduction::{how_to_reproduce, provenance};
use augsim_report::page::{Block, Cell, Column, Page, Row, Section, Table};
use std::path::Path;

/// Makes the report page; `command` is the command line that repeats the run.
pub fn page(result: &ResultFile, data: &Path, command: &str) -> Page {
    let mut sections: Vec<Section> = result.sets.iter().map(section).collect();
    sections.push(how_to_reproduce(command));
    Page {
        overline: "systems of equations".to_owned(),
        title: "Benchmark sets with textbook models".to_owned(),
        summary: "Each model was calibrated and augmented on the training record alone; the errors are those of free runs on \
                  the test record, in the benchmark's own metric, next to published results."
            .to_owned(),
        sections,
        provenance: provenance(result.seed, Some(data)),
        ..Default::default()
    }
}

/// Makes the section of one benchmark set: errors, published errors and findings.
fn section(set: &SetRow) -> Section {
    let row = |name: &str, error: Option<f64>, note: String| Row {
        cells: vec![Cell::text(name), Cell::number(error), Cell::text(note)],
        ..Default::default()
    };
    let found = |s: &Scored| s.kinds.join(" + ");
    let mut rows = vec![
        row("as declared", set.declared, String::new()),
        row("calibrated", set.calibrated, String::new()),
        row("augmented by the library", set.augmented.error, found(&set.augmented)),
    ];
    if let Some(formula) = &set.formula {
        rows.push(row("formulas only", formula.error, found(formula)));
    }
    if let Some(net) = &set.hybrid {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let crps = net.crps.map_or("no number".to_owned(), |crps| format!("{crps:.3} {}", set.unit));
        let taken = format!(
            "CRPS {crps}; {} in the 50 % band, {} in the 90 % band; {} of its corrections taken",
            percent(net.coverage50),
            percent(net.coverage90),
            percent(net.gain)
        );
        rows.push(row("Hybrid+ on the residual", net.error, taken));
    }
    for p in set.published {
        let read = if p.verified { "published, verified" } else { "published, from memory" };
        rows.push(row(p.method, Some(p.error), read.to_owned()));
    }
    let table = Table {
        caption: format!("Root mean square error: {}.", set.metric),
        columns: vec![
            Column::text("model"),
            Column::number("error", set.unit).decimals(3),
            Column::text("model structure"),
        ],
        rows,
        ..Default::default()
    };
    let runs =
        [Some(("with the library", &set.augmented)), set.formula.as_ref().map(|f| ("formulas only", f))];
    let errors = runs
        .into_iter()
        .flatten()
        .map(|(name, s)| (name.to_owned(), format!("{} Report: `{}`.", s.sentence, s.report.display())));
    let source = Block::Prose(format!("Data: {}.", set.source));
    Section::new(set.set, vec![Block::Table(table), Block::Definitions(errors.collect()), source])
}
