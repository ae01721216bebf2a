//! Compiles the rates of an external function, with its arguments as the equations use them.

use super::lower::{Lowering, Smoothing};
use super::{Code, Derivatives, Graph, Id, Variable};
use crate::model::Target;
use crate::text::Symbol;

impl Lowering<'_> {
    /// Compiles the rate of a declared state by the model's external function.
    ///
    /// Inputs and parameters are passed with the effects on them, and forces are the sums of the effects on them.
    pub(super) fn external_rate(&mut self, state: usize, smoothing: Smoothing) -> Id {
        let model = self.model;
        let (inputs, forces) = model.external.as_ref().map_or((0, 0), |e| (e.inputs, e.forces.len()));
        let mut symbols = vec![Symbol::Time];
        symbols.extend((0..model.declared_states()).map(Symbol::State));
        symbols.extend((0..inputs).map(Symbol::Input));
        symbols.extend(model.external_parameters().map(Symbol::Parameter));
        let mut arguments: Vec<Id> =
            symbols.into_iter().map(|symbol| self.symbol(symbol, smoothing)).collect();
        for force in 0..forces {
            arguments.push(self.force(force, smoothing));
        }
        let list = self.graph.arguments(&arguments);
        self.graph.external(Code::External, list, state, 0)
    }

    /// Compiles the sum of the effects on a generalised force.
    fn force(&mut self, force: usize, smoothing: Smoothing) -> Id {
        let model = self.model;
        let mut total = self.graph.constant(0.0);
        let changes = model.additions.iter().flat_map(|a| &a.changes);
        for change in changes.filter(|c| c.target == Target::Force(force)) {
            let value = self.tree(&change.value.tree, smoothing);
            total = self.combine(total, change.how, value);
        }
        total
    }
}

impl Graph {
    /// Appends the list of the arguments of an external function.
    ///
    /// Each element refers to its value and to the element before it, so that the list is an operand like any other.
    fn arguments(&mut self, values: &[Id]) -> Id {
        let mut last = None;
        for (index, value) in values.iter().enumerate() {
            last = Some(self.external(Code::Argument, *value, last.unwrap_or(*value) as usize, index));
        }
        last.unwrap_or(0)
    }

    /// Values of the arguments in a list, in their order.
    pub(crate) fn values_of_arguments(&self, list: Id) -> Vec<Id> {
        let mut values = Vec::new();
        let mut element = self.get(list);
        loop {
            values.push(element.a);
            if element.c == 0 {
                values.reverse();
                return values;
            }
            element = self.get(element.b);
        }
    }
}

impl Derivatives {
    /// Differentiates the rate number `state` of an external function: the sum over its arguments of the partial
    /// derivative times the derivative of the argument.
    pub(super) fn differentiate_external(
        &self,
        graph: &mut Graph,
        (list, state): (Id, usize),
    ) -> Vec<(Variable, Id)> {
        let mut total: Vec<(Variable, Id)> = Vec::new();
        for (index, value) in graph.values_of_arguments(list).into_iter().enumerate() {
            let known = self.of(value).to_vec();
            if known.is_empty() {
                continue;
            }
            let partial = graph.external(Code::ExternalDerivative, list, state, index);
            for (variable, derivative) in known {
                let term = graph.multiply(partial, derivative);
                match total.iter_mut().find(|(other, _)| *other == variable) {
                    Some((_, sum)) => *sum = graph.add(*sum, term),
                    None => total.push((variable, term)),
                }
            }
        }
        total.sort_by_key(|(variable, _)| *variable);
        total
    }
}
