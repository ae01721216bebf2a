//! The compiled equations as lists of assignments, from which exported programs are written.
//!
//! They are the instructions that the engine runs, so that a program computes what a simulation computes: with
//! the effects in their order, smoothed discontinuities, and exact derivatives.

use crate::ModelError;
use crate::compile::Section;
use crate::model::Model;
use crate::system::{Column, Gradient, System};
use std::collections::BTreeMap;

pub use crate::compile::Code;

/// An operand of an assignment of a program: a constant, a quantity of the model, or an earlier result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A constant number.
    Constant(f64),
    /// A state of the model, by index.
    State(usize),
    /// An input of the model, by index.
    Input(usize),
    /// The time derivative of an input of the model, by index.
    InputSlope(usize),
    /// Time since the trajectory began, s.
    Time,
    /// A parameter of the model, by index.
    Parameter(usize),
    /// The width of a smoothed discontinuity, by index.
    Width(usize),
    /// The result of an earlier assignment of the same routine, by index.
    Assignment(usize),
}

/// An operation on earlier values, whose result a program assigns to a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// The operation; never one that reads a quantity of the model.
    pub code: Code,
    /// Operands of the operation, as many as it has.
    pub operands: Vec<Value>,
    /// Index of the table that the operation reads; meaningless if it reads none.
    pub table: usize,
    /// Index of the `[let]` value that this assignment computes; `None` if it computes none.
    pub let_value: Option<usize>,
}

/// Assignments that compute one group of quantities (such as the rates), and the results.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Routine {
    /// Assignments of the routine, each after those that it uses.
    pub assignments: Vec<Assignment>,
    /// Values that the routine computes, as operands.
    pub results: Vec<Value>,
}

/// The variable with respect to which a listed derivative is taken: a state or time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// The derivative is taken with respect to a state, by index.
    State(usize),
    /// The derivative is taken with respect to the time.
    Time,
}

/// Derivatives that are not always 0, each for one value and one variable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Derivatives {
    /// Routine whose results are the derivatives.
    pub routine: Routine,
    /// For each result of the routine: index of the value that is differentiated, and the variable.
    pub entries: Vec<(usize, Variable)>,
}

/// A discontinuity of the equations that is smoothed over a width.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothedDiscontinuity {
    /// Text, in the model, of the argument at whose zero the discontinuity is.
    pub argument: String,
    /// Smoothing width in the unit of the argument: as declared, or a default before one is chosen from a simulation.
    pub width: f64,
    /// Whether the model file declares the width.
    pub is_declared: bool,
}

/// All compiled equations of a model, as lists of assignments.
#[derive(Debug, Clone, PartialEq)]
pub struct Listing {
    /// Assignments that compute the rates of the states.
    pub rates: Routine,
    /// Derivatives of the rates with respect to the states.
    pub jacobian: Derivatives,
    /// Assignments that compute the outputs.
    pub outputs: Routine,
    /// Assignments that compute the event conditions, then the conditions that end rests (positive where they hold).
    pub conditions: Routine,
    /// Derivatives of the condition of each event with respect to states and time.
    pub condition_derivatives: Vec<Derivatives>,
    /// For each event, assignments that compute all states after it.
    pub resets: Vec<Routine>,
    /// For each event, the index in `conditions` of the condition that ends its rest; `None` if it has none.
    pub rest_ends: Vec<Option<usize>>,
    /// Assignments that compute the arguments of the smoothed discontinuities.
    pub discontinuity_arguments: Routine,
    /// The smoothed discontinuities, in the order of `discontinuity_arguments`.
    pub discontinuities: Vec<SmoothedDiscontinuity>,
}

impl Listing {
    /// Compiles a model and lists its equations.
    ///
    /// # Errors
    /// Those of [`System::compile`], and a model whose rates an external function computes.
    pub fn new(model: &Model) -> Result<Listing, ModelError> {
        if let Some(external) = &model.external {
            return Err(external.not_exported(model));
        }
        let system = System::compile(model, &[])?;
        let reader = Reader::new(&system);
        let derivatives = |gradient: &Gradient| reader.derivatives(gradient);
        let states = |gradient: &Gradient| {
            let mut section = gradient.section.clone();
            section.results.truncate(model.states.len());
            reader.routine(&section)
        };
        let events = model.events.len();
        let discontinuity = |index: usize| SmoothedDiscontinuity {
            argument: system.width_texts[index].clone(),
            width: system.widths[index],
            is_declared: system.declared_widths[index],
        };
        Ok(Listing {
            rates: reader.routine(&system.rates),
            jacobian: derivatives(&system.rate_gradient),
            outputs: reader.routine(&system.outputs),
            conditions: reader.routine(&system.conditions),
            condition_derivatives: system.condition_gradients.iter().take(events).map(derivatives).collect(),
            resets: system.resets.iter().map(states).collect(),
            rest_ends: system.rest_ends.clone(),
            discontinuity_arguments: reader.routine(&system.discontinuity_arguments),
            discontinuities: (0..system.widths.len()).map(discontinuity).collect(),
        })
    }
}

/// Converts sections of a compiled system to assignments.
struct Reader<'s> {
    system: &'s System,
    constants: BTreeMap<u32, f64>,
    let_values: BTreeMap<u32, usize>,
}

impl<'s> Reader<'s> {
    fn new(system: &'s System) -> Self {
        let constants = system.layout.constants.iter().copied().collect();
        Reader { system, constants, let_values: system.let_registers.iter().copied().collect() }
    }

    /// Lists the derivatives in a gradient, whose section computes the values first and then the derivatives.
    fn derivatives(&self, gradient: &Gradient) -> Derivatives {
        let variable = |column: Column| match column {
            Column::State(state) => Some(Variable::State(state)),
            Column::Time => Some(Variable::Time),
            Column::Active(_) => None,
        };
        let known: Vec<(u32, usize, Variable)> = gradient
            .entries
            .iter()
            .filter_map(|e| variable(e.column).map(|v| (e.register as u32, e.row, v)))
            .collect();
        let section = Section {
            body: gradient.section.body.clone(),
            results: known.iter().map(|(register, ..)| *register).collect(),
            calls: Vec::new(),
        };
        let entries = known.iter().map(|(_, row, variable)| (*row, *variable)).collect();
        Derivatives { routine: self.routine(&section), entries }
    }

    /// Lists the assignments that the results of a section need.
    fn routine(&self, section: &Section) -> Routine {
        let body = || self.system.parameter_section.body.iter().chain(&section.body);
        let mut needed: BTreeMap<u32, Option<usize>> = section.results.iter().map(|r| (*r, None)).collect();
        let mut used = vec![false; body().count()];
        // Operands have lower registers than results, so that one pass from the end finds all of them.
        let mut order: Vec<(usize, &crate::compile::Instruction)> = body().enumerate().collect();
        order.sort_by_key(|(_, instruction)| std::cmp::Reverse(instruction.to));
        for (index, instruction) in order {
            if needed.contains_key(&instruction.to) && !used[index] {
                used[index] = true;
                let operands = &instruction.operands[..instruction.code.operands()];
                for register in operands {
                    needed.entry(*register).or_insert(None);
                }
            }
        }
        let mut assignments = Vec::new();
        let mut chosen: Vec<_> = body().zip(used).filter(|(_, used)| *used).map(|(i, _)| i).collect();
        chosen.sort_by_key(|instruction| instruction.to);
        for instruction in chosen {
            let operands = &instruction.operands[..instruction.code.operands()];
            assignments.push(Assignment {
                code: instruction.code,
                operands: operands.iter().map(|r| self.value(*r, &needed)).collect(),
                table: instruction.table as usize,
                let_value: self.let_values.get(&instruction.to).copied(),
            });
            needed.insert(instruction.to, Some(assignments.len() - 1));
        }
        let results = section.results.iter().map(|r| self.value(*r, &needed)).collect();
        Routine { assignments, results }
    }

    /// The operand that a register holds.
    fn value(&self, register: u32, assigned: &BTreeMap<u32, Option<usize>>) -> Value {
        if let Some(Some(index)) = assigned.get(&register) {
            return Value::Assignment(*index);
        }
        if let Some(constant) = self.constants.get(&register) {
            return Value::Constant(*constant);
        }
        let (layout, index) = (&self.system.layout, register as usize);
        let after = |first: usize| index - first;
        match index {
            i if i < layout.input(0) => Value::State(i),
            i if i < layout.input_slope(0) => Value::Input(after(layout.input(0))),
            i if i < layout.time() => Value::InputSlope(after(layout.input_slope(0))),
            i if i == layout.time() => Value::Time,
            i if i < layout.width(0) => Value::Parameter(after(layout.parameter(0))),
            _ => Value::Width(after(layout.width(0))),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a listing names every value that it reads, in an order that can be evaluated.
    use super::*;

    #[test]
    fn assignments_read_only_earlier_ones() {
        for (name, text) in crate::EXAMPLES {
            let model = crate::model::parse(text, "model.toml").unwrap();
            let listing = Listing::new(&model).unwrap();
            assert_eq!(listing.rates.results.len(), model.states.len());
            assert_eq!(listing.outputs.results.len(), model.outputs.len());
            let derivatives = listing.condition_derivatives.iter().map(|d| &d.routine);
            let all = [&listing.rates, &listing.jacobian.routine, &listing.outputs, &listing.conditions];
            for routine in all.into_iter().chain(derivatives).chain(&listing.resets) {
                for (index, assignment) in routine.assignments.iter().enumerate() {
                    assert_eq!(assignment.operands.len(), assignment.code.operands());
                    for operand in &assignment.operands {
                        assert!(
                            !matches!(operand, Value::Assignment(i) if *i >= index),
                            "{name}: {assignment:?}"
                        );
                    }
                }
            }
        }
    }
}
