//! Operations in static single assignment: each is made once, constants are folded, products join the sums behind them.

use super::{Code, Operation};
use crate::limits::OPERATIONS;
use crate::machine;
use std::collections::BTreeMap;

/// Index of an operation; those that it uses have smaller ones.
pub(crate) type Id = u32;

/// Operations, each different from all others.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    operations: Vec<Operation>,
    known: BTreeMap<Operation, Id>,
}

impl Graph {
    pub(crate) fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// Whether more was asked for than is allowed; its results are then meaningless.
    pub(crate) fn is_too_large(&self) -> bool {
        self.operations.len() >= OPERATIONS
    }

    pub(crate) fn get(&self, id: Id) -> Operation {
        self.operations[id as usize]
    }

    pub(crate) fn value_of(&self, id: Id) -> Option<f64> {
        self.get(id).as_constant()
    }

    pub(crate) fn constant(&mut self, value: f64) -> Id {
        // One zero: -0.0 differs from 0.0 in its bits alone and would defeat sharing.
        self.intern(Operation::constant(if value == 0.0 { 0.0 } else { value }))
    }

    pub(crate) fn leaf(&mut self, code: Code, index: usize) -> Id {
        self.intern(Operation::new(code, index as u32, 0, 0))
    }

    fn intern(&mut self, operation: Operation) -> Id {
        if let Some(id) = self.known.get(&operation) {
            return *id;
        }
        if self.is_too_large() {
            return 0;
        }
        let id = self.operations.len() as Id;
        self.operations.push(operation);
        self.known.insert(operation, id);
        id
    }

    fn is(&self, id: Id, value: f64) -> bool {
        self.value_of(id) == Some(value)
    }

    /// An operation on results; folded where all of them are numbers.
    fn make(&mut self, code: Code, mut a: Id, mut b: Id, c: Id) -> Id {
        if code.commutes() && b < a {
            (a, b) = (b, a);
        }
        let operation = Operation::new(code, a, b, c);
        let numbers: Option<Vec<f64>> = operation.used().map(|id| self.value_of(id)).collect();
        match numbers {
            Some(numbers) if code != Code::Table && code != Code::TableSlope => {
                let at = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
                let value = machine::evaluate(code, at(0), at(1), at(2));
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

    /// Table number `table` (or its slope) at `a`.
    pub(crate) fn table(&mut self, code: Code, a: Id, table: u32) -> Id {
        self.intern(Operation::new(code, a, table, 0))
    }

    pub(crate) fn negate(&mut self, a: Id) -> Id {
        let operation = self.get(a);
        match operation.code {
            Code::Negate => operation.a,
            Code::Subtract => self.subtract(operation.b, operation.a),
            _ => self.unary(Code::Negate, a),
        }
    }

    /// `a + b`. A product among them is joined whether or not it is used elsewhere: the sum costs the same, and the
    /// value does not depend on what else is computed.
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
            // The reciprocal of a power of two is exact.
            let reciprocal = self.constant(1.0 / value);
            return self.multiply(a, reciprocal);
        }
        let left = self.get(a);
        if left.code == Code::Negate {
            let quotient = self.divide(left.a, b);
            return self.negate(quotient);
        }
        self.binary(Code::Divide, a, b)
    }

    /// `a` to a whole power by repeated squaring.
    pub(crate) fn whole_power(&mut self, a: Id, exponent: u32) -> Id {
        let mut result = self.constant(1.0);
        let (mut square, mut left) = (a, exponent);
        while left > 0 {
            if left & 1 == 1 {
                result = self.multiply(result, square);
            }
            left >>= 1;
            if left > 0 {
                square = self.multiply(square, square);
            }
        }
        result
    }

    /// `b` where `a > 0`, else `c`.
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
