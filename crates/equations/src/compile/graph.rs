//! Expression graph in static single assignment form.
//!
//! Equal operations are stored once, constants are folded, and a product is fused with a sum that uses it.

use super::{Code, Operation};
use crate::limits::MAX_OPERATIONS;
use crate::machine;
use std::collections::BTreeMap;

/// Index of an operation in a graph; its operands have smaller indices.
pub(crate) type Id = u32;

/// Graph of the operations of a system; no operation is stored twice.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    operations: Vec<Operation>,
    /// For each operation, whether its result depends on a state, an input or time.
    varies: Vec<bool>,
    ids: BTreeMap<Operation, Id>,
}

impl Graph {
    /// All operations of the graph, operands before the operations that use them.
    pub(crate) fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// Whether the graph has reached the maximum number of operations; results beyond it are meaningless.
    pub(crate) fn is_too_large(&self) -> bool {
        self.operations.len() >= MAX_OPERATIONS
    }

    pub(crate) fn get(&self, id: Id) -> Operation {
        self.operations[id as usize]
    }

    /// For each operation up to the last of `ids`, whether it is needed to compute `ids`.
    pub(crate) fn needed_by(&self, ids: &[Id]) -> Vec<bool> {
        let last = ids.iter().max().map_or(0, |id| *id as usize);
        let mut needed = vec![false; last + 1];
        ids.iter().for_each(|id| needed[*id as usize] = true);
        for id in (0..=last).rev() {
            if needed[id] {
                self.get(id as Id).inputs().for_each(|input| needed[input as usize] = true);
            }
        }
        needed
    }

    /// Whether the result of an operation depends on a state, an input or time, not on parameters alone.
    pub(crate) fn varies(&self, id: Id) -> bool {
        self.varies[id as usize]
    }

    /// Value of an operation if it is a constant; `None` otherwise.
    pub(crate) fn value_of(&self, id: Id) -> Option<f64> {
        self.get(id).as_constant()
    }

    pub(crate) fn constant(&mut self, value: f64) -> Id {
        // -0.0 differs from 0.0 only in its bits and would defeat sharing, so only 0.0 is stored.
        self.intern(Operation::constant(if value == 0.0 { 0.0 } else { value }))
    }

    /// Appends, or finds, the operation that reads a state, input, parameter, width or the time.
    pub(crate) fn leaf(&mut self, code: Code, index: usize) -> Id {
        self.intern(Operation::new(code, index as u32, 0, 0))
    }

    /// Returns the index of an operation; appends the operation if the graph does not have it.
    fn intern(&mut self, operation: Operation) -> Id {
        if let Some(id) = self.ids.get(&operation) {
            return *id;
        }
        if self.is_too_large() {
            return 0;
        }
        let id = self.operations.len() as Id;
        let is_variable = matches!(operation.code, Code::State | Code::Input | Code::InputSlope | Code::Time);
        self.varies.push(is_variable || operation.inputs().any(|input| self.varies[input as usize]));
        self.operations.push(operation);
        self.ids.insert(operation, id);
        id
    }

    /// Whether an operation is the constant `value`.
    fn is(&self, id: Id, value: f64) -> bool {
        self.value_of(id) == Some(value)
    }

    /// Appends an operation on earlier results; computes it at once if all of them are constants.
    fn make(&mut self, code: Code, mut a: Id, mut b: Id, c: Id) -> Id {
        if code.commutes() && b < a {
            (a, b) = (b, a);
        }
        let operation = Operation::new(code, a, b, c);
        let constants: Option<Vec<f64>> = operation.inputs().map(|id| self.value_of(id)).collect();
        match constants {
            Some(constants) if code != Code::Table && code != Code::TableSlope => {
                let operand = |i: usize| constants.get(i).copied().unwrap_or(0.0);
                let value = machine::evaluate(code, operand(0), operand(1), operand(2));
                self.constant(value)
            }
            _ => self.intern(operation),
        }
    }

    pub(crate) fn unary(&mut self, code: Code, a: Id) -> Id {
        self.make(code, a, 0, 0)
    }

    pub(crate) fn binary(&mut self, code: Code, a: Id, b: Id) -> Id {
        self.make(code, a, b, 0)
    }

    /// Appends the value, or the slope, of table number `table` at the argument `a`.
    pub(crate) fn table(&mut self, code: Code, a: Id, table: u32) -> Id {
        self.intern(Operation::new(code, a, table, 0))
    }

    /// Appends an operation of an external function: its code, its operand and two numbers.
    pub(super) fn external(&mut self, code: Code, a: Id, b: usize, c: usize) -> Id {
        self.intern(Operation::new(code, a, b as u32, c as u32))
    }

    pub(crate) fn negate(&mut self, a: Id) -> Id {
        let operation = self.get(a);
        match operation.code {
            Code::Negate => operation.a,
            Code::Subtract => self.subtract(operation.b, operation.a),
            _ => self.unary(Code::Negate, a),
        }
    }

    /// Appends `a + b`, fused with a product if `a` or `b` is one.
    ///
    /// The product is fused even if it is used elsewhere: the fused sum costs the same, and its value must
    /// not depend on what else is computed.
    pub(crate) fn add(&mut self, a: Id, b: Id) -> Id {
        let (a, b) = if b < a { (b, a) } else { (a, b) };
        if self.is(a, 0.0) {
            return b;
        }
        if self.is(b, 0.0) {
            return a;
        }
        if self.value_of(a).is_some() && self.value_of(b).is_some() {
            return self.binary(Code::Add, a, b);
        }
        let (left, right) = (self.get(a), self.get(b));
        match (left.code, right.code) {
            (_, Code::Negate) => self.subtract(a, right.a),
            (Code::Negate, _) => self.subtract(b, left.a),
            (Code::Multiply, _) => self.make(Code::MultiplyAdd, left.a, left.b, b),
            (_, Code::Multiply) => self.make(Code::MultiplyAdd, right.a, right.b, a),
            _ => self.binary(Code::Add, a, b),
        }
    }

    pub(crate) fn subtract(&mut self, a: Id, b: Id) -> Id {
        if self.is(b, 0.0) {
            return a;
        }
        if self.is(a, 0.0) {
            return self.negate(b);
        }
        if a == b {
            return self.constant(0.0);
        }
        if self.value_of(a).is_some() && self.value_of(b).is_some() {
            return self.binary(Code::Subtract, a, b);
        }
        let (left, right) = (self.get(a), self.get(b));
        match (left.code, right.code) {
            (_, Code::Negate) => self.add(a, right.a),
            (Code::Multiply, _) => self.make(Code::MultiplySubtract, left.a, left.b, b),
            (_, Code::Multiply) => self.make(Code::SubtractProduct, right.a, right.b, a),
            _ => self.binary(Code::Subtract, a, b),
        }
    }

    pub(crate) fn multiply(&mut self, a: Id, b: Id) -> Id {
        for (one, other) in [(a, b), (b, a)] {
            if self.is(one, 0.0) {
                return one;
            }
            if self.is(one, 1.0) {
                return other;
            }
            if self.is(one, -1.0) {
                return self.negate(other);
            }
        }
        let (left, right) = (self.get(a), self.get(b));
        match (left.code, right.code) {
            (Code::Negate, Code::Negate) => self.multiply(left.a, right.a),
            (Code::Negate, _) => {
                let product = self.multiply(left.a, b);
                self.negate(product)
            }
            (_, Code::Negate) => {
                let product = self.multiply(a, right.a);
                self.negate(product)
            }
            _ => self.binary(Code::Multiply, a, b),
        }
    }

    pub(crate) fn divide(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0.0) || self.is(b, 1.0) {
            return a;
        }
        if let Some(value) = self.value_of(b)
            && value != 0.0
            && value.abs().log2().fract() == 0.0
        {
            // The reciprocal of a power of two is exact, so that this is still the same value.
            let reciprocal = self.constant(1.0 / value);
            return self.multiply(a, reciprocal);
        }
        let left = self.get(a);
        if left.code == Code::Negate {
            let quotient = self.divide(left.a, b);
            return self.negate(quotient);
        }
        if self.varies(a) && !self.varies(b) {
            // A divisor of parameters alone is inverted once per simulation, because a division costs as much
            // as eight products.
            let one = self.constant(1.0);
            let reciprocal = self.binary(Code::Divide, one, b);
            return self.multiply(a, reciprocal);
        }
        self.binary(Code::Divide, a, b)
    }

    /// Appends `a` to the power of a whole number, by repeated squaring.
    pub(crate) fn whole_power(&mut self, a: Id, exponent: u32) -> Id {
        let mut result = self.constant(1.0);
        let (mut square, mut remaining) = (a, exponent);
        while remaining > 0 {
            if remaining & 1 == 1 {
                result = self.multiply(result, square);
            }
            remaining >>= 1;
            if remaining > 0 {
                square = self.multiply(square, square);
            }
        }
        result
    }

    /// Appends the selection of `b` if `a > 0`, else `c`.
    pub(crate) fn select(&mut self, a: Id, b: Id, c: Id) -> Id {
        match self.value_of(a) {
            _ if b == c => b,
            Some(value) => {
                if value > 0.0 {
                    b
                } else {
                    c
                }
            }
            None => self.intern(Operation::new(Code::Select, a, b, c)),
        }
    }
}
