//! Dimensions of expressions. What cannot be decided is silent; a sum of two known, different dimensions and a rate
//! that is not its state per second are mistakes.

use super::Model;
use crate::text::{Function, Kind, Problem, Side, Symbol, Tree};
use augsim_data::{Dimensions, Unit, shown};
use std::ops::Range;

/// Dimension of an expression, where it can be decided. A number takes the dimension that it needs.
///
/// # Errors
/// [`Problem::Units`] with the bytes of the text, for a sum, a comparison or a choice of unequal dimensions.
pub(super) fn infer(model: &Model, tree: &Tree) -> Result<Option<Dimensions>, (Problem, Range<usize>)> {
    let mut found: Vec<Option<Dimensions>> = Vec::with_capacity(tree.nodes.len());
    for (index, node) in tree.nodes.iter().enumerate() {
        let one = |a: &usize| found[*a];
        let both = |a: &usize, b: &usize, verb, sign| match (found[*a], found[*b]) {
            (Some(x), Some(y)) if x != y => {
                let side = |node: usize, dimensions| {
                    let unit = unit_of(model, tree, node, dimensions);
                    Box::new(Side { unit, text: shown(tree.text_of(node)) })
                };
                let problem = Problem::Units { verb, sign, left: side(*a, x), right: side(*b, y) };
                Err((problem, tree.nodes[index].span.clone()))
            }
            (x, y) => Ok(x.or(y)),
        };
        let dimension = match &node.kind {
            Kind::Number(_) => None,
            Kind::Symbol(symbol) => of_symbol(model, *symbol),
            Kind::Negate(a) => one(a),
            Kind::Add(a, b) => both(a, b, "adds", "+")?,
            Kind::Subtract(a, b) => both(a, b, "subtracts", "-")?,
            Kind::Multiply(a, b) => one(a).zip(one(b)).map(|(x, y)| x * y),
            Kind::Divide(a, b) => one(a).zip(one(b)).map(|(x, y)| x / y),
            Kind::Power(a, b) => match (one(a), &tree.nodes[*b].kind) {
                (Some(x), Kind::Number(exponent)) => x.power(*exponent),
                (Some(x), _) if x.is_pure() => Some(Dimensions::NONE),
                _ => None,
            },
            Kind::Call(function, arguments) => match (function, &arguments[..]) {
                (Function::Sqrt, [a]) => one(a).and_then(|x| x.power(0.5)),
                (Function::Cbrt, [a]) => one(a).and_then(|x| x.power(1.0 / 3.0)),
                (Function::Abs | Function::Relu, [a]) => one(a),
                (Function::Hypot | Function::Min | Function::Max, [a, b]) => both(a, b, "compares", "and")?,
                (Function::Deadzone, [a, b]) => both(a, b, "compares", "and")?,
                (Function::Clamp, [z, low, high]) => {
                    both(z, low, "compares", "and")?.or(both(z, high, "compares", "and")?)
                }
                (Function::Atan2, [a, b]) => {
                    both(a, b, "compares", "and")?;
                    Some(Dimensions::NONE)
                }
                _ => Some(Dimensions::NONE),
            },
            Kind::If { left, right, then, otherwise, .. } => {
                both(left, right, "compares", "and")?;
                both(then, otherwise, "chooses between", "or")?
            }
            Kind::Table { table, .. } => model.tables.get(*table).and_then(|t| t.unit).map(Unit::dimensions),
            Kind::Slope { output } => {
                let unit = model.outputs.get(*output).and_then(|o| o.unit);
                unit.map(|unit| unit.dimensions() / Dimensions::TIME)
            }
        };
        found.push(dimension);
    }
    Ok(found.last().copied().flatten())
}

/// Dimension of an expression, where it can be decided and nothing in it disagrees.
pub(crate) fn dimensions_of(model: &Model, tree: &Tree) -> Option<Dimensions> {
    infer(model, tree).ok().flatten()
}

fn of_symbol(model: &Model, symbol: Symbol) -> Option<Dimensions> {
    match symbol {
        Symbol::Let(i) => model.lets.get(i).and_then(|l| l.dimensions),
        Symbol::Time => Some(Dimensions::TIME),
        _ => declared(model, symbol).map(Unit::dimensions),
    }
}

/// Unit that a name states.
fn declared(model: &Model, symbol: Symbol) -> Option<Unit> {
    match symbol {
        Symbol::State(i) => model.states.get(i).and_then(|q| q.unit),
        Symbol::Input(i) => model.inputs.get(i).and_then(|q| q.unit),
        Symbol::Parameter(i) => model.parameters.get(i).and_then(|q| q.unit),
        Symbol::Output(i) => model.outputs.get(i).and_then(|q| q.unit),
        Symbol::Let(_) | Symbol::Time => None,
    }
}

/// Unit of a node for a message: as its name states it where it is a name, so that `rad/s` is not printed as `1/s`.
fn unit_of(model: &Model, tree: &Tree, node: usize, dimensions: Dimensions) -> String {
    let stated = match tree.nodes[node].kind {
        Kind::Symbol(symbol) => declared(model, symbol),
        _ => None,
    };
    match stated {
        Some(unit) if unit != Unit::DIMENSIONLESS => unit.to_string(),
        _ if dimensions.is_pure() => "a pure number".into(),
        _ => dimensions.to_string(),
    }
}
