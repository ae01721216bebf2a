//! Compiles expression trees to the operations of a graph.

use super::joint_quantity::JointQuantity;
use super::probe::Probe;
use super::{Code, Derivatives, Graph, Id, Variable};
use crate::model::{How, Model, Numerics, Target};
use crate::text::{Comparison, Function, Kind, Symbol, Tree};
use std::collections::BTreeMap;

/// Whether discontinuities such as `sign` are smoothed when an expression is compiled.
///
/// An integrator would step across a discontinuity in a rate; in an output or a reset it does no harm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Smoothing {
    /// Discontinuities are smoothed: `sign(z)` becomes `tanh(z / width)`.
    Smooth,
    /// Discontinuities are kept: `sign(z)` is -1, 0 or 1.
    Sharp,
}

/// A discontinuity that is smoothed over a width.
#[derive(Debug, Clone)]
pub(crate) struct Width {
    /// The operation that computes the argument, at whose zero the value is discontinuous.
    pub(crate) argument: Id,
    /// Text of the argument in the model file.
    pub(crate) text: String,
    /// Smoothing width that the file declares, in the unit of the argument; `None` if it declares none.
    pub(crate) declared: Option<f64>,
}

/// Compiles a model to a graph of operations.
#[derive(Debug)]
pub(crate) struct Lowering<'m> {
    pub(crate) graph: Graph,
    pub(crate) widths: Vec<Width>,
    pub(super) model: &'m Model,
    lets: BTreeMap<(usize, Smoothing), Id>,
    /// Operation and index of every compiled `[let]` value; exported programs name these values.
    pub(crate) let_ids: Vec<(Id, usize)>,
    /// Inputs and parameters that effects have changed, with the operations of their changed values.
    changed: BTreeMap<Target, Id>,
    /// Rates of states of effects on an input, by state; they use the input as it was before the effect.
    rates_before_input_effects: BTreeMap<usize, Id>,
    /// Index of the output to which effects are being applied, and its value so far; `None` while there is none.
    output: Option<(usize, Id)>,
    /// Rates of all states; empty until they are compiled.
    rates: Vec<Id>,
    /// Torques or accelerations of the joints of the model's robot, as far as they are compiled.
    pub(super) joint_values: BTreeMap<(JointQuantity, Smoothing), Vec<Id>>,
    /// Whether the expression of an effect on a joint is being compiled.
    pub(super) in_joint_effect: bool,
    probe: Probe,
}

impl<'m> Lowering<'m> {
    /// Starts to compile a model: creates a graph and applies the effects on inputs and parameters.
    pub(crate) fn new(model: &'m Model) -> Self {
        let mut lowering = Self {
            graph: Graph::default(),
            widths: Vec::new(),
            model,
            lets: BTreeMap::new(),
            let_ids: Vec::new(),
            changed: BTreeMap::new(),
            rates_before_input_effects: BTreeMap::new(),
            output: None,
            rates: Vec::new(),
            joint_values: BTreeMap::new(),
            in_joint_effect: false,
            probe: Probe::new(model),
        };
        lowering.apply_input_and_parameter_effects();
        lowering
    }

    /// Applies the effects on inputs, then those on parameters, so that all equations use them.
    fn apply_input_and_parameter_effects(&mut self) {
        let model = self.model;
        for addition in &model.additions {
            if addition.changes.iter().any(|c| matches!(c.target, Target::Input(_))) {
                for state in addition.states.clone() {
                    let rate = self.tree(&model.states[state].rate.tree, Smoothing::Smooth);
                    self.rates_before_input_effects.insert(state, rate);
                }
            }
            for change in addition.changes.iter().filter(|c| matches!(c.target, Target::Input(_))) {
                let before = match (self.changed.get(&change.target), change.target) {
                    (Some(id), _) => *id,
                    (None, Target::Input(i)) => self.graph.leaf(Code::Input, i),
                    _ => continue,
                };
                let value = self.tree(&change.value.tree, Smoothing::Smooth);
                let after = self.combine(before, change.how, value);
                self.changed.insert(change.target, after);
                // The [let] values compiled so far use the input without this change.
                self.lets.clear();
                self.joint_values.clear();
            }
        }
        let changes = model.additions.iter().flat_map(|a| &a.changes);
        for change in changes.filter(|c| matches!(c.target, Target::Parameter(_))) {
            let before = match (self.changed.get(&change.target), change.target) {
                (Some(id), _) => *id,
                (None, Target::Parameter(p)) => self.graph.leaf(Code::Parameter, p),
                _ => continue,
            };
            let value = self.tree(&change.value.tree, Smoothing::Smooth);
            let after = self.combine(before, change.how, value);
            self.changed.insert(change.target, after);
            self.lets.clear();
            self.joint_values.clear();
        }
    }

    /// Adds `value` to the target's value `before` the change, multiplies by it, or replaces `before` by it.
    pub(super) fn combine(&mut self, before: Id, how: How, value: Id) -> Id {
        match how {
            How::Add => self.graph.add(before, value),
            How::Factor => self.graph.multiply(before, value),
            How::Replace => value,
        }
    }

    /// Compiles the rates of all states, with the effects on these rates.
    pub(crate) fn rates(&mut self) -> Vec<Id> {
        let model = self.model;
        let mut rates = Vec::with_capacity(model.states.len());
        for (index, state) in model.states.iter().enumerate() {
            let before_effects = self.rates_before_input_effects.get(&index).copied();
            let mut rate = before_effects.unwrap_or_else(|| self.tree(&state.rate.tree, Smoothing::Smooth));
            let changes = model.additions.iter().flat_map(|a| &a.changes);
            for change in changes.filter(|c| c.target == Target::Rate(index)) {
                let value = self.tree(&change.value.tree, Smoothing::Smooth);
                rate = self.combine(rate, change.how, value);
            }
            rates.push(rate);
        }
        self.rates.clone_from(&rates);
        rates
    }

    /// Compiles the outputs, with the effects on these outputs; the rates must be compiled first.
    pub(crate) fn outputs(&mut self) -> Vec<Id> {
        let model = self.model;
        let mut outputs = Vec::with_capacity(model.outputs.len());
        for (index, output) in model.outputs.iter().enumerate() {
            let mut value = self.tree(&output.value.tree, Smoothing::Sharp);
            let changes = model.additions.iter().flat_map(|a| &a.changes);
            for change in changes.filter(|c| c.target == Target::Output(index)) {
                self.output = Some((index, value));
                let change_value = self.tree(&change.value.tree, Smoothing::Sharp);
                value = self.combine(value, change.how, change_value);
            }
            self.output = None;
            outputs.push(value);
        }
        outputs
    }

    /// Value of an output as an effect uses it: with the effects applied so far, or as declared.
    fn output_for_effects(&mut self, index: usize, smoothing: Smoothing) -> Id {
        match self.output {
            Some((current, id)) if current == index => id,
            _ => {
                let model = self.model;
                match model.outputs.get(index) {
                    Some(output) => self.tree(&output.value.tree, smoothing),
                    None => self.graph.constant(0.0),
                }
            }
        }
    }

    /// Compiles the change per second of an output: its gradient times the rates.
    fn speed_of_output(&mut self, index: usize, smoothing: Smoothing) -> Id {
        let value = self.output_for_effects(index, smoothing);
        let mut speed = self.graph.constant(0.0);
        let gradient = Derivatives::new(&[], Vec::new()).all_derivatives(&mut self.graph, value);
        for (variable, slope) in gradient {
            let term = match variable {
                Variable::State(state) => match self.rates.get(state) {
                    Some(rate) => self.graph.multiply(slope, *rate),
                    None => continue,
                },
                Variable::Time => slope,
                Variable::Parameter(_) => continue,
            };
            speed = self.graph.add(speed, term);
        }
        speed
    }

    /// Compiles an expression tree to operations.
    pub(crate) fn tree(&mut self, tree: &Tree, smoothing: Smoothing) -> Id {
        let mut ids: Vec<Id> = Vec::with_capacity(tree.nodes.len());
        for node in &tree.nodes {
            let id = match &node.kind {
                Kind::Number(value) => self.graph.constant(*value),
                Kind::Symbol(symbol) => self.symbol(*symbol, smoothing),
                Kind::Negate(a) => self.graph.negate(ids[*a]),
                Kind::Add(a, b) => self.graph.add(ids[*a], ids[*b]),
                Kind::Subtract(a, b) => self.graph.subtract(ids[*a], ids[*b]),
                Kind::Multiply(a, b) => self.graph.multiply(ids[*a], ids[*b]),
                Kind::Divide(a, b) => self.graph.divide(ids[*a], ids[*b]),
                Kind::Power(a, b) => self.power(ids[*a], ids[*b]),
                Kind::Call(function, arguments) => {
                    let values: Vec<Id> = arguments.iter().map(|a| ids[*a]).collect();
                    let text = arguments.first().map_or("", |a| tree.text_of(*a));
                    self.call(*function, &values, text, smoothing)
                }
                Kind::If { comparison, left, right, then, otherwise } => {
                    let sides = (ids[*left], ids[*right]);
                    self.choose(
                        *comparison,
                        sides,
                        (ids[*then], ids[*otherwise]),
                        tree.text_of(*left),
                        smoothing,
                    )
                }
                Kind::Table { table, at } => self.graph.table(Code::Table, ids[*at], *table as u32),
                // Reached only in an effect on an output: elsewhere the reader allows `slope` only in
                // `start`, which is not compiled.
                Kind::Slope { output } => self.speed_of_output(*output, smoothing),
            };
            ids.push(id);
        }
        ids.last().copied().unwrap_or_else(|| self.graph.constant(0.0))
    }

    /// Compiles a condition, such as `a < b`, to a value that is positive where the condition holds.
    ///
    /// `a < b` and `a <= b` give the same value: they differ only at its zero, and an event fires on a
    /// passage through it.
    pub(crate) fn condition(&mut self, tree: &Tree) -> Id {
        let parts = match tree.nodes.last().map(|node| &node.kind) {
            Some(Kind::If { comparison, left, right, .. }) => Some((*comparison, *left, *right)),
            _ => None,
        };
        let Some((comparison, left, right)) = parts else { return self.tree(tree, Smoothing::Sharp) };
        let side = |root: usize| Tree { text: tree.text.clone(), nodes: tree.nodes[..=root].to_vec() };
        let left = self.tree(&side(left), Smoothing::Sharp);
        let right = self.tree(&side(right), Smoothing::Sharp);
        match comparison {
            Comparison::Less | Comparison::LessOrEqual => self.graph.subtract(right, left),
            _ => self.graph.subtract(left, right),
        }
    }

    pub(super) fn symbol(&mut self, symbol: Symbol, smoothing: Smoothing) -> Id {
        match symbol {
            Symbol::State(i) => self.graph.leaf(Code::State, i),
            Symbol::Input(i) => {
                let changed = self.changed.get(&Target::Input(i)).copied();
                changed.unwrap_or_else(|| self.graph.leaf(Code::Input, i))
            }
            Symbol::Parameter(i) => {
                let changed = self.changed.get(&Target::Parameter(i)).copied();
                changed.unwrap_or_else(|| self.graph.leaf(Code::Parameter, i))
            }
            Symbol::Time => self.graph.leaf(Code::Time, 0),
            Symbol::JointTorque(joint) => self.joint_torque(joint, smoothing),
            Symbol::JointAcceleration(joint) => {
                self.joint_values(JointQuantity::Acceleration, joint, smoothing)
            }
            Symbol::ExternalRate(state) => self.external_rate(state, smoothing),
            Symbol::Output(i) => self.output_for_effects(i, smoothing),
            Symbol::Let(i) => match self.lets.get(&(i, smoothing)) {
                Some(id) => *id,
                None => {
                    // Compile the earlier values first, so that the recursion is never more than one level
                    // deep.
                    for earlier in 0..=i {
                        if !self.lets.contains_key(&(earlier, smoothing)) {
                            let model = self.model;
                            let id = self.tree(&model.lets[earlier].value.tree, smoothing);
                            self.lets.insert((earlier, smoothing), id);
                            self.let_ids.push((id, earlier));
                        }
                    }
                    self.lets[&(i, smoothing)]
                }
            },
        }
    }

    /// Compiles a power; whole exponents up to 64 become products.
    ///
    /// With larger exponents the rounding errors of the products would matter.
    fn power(&mut self, base: Id, exponent: Id) -> Id {
        match self.graph.value_of(exponent) {
            Some(n) if n.fract() == 0.0 && n.abs() <= 64.0 => {
                let power = self.graph.whole_power(base, n.abs() as u32);
                let one = self.graph.constant(1.0);
                if n < 0.0 { self.graph.divide(one, power) } else { power }
            }
            _ => self.graph.binary(Code::Power, base, exponent),
        }
    }

    /// Compiles the call of a function with arguments `z`; `text` is the text of the first argument.
    fn call(&mut self, function: Function, z: &[Id], text: &str, smoothing: Smoothing) -> Id {
        let g = &mut self.graph;
        let code = match function {
            Function::Sin => Code::Sin,
            Function::Cos => Code::Cos,
            Function::Tan => Code::Tan,
            Function::Asin => Code::Asin,
            Function::Acos => Code::Acos,
            Function::Atan => Code::Atan,
            Function::Sinh => Code::Sinh,
            Function::Cosh => Code::Cosh,
            Function::Tanh => Code::Tanh,
            Function::Exp => Code::Exp,
            Function::Ln => Code::Ln,
            Function::Sqrt => Code::Sqrt,
            Function::Cbrt => Code::Cbrt,
            Function::Abs => Code::Absolute,
            Function::Atan2 => return g.binary(Code::Atan2, z[0], z[1]),
            Function::Hypot => return g.binary(Code::Hypot, z[0], z[1]),
            Function::Min => return g.binary(Code::Minimum, z[0], z[1]),
            Function::Max => return g.binary(Code::Maximum, z[0], z[1]),
            Function::Clamp => {
                let above = g.binary(Code::Maximum, z[0], z[1]);
                return g.binary(Code::Minimum, above, z[2]);
            }
            Function::Relu => {
                let zero = g.constant(0.0);
                return g.binary(Code::Maximum, z[0], zero);
            }
            Function::Deadzone => {
                let low = g.negate(z[1]);
                let above = g.binary(Code::Maximum, z[0], low);
                let inside = g.binary(Code::Minimum, above, z[1]);
                return g.subtract(z[0], inside);
            }
            Function::Sign if smoothing == Smoothing::Smooth => return self.smooth_sign(z[0], text),
            Function::Sign => {
                let [zero, one, minus] = [0.0, 1.0, -1.0].map(|x| g.constant(x));
                let negated = g.negate(z[0]);
                let below = g.select(negated, minus, zero);
                return g.select(z[0], one, below);
            }
            Function::Step if smoothing == Smoothing::Smooth => return self.smooth_step(z[0], text),
            Function::Step => {
                let [zero, one] = [0.0, 1.0].map(|x| g.constant(x));
                return g.select(z[0], one, zero);
            }
        };
        g.unary(code, z[0])
    }

    /// Compiles a smoothed sign: `tanh(z / width)`.
    fn smooth_sign(&mut self, z: Id, text: &str) -> Id {
        let known = self.widths.iter().position(|w| w.argument == z);
        let index = known.unwrap_or_else(|| {
            let declared = declared_width(&self.model.numerics, text);
            self.widths.push(Width { argument: z, text: text.to_owned(), declared });
            self.widths.len() - 1
        });
        let width = self.graph.leaf(Code::Width, index);
        let scaled = self.graph.divide(z, width);
        self.graph.unary(Code::Tanh, scaled)
    }

    /// Compiles a smoothed step from 0 to 1: `(1 + tanh(z / width)) / 2`.
    fn smooth_step(&mut self, z: Id, text: &str) -> Id {
        let sign = self.smooth_sign(z, text);
        let half = self.graph.constant(0.5);
        let scaled = self.graph.multiply(sign, half);
        self.graph.add(scaled, half)
    }

    /// Compiles an `if`; it is smoothed if its branches differ where the condition changes.
    fn choose(
        &mut self,
        comparison: Comparison,
        (left, right): (Id, Id),
        (then, otherwise): (Id, Id),
        text: &str,
        smoothing: Smoothing,
    ) -> Id {
        // Select by `difference > 0`; `a <= b` is the negation of `a - b > 0`.
        let (difference, yes, no) = match comparison {
            Comparison::Less => (self.graph.subtract(right, left), then, otherwise),
            Comparison::Greater => (self.graph.subtract(left, right), then, otherwise),
            Comparison::LessOrEqual => (self.graph.subtract(left, right), otherwise, then),
            Comparison::GreaterOrEqual => (self.graph.subtract(right, left), otherwise, then),
        };
        let is_constant = self.graph.value_of(difference).is_some() || yes == no;
        let sharp = smoothing == Smoothing::Sharp || is_constant;
        if sharp || self.probe.branches_agree(&self.graph, difference, [yes, no]) {
            return self.graph.select(difference, yes, no);
        }
        let share = self.smooth_step(difference, text);
        let gap = self.graph.subtract(yes, no);
        let part = self.graph.multiply(share, gap);
        self.graph.add(no, part)
    }
}

/// Width that the file declares for a smoothed discontinuity with this argument text; `None` without one.
fn declared_width(numerics: &Numerics, text: &str) -> Option<f64> {
    numerics.widths.get(text).copied()
}
