//! Assigns registers to all results, and lists the instructions to run for each purpose.

use super::{Code, Graph, Id, Operation};

/// Assignment of a compiled system's values to registers.
///
/// The first registers hold states, inputs, the time derivatives of inputs, time, parameters and widths.
#[derive(Debug, Clone, Default)]
pub(crate) struct Layout {
    pub(crate) states: usize,
    pub(crate) inputs: usize,
    pub(crate) parameters: usize,
    /// Register of each operation of the graph; `None` if no section needs the operation.
    register_of: Vec<Option<u32>>,
    /// Register and value of each constant.
    pub(crate) constants: Vec<(u32, f64)>,
    pub(crate) registers: usize,
    /// Whether a derivative of the system uses the time derivative of an input.
    pub(crate) needs_input_slopes: bool,
}

/// Instructions that compute one group of values, such as the rates, and the registers of the results.
#[derive(Debug, Clone, Default)]
pub(crate) struct Section {
    /// Instructions to run each time that states, inputs or time have changed.
    pub(crate) body: Vec<Instruction>,
    /// Registers of the computed values.
    pub(crate) results: Vec<u32>,
}

/// An operation on registers; its result is stored in a later register than its operands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instruction {
    pub(crate) code: Code,
    /// Registers of the operands; 0 for an operand that the operation does not have.
    pub(crate) operands: [u32; 3],
    /// Index of the table that the operation reads; meaningless if it reads none.
    pub(crate) table: u32,
    pub(crate) to: u32,
}

impl Layout {
    pub(crate) fn state(&self, index: usize) -> usize {
        index
    }

    pub(crate) fn input(&self, index: usize) -> usize {
        self.states + index
    }

    pub(crate) fn input_slope(&self, index: usize) -> usize {
        self.states + self.inputs + index
    }

    pub(crate) fn time(&self) -> usize {
        self.states + 2 * self.inputs
    }

    pub(crate) fn parameter(&self, index: usize) -> usize {
        self.time() + 1 + index
    }

    pub(crate) fn width(&self, index: usize) -> usize {
        self.time() + 1 + self.parameters + index
    }

    /// Assigns registers to all operations that the results in `wanted` need.
    ///
    /// Returns the layout, the section of values that depend on parameters alone and run once per simulation,
    /// and one section per entry of `wanted`.
    pub(crate) fn assign(
        (states, inputs, parameters, widths): (usize, usize, usize, usize),
        graph: &Graph,
        wanted: &[Vec<Id>],
    ) -> (Layout, Section, Vec<Section>) {
        let operations = graph.operations();
        let mut layout = Layout { states, inputs, parameters, ..Layout::default() };
        layout.registers = layout.width(widths);
        let needed: Vec<Vec<bool>> = wanted.iter().map(|results| needed_in(graph, results)).collect();
        let varies: Vec<bool> = (0..operations.len()).map(|id| graph.varies(id as Id)).collect();
        layout.register_of = vec![None; operations.len()];
        let mut parameter_section = Section::default();
        for (id, operation) in operations.iter().enumerate() {
            if !needed.iter().any(|needed| needed[id]) {
                continue;
            }
            let index = operation.a as usize;
            let register = match operation.code {
                Code::State => layout.state(index),
                Code::Input => layout.input(index),
                Code::InputSlope => layout.input_slope(index),
                Code::Time => layout.time(),
                Code::Parameter => layout.parameter(index),
                Code::Width => layout.width(index),
                _ => {
                    layout.registers += 1;
                    layout.registers - 1
                }
            } as u32;
            layout.register_of[id] = Some(register);
            layout.needs_input_slopes |= operation.code == Code::InputSlope;
            if let Some(value) = operation.as_constant() {
                layout.constants.push((register, value));
            } else if operation.code.operands() > 0 && !varies[id] {
                parameter_section.body.push(layout.instruction(operation, register));
            }
        }
        let section = |(results, needed): (&Vec<Id>, Vec<bool>)| Section {
            results: results.iter().map(|id| layout.register(*id)).collect(),
            body: (0..operations.len())
                .filter(|id| needed[*id] && varies[*id] && operations[*id].code.operands() > 0)
                .map(|id| layout.instruction(&operations[id], layout.register(id as Id)))
                .collect(),
        };
        let sections = wanted.iter().zip(needed).map(section).collect();
        (layout, parameter_section, sections)
    }

    /// Register of an operation, which some section must need.
    pub(crate) fn register(&self, id: Id) -> u32 {
        self.assigned_register(id).unwrap_or(0)
    }

    /// Register of an operation; `None` if no section needs it.
    pub(crate) fn assigned_register(&self, id: Id) -> Option<u32> {
        self.register_of.get(id as usize).copied().flatten()
    }

    fn instruction(&self, operation: &Operation, to: u32) -> Instruction {
        let mut operands = [0; 3];
        operands.iter_mut().zip(operation.inputs()).for_each(|(to, used)| *to = self.register(used));
        let is_table = matches!(operation.code, Code::Table | Code::TableSlope);
        let table = if is_table { operation.b } else { 0 };
        Instruction { code: operation.code, operands, table, to }
    }
}

/// For each operation of the graph, whether it is needed to compute `results`.
fn needed_in(graph: &Graph, results: &[Id]) -> Vec<bool> {
    let mut needed = graph.needed_by(results);
    needed.resize(graph.operations().len(), false);
    needed
}
