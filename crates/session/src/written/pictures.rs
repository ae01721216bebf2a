//! Pictures in a report on a system of equations: the first record with the runs of both models, and the laws that were found.

use super::fit::prepared;
use super::forecast::{FreeRun, free_runs};
use super::records;
use crate::{DataFrom, Subject};
use augsim_data::Dataset;
use augsim_discovery::Discovery;
use augsim_physics::system::Record;
use augsim_report::discovery::{Example, LawCurve};
use augsim_written::library::curves;
use augsim_written::{Model, WrittenSystem};

/// Samples of a record that are shown, and those that the runs start from.
const SHOWN: usize = 600;
const BURN_IN: usize = 20;
/// Records that are shown.
const RECORDS: usize = 2;

/// Pictures for the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pictures {
    /// Records with the runs of both models.
    pub examples: Vec<Example>,
    /// Laws as curves.
    pub laws: Vec<LawCurve>,
}

/// The pictures of a discovery on `data`; none for a built-in system, and where the augmented model cannot be run on them.
pub fn pictures(subject: &Subject, found: &Discovery, data: &DataFrom) -> Pictures {
    match subject {
        Subject::BuiltIn(_) => Pictures::default(),
        Subject::Written(model) => records::read(data, model)
            .and_then(|measured| drawn(model, found, &measured.data))
            .unwrap_or_default(),
    }
}

fn drawn(declared: &Model, found: &Discovery, data: &Dataset) -> anyhow::Result<Pictures> {
    let augmented = augsim_written::model::parse(&found.model_toml, &declared.file)?;
    let mut calibrated = declared.clone();
    for (input, chosen) in calibrated.inputs.iter_mut().zip(&augmented.inputs) {
        input.hold = chosen.hold;
    }
    for p in &mut calibrated.parameters {
        if let Some(estimate) = found.calibrated.get(&p.name) {
            p.nominal = estimate.value;
        }
    }
    let mut list: Vec<Record> = records::records(data, declared, false)?;
    list.truncate(RECORDS);
    let laws = laws(&augmented, &list)?;
    for record in &mut list {
        record.times.truncate(SHOWN);
        record.values.iter_mut().for_each(|v| v.truncate(SHOWN));
    }
    let before = free_runs(&calibrated, &list, BURN_IN)?;
    let after =
        if augmented.additions.is_empty() { Vec::new() } else { free_runs(&augmented, &list, BURN_IN)? };
    let mut examples = Vec::new();
    for (index, (record, before)) in list.iter().zip(&before).enumerate() {
        for (output, column) in declared.outputs.iter().enumerate() {
            let of = |run: &FreeRun| run.foretold[output].clone();
            examples.push(Example {
                trajectory: format!("trajectory {}", record.id),
                channel: column.name.clone(),
                unit: super::unit_text(column.unit).trim().to_owned(),
                t_s: before.times.clone(),
                measured: before.measured[output].clone(),
                before: of(before),
                after: after.get(index).map_or_else(Vec::new, of),
                ..Example::default()
            });
        }
    }
    Ok(Pictures { examples, laws })
}

fn laws(augmented: &Model, list: &[Record]) -> anyhow::Result<Vec<LawCurve>> {
    if augmented.additions.is_empty() {
        return Ok(Vec::new());
    }
    let system = WrittenSystem::declared_only(augmented)?;
    let windows = prepared(&system, list)?;
    let scales = system.tuned(&windows)?.scales(&windows);
    let shown = curves(augmented, &scales).into_iter().map(|curve| LawCurve {
        title: curve.kind,
        adds: curve.target,
        unit: curve.unit,
        of: curve.of.0,
        of_unit: curve.of.1,
        x: curve.x,
        y: curve.y,
    });
    Ok(shown.collect())
}
