//! A law that no expression describes: values at uniform knots of one quantity, straight between them, constant outside.

use crate::model::{Draft, How, Parameter, Target};

/// Bound of the values of a table, in the unit of what it adds to; that of the ball's tables.
const MOST_OF_A_KNOT: f64 = 100.0;

/// The effect that adds a table of `against` over `first` to `last` with `values` at its knots, which are its parameters
/// `knot0`, `knot1`, ….
pub fn draft(target: Target, on: &str, against: &str, (first, last): (f64, f64), values: &[f64]) -> Draft {
    let spacing = (last - first) / (values.len().max(2) - 1) as f64;
    let end = values.len().saturating_sub(1);
    // Each knot carries a hat over its neighbours; those at the ends stay up outside.
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
    let bound = values.iter().fold(MOST_OF_A_KNOT, |most: f64, v| most.max(10.0 * v.abs()));
    let knot = |(i, value): (usize, &f64)| Parameter {
        name: format!("knot{i}"),
        unit: None,
        nominal: *value,
        min: -bound,
        max: bound,
        frozen: false,
        ci95: None,
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
