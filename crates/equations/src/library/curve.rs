//! Effects as curves over the quantity that they depend on, for reports.

use super::scale::Scales;
use crate::model::{How, Model, Target};
use crate::text::Symbol;
use augsim_data::Unit;

/// Number of points of a curve.
const CURVE_POINTS: usize = 81;

/// Curve of an effect of a model, over the range of its argument in the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Kind of the effect.
    pub kind: String,
    /// The rate, output, input, delay or parameter that the effect changes, as text.
    pub target: String,
    /// Unit of the change; empty for a pure number and for a factor.
    pub unit: String,
    /// Name and unit of the state or input that it depends on.
    pub of: (String, String),
    /// Values of that quantity, over its range in the data.
    pub x: Vec<f64>,
    /// The change at each value of `x`; for a factor, the number that it multiplies by.
    pub y: Vec<f64>,
}

/// Curves of the effects of a model that depend on a single state or input.
///
/// Effects with states of their own are left out.
pub fn curves(model: &Model, scales: &Scales) -> Vec<Curve> {
    (0..model.additions.len()).filter_map(|index| curve(model, scales, index)).collect()
}

/// Curve of one effect.
///
/// `None` if it is not a function of a single state or input, or if that has no range in the data.
fn curve(model: &Model, scales: &Scales, index: usize) -> Option<Curve> {
    let addition = &model.additions[index];
    let change = addition.changes.first().filter(|_| addition.states.is_empty())?;
    let mut arguments: Vec<Symbol> =
        change.value.tree.symbols().filter(|s| !matches!(s, Symbol::Parameter(_))).collect();
    arguments.sort_unstable();
    arguments.dedup();
    let [argument] = arguments[..] else { return None };
    let (name, unit) = match argument {
        Symbol::State(i) => (&model.states[i].name, model.states[i].unit),
        Symbol::Input(i) => (&model.inputs[i].name, model.inputs[i].unit),
        _ => return None,
    };
    let symbol = |unit: Option<Unit>| unit.map_or_else(String::new, Unit::symbol);
    let [low, high] = scales.range(name, model)?;
    let x: Vec<f64> =
        (0..CURVE_POINTS).map(|k| low + (high - low) * k as f64 / (CURVE_POINTS - 1) as f64).collect();
    let y = scales.values_over(model, &change.value.tree, argument, &x)?;
    let per_second = |unit: Option<Unit>| {
        let dimensions = unit?.dimensions() / augsim_data::Dimensions::TIME;
        Unit::from_dimensions(dimensions)
    };
    let (target, target_unit) = match change.target {
        Target::Rate(i) => (format!("d({})/dt", model.states[i].name), per_second(model.states[i].unit)),
        Target::Output(i) => (model.outputs[i].name.clone(), model.outputs[i].unit),
        Target::Input(i) => (model.inputs[i].name.clone(), model.inputs[i].unit),
        Target::Delay(i) => (format!("delay of {}", model.inputs[i].name), Some(Unit::SECOND)),
        Target::Parameter(i) => (model.parameters[i].name.clone(), model.parameters[i].unit),
    };
    let unit_of_change = if change.how == How::Factor { String::new() } else { symbol(target_unit) };
    Some(Curve {
        kind: addition.kind.clone(),
        target,
        unit: unit_of_change,
        of: (name.clone(), symbol(unit)),
        x,
        y,
    })
}
