//! Forward-mode differentiation of a graph, which appends the derivatives as further operations.
//!
//! Derivatives that are 0 are not listed, so that a variable without influence costs nothing.

use super::{Code, Graph, Id};

/// Smallest argument at which the slope of a square root is computed, in the unit of the argument.
///
/// Smaller arguments have the slope at this one. Rates such as `sqrt(level)` would otherwise have unbounded
/// sensitivities when a tank runs empty.
const SQRT_SLOPE_FLOOR: f64 = 1e-6;

/// A variable with respect to which operations are differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Variable {
    /// A state, by its index in the model.
    State(usize),
    /// A parameter, by its index in the model.
    Parameter(usize),
    /// Time, for conditions of events that depend on it directly.
    Time,
}

/// Derivatives of a graph's operations that are computed so far, without those that are 0.
#[derive(Debug, Default)]
pub(crate) struct Derivatives {
    /// Derivatives of each operation, in the order of the variables; `None` where not computed yet.
    known: Vec<Option<Vec<(Variable, Id)>>>,
    /// Indices of the parameters to differentiate with respect to.
    active: Vec<usize>,
    /// For each input, the index of the parameter that delays it; `None` without a delay.
    delays: Vec<Option<usize>>,
}

impl Derivatives {
    pub(crate) fn new(active: &[usize], delays: Vec<Option<usize>>) -> Self {
        Self { known: Vec::new(), active: active.to_vec(), delays }
    }

    /// Returns the derivatives of operation `id` with respect to all states, active parameters and time.
    pub(crate) fn all_derivatives(&mut self, graph: &mut Graph, id: Id) -> Vec<(Variable, Id)> {
        // The derivatives add operations that are never differentiated themselves, so the loop covers only
        // the operations up to `id` that it uses.
        let mut needed = vec![false; id as usize + 1];
        needed[id as usize] = true;
        for index in (0..=id as usize).rev() {
            if needed[index] && self.known.get(index).is_none_or(Option::is_none) {
                graph.get(index as Id).inputs().for_each(|inputs| needed[inputs as usize] = true);
            }
        }
        for (index, needed) in needed.into_iter().enumerate() {
            if self.known.len() <= index {
                self.known.resize(index + 1, None);
            }
            if needed && self.known[index].is_none() && !graph.is_too_large() {
                self.known[index] = Some(self.differentiate(graph, index as Id));
            }
        }
        self.known.get(id as usize).cloned().flatten().unwrap_or_default()
    }

    /// The derivatives of an operation that is differentiated already.
    pub(super) fn of(&self, id: Id) -> &[(Variable, Id)] {
        self.known.get(id as usize).and_then(Option::as_deref).unwrap_or(&[])
    }

    /// Differentiates operation `id`, whose operands are differentiated already.
    fn differentiate(&self, graph: &mut Graph, id: Id) -> Vec<(Variable, Id)> {
        let operation = graph.get(id);
        let (a, b, c) = (operation.a, operation.b, operation.c);
        let of = |id: Id| self.of(id);
        match operation.code {
            Code::Add => merge(of(a), of(b), |x, y| sum(graph, x, y)),
            Code::Subtract => merge(of(a), of(b), |x, y| match (x, y) {
                (Some(x), Some(y)) => graph.subtract(x, y),
                (Some(x), None) => x,
                (_, y) => graph.negate(y.unwrap_or(0)),
            }),
            Code::Negate => map(of(a), |x| graph.negate(x)),
            Code::Multiply => product(graph, (a, of(a)), (b, of(b))),
            Code::MultiplyAdd | Code::MultiplySubtract | Code::SubtractProduct => {
                let both = product(graph, (a, of(a)), (b, of(b)));
                merge(&both, of(c), |x, y| match (operation.code, x, y) {
                    (Code::MultiplyAdd, Some(x), Some(y)) => graph.add(x, y),
                    (Code::MultiplySubtract, Some(x), Some(y)) => graph.subtract(x, y),
                    (_, Some(x), Some(y)) => graph.subtract(y, x),
                    (Code::SubtractProduct, Some(x), None) => graph.negate(x),
                    (Code::MultiplySubtract, None, y) => graph.negate(y.unwrap_or(0)),
                    (_, x, y) => x.or(y).unwrap_or(0),
                })
            }
            // (a/b)' = (a' - (a/b) b') / b
            Code::Divide => {
                let above = merge(of(a), of(b), |x, y| match (x, y) {
                    (Some(x), None) => x,
                    (x, y) => {
                        let moved = graph.multiply(id, y.unwrap_or(0));
                        match x {
                            Some(x) => graph.subtract(x, moved),
                            None => graph.negate(moved),
                        }
                    }
                });
                map(&above, |x| graph.divide(x, b))
            }
            Code::Minimum | Code::Maximum => {
                let zero = graph.constant(0.0);
                let (first, second) = if operation.code == Code::Minimum { (b, a) } else { (a, b) };
                let difference = graph.subtract(first, second);
                merge(of(a), of(b), |x, y| graph.select(difference, x.unwrap_or(zero), y.unwrap_or(zero)))
            }
            Code::Absolute => {
                let below = graph.negate(a);
                map(of(a), |x| {
                    let negated = graph.negate(x);
                    graph.select(below, negated, x)
                })
            }
            Code::Select => {
                let zero = graph.constant(0.0);
                merge(of(b), of(c), |x, y| graph.select(a, x.unwrap_or(zero), y.unwrap_or(zero)))
            }
            Code::Atan2 | Code::Hypot | Code::Power => {
                let [first, second] = partials(graph, operation.code, id, (a, b), of(b).is_empty());
                merge(of(a), of(b), |x, y| {
                    let x = x.map(|x| graph.multiply(first, x));
                    let y = y.map(|y| graph.multiply(second, y));
                    sum(graph, x, y)
                })
            }
            Code::Table => {
                let slope = graph.table(Code::TableSlope, a, b);
                map(of(a), |x| graph.multiply(slope, x))
            }
            Code::External => self.differentiate_external(graph, (a, b as usize)),
            // The slope of a table is constant between its knots. Second derivatives of an external function are unknown.
            Code::TableSlope | Code::Argument | Code::ExternalDerivative => Vec::new(),
            code if code.operands() == 0 => self.differentiate_leaf(graph, code, a as usize),
            code => {
                if of(a).is_empty() {
                    return Vec::new();
                }
                let slope = slope(graph, code, id, a);
                map(of(a), |x| graph.multiply(slope, x))
            }
        }
    }

    /// Differentiates a constant, or the state, input or parameter number `index`.
    fn differentiate_leaf(&self, graph: &mut Graph, code: Code, index: usize) -> Vec<(Variable, Id)> {
        match code {
            Code::State => vec![(Variable::State(index), graph.constant(1.0))],
            Code::Parameter if self.active.contains(&index) => {
                vec![(Variable::Parameter(index), graph.constant(1.0))]
            }
            Code::Time => vec![(Variable::Time, graph.constant(1.0))],
            Code::Input => {
                // An input is u(t - delay): its derivative with respect to the delay is minus that with
                // respect to time.
                let slope = graph.leaf(Code::InputSlope, index);
                let delay = self.delays.get(index).copied().flatten().filter(|d| self.active.contains(d));
                let mut out: Vec<_> =
                    delay.map(|d| (Variable::Parameter(d), graph.negate(slope))).into_iter().collect();
                out.push((Variable::Time, slope));
                out
            }
            _ => Vec::new(),
        }
    }
}

/// Appends the derivative of a function of one variable `a`; `id` is the value of the function.
fn slope(g: &mut Graph, code: Code, id: Id, a: Id) -> Id {
    let one = g.constant(1.0);
    match code {
        Code::Sqrt => {
            let [floor, zero, half] = [SQRT_SLOPE_FLOOR, 0.0, 0.5].map(|x| g.constant(x));
            let bounded = g.binary(Code::Maximum, a, floor);
            let root = g.unary(Code::Sqrt, bounded);
            let slope = g.divide(half, root);
            g.select(a, slope, zero)
        }
        // 1 / (3 cbrt(a)^2), bounded like the slope of the square root.
        Code::Cbrt => {
            let [floor, three] = [SQRT_SLOPE_FLOOR, 3.0].map(|x| g.constant(x));
            let square = g.multiply(id, id);
            let bounded = g.binary(Code::Maximum, square, floor);
            let below = g.multiply(three, bounded);
            g.divide(one, below)
        }
        Code::Exp => id,
        Code::Ln => g.divide(one, a),
        Code::Sin => g.unary(Code::Cos, a),
        Code::Cos => {
            let sine = g.unary(Code::Sin, a);
            g.negate(sine)
        }
        Code::Tan => {
            let square = g.multiply(id, id);
            g.add(one, square)
        }
        // (1 - a)(1 + a) stays accurate near the ends, where 1 - a^2 loses digits.
        Code::Asin | Code::Acos => {
            let (below, above) = (g.subtract(one, a), g.add(one, a));
            let square = g.multiply(below, above);
            let root = g.unary(Code::Sqrt, square);
            let slope = g.divide(one, root);
            if code == Code::Asin { slope } else { g.negate(slope) }
        }
        Code::Atan => {
            let square = g.multiply(a, a);
            let below = g.add(one, square);
            g.divide(one, below)
        }
        Code::Sinh => g.unary(Code::Cosh, a),
        Code::Cosh => g.unary(Code::Sinh, a),
        Code::Tanh => {
            let square = g.multiply(id, id);
            g.subtract(one, square)
        }
        _ => g.constant(0.0),
    }
}

/// Appends the partial derivatives of a function of two variables `a` and `b`; `id` is the value of the function.
///
/// The derivative with respect to `b` is not computed for a power whose exponent is constant.
fn partials(g: &mut Graph, code: Code, id: Id, (a, b): (Id, Id), exponent_is_constant: bool) -> [Id; 2] {
    let [zero, one] = [0.0, 1.0].map(|x| g.constant(x));
    match code {
        Code::Hypot => [a, b].map(|x| {
            let slope = g.divide(x, id);
            g.select(id, slope, zero)
        }),
        Code::Atan2 => {
            let square = g.multiply(a, a);
            let other = g.multiply(b, b);
            let below = g.add(square, other);
            let (first, second) = (g.divide(b, below), g.divide(a, below));
            [first, g.negate(second)]
        }
        _ => {
            let less = g.subtract(b, one);
            let power = g.binary(Code::Power, a, less);
            let first = g.multiply(b, power);
            if exponent_is_constant {
                return [first, zero];
            }
            // a^b ln a tends to 0 with a for b > 0; the lower bound of a avoids 0 * ln 0 = NaN.
            let tiny = g.constant(1e-300);
            let bounded = g.binary(Code::Maximum, a, tiny);
            let logarithm = g.unary(Code::Ln, bounded);
            [first, g.multiply(id, logarithm)]
        }
    }
}

/// Appends the derivative of a product `a b`: `a' b + a b'`, or `2 a a'` for a square.
fn product(
    g: &mut Graph,
    (a, da): (Id, &[(Variable, Id)]),
    (b, db): (Id, &[(Variable, Id)]),
) -> Vec<(Variable, Id)> {
    if a == b {
        let two = g.constant(2.0);
        let double = g.multiply(two, a);
        return map(da, |x| g.multiply(double, x));
    }
    merge(da, db, |x, y| {
        let x = x.map(|x| g.multiply(x, b));
        let y = y.map(|y| g.multiply(a, y));
        sum(g, x, y)
    })
}

/// Appends the sum of two derivatives, of which one may be missing (0).
fn sum(g: &mut Graph, x: Option<Id>, y: Option<Id>) -> Id {
    match (x, y) {
        (Some(x), Some(y)) => g.add(x, y),
        (x, y) => x.or(y).unwrap_or(0),
    }
}

/// Applies `f` to every derivative in a list.
fn map(list: &[(Variable, Id)], mut f: impl FnMut(Id) -> Id) -> Vec<(Variable, Id)> {
    list.iter().map(|(variable, id)| (*variable, f(*id))).collect()
}

/// Merges two lists of derivatives in the order of their variables, combining each pair with `f`.
///
/// A derivative that one list does not have is passed as `None` (0).
fn merge(
    a: &[(Variable, Id)],
    b: &[(Variable, Id)],
    mut f: impl FnMut(Option<Id>, Option<Id>) -> Id,
) -> Vec<(Variable, Id)> {
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    let mut out = Vec::new();
    loop {
        let next = match (a.peek(), b.peek()) {
            (None, None) => return out,
            (Some((x, _)), Some((y, _))) => *x.min(y),
            (Some((x, _)), None) | (None, Some((x, _))) => *x,
        };
        let left = a.next_if(|(v, _)| *v == next).map(|(_, id)| *id);
        let right = b.next_if(|(v, _)| *v == next).map(|(_, id)| *id);
        out.push((next, f(left, right)));
    }
}
