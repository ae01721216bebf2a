//! Figures in the report on an equation model: free runs and curves of the added effects.

use super::fit::prepare_records;
use super::forecast::{BURN_IN, FreeRun, free_runs};
use super::hidden_states::hidden_states;
use super::records;
use crate::Subject;
use crate::discovery_page::{EffectCurve, Example, HiddenState};
use crate::joints::{FrictionCurve, JointResult, friction_curves, joint_results};
use augsim_data::Dataset;
use augsim_discovery::Discovery;
use augsim_equations::library::curves;
use augsim_equations::{EquationSystem, Model};
use augsim_system::{Record, shortest_difference, typical_step};

/// Maximum number of plotted points of a curve.
const MAX_POINTS: usize = 600;
/// Maximum RMS error of linear interpolation between plotted points.
///
/// Relative to the standard deviation of the curve.
const MAX_INTERPOLATION_ERROR: f64 = 0.02;
/// Number of samples of the windows from which the scales of quantities are estimated.
const WINDOW_SAMPLES: usize = 400;
/// Maximum number of records whose free runs are plotted.
const MAX_RECORDS: usize = 2;

/// Figures for the report of a discovery.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figures {
    /// Plotted records with free runs of the calibrated and of the augmented model.
    pub examples: Vec<Example>,
    /// Curves of the added effects over the quantities they depend on.
    pub curves: Vec<EffectCurve>,
    /// Hidden states of the added effects over a recording, and their step responses.
    pub hidden_states: Vec<HiddenState>,
    /// Errors and effects of each joint of a robot; empty for other models.
    pub joints: Vec<JointResult>,
    /// Friction torque of each joint of a robot over its speed; empty for other models.
    pub friction: Vec<FrictionCurve>,
}

/// Builds the figures of a discovery in `data`, which have the columns of the model.
///
/// Empty for a built-in scenario, or if a model cannot be simulated.
pub fn figures(subject: &Subject, found: &Discovery, data: &Dataset) -> Figures {
    match subject {
        Subject::BuiltIn(_) => Figures::default(),
        Subject::Equations(model) => Figures {
            joints: joint_results(subject, found, Some(data)),
            friction: friction_curves(subject, found, data),
            ..draw(model, found, data).unwrap_or_default()
        },
    }
}

fn draw(declared: &Model, found: &Discovery, data: &Dataset) -> anyhow::Result<Figures> {
    let augmented = declared.parse_changed(&found.model_toml)?;
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
    list.truncate(MAX_RECORDS);
    let curves = laws(&augmented, &list)?;
    let (before, after) = match runs(&calibrated, &augmented, &list) {
        Ok(runs) => runs,
        Err(_) => {
            // A model that diverges later may still be simulated over the beginning.
            for record in &mut list {
                record.times.truncate(MAX_POINTS);
                record.values.iter_mut().for_each(|v| v.truncate(MAX_POINTS));
            }
            runs(&calibrated, &augmented, &list)?
        }
    };
    let mut examples = Vec::new();
    for (index, (record, before)) in list.iter().zip(&before).enumerate() {
        let predictions =
            before.predicted.iter().chain(after.get(index).into_iter().flat_map(|run| &run.predicted));
        let stride = stride(&predictions.map(Vec::as_slice).collect::<Vec<_>>());
        let thinned =
            |values: &[f64]| values.iter().copied().step_by(stride).take(MAX_POINTS).collect::<Vec<_>>();
        for (output, column) in declared.outputs.iter().enumerate() {
            let measured = continuous(&before.measured[output], column.period);
            let predicted =
                |run: &FreeRun| thinned(&on_measured_turn(&run.predicted[output], &measured, column.period));
            examples.push(Example {
                trajectory: format!("trajectory {}", record.id),
                channel: column.name.clone(),
                unit: super::unit_text(column.unit).trim().to_owned(),
                t_s: thinned(&before.times),
                measured: thinned(&measured),
                before: predicted(before),
                after: after.get(index).map_or_else(Vec::new, predicted),
                ..Example::default()
            });
        }
    }
    // A model that diverges over the whole record has no such figures.
    let hidden_states = hidden_states(&augmented, &list, BURN_IN).unwrap_or_default();
    Ok(Figures { examples, curves, hidden_states, ..Figures::default() })
}

/// Unwraps a periodic quantity: moves each value by whole periods to the one nearest to its predecessor.
fn continuous(values: &[f64], period: Option<f64>) -> Vec<f64> {
    let mut previous = f64::NAN;
    let follow = |value: &f64| {
        let value = if previous.is_finite() {
            previous + shortest_difference(value - previous, period)
        } else {
            *value
        };
        previous = if value.is_finite() { value } else { previous };
        value
    };
    values.iter().map(follow).collect()
}

/// Moves predictions of a periodic quantity by whole periods to within half a period of the measured values.
///
/// Where no value was measured, the shift of the last measured sample applies.
fn on_measured_turn(predicted: &[f64], measured: &[f64], period: Option<f64>) -> Vec<f64> {
    let mut shift = 0.0;
    let follow = |(predicted, measured): (&f64, &f64)| {
        let difference = predicted - measured;
        if difference.is_finite() {
            shift = shortest_difference(difference, period) - difference;
        }
        predicted + shift
    };
    predicted.iter().zip(measured).map(follow).collect()
}

/// Simulates free runs of the calibrated and of the augmented model, in this order.
///
/// The second list is empty if no effect was added.
fn runs(
    calibrated: &Model,
    augmented: &Model,
    list: &[Record],
) -> anyhow::Result<(Vec<FreeRun>, Vec<FreeRun>)> {
    let is_same = augmented.additions.is_empty();
    let after = if is_same { Vec::new() } else { free_runs(augmented, list, BURN_IN)? };
    Ok((free_runs(calibrated, list, BURN_IN)?, after))
}

/// Largest stride, in samples, at which linear interpolation still represents all plotted series.
///
/// It is at most the stride with which [`MAX_POINTS`] points reach the end of the series.
fn stride(outputs: &[&[f64]]) -> usize {
    let samples = outputs.first().map_or(0, |values| values.len());
    let is_accurate = |stride: &usize| outputs.iter().all(|values| is_represented(values, *stride));
    let longest = samples.div_ceil(MAX_POINTS).max(1);
    (1..=longest).rev().find(is_accurate).unwrap_or(1)
}

/// Whether every `stride`-th sample, linearly interpolated, represents the plotted part of a series.
fn is_represented(values: &[f64], stride: usize) -> bool {
    let plotted = &values[..values.len().min(MAX_POINTS * stride)];
    let mean = plotted.iter().sum::<f64>() / plotted.len().max(1) as f64;
    let (mut error_squares, mut deviation_squares) = (0.0, 0.0);
    for piece in plotted.windows(stride + 1).step_by(stride) {
        for (k, value) in piece.iter().enumerate() {
            let line = piece[0] + (piece[stride] - piece[0]) * k as f64 / stride as f64;
            error_squares += (value - line).powi(2);
            deviation_squares += (value - mean).powi(2);
        }
    }
    error_squares <= MAX_INTERPOLATION_ERROR * MAX_INTERPOLATION_ERROR * deviation_squares
}

/// Computes the curves of the added effects, over the range of their arguments in the records.
fn laws(augmented: &Model, list: &[Record]) -> anyhow::Result<Vec<EffectCurve>> {
    if augmented.additions.is_empty() {
        return Ok(Vec::new());
    }
    let window_s = list.first().map(|record| WINDOW_SAMPLES as f64 * typical_step(&record.times));
    let system = EquationSystem::declared_only(augmented)?.with_windows(window_s);
    let windows = prepare_records(&system, list)?;
    let scales = system.tuned(&windows)?.scales(&windows);
    let curves = curves(augmented, &scales).into_iter().map(|curve| EffectCurve {
        title: curve.kind,
        adds: curve.target,
        unit: curve.unit,
        of: curve.of.0,
        of_unit: curve.of.1,
        x: curve.x,
        y: curve.y,
    });
    Ok(curves.collect())
}

#[cfg(test)]
mod tests {
    //! Contract: plotted points are as far apart as linear interpolation allows, and no farther than needed
    //! to reach the end.
    use super::*;

    fn wave(samples: usize, period: f64) -> Vec<f64> {
        (0..samples).map(|k| (std::f64::consts::TAU * k as f64 / period).sin()).collect()
    }

    #[test]
    fn slow_curves_are_plotted_to_the_end_and_fast_ones_with_a_shorter_stride() {
        assert_eq!(stride(&[&wave(500, 100.0)]), 1, "all of it fits");
        assert_eq!(stride(&[&wave(24_000, 5_000.0)]), 40, "to the end");
        let fast = stride(&[&wave(24_000, 40.0)]);
        assert!((2..8).contains(&fast), "{fast} samples apart");
        assert_eq!(stride(&[&wave(24_000, 5_000.0), &wave(24_000, 40.0)]), fast, "all outputs");
    }

    #[test]
    fn predictions_of_a_wrapped_angle_lie_on_the_measured_curve() {
        let tau = std::f64::consts::TAU;
        let angle: Vec<f64> = (0..20).map(|k| 0.5 * f64::from(k)).collect();
        let mut wrapped: Vec<f64> = angle.iter().map(|a| shortest_difference(*a, Some(tau))).collect();
        wrapped[7] = f64::NAN;
        let measured = continuous(&wrapped, Some(tau));
        let predicted: Vec<f64> = angle.iter().map(|a| a + 0.1 + tau).collect();
        for (k, p) in on_measured_turn(&predicted, &measured, Some(tau)).into_iter().enumerate() {
            assert!((p - angle[k] - 0.1).abs() < 1e-12, "{k}: {p}");
        }
        assert_eq!(continuous(&wrapped, None)[8], wrapped[8]);
    }

    #[test]
    fn diverging_curves_are_plotted_at_their_beginning() {
        let mut values = wave(24_000, 5_000.0);
        values[2_000..].fill(f64::NAN);
        assert!(stride(&[&values]) <= 3);
    }
}
