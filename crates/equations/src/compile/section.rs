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
    /// Calls of the external function, which instructions of the body run by their index.
    pub(crate) calls: Vec<ExternalCall>,
}

/// A call of the external function: registers of its arguments and of the results that are needed.
#[derive(Debug, Clone, Default)]
pub(crate) struct ExternalCall {
    /// Operation that ends the list of the arguments.
    list: Id,
    /// Registers of the arguments, in their order.
    pub(crate) arguments: Vec<u32>,
    /// Index of each rate that is needed, with the register of its value.
    pub(crate) rates: Vec<(usize, u32)>,
    /// Indices of the arguments with respect to which derivatives are needed.
    pub(crate) wanted: Vec<usize>,
    /// Index of the rate, index in `wanted`, and register of each derivative that is needed.
    pub(crate) derivatives: Vec<(usize, usize, u32)>,
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
                Code::Argument => continue,
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
        let section = |(results, needed): (&Vec<Id>, Vec<bool>)| {
            let mut section = Section {
                results: results.iter().map(|id| layout.register(*id)).collect(),
                ..Section::default()
            };
            for id in (0..operations.len()).filter(|id| needed[*id] && varies[*id]) {
                let (operation, register) = (&operations[id], layout.register(id as Id));
                match operation.code {
                    Code::Argument => {}
                    Code::External | Code::ExternalDerivative => {
                        layout.add_to_call(&mut section, graph, operation, register);
                    }
                    code if code.operands() > 0 => section.body.push(layout.instruction(operation, register)),
                    _ => {}
                }
            }
            section
        };
        let sections = wanted.iter().zip(needed).map(section).collect();
        (layout, parameter_section, sections)
    }

    /// Adds a result to the section's call of the external function with the same arguments.
    ///
    /// The first result of a call appends the instruction that runs it: all its arguments are computed before.
    fn add_to_call(&self, section: &mut Section, graph: &Graph, operation: &Operation, register: u32) {
        let (list, state) = (operation.a, operation.b as usize);
        let index = section.calls.iter().position(|call| call.list == list).unwrap_or_else(|| {
            let values = graph.values_of_arguments(list);
            let arguments = values.into_iter().map(|id| self.register(id)).collect();
            let table = section.calls.len() as u32;
            section.body.push(Instruction { code: Code::External, operands: [0; 3], table, to: register });
            section.calls.push(ExternalCall { list, arguments, ..ExternalCall::default() });
            section.calls.len() - 1
        });
        let call = &mut section.calls[index];
        if operation.code == Code::External {
            return call.rates.push((state, register));
        }
        let argument = operation.c as usize;
        let wanted = call.wanted.iter().position(|k| *k == argument).unwrap_or_else(|| {
            call.wanted.push(argument);
            call.wanted.len() - 1
        });
        call.derivatives.push((state, wanted, register));
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
