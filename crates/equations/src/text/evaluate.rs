//! Evaluates an expression at one point, for start values, messages and scales.
//!
//! This is slower than the compiled form of the expressions, which simulations use.

use super::{Kind, Symbol, Tree};

/// Provides the values of all quantities that an expression may refer to.
pub(crate) trait Bindings {
    /// Returns the value of a state, input, parameter, `[let]` value, output or the time.
    fn symbol(&self, symbol: Symbol) -> f64;
    /// Returns the value of table number `table` at the argument `at`.
    fn table(&self, table: usize, at: f64) -> f64;
    /// Returns the change per second of output number `output`.
    fn slope(&self, output: usize) -> f64;
}

/// Bindings of an expression without tables and slopes to the values that a function returns.
struct Values<'f>(&'f dyn Fn(Symbol) -> f64);

impl Bindings for Values<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        (self.0)(symbol)
    }

    fn table(&self, _table: usize, _at: f64) -> f64 {
        f64::NAN
    }

    fn slope(&self, _output: usize) -> f64 {
        f64::NAN
    }
}

impl Tree {
    /// Computes the value of every node of the tree from the values of its names, in the order of the nodes.
    ///
    /// NaN for tables and slopes. `sign` and `step` are not smoothed.
    pub fn node_values(&self, value_of: &dyn Fn(Symbol) -> f64) -> Vec<f64> {
        self.values(&Values(value_of))
    }

    /// Computes the value of the whole expression from the values of its names, as [`Tree::node_values`].
    pub(crate) fn value_of(&self, value_of: &dyn Fn(Symbol) -> f64) -> f64 {
        self.value(&Values(value_of))
    }

    /// Computes the value of every node of the tree, in the order of the nodes; `sign` and `step` are not smoothed.
    pub(crate) fn values(&self, bindings: &dyn Bindings) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let value_of = |i: &usize| values[*i];
            let value = match &node.kind {
                Kind::Number(value) => *value,
                Kind::Symbol(symbol) => bindings.symbol(*symbol),
                Kind::Negate(a) => -value_of(a),
                Kind::Add(a, b) => value_of(a) + value_of(b),
                Kind::Subtract(a, b) => value_of(a) - value_of(b),
                Kind::Multiply(a, b) => value_of(a) * value_of(b),
                Kind::Divide(a, b) => value_of(a) / value_of(b),
                Kind::Power(a, b) => value_of(a).powf(value_of(b)),
                Kind::Call(function, arguments) => {
                    function.value(&arguments.iter().map(value_of).collect::<Vec<f64>>())
                }
                Kind::If { comparison, left, right, then, otherwise } => {
                    value_of(if comparison.holds_for(value_of(left), value_of(right)) {
                        then
                    } else {
                        otherwise
                    })
                }
                Kind::Table { table, at: z } => bindings.table(*table, value_of(z)),
                Kind::Slope { output } => bindings.slope(*output),
            };
            values.push(value);
        }
        values
    }

    /// Computes the value of the whole expression.
    pub(crate) fn value(&self, bindings: &dyn Bindings) -> f64 {
        self.values(bindings).last().copied().unwrap_or(0.0)
    }
}
