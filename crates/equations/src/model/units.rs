//! Infers the physical dimensions of expressions, and checks that they are consistent.
//!
//! Where they cannot be determined nothing is reported. It is an error if both operands of a sum, comparison
//! or choice have known, different dimensions, or if a rate is not in the unit of its state per second.

use super::Model;
use crate::text::{Function, Kind, Problem, Side, Symbol, Tree};
use augsim_data::{Dimensions, Unit, escaped_short};
use std::ops::Range;

/// Infers the dimensions of an expression; `None` if they cannot be determined.
///
/// Numbers take any dimensions.
///
/// # Errors
/// [`Problem::Units`] with its bytes of the text, if the operands of a sum, comparison or choice have
/// different dimensions.
pub(super) fn infer(model: &Model, tree: &Tree) -> Result<Option<Dimensions>, (Problem, Range<usize>)> {
    let mut found: Vec<Option<Dimensions>> = Vec::with_capacity(tree.nodes.len());
    for (index, node) in tree.nodes.iter().enumerate() {
        let dimensions_at = |a: &usize| found[*a];
        let common = |a: &usize, b: &usize, verb, sign| match (found[*a], found[*b]) {
            (Some(x), Some(y)) if x != y => {
                let side = |node: usize, dimensions| {
                    let unit = unit_of(model, tree, node, dimensions);
                    Box::new(Side { unit, text: escaped_short(tree.text_of(node)) })
                };
                let problem = Problem::Units { verb, sign, left: side(*a, x), right: side(*b, y) };
                Err((problem, tree.nodes[index].span.clone()))
            }
            (x, y) => Ok(x.or(y)),
        };
        let dimension = match &node.kind {
            Kind::Number(_) => None,
            Kind::Symbol(symbol) => dimensions_of_symbol(model, *symbol),
            Kind::Negate(a) => dimensions_at(a),
            Kind::Add(a, b) => common(a, b, "add", "+")?,
            Kind::Subtract(a, b) => common(a, b, "subtract", "-")?,
            Kind::Multiply(a, b) => dimensions_at(a).zip(dimensions_at(b)).map(|(x, y)| x * y),
            Kind::Divide(a, b) => dimensions_at(a).zip(dimensions_at(b)).map(|(x, y)| x / y),
            Kind::Power(a, b) => match (dimensions_at(a), &tree.nodes[*b].kind) {
                (Some(x), Kind::Number(exponent)) => x.power(*exponent),
                (Some(x), _) if x.is_pure() => Some(Dimensions::NONE),
                _ => None,
            },
            Kind::Call(function, arguments) => match (function, &arguments[..]) {
                (Function::Sqrt, [a]) => dimensions_at(a).and_then(|x| x.power(0.5)),
                (Function::Cbrt, [a]) => dimensions_at(a).and_then(|x| x.power(1.0 / 3.0)),
                (Function::Abs | Function::Relu, [a]) => dimensions_at(a),
                (Function::Hypot | Function::Min | Function::Max, [a, b]) => common(a, b, "compare", "and")?,
                (Function::Deadzone, [a, b]) => common(a, b, "compare", "and")?,
                (Function::Clamp, [z, low, high]) => {
                    common(z, low, "compare", "and")?.or(common(z, high, "compare", "and")?)
                }
                (Function::Atan2, [a, b]) => {
                    common(a, b, "compare", "and")?;
                    Some(Dimensions::NONE)
                }
                _ => Some(Dimensions::NONE),
            },
            Kind::If { left, right, then, otherwise, .. } => {
                common(left, right, "compare", "and")?;
                common(then, otherwise, "choose between", "or")?
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

/// Dimensions of an expression, if they can be determined and nothing in it is inconsistent.
pub(crate) fn dimensions_of(model: &Model, tree: &Tree) -> Option<Dimensions> {
    infer(model, tree).ok().flatten()
}

/// Dimensions of a quantity of the model; `None` if it has no unit.
fn dimensions_of_symbol(model: &Model, symbol: Symbol) -> Option<Dimensions> {
    match symbol {
        Symbol::Let(i) => model.lets.get(i).and_then(|l| l.dimensions),
        Symbol::Time => Some(Dimensions::TIME),
        Symbol::JointTorque(i) => model.robot.as_ref().and_then(|r| r.torque_unit(i)).map(Unit::dimensions),
        Symbol::JointAcceleration(i) => {
            model.robot.as_ref().and_then(|r| r.acceleration_unit(i)).map(Unit::dimensions)
        }
        Symbol::ExternalRate(i) => {
            let unit = model.states.get(i).and_then(|state| state.unit);
            unit.map(|unit| unit.dimensions() / Dimensions::TIME)
        }
        _ => declared_unit(model, symbol).map(Unit::dimensions),
    }
}

/// Unit that the model file declares for a quantity; `None` if it declares none.
fn declared_unit(model: &Model, symbol: Symbol) -> Option<Unit> {
    match symbol {
        Symbol::State(i) => model.states.get(i).and_then(|q| q.unit),
        Symbol::Input(i) => model.inputs.get(i).and_then(|q| q.unit),
        Symbol::Parameter(i) => model.parameters.get(i).and_then(|q| q.unit),
        Symbol::Output(i) => model.outputs.get(i).and_then(|q| q.unit),
        Symbol::Let(_)
        | Symbol::Time
        | Symbol::JointTorque(_)
        | Symbol::JointAcceleration(_)
        | Symbol::ExternalRate(_) => None,
    }
}

/// Unit of a node for a message; a quantity has its declared unit, so that `rad/s` is not shown as `1/s`.
fn unit_of(model: &Model, tree: &Tree, node: usize, dimensions: Dimensions) -> String {
    let declared = match tree.nodes[node].kind {
        Kind::Symbol(symbol) => declared_unit(model, symbol),
        _ => None,
    };
    match declared {
        Some(unit) if unit != Unit::DIMENSIONLESS => unit.to_string(),
        _ if dimensions.is_pure() => "1 (a pure number)".into(),
        _ => dimensions.to_string(),
    }
}
