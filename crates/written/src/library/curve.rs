//! A law that was added, as a curve over what it depends on.

use super::scale::Scales;
use crate::model::{How, Model, Target};
use crate::text::Symbol;
use augsim_data::Unit;

/// Points of a curve.
const POINTS: usize = 81;

/// Curve of an addition of a model, over the values that the quantity takes in data.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Kind of the addition.
    pub kind: String,
    /// Target of the addition: a rate, an output, an input or a parameter, in words.
    pub target: String,
    /// Unit of the addition; empty for a pure number and for a factor.
    pub unit: String,
    /// The state or input that it depends on, and its unit.
    pub of: (String, String),
    /// Values of that quantity, over its range in the data.
    pub x: Vec<f64>,
    /// The addition at each place of `x` (for a factor: the number that it multiplies by).
    pub y: Vec<f64>,
}

/// Curves of the additions of a model that depend on one state or input alone and bring no states along.
pub fn curves(model: &Model, scales: &Scales) -> Vec<Curve> {
    (0..model.additions.len()).filter_map(|index| curve(model, scales, index)).collect()
}

fn curve(model: &Model, scales: &Scales, index: usize) -> Option<Curve> {
    let addition = &model.additions[index];
    let change = addition.changes.first().filter(|_| addition.states.is_empty())?;
    let mut of: Vec<Symbol> =
        change.value.tree.symbols().filter(|s| !matches!(s, Symbol::Parameter(_))).collect();
    of.sort_unstable();
    of.dedup();
    let [of] = of[..] else { return None };
    let (name, unit) = match of {
        Symbol::State(i) => (&model.states[i].name, model.states[i].unit),
        Symbol::Input(i) => (&model.inputs[i].name, model.inputs[i].unit),
        _ => return None,
    };
    let symbol = |unit: Option<Unit>| unit.map_or_else(String::new, Unit::symbol);
    let [low, high] = scales.range(name, model)?;
    let x: Vec<f64> = (0..POINTS).map(|k| low + (high - low) * k as f64 / (POINTS - 1) as f64).collect();
    let y = scales.swept(model, &change.value.tree, of, &x)?;
    let per_second = |unit: Option<Unit>| {
        let dimensions = unit?.dimensions() / augsim_data::Dimensions::TIME;
        Unit::of_dimensions(dimensions)
    };
    let (target, of_target) = match change.target {
        Target::Rate(i) => (format!("d({})/dt", model.states[i].name), per_second(model.states[i].unit)),
        Target::Output(i) => (model.outputs[i].name.clone(), model.outputs[i].unit),
        Target::Input(i) => (model.inputs[i].name.clone(), model.inputs[i].unit),
        Target::Delay(i) => (format!("delay of {}", model.inputs[i].name), Some(Unit::SECOND)),
        Target::Parameter(i) => (model.parameters[i].name.clone(), model.parameters[i].unit),
    };
    let unit_of_change = if change.how == How::Factor { String::new() } else { symbol(of_target) };
    Some(Curve {
        kind: addition.kind.clone(),
        target,
        unit: unit_of_change,
        of: (name.clone(), symbol(unit)),
        x,
        y,
    })
}
