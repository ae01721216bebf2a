//! Pictures in a report on a system of equations: the first record with the runs of both models, and the laws that were found.

use super::fit::prepared;
use super::forecast::{FreeRun, free_runs};
use super::records;
use crate::discovery_page::{Example, LawCurve};
use crate::{DataFrom, Subject};
use augsim_data::Dataset;
use augsim_discovery::Discovery;
use augsim_physics::system::{Record, typical_step};

use augsim_written::library::curves;
use augsim_written::{Model, WrittenSystem};

/// Points of a curve that are drawn, and samples that the runs start from.
const SHOWN: usize = 600;
const BURN_IN: usize = 20;
/// Share of what an output does that straight lines between the points drawn may miss.
const MISSED: f64 = 0.02;
/// Samples of the windows that sizes are taken from, all over the records.
const WINDOW: usize = 400;
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
    let (before, after) = match runs(&calibrated, &augmented, &list) {
        Ok(runs) => runs,
        Err(_) => {
            // What cannot be run to the end may be shown at its beginning.
            for record in &mut list {
                record.times.truncate(SHOWN);
                record.values.iter_mut().for_each(|v| v.truncate(SHOWN));
            }
            runs(&calibrated, &augmented, &list)?
        }
    };
    let mut examples = Vec::new();
    for (index, (record, before)) in list.iter().zip(&before).enumerate() {
        let both = before.foretold.iter().chain(after.get(index).into_iter().flat_map(|run| &run.foretold));
        let stride = stride(&both.map(Vec::as_slice).collect::<Vec<_>>());
        let thinned = |values: &[f64]| values.iter().copied().step_by(stride).take(SHOWN).collect::<Vec<_>>();
        for (output, column) in declared.outputs.iter().enumerate() {
            let of = |run: &FreeRun| thinned(&run.foretold[output]);
            examples.push(Example {
                trajectory: format!("trajectory {}", record.id),
                channel: column.name.clone(),
                unit: super::unit_text(column.unit).trim().to_owned(),
                t_s: thinned(&before.times),
                measured: thinned(&before.measured[output]),
                before: of(before),
                after: after.get(index).map_or_else(Vec::new, of),
                ..Example::default()
            });
        }
    }
    Ok(Pictures { examples, laws })
}

/// Free runs of the calibrated and of the augmented model; none of one without additions.
fn runs(
    calibrated: &Model,
    augmented: &Model,
    list: &[Record],
) -> anyhow::Result<(Vec<FreeRun>, Vec<FreeRun>)> {
    let is_same = augmented.additions.is_empty();
    let after = if is_same { Vec::new() } else { free_runs(augmented, list, BURN_IN)? };
    Ok((free_runs(calibrated, list, BURN_IN)?, after))
}

/// The largest distance, in samples, of points that straight lines between them show all these series by, but no larger than as
/// many points as are drawn need to reach the end.
fn stride(outputs: &[&[f64]]) -> usize {
    let samples = outputs.first().map_or(0, |values| values.len());
    let shows = |stride: &usize| outputs.iter().all(|values| is_shown(values, *stride));
    let needed = samples.div_ceil(SHOWN).max(1);
    (1..=needed).rev().find(shows).unwrap_or(1)
}

/// Whether straight lines between points so many samples apart show a series, as far as that many points reach.
fn is_shown(values: &[f64], stride: usize) -> bool {
    let reached = &values[..values.len().min(SHOWN * stride)];
    let mean = reached.iter().sum::<f64>() / reached.len().max(1) as f64;
    let (mut missed, mut moved) = (0.0, 0.0);
    for piece in reached.windows(stride + 1).step_by(stride) {
        for (k, value) in piece.iter().enumerate() {
            let line = piece[0] + (piece[stride] - piece[0]) * k as f64 / stride as f64;
            missed += (value - line).powi(2);
            moved += (value - mean).powi(2);
        }
    }
    missed <= MISSED * MISSED * moved
}

fn laws(augmented: &Model, list: &[Record]) -> anyhow::Result<Vec<LawCurve>> {
    if augmented.additions.is_empty() {
        return Ok(Vec::new());
    }
    let window_s = list.first().map(|record| WINDOW as f64 * typical_step(&record.times));
    let system = WrittenSystem::declared_only(augmented)?.with_windows(window_s);
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

#[cfg(test)]
mod tests {
    //! Contract: points are drawn as far apart as straight lines between them show the motion, and no farther than they have to be.
    use super::*;

    fn wave(samples: usize, period: f64) -> Vec<f64> {
        (0..samples).map(|k| (std::f64::consts::TAU * k as f64 / period).sin()).collect()
    }

    #[test]
    fn a_slow_motion_is_drawn_to_its_end_and_a_fast_one_as_far_as_it_shows() {
        assert_eq!(stride(&[&wave(500, 100.0)]), 1, "all of it fits");
        assert_eq!(stride(&[&wave(24_000, 5_000.0)]), 40, "to the end");
        let fast = stride(&[&wave(24_000, 40.0)]);
        assert!((2..8).contains(&fast), "{fast} samples apart");
        assert_eq!(stride(&[&wave(24_000, 5_000.0), &wave(24_000, 40.0)]), fast, "all outputs");
    }

    #[test]
    fn what_leaves_the_numbers_is_shown_at_its_beginning() {
        let mut values = wave(24_000, 5_000.0);
        values[2_000..].fill(f64::NAN);
        assert!(stride(&[&values]) <= 3);
    }
}
