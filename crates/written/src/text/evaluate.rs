//! The value of a tree at one point, node by node: for guesses, messages and scales, where no speed is needed.

use super::{Kind, Symbol, Tree};

/// Values of everything that a tree may name.
pub(crate) trait Meaning {
    /// Value of a name.
    fn symbol(&self, symbol: Symbol) -> f64;
    /// Value of a table.
    fn table(&self, table: usize, at: f64) -> f64;
    /// Slope of an output at the first samples.
    fn slope(&self, output: usize) -> f64;
}

impl Tree {
    /// Value of every node, in order; jumps are sharp.
    pub(crate) fn values(&self, meaning: &dyn Meaning) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let at = |i: &usize| values[*i];
            let value = match &node.kind {
                Kind::Number(value) => *value,
                Kind::Symbol(symbol) => meaning.symbol(*symbol),
                Kind::Negate(a) => -at(a),
                Kind::Add(a, b) => at(a) + at(b),
                Kind::Subtract(a, b) => at(a) - at(b),
                Kind::Multiply(a, b) => at(a) * at(b),
                Kind::Divide(a, b) => at(a) / at(b),
                Kind::Power(a, b) => at(a).powf(at(b)),
                Kind::Call(function, arguments) => {
                    function.value(&arguments.iter().map(at).collect::<Vec<f64>>())
                }
                Kind::If { comparison, left, right, then, otherwise } => {
                    at(if comparison.is_true_of(at(left), at(right)) { then } else { otherwise })
                }
                Kind::Table { table, at: z } => meaning.table(*table, at(z)),
                Kind::Slope { output } => meaning.slope(*output),
            };
            values.push(value);
        }
        values
    }

    /// Value of the whole.
    pub(crate) fn value(&self, meaning: &dyn Meaning) -> f64 {
        self.values(meaning).last().copied().unwrap_or(0.0)
    }
}
