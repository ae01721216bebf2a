//! The checked tree of an expression.
//!
//! Nodes are in one list with children before parents, so that every pass is a loop and no expression can
//! exhaust the stack.

use super::Function;
use std::ops::Range;

/// The quantity of the model that a name in an expression refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    /// A state, by its index.
    State(usize),
    /// An input, by its index.
    Input(usize),
    /// A parameter, by its index.
    Parameter(usize),
    /// A `[let]` value, by its index.
    Let(usize),
    /// An output, by its index; allowed in `start` and in effects on that output.
    Output(usize),
    /// The time in seconds since the trajectory began.
    Time,
    /// The torque of a joint of the robot by its inverse dynamics, N m (or force, N), by the joint's index.
    JointTorque(usize),
    /// The acceleration of a joint of the robot by its forward dynamics, rad/s2 (or m/s2), by the joint's index.
    JointAcceleration(usize),
    /// The rate of a state by the external function of the model, per second, by the index of the state.
    ExternalRate(usize),
}

/// Comparison operator of a condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is the comparison of its name")]
pub enum Comparison {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

impl Comparison {
    /// Whether the comparison holds for two numbers.
    pub(crate) fn holds_for(self, left: f64, right: f64) -> bool {
        match self {
            Comparison::Less => left < right,
            Comparison::LessOrEqual => left <= right,
            Comparison::Greater => left > right,
            Comparison::GreaterOrEqual => left >= right,
        }
    }
}

/// What a node of an expression is: a number, a name or an operation.
///
/// Children are indices into [`Tree::nodes`], smaller than that of their parent.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "each is the operation of its name on the nodes it lists")]
pub enum Kind {
    Number(f64),
    Symbol(Symbol),
    Negate(usize),
    Add(usize, usize),
    Subtract(usize, usize),
    Multiply(usize, usize),
    Divide(usize, usize),
    Power(usize, usize),
    Call(Function, Vec<usize>),
    If { comparison: Comparison, left: usize, right: usize, then: usize, otherwise: usize },
    Table { table: usize, at: usize },
    Slope { output: usize },
}

/// A node of an expression, with the bytes of the text it was parsed from.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeNode {
    /// Kind of the node: a number, a name or an operation.
    pub kind: Kind,
    /// Range of bytes of the node in the expression's text.
    pub span: Range<usize>,
}

/// An expression whose names are resolved and whose functions have the right number of arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Text that the tree was parsed from.
    pub text: String,
    /// Nodes of the tree, children before parents; the last is the whole expression.
    pub nodes: Vec<TreeNode>,
}

impl Tree {
    /// Creates a tree of a single number.
    pub fn number(value: f64) -> Tree {
        Tree { text: format!("{value}"), nodes: vec![TreeNode { kind: Kind::Number(value), span: 0..0 }] }
    }

    /// Index of the root node, which is the whole expression.
    pub fn root(&self) -> usize {
        self.nodes.len().saturating_sub(1)
    }

    /// Text of the node number `node`, as written in the expression.
    pub fn text_of(&self, node: usize) -> &str {
        self.nodes.get(node).and_then(|n| self.text.get(n.span.clone())).unwrap_or("")
    }

    /// Every quantity that the expression uses, repeated as often as it is used.
    pub fn symbols(&self) -> impl Iterator<Item = Symbol> + '_ {
        self.nodes.iter().filter_map(|n| match n.kind {
            Kind::Symbol(symbol) => Some(symbol),
            Kind::Slope { output } => Some(Symbol::Output(output)),
            _ => None,
        })
    }
}
