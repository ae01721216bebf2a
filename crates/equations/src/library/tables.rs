//! A table effect: a piecewise linear function of one quantity with uniform knots, constant outside.

use crate::model::{Draft, How, Parameter, Target};

/// Smallest bound of the values at the knots of a table, in the unit of what it adds to; as for tables of the ball.
const MIN_KNOT_BOUND: f64 = 100.0;

/// Builds a table effect: a function of the quantity `against`, with uniform knots from `first` to `last`.
///
/// The effect's parameters `knot0`, `knot1`, … are the `values` at the knots.
pub fn draft(target: Target, on: &str, against: &str, (first, last): (f64, f64), values: &[f64]) -> Draft {
    let spacing = (last - first) / (values.len().max(2) - 1) as f64;
    let end = values.len().saturating_sub(1);
    // Each knot has a triangular (hat) basis function; those of the end knots stay at 1 outside.
    let hat = |i: usize| {
        let at = first + spacing * i as f64;
        let z = format!("(({against}) - {at:?}) / {spacing:?}");
        match i {
            0 => format!("knot0 * clamp(1 - {z}, 0, 1)"),
            _ if i == end => format!("knot{i} * clamp(1 + {z}, 0, 1)"),
            _ => format!("knot{i} * relu(1 - abs({z}))"),
        }
    };
    let text = (0..values.len()).map(hat).collect::<Vec<_>>().join(" + ");
    let bound = values.iter().fold(MIN_KNOT_BOUND, |most: f64, v| most.max(10.0 * v.abs()));
    let knot = |(i, value): (usize, &f64)| Parameter {
        name: format!("knot{i}"),
        unit: None,
        nominal: *value,
        min: -bound,
        max: bound,
        frozen: false,
        ci95: None,
        by_group: None,
        line: 0,
    };
    Draft {
        kind: "table".into(),
        on: on.into(),
        with: Some(against.into()),
        parameters: values.iter().enumerate().map(knot).collect(),
        changes: vec![((target, How::Add), text)],
        table: Some((first, last)),
        ..Draft::default()
    }
}
