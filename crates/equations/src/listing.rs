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

/// A value that an assignment reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A number.
    Constant(f64),
    /// A state, by index.
    State(usize),
    /// An input, by index.
    Input(usize),
    /// The time derivative of an input, by index.
    InputSlope(usize),
    /// Time, s.
    Time,
    /// A parameter, by index.
    Parameter(usize),
    /// The width of a smoothed discontinuity, by index.
    Width(usize),
    /// The result of an assignment of the same routine, by index.
    Assignment(usize),
}

/// The result of an operation on earlier values.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// The operation; never one that reads a quantity.
    pub code: Code,
    /// Its operands, as many as the operation has.
    pub operands: Vec<Value>,
    /// Index of its table, if it reads one.
    pub table: usize,
    /// Index of the `[let]` value that it computes, if it is one.
    pub let_value: Option<usize>,
}

/// Assignments for one purpose, and the values that they lead to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Routine {
    /// Assignments in an order in which they can be evaluated.
    pub assignments: Vec<Assignment>,
    /// Results of the routine.
    pub results: Vec<Value>,
}

/// The variable of a derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// A state, by index.
    State(usize),
    /// Time.
    Time,
}

/// Derivatives that are not always 0: rows and variables in the order of the results of the routine.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Derivatives {
    /// The routine that computes the derivatives.
    pub routine: Routine,
    /// Index of the differentiated value, and the variable, of each result.
    pub entries: Vec<(usize, Variable)>,
}

/// A smoothed discontinuity.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothedDiscontinuity {
    /// Text of its argument in the model.
    pub argument: String,
    /// Width in the unit of the argument: as declared, or the default before one is chosen from a simulation.
    pub width: f64,
    /// Whether the model file declares the width.
    pub is_declared: bool,
}

/// All equations of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Listing {
    /// Rates of the states.
    pub rates: Routine,
    /// Derivatives of the rates with respect to the states.
    pub jacobian: Derivatives,
    /// Outputs.
    pub outputs: Routine,
    /// Condition of each event, then the conditions that end rests, which are positive where they hold.
    pub conditions: Routine,
    /// Derivatives of the condition of each event with respect to states and time.
    pub condition_derivatives: Vec<Derivatives>,
    /// All states after each event.
    pub resets: Vec<Routine>,
    /// Index in `conditions` of the condition that ends the rest of each event.
    pub rest_ends: Vec<Option<usize>>,
    /// Arguments of the smoothed discontinuities.
    pub discontinuity_arguments: Routine,
    /// The smoothed discontinuities.
    pub discontinuities: Vec<SmoothedDiscontinuity>,
}

impl Listing {
    /// Compiles a model and lists its equations.
    ///
    /// # Errors
    /// Those of [`System::compile`].
    pub fn new(model: &Model) -> Result<Listing, ModelError> {
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

/// Reads sections of a compiled system.
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

    /// Derivatives: the results of a gradient after its values.
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
        };
        let entries = known.iter().map(|(_, row, variable)| (*row, *variable)).collect();
        Derivatives { routine: self.routine(&section), entries }
    }

    /// The assignments that the results of a section need.
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

    /// The value in a register.
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
